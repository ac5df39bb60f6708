"""docs/robot.md: its numbers hold, its loop runs, and it names every field of every answer."""

import re
from dataclasses import fields
from datetime import datetime, timedelta
from pathlib import Path

import pytest

from sgm.belief import CORRECTIONS, Detector
from sgm.finder.finder import Finder
from sgm.finder.ranking import Place, Ranking
from sgm.finder.search_plan import EXACT_PLACES, Look, SearchPlan
from sgm.memory.clock import Clock
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import SeenAt, Sighting
from sgm.memory.thing_changes import ThingChange, ThingEvent
from sgm.policies.heuristics import Bayesian

PAGE = (Path(__file__).resolve().parents[3] / "docs" / "robot.md").read_text(encoding="utf-8")


class Robot:
    """Drives about a home of four places; a minute a metre."""

    position = "door"

    def __init__(self, at):
        self._at = at
        self._now = datetime(2026, 11, 20, 8)
        self.been = []

    def distance(self, start, furniture):
        return 1.0 if start == "door" else 2.0

    def go_to(self, furniture):
        self.been.append(furniture)
        self._now += timedelta(minutes=10)

    def detect(self):
        return [Sighting(thing) for thing, place in self._at.items() if place == self.been[-1]]

    def now(self):
        return self._now


def find_block(text):
    """The block of Python that holds a text."""
    (block,) = (b for b in re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL) if text in b)
    return block


def run_with_answers(block, names):
    """Run the lines of a block; what stands behind `# ` is what an expression gives."""
    for line in block.splitlines():
        code, _, answer = line.partition("  # ")
        if answer:
            assert repr(eval(code, names)).startswith(answer.rstrip("'")), line
        else:
            exec(code, names)


def test_what_is_told_as_on_the_page():
    memory = SceneGraphMemory(clock=Clock(datetime(2026, 11, 19, 18, 10)))
    room = memory.add_room("kitchen")
    drawer, sink = (memory.add_furniture(label, room) for label in ("drawer", "sink"))
    memory.observe(sink, [Sighting("keys"), Sighting("red mug")])
    told, *rest = find_block("memory.note_moved(").splitlines(keepends=True)
    names = {"memory": memory, "finder": Finder(Bayesian()), "drawer": drawer, "sink": sink}
    run_with_answers(told, names)
    memory.step(20)
    run_with_answers("".join(rest), names)
    assert memory.last_seen("red mug").by == "robot"


def test_numbers_of_the_page():
    assert EXACT_PLACES == 9
    assert PAGE.count("nine") == 2
    assert f"{CORRECTIONS.seen_now:.0%}".replace("%", " %") in PAGE


@pytest.mark.parametrize("thing", ["the red mug", "scissors", "keys"])
def test_the_loop_of_the_page_finds_things(thing):
    block = find_block("def fetch(")
    names = {}
    exec(compile(block, "docs/robot.md", "exec"), names)  # our own text
    memory = SceneGraphMemory(clock=Clock(datetime(2026, 11, 20, 8), 600))
    room = memory.add_room("kitchen")
    for label in ("fridge", "counter top", "dining table", "sink"):
        memory.add_furniture(label, room)
    memory.observe(1, [Sighting("large red mug")])
    robot = Robot({"large red mug": 2, "scissors": 3})
    outcome = names["fetch"](robot, memory, thing)
    if thing == "keys":
        assert re.match(r"keys: given up, elsewhere \d+% after \d+ looks$", outcome)
        assert set(robot.been) == {0, 1, 2, 3}
    else:
        assert re.match(rf"{thing}: found at .* in kitchen after \d+ looks?$", outcome)
        assert robot.been[-1] == {"the red mug": 2, "scissors": 3}[thing]
        assert len(robot.been) <= 12


@pytest.mark.parametrize(
    "answer",
    [Sighting, SeenAt, Place, Ranking, Look, SearchPlan, Detector, ThingChange, ThingEvent],
)
def test_every_field_is_named(answer):
    hidden = {"description", "places", "looks"}  # what they hold is said, not their names
    missing = [field.name for field in fields(answer) if f"`{field.name}`" not in PAGE]
    missing = [name for name in missing if not re.search(rf"\b{name}=", PAGE)]
    assert set(missing) <= hidden
