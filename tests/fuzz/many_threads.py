"""Threads that save, read and write: each call ends well or with one line, each file is whole.

The same seed gives the same calls, but not the same order of them.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from sgm.memory.memory_event import read_events
from simulator import Bayesian, SceneGraphMemory, Sighting
from simulator.story.past_memory import PastMemory

Rng = np.random.Generator
THINGS = ("mug", "red mug", "plate", "keys", "phone")
CALLS = 40  # of each thread
PLANS = ("alone", "readers", "writers", "one path", "one log")


def make_plan(folder: Path) -> None:
    """Write what warms up: one thread."""
    (folder / "plan").write_text("0 alone")


def change(folder: Path, rng: Rng) -> None:
    """Choose what the threads do."""
    (folder / "plan").write_text(f"{rng.integers(2**62)} {rng.choice(PLANS)}")


def use(folder: Path) -> None:
    """Run up to four threads at once, and check what they leave."""
    seed, plan = (folder / "plan").read_text().split(" ", 1)
    log, path = folder / "looks.sgm", folder / "home.sgm"
    memory = make_home(log)
    memory.save(path)
    works: list[Callable[[Rng], None]]
    if plan == "alone":
        works = [lambda rng: (write(memory, rng), read(memory, rng), save(memory, path)) and None]
    elif plan == "readers":
        works = [lambda rng: write(memory, rng), *[lambda rng: read(memory, rng)] * 3]
    elif plan == "writers":
        works = [*[lambda rng: write(memory, rng)] * 3, lambda rng: save(memory, path)]
    elif plan == "one path":  # two homes, whichever is last
        other = make_home()
        works = [lambda _: save(memory, path), lambda _: save(other, path)] * 2
    else:
        works = [lambda rng: write_in_turn(log, rng)] * 2 + [lambda _: load(path)] * 2
    run(works, int(seed))
    load(path)
    assert not list(folder.glob("*.part")), "a file that is not whole was left"
    try:
        story = PastMemory(read_events(log), "home")
        again = story.memory_at(story.num_steps)
    except ValueError as error:
        raise AssertionError("a log of legal calls must replay") from error
    if plan != "one log":
        assert again.to_dict() == memory.to_dict()


def run(works: list[Callable[[Rng], None]], seed: int) -> None:
    """Run threads; what one of them raises is raised."""
    errors: list[BaseException] = []

    def work(number: int) -> None:
        rng = np.random.default_rng([seed, number])
        try:
            for _ in range(CALLS):
                works[number](rng)
        except BaseException as error:
            errors.append(error)

    threads = [threading.Thread(target=work, args=(n,), daemon=True) for n in range(len(works))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    if errors:
        raise AssertionError(f"a legal call raised {type(errors[0]).__name__}") from errors[0]


def make_home(log: Path | None = None) -> SceneGraphMemory:
    """Return a memory of three places."""
    memory = SceneGraphMemory(path=log)
    kitchen = memory.add_room("kitchen")
    for label in ("shelf", "desk", "fridge"):
        memory.add_furniture(label, kitchen)
    return memory


def open_log(log: Path) -> SceneGraphMemory:
    """Go on in a log that another one may be writing: one at a time, the others are told."""
    try:
        return SceneGraphMemory.open(log)
    except (ValueError, OSError) as error:
        check_message(error)
        return make_home()


def write_in_turn(log: Path, rng: Rng) -> None:
    """Change a memory in a log; another one that opened it since has it, and this one is told."""
    try:
        write(open_log(log), rng)
    except ValueError as error:
        if "memory file must be written by one memory at a time" not in str(error):
            raise
        check_message(error)


def write(memory: SceneGraphMemory, rng: Rng) -> None:
    """Change a memory."""

    def take(values: Any) -> Any:
        return values[int(rng.integers(len(values)))]

    kind = rng.integers(6)
    if kind == 0:
        memory.step()
    elif kind == 1:
        memory.add_furniture("shelf", 0)
    elif kind == 2:
        memory.note_absent(take((0, 1, 2)), take(THINGS))
    else:
        seen = [Sighting(take(THINGS)) for _ in range(int(rng.integers(3)))]
        memory.observe(take((0, 1, 2)), seen)


def read(memory: SceneGraphMemory, rng: Rng) -> None:
    """Read a memory in one of the ways that there are."""
    thing = THINGS[int(rng.integers(len(THINGS)))]
    calls: list[Callable[[], object]] = [
        memory.to_dict,
        lambda: memory.last_seen(thing),
        lambda: memory.places_of(thing),
        lambda: memory.rank(Bayesian(), thing),
        lambda: memory.resolve(thing),
        lambda: memory.find_furniture("shelf"),
        memory.copy,
        lambda: [memory.describe(number) for number in memory.furniture_ids],
    ]
    try:
        calls[int(rng.integers(len(calls)))]()
    except KeyError as error:  # nothing of that name yet
        check_message(error)


def check_message(error: Exception) -> None:
    """Check that it says what must hold, in a line."""
    text = str(error)
    assert " must " in text, text[:300]
    assert "\n" not in text, text[:300]


def save(memory: SceneGraphMemory, path: Path) -> None:
    """Write a file, and find a whole one there."""
    memory.save(path)
    load(path)


def load(path: Path) -> None:
    """Read a file that others may be writing."""
    SceneGraphMemory.load(path)
