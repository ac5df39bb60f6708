"""Sessions of legal calls, whose log gives the memory again, to the bit; and logs of odd time."""

from __future__ import annotations

import json
import sqlite3
from contextlib import closing
from datetime import datetime
from pathlib import Path
from typing import Any

import mutate
import numpy as np
import targets

from nep.view.texts import tell_furniture, tell_step
from sgm.memory.memory_event import read_events
from sgm.store.event import StoredEvent, insert_event
from sgm.store.home_reader import HomeReader
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
        memory.close()
        change_log(folder / "looks.sgm", rng)
        targets.use_log(folder)
        return
    try:
        lines = read_events(folder / "looks.sgm")
        story = Replay(lines, "home")
        again = story.memory_at(story.num_steps)
        _tell(story)
    except (ValueError, OSError) as error:
        raise AssertionError(f"a log of legal calls must replay, got: {error}") from error
    assert again.to_dict() == memory.to_dict()
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
    log = folder / "looks.sgm"
    clock = Clock(datetime(2026, 5, 4, 7), 600) if rng.random() < 0.5 else None
    memory = SceneGraphMemory(clock=clock, path=log)
    for _ in range(int(rng.integers(5, 40))):
        if rng.random() < 0.08:
            memory = SceneGraphMemory.open(log)
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
    """Let events say odd times, be there twice, or hold no JSON that is read."""
    with HomeReader(path) as reader:
        _, rows = reader.read(from_first=True)
    for _ in range(int(rng.integers(1, 4))):
        at, kind = int(rng.integers(len(rows) or 1)), rng.integers(5)
        number = int(STEPS[int(rng.integers(len(STEPS)))])
        if kind == 0 or not rows:
            arguments = json.dumps({"num_steps": number})
            rows.append(StoredEvent(0, _bound(number), "step", arguments, None))
        elif kind == 1:
            rows[at] = rows[at]._replace(time=_bound(number))
        elif kind == 2 and len(rows[at].arguments) < 10_000:
            arguments = json.dumps(mutate.mutate_json(json.loads(rows[at].arguments), rng))
            rows[at] = rows[at]._replace(arguments=arguments)
        elif kind == 3:
            rows.insert(int(rng.integers(len(rows))), rows[at])
        else:
            del rows[at]
    with closing(sqlite3.connect(path, isolation_level=None)) as connection:
        connection.execute("DELETE FROM snapshots WHERE event > 0")
        connection.execute("DELETE FROM events")
        for place, row in enumerate(rows, 1):
            insert_event(connection, row._replace(number=place))


def _bound(number: int) -> int:
    """Return what a column of SQLite holds."""
    return max(min(number, 2**63 - 1), -(2**63))
