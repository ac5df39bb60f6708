"""Events of Frigate as looks, from files in the forms of its API and of its messages."""

import json

import pytest

from sgm import SceneGraphMemory
from sgm.memory.memory_event import read_events
from simulator.trace.__main__ import main
from simulator.trace.importers.frigate import read_frigate
from simulator.trace.trace import load_trace

NOON = 1_700_000_000.0  # 14 November 2023, 22:13:20 UTC


def event(number, label, start, end, zones=(), camera="kitchen_cam", **other):
    return {
        "id": f"{NOON + start}-{number}", "camera": camera, "label": label, "sub_label": None,
        "start_time": NOON + start, "end_time": None if end is None else NOON + end,
        "zones": list(zones), "has_clip": True, "has_snapshot": True, "false_positive": None,
        "data": {"box": [0.1, 0.2, 0.1, 0.1], "score": 0.7, "top_score": 0.8, "type": "object"},
        **other,
    }  # fmt: skip


EVENTS = [  # as the API lists them: the latest first
    event("d", "cell phone", 3700, None, ["sill", "counter"]),
    event("c", "person", 100, 200, ["counter"]),
    event("f", "cup", 50, 60, false_positive=True),
    event("b", "cat", 30, 4000, camera="hall", sub_label=["Minka", 0.9]),
    event("a", "cup", 0, 1300, ["counter"], data={"top_score": 0.3}),
    {"id": "x"},
    7,
]
PLACES = "counter: {room: kitchen, furniture: counter top}\nhall: {room: hall, furniture: floor}\n"


@pytest.fixture
def events(tmp_path):
    path = tmp_path / "events.json"
    path.write_text(json.dumps(EVENTS))
    return path


def list_looks(log):
    return [
        (line.time, line.values["furniture"], [row[0] for row in line.values["seen"]])
        for line in read_events(log)
        if line.kind == "look"
    ]


def test_events_of_the_api_become_looks(events, tmp_path):
    log = tmp_path / "looks.sgm"
    looks = read_frigate(events, file=log)
    memory = looks.memory
    assert [memory.describe(number) for number in memory.furniture_ids] == [
        "counter in kitchen cam", "floor in hall"
    ]  # fmt: skip
    # Steps of ten minutes from the first event on; an event that ends is missed where it was.
    assert list_looks(log) == [
        (0, 0, ["cup"]),
        (0, 1, ["Minka"]),
        (2, 0, []),
        (6, 0, ["cell phone"]),
        (6, 1, []),
    ]
    assert looks.num_looks == 5
    assert memory.clock.start.isoformat() == "2023-11-14T22:13:20"
    assert not memory.last_seen("cup").is_there
    assert memory.last_seen("cell phone").is_there
    assert dict(looks.counts) == {
        "events": 3, "events of 'person'": 1, "false positives": 1,
        "events without id, camera, label or start_time": 1, "entries that are no events": 1,
    }  # fmt: skip


def test_messages_say_where_a_thing_is_now(tmp_path):
    def message(kind, at, zones, **other):
        after = {
            **event("a", "cup", 0, None), "frame_time": NOON + at, "current_zones": zones, **other
        }  # fmt: skip
        return {"type": kind, "before": event("a", "cup", 0, None), "after": after}

    path = tmp_path / "messages.jsonl"
    messages = [
        message("new", 0, ["counter"]),
        message("update", 5, ["counter"]),  # nothing new
        message("update", 700, ["table"]),
        message("end", 1300, [], end_time=NOON + 1300),
    ]
    path.write_text("".join(f"{json.dumps(row)}\n" for row in messages))
    looks = read_frigate(path, file=tmp_path / "looks.sgm")
    assert list_looks(tmp_path / "looks.sgm") == [
        (0, 0, ["cup"]), (1, 0, []), (1, 1, ["cup"]), (2, 1, [])
    ]  # fmt: skip
    assert dict(looks.counts) == {"messages": 4}


