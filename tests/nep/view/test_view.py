"""The page without a browser: answers, sources, the command line and the server."""

import json
import os
import signal
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request
from pathlib import Path

import pytest

from nep.view.__main__ import main
from nep.view.answers import MOST_CHANGES, Desk
from nep.view.document import save_page
from nep.view.page_state import Judges, Stage
from nep.view.server import PageServer
from nep.view.texts import tell_furniture, tell_step
from sgm.finder.finder import Finder
from sgm.layout.box import Box
from sgm.layout.viewpoint import Viewpoint
from sgm.memory.memory_event import read_events
from simulator import Bayesian, SceneGraphMemory, Sighting
from simulator.story.past_memory import PastMemory, StillMemory

ROOT = Path(__file__).resolve().parents[3]


def test_an_answer_is_what_the_finder_says(desk):
    memory = desk.stage.story.memory_at(6)
    answer = desk.answer(6, "red mug", "bayesian")
    ranking = Finder(Bayesian()).rank(memory, "red mug")
    elsewhere, *rows = answer["rows"]
    assert (elsewhere["name"], elsewhere["p"]) == ("elsewhere", round(ranking.elsewhere, 4))
    assert [row["p"] for row in rows] == [round(one.probability, 4) for one in ranking]
    assert [row["why"] for row in rows] == [one.why for one in ranking]
    assert [row["furniture"] for row in rows] == [one.furniture for one in ranking]
    likely = sum(one.probability >= 0.01 for one in ranking)  # no way leads to an unlikely place
    assert 0 < likely < len(ranking)
    plan = Finder(Bayesian()).search_plan(memory, "red mug", k=min(likely, 5))
    search = answer["search"]
    assert [look["say"] for look in search["looks"]] == [one.instruction for one in plan]
    # A search finds less than the answer gives to its places: a look misses some of what is there.
    probability = answer["probability"]
    shown = [probability[look["furniture"]] * look["shows"] for look in search["looks"]]
    assert search["found"] == pytest.approx(sum(shown), abs=1e-3)
    assert search["found"] < sum(probability[look["furniture"]] for look in search["looks"])
    json.dumps(answer)


def test_a_thing_that_the_robot_carries_is_said_below_elsewhere(desk):
    memory = desk.stage.story.memory_at(6).copy()
    memory.picked_up("red mug")
    still = Desk(Stage(lambda: StillMemory(memory, "home")), desk.judges)
    names = [row["name"] for row in still.answer(6, "red mug", "bayesian")["rows"]]
    assert names[:2] == ["elsewhere", "with the robot"]


def test_a_place_itself_can_be_asked_for(desk):
    rows = desk.answer(6, "fridge")["rows"]
    assert [(row["name"], row.get("relation")) for row in rows[:2]] == [
        ("elsewhere", None),
        ("white fridge in kitchen", ""),
    ]


def test_a_state_has_all_things_where_they_were_seen(desk):
    """Furniture 0 is the fridge, 1 the counter, 2 the desk; places are 2 f for "in", 2 f + 1."""
    assert desk.tell_state(6)["things"]["relations"] == [["inside", True], ["on top", False]]
    state = desk.tell_state(6)
    names = desk.list_names()
    things = state["things"]
    rows = zip(*(things[key] for key in ("name", "place", "seen", "there")), strict=True)
    assert {(names[name], *row) for name, *row in rows} == {
        ("milk", 0, 0, 1), ("<b>butter</b>", 0, 0, 1), ("red mug", 5, 0, 0), ("laptop", 5, 5, 1),
        ("red mug", 3, 6, 1),
    }  # fmt: skip
    assert state["lastLook"] == [0, 6, 5]
    assert [(look["furniture"], look["step"]) for look in state["looks"]] == [(1, 6)]
    assert state["numNames"] == len(names)
    assert desk.list_names(2) == names[2:]


def test_what_cannot_be_asked_is_said(desk):
    assert "must" in desk.answer(6, "two\nlines")["problem"]
    assert "policy must be one of" in desk.answer(6, "mug", "nobody")["problem"]


def test_furniture_is_told(desk):
    story = desk.stage.story
    things, looks = tell_furniture(story, story.memory_at(6), 2)
    assert things.rows == (
        ("laptop", "there", "step 5", "1", "2 of 2"),
        ("red mug", "missing at the last look", "step 0", "6", "1 of 2"),
    )
    assert looks.rows == (("step 5", "saw laptop"), ("step 0", "saw red mug, laptop"))
    assert tell_step(story, story.memory_at(3), 3) == ["nothing was seen or asked"]


