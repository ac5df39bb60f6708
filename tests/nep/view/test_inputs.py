"""Forged requests to the page: each gets a line or no update, and nothing is imported or logged."""

import json
import logging
import sys
from itertools import pairwise

import pytest

pytest.importorskip("dash", reason="dash is not installed: pip install .[view]")

from nep.view.answers import Desk
from nep.view.app import make_app
from nep.view.page_state import Judges, Stage
from simulator import SceneGraphMemory, Sighting
from simulator.replay.still_memory import StillMemory

PATH = "/_dash-update-component"


def nest(levels, inner=None):
    for _ in range(levels):
        inner = [inner]
    return inner


# A good value of each input, as the browser sends it at step 6 of the log.
GOOD = {
    "ask.n_clicks": 1, "words.n_submit": None, "words.value": "red mug", "asked.data": "red mug",
    "object.data": "milk", "step.value": 6, "step.max": 6, "version.data": 0,
    "judge-a.value": "bayesian", "judge-b.value": "last_seen_prior",
    "options.value": ["search plan"], "view-a.data": [0, 1, 0.5, 2], "view-b.data": None,
    "selected.data": 2, "play.n_clicks": 1, "tick.n_intervals": 0, "tick.disabled": True,
    "watch.n_intervals": 3, "map-a.relayoutData": {"xaxis.autorange": True},
    "map-b.relayoutData": {
        "xaxis.range[0]": 0, "xaxis.range[1]": 1.5, "yaxis.range[0]": -1, "yaxis.range[1]": 1,
    },
    "map-a.clickData": {"points": [{"customdata": ["furniture", 2], "x": 1}]},
    "map-b.clickData": {"points": [{"x": 1, "y": 2}]},
}  # fmt: skip
TEXTS = ["", "x", "nobody", "evilmod:P", "os:system", ".:", "..x:y", "nep.view.app:make_app",
         "x" * 5000, "\ud800", "\0", "../../x", "<b>x</b>"]  # fmt: skip
FORGED = [
    None, True, False, 0, 1, -1, 0.0, 1.5, 2**53 + 1, 10**18, 10**30, 10**400, 1e308, -1e308,
    *TEXTS, [], {}, [[]], nest(400), ["x"], ["search plan", "truth"], ["search plan"] * 1000,
    [["search plan"]], [0, 1, 2], [0, 1, 2, 3], [0, 1, 2, 3, 4], [0, 1, 2, "3"], [0, 1, 2, True],
    [0, 1, 2, 10**400], [0, 1, 2, None], {"points": []}, {"points": None}, {"points": [None]},
    {"points": [{}]}, {"points": [{"customdata": None}]}, {"points": [{"customdata": 1}]},
    {"points": [{"customdata": []}]}, {"points": [{"customdata": ["furniture"]}]},
    {"points": [{"customdata": ["furniture", "evilmod:P"]}]},
    {"points": [{"customdata": ["furniture", 10**30]}]},
    {"points": [{"customdata": ["object", 5]}]}, {"points": [{"customdata": ["object", "x", "y"]}]},
    {"points": [{"customdata": ["evilmod:P", 5]}]}, {"points": {"0": {}}},
    {"xaxis.range[0]": "evilmod:P"}, {"yaxis.range[1]": 10**400}, {"xaxis.range[1]": nest(300)},
    {"xaxis.range[0]": None, "xaxis.range[1]": 1, "yaxis.range[0]": 1, "yaxis.range[1]": 1},
]  # fmt: skip
OBJECTS = [value for value in FORGED if isinstance(value, dict)]
COUNTS, STEPS = [None, 0, 1], [0, 1]  # no integer of a browser is larger than 2**53
VIEWS = [None, [0, 1, 2, 3]]
ZOOMS = [None, *(value for value in OBJECTS if not any("range" in key for key in value))]
NO_OWNER = [None, {"points": [{}]}, {"points": [{"customdata": None}]}]
# Which of these an input takes all the same; everything else is refused.
TAKEN = {
    **dict.fromkeys(("ask.n_clicks", "words.n_submit", "play.n_clicks"), COUNTS),
    **dict.fromkeys(("tick.n_intervals", "watch.n_intervals"), COUNTS),
    **dict.fromkeys(("version.data", "step.max", "step.value"), STEPS),
    "words.value": [None, *TEXTS], "asked.data": TEXTS, "object.data": [None, *TEXTS],
    "selected.data": COUNTS, "tick.disabled": [True, False],
    "judge-a.value": [], "judge-b.value": ["nobody"], "options.value": [[]],
    **dict.fromkeys(("view-a.data", "view-b.data"), VIEWS),
    **dict.fromkeys(("map-a.relayoutData", "map-b.relayoutData"), ZOOMS),
    **dict.fromkeys(("map-a.clickData", "map-b.clickData"), NO_OWNER),
}  # fmt: skip
RAW = ["NaN", "-Infinity", "1e999", "9" * 5000, "[" * 100_000 + "]" * 100_000, "{", "'x'"]


