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

import numpy as np
import pytest

from nep.view.__main__ import main
from nep.view.answers import Desk
from nep.view.map_figure import MOST_DOTS, MapContent, find_outer_corners, make_map
from nep.view.page_state import Judges, Stage
from nep.view.saved_page import save_page
from nep.view.texts import tell_furniture, tell_ranking, tell_step
from sgm.finder.finder import Finder
from sgm.layout.box import Box
from sgm.layout.viewpoint import Viewpoint
from sgm.memory.look_log import read_log
from simulator import Bayesian, SceneGraphMemory, Sighting
from simulator.drawing import FloorPlan
from simulator.replay.replay import Replay
from simulator.replay.still_memory import StillMemory

ROOT = Path(__file__).resolve().parents[3]


def list_owners(figure, kind):
    """What can be clicked on a map."""
    owners = [owner for trace in figure["data"] for owner in trace.get("customdata", ())]
    return [value for owner, value in owners if owner == kind]


def test_an_answer_is_what_the_finder_says(desk):
    memory = desk.stage.story.memory_at(6)
    answer = desk.answer(6, "red mug", "bayesian")
    ranking = Finder(Bayesian()).rank(memory, "red mug")
    table = answer.tables[0]
    assert [row[0] for row in table.rows[:-1]] == [f"{one.probability:.1%}" for one in ranking]
    assert [row[2] for row in table.rows[:-1]] == [one.why for one in ranking]
    assert table.rows[-1][:2] == (f"{ranking.elsewhere:.1%}", "elsewhere")
    plan = Finder(Bayesian()).search_plan(memory, "red mug", k=5)
    assert [row[1] for row in answer.tables[1].rows] == [look.place.name for look in plan]
    json.dumps(answer.figure)


def test_what_is_clicked_is_on_the_map(desk):
    figure = desk.answer(6).figure
    assert list_owners(figure, "furniture") == [0, 1, 2]
    assert sorted(set(list_owners(figure, "object"))) == [
        "<b>butter</b>", "laptop", "milk", "red mug",
    ]  # fmt: skip


def test_names_are_no_html(desk):
    figure = json.dumps(desk.answer(6, "<b>butter</b>").figure["data"])
    assert "&lt;b&gt;butter" in figure
    history = desk.trace("<b>butter</b>", "bayesian", 6)
    assert "<b>" not in history["layout"]["title"]["text"]


def test_what_cannot_be_asked_is_said(desk):
    assert "must" in desk.answer(6, "two\nlines").problem
    assert "policy must be one of" in desk.answer(6, "mug", "nobody").problem