def test_a_long_ranking_is_cut():
    memory = SceneGraphMemory()
    room = memory.add_room("kitchen")
    for number in range(20):
        memory.add_furniture("shelf", room, f"shelf {number}")
    desk = Desk(Stage(lambda: StillMemory(memory, "home")), Judges())
    answer = desk.answer(0, "mug")
    assert len(answer["rows"]) == 14
    assert answer["rows"][13]["name"] == "8 other places"
    assert sum(row["p"] for row in answer["rows"]) == pytest.approx(1, abs=0.001)
    assert len(answer["probability"]) == 20  # the map shows all


def test_changes_are_those_of_the_memory(desk):
    memory = desk.stage.story.memory_at(6)
    told = desk.tell_changes(6)
    fields = ("kind", "thing", "from_place", "to_place", "after", "time", "by")
    assert [tuple(row[name] for name in fields) for row in told["rows"]] == [
        tuple(getattr(change, name) for name in fields) for change in memory.changes(0)
    ]
    assert told["rows"][0] == {
        "kind": "moved",
        "thing": "red mug",
        "id": "",
        "from_place": 2,
        "to_place": 1,
        "after": 0,
        "time": 6,
        "probability": 1.0,
        "by": "",
        "picture": None,
        "from": "desk in study",
        "to": "counter top in kitchen",
    }
    assert told["more"] == 0
    assert next(row["kind"] for row in desk.tell_changes(5)["rows"]) == "gone"


def test_of_many_changes_the_latest_are_told():
    memory = SceneGraphMemory()
    shelf = memory.add_furniture("shelf", memory.add_room("kitchen"))
    for step in range(2):
        memory.observe(shelf, [Sighting(f"thing {step} {n}") for n in range(MOST_CHANGES)])
        memory.step()
    told = Desk(Stage(lambda: StillMemory(memory, "home")), Judges()).tell_changes(2)
    assert len(told["rows"]) == MOST_CHANGES
    assert told["more"] == len(memory.changes(0)) - MOST_CHANGES > 0
    assert {row["time"] for row in told["rows"]} == {1}


def test_a_history_is_told_in_steps(desk):
    trace = desk.trace("red mug", "bayesian")
    assert trace["places"][:2] == ("counter top in kitchen", "desk in study")
    assert trace["edges"] == [*range(7), 7]
    assert trace["looks"] == [[0, 1, 1], [5, 1, 0], [6, 0, 1]]
    assert all(len(row) == 7 for row in trace["belief"])
    assert trace["belief"][0][6] == pytest.approx(0.97, abs=0.01)


def test_judges_need_no_true_homes():
    names = Judges().names
    assert names[0] == "any_home"  # the default of the finder
    assert {"heat", "bayesian", "priors", "last_seen", "adaptive"} <= set(names)
    assert not {"oracle", "ceiling", "prior_filter", "home_filter"} & set(names)
    with pytest.raises(ValueError, match="checkpoint must be a file"):
        Judges(["mine=nowhere.ckpt"])
    with pytest.raises(ValueError, match="must be SOURCE or NAME=SOURCE, got '=heat'"):
        Judges(["=heat"])