def test_the_command_knows_what_zones_look_at(events, tmp_path, capsys):
    places, out, memory = tmp_path / "places.yaml", tmp_path / "out", tmp_path / "home.sgm"
    places.write_text(PLACES)
    arguments = ["import", "frigate", str(events), "--places", str(places), "--out", str(out)]
    assert main([*arguments, "--memory", str(memory), "--utc_hours", "1"]) == 0
    assert "5 looks, 3 things, 2 pieces of furniture, 6 time steps" in capsys.readouterr().out
    loaded = SceneGraphMemory.load(memory)
    names = [loaded.describe(number) for number in loaded.furniture_ids]
    assert names == ["counter top in kitchen", "floor in hall"]
    assert loaded.clock.start.hour == 23
    assert len({row.object for row in load_trace(out).events}) == 3


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("start_time", 10**400), ("start_time", 1e300), ("start_time", -1), ("camera", "\0"),
        ("label", "_"), ("label", "a\nb"), ("label", "x" * 300), ("label", "\ud800"),
        ("end_time", 10**400), ("end_time", 1e300), ("zones", ["counter", "_"]),
        ("zones", ["counter", "x" * 300]), ("sub_label", ["a\nb", 0.9]),
        ("data", {"score": 10**400, "top_score": 0.5}),
    ],
)  # fmt: skip
def test_one_entry_of_another_form_spoils_no_other(tmp_path, field, value):
    """It is left out and counted, or else what is wrong in it is."""
    path = tmp_path / "events.json"
    path.write_text(
        json.dumps([EVENTS[4], event("k", "keys", 60, 90, ["counter"]) | {field: value}])
    )
    memory = tmp_path / "home.sgm"
    assert main(["import", "frigate", str(path), "--memory", str(memory)]) == 0
    looks = read_frigate(path)
    is_left_out = "events without id, camera, label or start_time" in looks.counts
    assert is_left_out == (field in ("start_time", "camera", "label"))
    assert looks.memory.descriptions == (("cup",) if is_left_out else ("cup", "keys"))
    assert SceneGraphMemory.load(memory).descriptions == looks.memory.descriptions


@pytest.mark.parametrize(
    ("content", "places", "error"),
    [
        (None, None, "events must be a file that can be read"),
        ("no json", None, "events must be a list of JSON"),
        (json.dumps(EVENTS)[:-9], None, "events must be a list of JSON"),
        (json.dumps(EVENTS[0]) + "\n" + json.dumps(EVENTS[3])[:-9], None, "in line 2 of"),
        (json.dumps({**EVENTS[0], "start_time": 1e300}), None, "got 1 events without id"),
        (json.dumps(EVENTS), "counter: {room: '_', furniture: counter}", "for 'counter'"),
        ("[]", None, "events must have one of a thing, got none"),
        ('{"id": 3}', None, "got 1 events without id, camera, label or start_time"),
        (json.dumps(EVENTS), "- counter", "places must be room and furniture by zone"),
        (json.dumps(EVENTS), "counter: {room: kitchen}", "for 'counter'"),
    ],
)
def test_bad_files_end_in_one_line(tmp_path, capsys, content, places, error):
    path, options = tmp_path / "events.json", []
    if content is not None:
        path.write_text(content)
    if places is not None:
        (tmp_path / "places.yaml").write_text(places)
        options = ["--places", str(tmp_path / "places.yaml")]
    out = ["--memory", str(tmp_path / "home.sgm")]
    assert main(["import", "frigate", str(path), *options, *out]) == 1
    said = capsys.readouterr()
    assert (said.out, said.err.count("\n")) == ("", 1)
    assert error in said.err
    assert not (tmp_path / "home.sgm").exists()


@pytest.mark.parametrize("kind", ["audio", "manual", "api"])
def test_a_sound_is_no_thing(tmp_path, kind):
    """Nor is what a person has noted: neither was tracked."""
    path = tmp_path / "events.json"
    path.write_text(json.dumps([EVENTS[4], event("s", "bark", 60, 90, data={"type": kind})]))
    looks = read_frigate(path)
    assert looks.memory.descriptions == ("cup",)
    assert looks.counts["events of no tracked object"] == 1