@pytest.mark.slow
def test_what_is_off_screen_is_not_sent():
    memory = SceneGraphMemory()
    for number in range(100):
        room = memory.add_room(f"room {number}")
        for place in range(8):
            furniture = memory.add_furniture("shelf", room, f"shelf {number} {place}")
            memory.observe(furniture, [Sighting(f"thing {furniture} {n}") for n in range(13)])
    plan = FloorPlan.of_memory(memory)
    everything = make_map(MapContent(plan, memory))
    # 10,400 objects: their number at each place.
    assert list_owners(everything, "object") == []
    counts = [trace["text"] for trace in everything["data"] if trace.get("text")]
    assert ["13"] * 800 in counts
    x, y, width, height = plan.room_box[57]
    room = make_map(MapContent(plan, memory, view=(x, x + width, y, y + height)))
    assert len(list_owners(room, "object")) == 8 * 13 <= MOST_DOTS
    assert list_owners(room, "furniture") == list(range(57 * 8, 58 * 8))
    assert len(json.dumps(room)) < 40_000
    assert len(json.dumps(everything)) < 250_000


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
    ranking = Finder(Bayesian()).rank(memory, "mug")
    rows = tell_ranking(ranking, "bayesian").rows
    assert len(rows) == 14
    assert rows[12][1] == "8 other places"
    assert sum(float(row[0][:-1]) for row in rows) == pytest.approx(100, abs=0.7)


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
        (["broken.jsonl"], "line 1 of a log must be one that SceneGraphMemory wrote"),
        (["routine", "--port", "0"], "port must be at least 1, got 0"),
        (["routine", "--robot", "nobody", "--steps", "2"], "policy must be one of"),
        (["routine", "--steps", "0"], "steps must be at least 1, got 0"),
    ],
)
def test_bad_input_is_one_line(arguments, message, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("broken.sgm").write_bytes(b"no memory")
    Path("broken.jsonl").write_bytes(b"no log\n")
    with pytest.raises(SystemExit) as ended:
        main([*arguments, "--no_browser"])
    said = capsys.readouterr().err
    assert ended.value.code == 2
    assert message in said
    assert len(said.splitlines()) == 1


@pytest.mark.parametrize("source", ["home.sgm", "looks.jsonl"])
def test_a_page_is_saved(source, log, monkeypatch, capsys):
    pytest.importorskip("plotly", reason="plotly is not installed: pip install .[view]")
    monkeypatch.chdir(log.parent)
    monkeypatch.setattr("nep.view.page_state.list_shipped", list)  # no seconds for torch
    main([source, "--ask", "red mug", "milk", "--save", "page.html"])
    text = Path("page.html").read_text("utf-8")
    assert "counter top in kitchen" in text
    assert "</script><script>alert" not in text
    assert capsys.readouterr().out == "Saved page.html\n"


def test_a_name_cannot_end_the_data_of_a_saved_page(tmp_path):
    pytest.importorskip("plotly", reason="plotly is not installed: pip install .[view]")
    memory = SceneGraphMemory()
    shelf = memory.add_furniture("shelf", memory.add_room("kitchen"))
    memory.observe(shelf, [Sighting("</script><script>alert(1)</script>")])
    desk = Desk(Stage(lambda: StillMemory(memory, "<i>home</i>")), Judges())
    desk.judges.names = ["bayesian"]
    save_page(desk, [], tmp_path / "page.html")
    text = (tmp_path / "page.html").read_text("utf-8")
    assert "<script>alert" not in text
    assert "<i>home" not in text


def test_only_this_machine_is_answered(desk, serve):
    address = serve(desk)
    assert address.startswith("http://127.0.0.1:")
    with urllib.request.urlopen(address) as page:
        text = page.read().decode()
    assert "https://" not in text
    request = urllib.request.Request(address, headers={"Host": "somewhere.example:80"})
    with pytest.raises(urllib.error.HTTPError, match="403"):
        urllib.request.urlopen(request)


def test_a_second_page_takes_another_port(desk, serve):
    ports = {int(serve(desk).rsplit(":", 1)[1].strip("/")) for _ in range(3)}
    assert len(ports) == 3


def test_no_free_port_is_said():
    pytest.importorskip("dash", reason="dash is not installed: pip install .[view]")
    from nep.view.server import _find_socket

    with pytest.raises(OSError, match="port must be free on this machine, got none from 70000"):
        _find_socket(70_000)


@pytest.mark.slow
def test_ctrl_c_ends_it_cleanly(log):
    pytest.importorskip("dash", reason="dash is not installed: pip install .[view]")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    command = [sys.executable, "-m", "nep.view", str(log), "--no_browser", "--port", str(port)]
    page = subprocess.Popen(
        command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env={**os.environ, "PYTHONUNBUFFERED": "1"},
    )  # fmt: skip
    line = page.stdout.readline()
    assert line.startswith("Open http://127.0.0.1:"), page.stderr.read()
    time.sleep(0.5)
    page.send_signal(signal.SIGINT)
    _, said = page.communicate(timeout=60)
    assert page.returncode == 0
    assert said == ""


def test_show_follows_a_memory_of_a_program():
    pytest.importorskip("dash", reason="dash is not installed: pip install .[view]")
    from nep.view import show

    memory = SceneGraphMemory()
    memory.add_furniture("shelf", memory.add_room("kitchen"))
    address = show(memory, opens_browser=False)
    with urllib.request.urlopen(address) as page:
        assert page.status == 200


def test_a_week_with_people_is_played(monkeypatch, tmp_path):
    pytest.importorskip("plotly", reason="plotly is not installed: pip install .[view]")
    monkeypatch.setattr("nep.view.page_state.list_shipped", list)  # no seconds for torch
    page = tmp_path / "page.html"
    main(["routine", "--steps", "6", "--save", str(page), "--home.furniture_per_room", "2"])
    text = page.read_text("utf-8")
    assert "Mon 06 May 03:00" in text
    assert "asked for" in text


def test_furniture_with_a_box_is_a_polygon_and_a_look_at_it_a_wedge():
    memory = SceneGraphMemory()
    kitchen = memory.add_room("kitchen")
    box = Box((3, 2, 0.4), (2, 1, 0.8))
    table = memory.add_furniture("table", kitchen, box=box, position=(5, 2))
    plan = FloorPlan.of_memory(memory)
    traces = make_map(MapContent(plan, memory, looked={table: None}))["data"]
    outline = [[4, 2.5], [2, 2.5], [2, 1.5], [4, 1.5], [4, 2.5]]
    drawn = [list(zip(one["x"], one["y"], strict=True)) for one in traces]
    assert [tuple(point) for point in outline] in [points[:5] for points in drawn]
    (stood,) = [one for one in traces if one.get("hovertext") == "the robot stood here"]
    assert (stood["x"], stood["y"]) == ([5.0], [2.0])
    assert [(5.0, 2.0), (4.0, 2.5), (4.0, 1.5), (5.0, 2.0)] in [points[:4] for points in drawn]
    plain = make_map(MapContent(plan, memory))["data"]
    assert not [one for one in plain if one.get("hovertext") == "the robot stood here"]


def test_furniture_with_a_polygon_has_it_on_the_map_beside_rectangles_and_squares():
    memory = SceneGraphMemory()
    kitchen = memory.add_room("kitchen")
    around = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]
    memory.add_furniture("counter", kitchen, box=Box.of_polygon(around, 0, 0.9))
    memory.add_furniture("table", kitchen, box=Box((4, 1, 0.4), (1, 1, 0.8)))
    memory.add_furniture("shelf", kitchen, position=(6, 1))
    plan = FloorPlan.of_memory(memory)
    assert plan.footprints.shape == (3, 6, 2)
    (drawn, *_) = [
        list(zip(one["x"], one["y"], strict=True))
        for one in make_map(MapContent(plan, memory))["data"]
        if one.get("fill") == "toself" and len(one["x"]) == 3 * 8  # 6, the first again and a gap
    ]
    counter, table, shelf = (drawn[8 * row : 8 * row + 7] for row in range(3))
    assert counter == [tuple(map(float, corner)) for corner in (*around, around[0])]
    assert set(table) == {(4.5, 1.5), (3.5, 1.5), (3.5, 0.5), (4.5, 0.5)}
    assert len(set(shelf)) == 4  # a square


