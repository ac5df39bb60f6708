"""Questions about a log: all looks of a time step at once, and the latest only."""

import numpy as np
import pytest

from sgm.finder import object_finder
from sgm.finder.object_finder import ObjectFinder
from sgm.memory.look_log import read_log
from sgm.memory.replay import replay
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting

STEPS = 8


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    """Two looks a step at three places; the mug is at the desk and the table in turn."""
    path = tmp_path_factory.mktemp("home") / "looks.jsonl"
    memory = SceneGraphMemory(log=path)
    study = memory.add_room("study")
    desk, table, shelf = (memory.add_furniture(name, study) for name in ("desk", "table", "shelf"))
    for step in range(STEPS):
        memory.observe((desk, table)[step % 2], [Sighting("mug"), Sighting("cup", confidence=0.2)])
        memory.observe(
            shelf, [Sighting("book"), Sighting("mug")] if step == 5 else [Sighting("book")]
        )
        memory.step()
    return path


def ask_look_by_look(finder, log):
    """The plain way: before each look ask for what its step shows; keep what it shows itself."""
    lines = read_log(log)
    shown = {}
    for line in lines:
        if line.kind == "look":
            sure = [name for name, _, confidence in line.values["seen"] if confidence >= 0.5]
            shown.setdefault(line.time, {}).update(dict.fromkeys(sure))
    for memory, line, furniture in replay(lines):
        if line.kind == "look":
            names = list(shown[line.time])
            scores, belief = finder._score(memory.ask(names))
            for name, _, confidence in line.values["seen"]:
                if confidence >= 0.5:
                    known = memory.places_of(name)
                    here = furniture[line.values["furniture"]]
                    was_here = any(place.furniture == here and place.is_there for place in known)
                    row = names.index(name)
                    has_moved = bool(known) and not was_here
                    yield scores[row], belief[row], line.values["furniture"], has_moved


def test_all_looks_of_a_step_are_asked_about_at_once(log, monkeypatch):
    finder = ObjectFinder.load()
    expected = list(ask_look_by_look(finder, log))
    calls, score = [], finder._score
    monkeypatch.setattr(finder, "_score", lambda asked: calls.append(asked) or score(asked))
    found = finder.ask_again(log)
    assert len(calls) == STEPS  # and not one a look
    assert len(found) == len(expected) == 2 * STEPS + 1
    scores, belief, furniture, has_moved = zip(*expected, strict=True)
    assert found.scores == pytest.approx(np.array(scores), abs=1e-5)
    assert found.belief == pytest.approx(np.array(belief))
    assert [found.furniture[place] for place in found.answer] == list(furniture)
    assert found.has_moved.tolist() == list(has_moved)


@pytest.mark.parametrize(("most", "number"), [(2, 2), (3, 2), (7, 7), (100, 17)])
def test_the_latest_looks_are_asked_about(log, monkeypatch, most, number):
    """Whole looks: with room for three questions the latest two looks of one thing each."""
    finder = ObjectFinder.load()
    every = finder.ask_again(log)
    monkeypatch.setattr(object_finder, "_MOST_QUESTIONS", most)
    found = finder.ask_again(log)
    assert len(found) in (number, number + 1)
    assert found.answer.tolist() == every.answer[-len(found) :].tolist()
    assert len(found) <= most