@pytest.fixture
def app(desk, tmp_path, monkeypatch):
    """The page, run where a module lies that must not be imported."""
    (tmp_path / "evilmod.py").write_text("import pathlib\npathlib.Path('ran').touch()\nP = dict\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    return make_app(desk)


@pytest.fixture
def post(app, caplog, tmp_path):
    """Send a body; what comes back is an answer, a line or nothing, never a traceback."""
    browser = app.server.test_client()
    caplog.set_level(logging.WARNING)

    def send(body, **options):
        content = body if isinstance(body, (str, bytes)) else json.dumps(body)
        options = {"content_type": "application/json", **options}
        found = browser.post(PATH, data=content, headers={"Host": "127.0.0.1:8050"}, **options)
        assert found.status_code < 500, content[:300]
        assert caplog.records == [], content[:300]
        assert "evilmod" not in sys.modules, content[:300]
        if found.status_code == 204:
            assert found.data == b""
        if found.status_code == 400:
            assert len(found.data) < 1000, content[:300]
            assert found.data.count(b"\n") == 1
            assert b" must " in found.data
        return found.status_code

    yield send
    assert not (tmp_path / "ran").exists()


def list_keys(callback):
    return [f"{row['id']}.{row['property']}" for row in (*callback["inputs"], *callback["state"])]


def make_body(app, output, **changed):
    """Return what a browser sends, with good values but for those given."""
    callback = app.callback_map[output]
    names = output[2:-2].split("...") if output.startswith("..") else [output]
    outputs = [dict(zip(("id", "property"), name.rsplit(".", 1), strict=True)) for name in names]
    rows = {
        part: [
            {**row, "value": changed.get(key, GOOD[key])}
            for row in callback[part]
            for key in [f"{row['id']}.{row['property']}"]
        ]
        for part in ("inputs", "state")
    }
    return {
        "output": output,
        "outputs": outputs if output.startswith("..") else outputs[0],
        **rows,
        "changedPropIds": [f"{row['id']}.{row['property']}" for row in callback["inputs"][:1]],
        "parsedChangedPropsIds": [],
    }


@pytest.mark.slow
def test_what_the_page_sends_is_answered(app, post):
    keys = {key for callback in app.callback_map.values() for key in list_keys(callback)}
    assert keys == set(GOOD) == set(TAKEN)
    for output in app.callback_map:
        body = make_body(app, output)
        assert post(body) == 200, output
        body["changedPropIds"] = []  # at first
        del body["state"]
        if not app.callback_map[output]["state"]:
            assert post(body) == 200, output


@pytest.mark.parametrize("key", sorted(GOOD))
def test_every_value_is_checked(key, app, post):
    outputs = [name for name, made in app.callback_map.items() if key in list_keys(made)]
    taken = [json.dumps(value) for value in TAKEN[key]]
    for value in FORGED:
        good = json.dumps(value) in taken
        for output in outputs:
            found = post(make_body(app, output, **{key: value}))
            assert found in ((200, 204) if good else (400,)), (key, output, str(value)[:100])
    for text in RAW:
        for output in outputs:
            body = json.dumps(make_body(app, output, **{key: "HERE"})).replace('"HERE"', text)
            assert post(body) == 400, (key, text[:20])


def test_a_step_that_there_is_not_updates_nothing(app, post):
    for step in (7, 10**6, 2**53):
        found = {
            output: post(make_body(app, output, **{"step.value": step}))
            for output, callback in app.callback_map.items()
            if "step.value" in list_keys({**callback, "state": ()})
        }
        assert found
        assert set(found.values()) == {204}, found


@pytest.mark.slow
def test_the_frame_of_a_request_is_checked(app, post):
    outputs = list(app.callback_map)
    for value in (*FORGED, "view-a.figure", "..view-a.data..", "view-a.data@x"):
        for part in ("output", "outputs", "inputs", "state", "changedPropIds"):
            for output in outputs[:4]:
                body = {**make_body(app, output), part: value}
                if value != [] or part not in ("changedPropIds", "state"):
                    assert post(body) == 400, (part, output, str(value)[:100])
                if part != "state":
                    del body[part]
                    assert post(body) == 400, (part, output)
    for output, other in pairwise(outputs):
        body, foreign = make_body(app, output), make_body(app, other)
        for part in ("outputs", "inputs"):
            assert post({**body, part: foreign[part]}) == 400, (output, part)
        assert post({**body, "inputs": [body["inputs"]]}) == 400  # as of a pattern
        assert post({**body, "inputs": body["inputs"] * 2}) == 400
        assert post({**body, "changedPropIds": ["__import__('evilmod')"]}) == 400
        broken = [{**body["inputs"][0], "id": {"type": "evilmod:P"}}, *body["inputs"][1:]]
        assert post({**body, "inputs": broken}) == 400
    for text in (
        "",
        "null",
        "[]",
        "1",
        '"x"',
        *RAW,
        '{"output": 1, "output": 2}',
        b"\xff\xfe{\0}\0",
    ):
        assert post(text) == 400, text[:20]


def test_other_types_and_sizes_are_refused(app, post):
    body = json.dumps(make_body(app, "view-a.data"))
    assert post(body, content_type="text/plain") == 415
    assert post(body + " " * 1_000_000) == 413
    assert post(body, query_string="cacheKey=x&job=1&oldJob=1&cancelJob=1&endId=%ff") == 200


def test_other_paths_are_no_files(app, caplog):
    browser = app.server.test_client()
    for path in (
        "/_dash-component-suites/os/x.js", "/_dash-component-suites/evilmod/x.js",
        "/_dash-component-suites/dash/../../x.js", "/_dash-component-suites/dash/x",
        "/assets/../app.py", "/static/../app.py", "/_favicon.ico/x", "/_dash-update-component/x",
    ):  # fmt: skip
        for method in ("GET", "HEAD", "POST", "PUT", "OPTIONS", "TRACE"):
            found = browser.open(path, method=method, headers={"Host": "127.0.0.1:8050"})
            assert found.status_code < 500, (method, path)
    assert caplog.records == []
    assert "evilmod" not in sys.modules


def test_a_callback_without_a_rule_is_an_error(desk):
    from nep.view.inputs import Inputs

    row = {"id": "new", "property": "value"}
    with pytest.raises(KeyError, match=r"new\.value"):
        Inputs(desk, {"x.y": {"inputs": [row], "state": []}})


def test_a_judge_that_is_not_offered_is_not_imported(desk, app):
    for name in ("evilmod:P", "evilmod.P", "os:system", "", "nobody"):
        with pytest.raises(ValueError, match="policy must be one of bayesian, last"):
            desk.judges.get(name)
    assert "evilmod" not in sys.modules


def test_a_page_whose_story_went_on_is_told_and_not_broken():
    memory = SceneGraphMemory()
    shelf = memory.add_furniture("shelf", memory.add_room("kitchen"))
    memory.observe(shelf, [Sighting("red mug")])
    desk = Desk(Stage(lambda: StillMemory(memory.copy(), "home"), lambda: memory.time), Judges())
    desk.judges.names = ["bayesian", "last_seen_prior"]
    app = make_app(desk)
    browser = app.server.test_client()

    def send(output):
        body = make_body(app, output, **{"step.value": 0, "step.max": 1})
        return browser.post(PATH, json=body, headers={"Host": "127.0.0.1:8050"})

    answer, watch = (
        next(name for name in app.callback_map if part in name)
        for part in ("map-a.figure", "version.data")
    )
    assert send(answer).status_code == 200
    memory.step(6)
    assert send(watch).json["response"]["step"]["value"] == 6
    assert send(answer).status_code == 204  # the step that it shows is gone
    assert send(watch).json["response"]["step"]["value"] == 6  # another page