def test_a_look_that_says_from_where_it_was_is_drawn_as_the_cone_of_the_camera():
    """The table reaches from x = 2 to 4 and y = 1.5 to 2.5; the camera is at (5, 2), turned to -x.

    Its farthest corners are hypot(3, .5) = 3.04 m away; half of a right angle to both sides of -x
    are the directions (-1, -1) and (-1, 1) / sqrt 2: x = y - 2 = 3.04 / sqrt 2 = 2.15 m.
    """
    memory = SceneGraphMemory()
    table = memory.add_furniture(
        "table", memory.add_room("kitchen"), box=Box((3, 2, 0.4), (2, 1, 0.8))
    )
    plan = FloorPlan.of_memory(memory)
    camera = Viewpoint(5.0, 2.0, 1.4, yaw=np.pi, angle=np.pi / 2, reach=4.0)
    traces = make_map(MapContent(plan, memory, looked={table: camera}))["data"]
    (stood,) = [one for one in traces if one.get("hovertext") == "the robot stood here"]
    assert (stood["x"], stood["y"]) == ([5.0], [2.0])
    wedge = [(5.0, 2.0), (2.849, -0.151), (2.849, 4.151), (5.0, 2.0)]
    assert wedge in [list(zip(one["x"], one["y"], strict=True))[:4] for one in traces]


def test_the_page_reads_from_where_a_log_was_looked(tmp_path):
    memory = SceneGraphMemory(log=tmp_path / "looks.jsonl")
    table = memory.add_furniture(
        "table", memory.add_room("kitchen"), box=Box((3, 2, 0.4), (2, 1, 0.8))
    )
    camera = Viewpoint(5.0, 2.0, 1.4, yaw=3.0, angle=1.0, reach=4.0)
    memory.observe(table, [Sighting("mug")], viewpoint=camera)
    memory.observe(table, [Sighting("mug")])
    looks = Replay(read_log(tmp_path / "looks.jsonl"), "home").looks
    assert [look.viewpoint for look in looks] == [camera, None]


def test_outer_corners_by_hand():
    """From below, the lower corners are the outer ones; from beside a corner, its neighbours."""
    square = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]], dtype=float)
    below = find_outer_corners(np.array([0.0, -3.0]), square)
    assert below.tolist() == [[1, -1], [-1, -1]]
    aside = find_outer_corners(np.array([3.0, 3.0]), square)
    assert sorted(aside.tolist()) == [[-1, 1], [1, -1]]
