"""Sessions of legal calls, whose log gives the memory again, to the bit; and logs of odd time."""

from __future__ import annotations

import json
from datetime import datetime
from pathlib import Path
from typing import Any

import mutate
import numpy as np
import targets

from nep.view.texts import tell_furniture, tell_step
from sgm.memory.log_reader import read_log
from simulator import Clock, SceneGraphMemory, Sighting
from simulator.replay.replay import Replay
from simulator.trace.from_log import make_trace

Rng = np.random.Generator
ROOMS, LABELS = ("kitchen", "study", "attic"), ("shelf", "desk", "fridge")
THINGS = ("mug", "red mug", "plate", "keys")
STEPS = (10**3, 10**6, 3 * 10**9, 2**53, 2**63 - 1, 10**30, -1)


def make_seed(folder: Path) -> None:
    """Write the seed of the session that warms up, one in which something was seen."""
    (folder / "plan").write_text("4 legal")


def change(folder: Path, rng: Rng) -> None:
    """Write another seed, and whether its log is changed."""
    (folder / "plan").write_text(f"{rng.integers(2**62)} {rng.choice(['legal', 'odd'])}")


def use(folder: Path) -> None:
    """Live in a home and replay the log of it."""
    seed, kind = (folder / "plan").read_text().split()
    rng = np.random.default_rng(int(seed))
    memory = live(folder, rng)
    if kind == "odd":
        change_log(folder / "looks.jsonl", rng)
        targets.use_log(folder)
        return
    try:
        lines = read_log(folder / "looks.jsonl")
        story = Replay(lines, "home")
        again = story.memory_at(story.num_steps)
        _tell(story)
    except (ValueError, OSError) as error:
        raise AssertionError(f"a log of legal calls must replay, got: {error}") from error
    assert again.to_dict() == memory.to_dict()
    memory.save(folder / "live.sgm")
    again.save(folder / "again.sgm")
    assert (folder / "live.sgm").read_bytes() == (folder / "again.sgm").read_bytes()
    make_trace(lines)  # refuses a home in which nothing was seen for sure


def _tell(story: Replay) -> None:
    """Say in words what happened, and what was known then."""
    for step in story.choose_steps(20):
        memory = story.memory_at(step)
        assert all(tell_step(story, memory, step))
        for furniture in memory.furniture_ids:
            assert tell_furniture(story, memory, furniture)


def live(folder: Path, rng: Rng) -> SceneGraphMemory:
    """Call whatever may be called, and start again now and then."""
    log = folder / "looks.jsonl"
    clock = Clock(datetime(2026, 5, 4, 7), 600) if rng.random() < 0.5 else None
    memory = SceneGraphMemory(clock=clock, log=log)
    for _ in range(int(rng.integers(5, 40))):
        if rng.random() < 0.08:
            memory.save(folder / "home.sgm")
            memory = SceneGraphMemory.load(folder / "home.sgm", log=log)
        _act(memory, rng)
    return memory


def _act(memory: SceneGraphMemory, rng: Rng) -> None:
    rooms, furniture = sorted(memory.layout.rooms), memory.furniture_ids

    def take(values: Any) -> Any:
        return values[int(rng.integers(len(values)))]

    kind = rng.integers(14)
    if kind <= 1 or not rooms:
        memory.add_room(take(ROOMS))
    elif kind <= 3 or not furniture:
        position = (1.5, float(rng.uniform())) if rng.random() < 0.5 else None
        memory.add_furniture(take(LABELS), take(rooms), None, position)
    elif kind <= 6:
        seen = [Sighting(take(THINGS), take(("in", "onTop")), float(rng.uniform(0.1, 1)))]
        memory.observe(take(furniture), seen * int(rng.integers(3)), float(rng.uniform(0.1, 1)))
    elif kind == 7:
        memory.note_absent(take(furniture), take(THINGS), float(rng.uniform(0.1, 1)))
    elif kind == 8:
        memory.step(int(rng.integers(4)))
    elif kind == 9:
        memory.move_furniture(take(furniture), take(rooms))
    elif kind == 10:
        memory.remove_furniture(take(furniture)) if rng.random() < 0.5 else memory.remove_room(
            take(rooms)
        )
    elif kind == 11:
        memory.name_furniture(take(furniture), take(LABELS), take((None, "white one")))
    elif kind == 12 and len(furniture) > 1:
        memory.merge_furniture(*rng.permutation(furniture)[:2].tolist())
    elif memory.descriptions:
        memory.remove_object(take(memory.descriptions))


def change_log(path: Path, rng: Rng) -> None:
    """Let a log say odd times, leave out lines, begin again, or hold no JSON that is read."""
    lines = path.read_text().splitlines()
    for _ in range(int(rng.integers(1, 4))):
        at, kind = int(rng.integers(len(lines))), rng.integers(6)
        number = int(STEPS[int(rng.integers(len(STEPS)))])
        try:
            line = json.loads(lines[at]) if len(lines[at]) < 10_000 else {}
        except (ValueError, RecursionError):  # it was nested before
            line = {}
        if kind == 0:
            line = {"kind": "step", "time": number, "num_steps": number}
            lines.append(json.dumps(line))
        elif kind == 1 and line:
            lines[at] = json.dumps({**line, "time": number})
        elif kind == 2 and line:
            lines[at] = json.dumps(mutate.mutate_json(line, rng))
        elif kind == 3:
            lines.insert(int(rng.integers(len(lines))), lines[at])
        elif kind == 4 and len(lines) > 1:
            del lines[at]
        else:
            levels = int(rng.choice([100, 1000, 100_000]))
            lines[at] = '{"kind": ' * levels if rng.random() < 0.5 else "[" * levels
    path.write_text("\n".join(lines) + "\n")