def test_a_story_that_goes_on_is_read_again():
    memory = SceneGraphMemory()
    shelf = memory.add_furniture("shelf", memory.add_room("kitchen"))
    state = [0]

    def load():
        if state[0] == 2:
            raise ValueError("half written")
        return StillMemory(memory.copy(), "home")

    stage = Stage(load, lambda: state[0])
    memory.step(4)
    memory.observe(shelf, [Sighting("mug")])
    stage.refresh()
    assert (stage.version, stage.story.num_steps) == (0, 0)
    state[0] = 1
    stage.refresh()
    assert (stage.version, stage.story.num_steps) == (1, 4)
    state[0] = 2
    stage.refresh()
    assert (stage.version, stage.problem) == (1, "half written")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["nowhere.sgm"], "source must be a memory file"),
        (["broken.sgm"], "memory file"),
        (["routine", "--port", "0"], "port must be at least 1, got 0"),
        (["routine", "--robot", "nobody", "--steps", "2"], "policy must be one of"),
        (["routine", "--steps", "0"], "steps must be at least 1, got 0"),
    ],
)
def test_bad_input_is_one_line(arguments, message, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("broken.sgm").write_bytes(b"no memory")
    with pytest.raises(SystemExit) as ended:
        main([*arguments, "--no_browser"])
    said = capsys.readouterr().err
    assert ended.value.code == 2
    assert message in said
    assert len(said.splitlines()) == 1


@pytest.mark.parametrize("source", ["home.sgm", "looks.sgm"])
def test_a_page_is_saved(source, log, monkeypatch, capsys):
    monkeypatch.chdir(log.parent)
    monkeypatch.setattr("nep.view.page_state.list_shipped", list)  # no seconds for torch
    main([source, "--ask", "red mug", "milk", "--save", "page.html"])
    text = Path("page.html").read_text("utf-8")
    assert "counter top in kitchen" in text
    assert text.count("<script") == 2  # the data, and the page's own
    assert capsys.readouterr().out == "Saved page.html\n"


def test_a_name_cannot_end_the_data_of_a_saved_page(tmp_path):
    memory = SceneGraphMemory()
    shelf = memory.add_furniture("shelf", memory.add_room("kitchen"))
    memory.observe(shelf, [Sighting("</script><script>alert(1)</script>")])
    desk = Desk(Stage(lambda: StillMemory(memory, "<i>home</i>")), Judges())
    desk.judges.names = ["bayesian"]
    save_page(desk, [], tmp_path / "page.html")
    text = (tmp_path / "page.html").read_text("utf-8")
    assert "<script>alert" not in text
    assert "<i>home" not in text
    assert text.count("<script") == text.count("</script>") == 2


def test_only_this_machine_is_answered(desk, serve):
    address = serve(desk)
    assert address.startswith("http://127.0.0.1:")
    with urllib.request.urlopen(address) as page:
        text = page.read().decode()
        policy = page.headers["Content-Security-Policy"]
    assert "https://" not in text
    assert "http://" not in text.replace("http://www.w3.org/2000/svg", "")  # a name, no address
    assert "default-src 'none'" in policy
    assert "unsafe" not in policy
    request = urllib.request.Request(address, headers={"Host": "somewhere.example:80"})
    with pytest.raises(urllib.error.HTTPError, match="403"):
        urllib.request.urlopen(request)


def test_a_second_page_takes_another_port(desk, serve):
    ports = {int(serve(desk).rsplit(":", 1)[1].strip("/")) for _ in range(3)}
    assert len(ports) == 3


def test_no_free_port_is_said():
    with pytest.raises(OSError, match="port must be free on this machine, got none from 70000"):
        PageServer(Desk(Stage(lambda: StillMemory(SceneGraphMemory(), "home")), Judges()), 70_000)


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_it_cleanly(log, number):
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    command = [sys.executable, "-m", "nep.view", str(log), "--no_browser", "--port", str(port)]
    page = subprocess.Popen(
        command,
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONUNBUFFERED": "1"},
    )
    line = page.stdout.readline()
    assert line.startswith("Open http://127.0.0.1:"), page.stderr.read()
    time.sleep(0.5)
    page.send_signal(number)
    _, said = page.communicate(timeout=60)
    assert page.returncode == 0
    assert said == ""


def test_show_follows_a_memory_of_a_program():
    from nep.view import show

    memory = SceneGraphMemory()
    memory.add_furniture("shelf", memory.add_room("kitchen"))
    address = show(memory, opens_browser=False)
    with urllib.request.urlopen(address) as page:
        assert page.status == 200


def test_a_week_with_people_is_played(monkeypatch, tmp_path):
    monkeypatch.setattr("nep.view.page_state.list_shipped", list)  # no seconds for torch
    page = tmp_path / "page.html"
    main(["routine", "--steps", "6", "--save", str(page), "--home.furniture_per_room", "2"])
    text = page.read_text("utf-8")
    assert "Mon 06 May 03:00" in text
    assert "asked for" in text


def test_the_page_reads_from_where_a_log_was_looked(tmp_path):
    memory = SceneGraphMemory(path=tmp_path / "looks.sgm")
    table = memory.add_furniture(
        "table", memory.add_room("kitchen"), box=Box((3, 2, 0.4), (2, 1, 0.8))
    )
    camera = Viewpoint(5.0, 2.0, 1.4, yaw=3.0, angle=1.0, reach=4.0)
    memory.observe(table, [Sighting("mug")], viewpoint=camera)
    memory.observe(table, [Sighting("mug")])
    looks = PastMemory(read_events(tmp_path / "looks.sgm"), "home").looks
    assert [look.viewpoint for look in looks] == [camera, None]
