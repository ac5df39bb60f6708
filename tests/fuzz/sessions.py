"""A robot that does anything in any order, with good and odd arguments, and what must hold."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from datetime import datetime
from fractions import Fraction
from pathlib import Path
from typing import Any

import mutate
import numpy as np

from sgm.finder.finder import Finder
from sgm.layout.box import Box
from sgm.memory.memory_event import read_events
from sgm.policies.heuristics import Frequentist, Priors
from sgm.replay.replay import replay
from simulator import Bayesian, Clock, SceneGraphMemory, Sighting

Rng = np.random.Generator
ODD = (*mutate.VALUES, -5, 7, 1.5, b"mug", ("mug",), datetime(2026, 1, 1), object())
ROOMS = ("kitchen", "study", "Bad", "床の間")
LABELS = ("shelf", "desk", "fridge", "oak cabinet", "πάγκος")
THINGS = ("mug", "large red mug", "keys", "the Keys", "knives", "plate", "café", "remote control")
STEPS = 40


def make_session(folder: Path) -> None:
    """Write the seed of the session that warms up."""
    (folder / "seed").write_text("0")


def change_session(folder: Path, rng: Rng) -> None:
    """Write another seed."""
    (folder / "seed").write_text(str(rng.integers(2**62)))


def use_session(folder: Path) -> None:
    """Play a session; an AssertionError is a finding."""
    rng = np.random.default_rng(int((folder / "seed").read_text()))
    clock = Clock(datetime(2026, 5, 4, 7), 600) if rng.random() < 0.3 else None
    log = folder / "looks.sgm" if rng.random() < 0.3 else None
    memory = SceneGraphMemory(clock=clock, path=log)
    for room in ROOMS[:2]:
        number = memory.add_room(room)
        for label in LABELS[:2]:
            memory.add_furniture(label, number)
    for _ in range(STEPS):
        memory = _act(memory, folder, rng, log)
    if log is not None:
        *_, (again, _, _) = replay(read_events(log))
        assert _dump(again) == _dump(memory)


def _dump(memory: SceneGraphMemory) -> bytes:
    """Return all that a memory holds."""
    return json.dumps(memory.parts.state.get_content_to_save().to_json()).encode()


def _act(memory: SceneGraphMemory, folder: Path, rng: Rng, log: Path | None) -> SceneGraphMemory:
    rooms, furniture = sorted(memory.layout.rooms), memory.furniture_ids
    if rng.random() < 0.2:
        rooms, furniture = np.array(rooms, dtype=np.int32), np.array(furniture, dtype=np.int64)

    def take(values: Any) -> Any:
        if not len(values):
            return 0
        return values[int(rng.integers(len(values)))]

    def share() -> Any:  # as a detector gives it
        number = float(rng.uniform(0.01, 1))
        return take((number, np.float32(number), Fraction(number), 1, np.int64(1), True))

    def see() -> Any:
        seen = [
            Sighting(take(THINGS), take(("in", "onTop")), share()) for _ in range(rng.poisson(2))
        ]
        return take((seen, tuple(seen), iter(seen)))

    position = tuple(map(float, rng.uniform(0.01, 1, 2))) if rng.random() < 0.5 else None
    box = Box((share(), share(), 0.5), (0.5, 1.0, 1.0), share(), take(("none", "open", "door")))
    acts: list[tuple[Callable[..., Any], tuple[Any, ...]]] = [
        (memory.add_room, (take(ROOMS),)),
        (memory.rename_room, (take(rooms), take(ROOMS))),
        (memory.add_furniture, (take(LABELS), take(rooms), None, position)),
        (memory.move_furniture, (take(furniture), take(rooms), position)),
        (memory.name_furniture, (take(furniture), take(LABELS), take((None, *LABELS)))),
        (memory.merge_furniture, (take(furniture), take(furniture))),
        (memory.remove_furniture, (take(furniture),)),
        (memory.remove_room, (take(rooms),)),
        (memory.remove_object, (take(THINGS),)),
        (memory.observe, (take(furniture), see(), share())),
        (memory.observe, (take(furniture), see())),
        (memory.observe, (take(furniture), see(), {"in": share(), "onTop": share()}, THINGS[:1])),
        (memory.add_furniture, (take(LABELS), take(rooms), None, position, box, float(share()))),
        (memory.note_absent, (take(furniture), take(THINGS), share())),
        (memory.step, (int(rng.integers(4)),)),
        *([(memory.query, (take(THINGS),))] if len(furniture) else []),
        (memory.find_furniture, (take(LABELS),)),
        (memory.places_of, (take(THINGS),)),
        (memory.resolve, (take(THINGS),)),
    ]
    kind = rng.random()
    if kind < 0.15:
        _ask(memory, take(THINGS), rng)
    elif kind < 0.2 and memory.num_furniture:
        _search(memory, take(THINGS), see, rng)
    elif kind < 0.25:
        memory.save(folder / "home.sgm")
        again = SceneGraphMemory.load(folder / "home.sgm")
        assert again.to_dict() == memory.to_dict()
        assert _dump(again) == _dump(memory)
        return again if log is None else SceneGraphMemory.open(log)
    elif kind < 0.5:  # one argument is odd
        call, arguments = take(acts[:-3])
        arguments = list(arguments)
        arguments[int(rng.integers(len(arguments)))] = take(ODD)
        before = _dump(memory), log and len(read_events(log))
        try:
            call(*arguments)
        except (ValueError, KeyError, TypeError) as error:
            _check_message(call.__name__, error)
            after = _dump(memory), log and len(read_events(log))
            assert after == before, call.__name__
    else:
        call, arguments = take(acts)
        try:
            call(*arguments)
        except KeyError as error:  # nothing of that kind
            _check_message(call.__name__, error)
        except ValueError as error:
            if call != memory.merge_furniture:  # a piece with itself
                raise
            _check_message(call.__name__, error)
    return memory


def _check_message(name: str, error: Exception) -> None:
    """Check that it says what must hold, in a line."""
    text = str(error.args[0])
    assert " must " in text, f"{name}: {text[:300]}"
    assert len(text) < 1000, f"{name}: {text[:300]}"
    assert "\n" not in text, f"{name}: {text[:300]}"


def _ask(memory: SceneGraphMemory, thing: str, rng: Rng) -> None:
    """Ask, which is reading, and check what is answered."""
    policy = (Bayesian, Frequentist, Priors)[int(rng.integers(3))]()
    before = json.dumps(memory.to_dict())
    if not memory.num_furniture:
        try:
            Finder(policy).rank(memory, thing)
        except ValueError as error:
            _check_message("rank", error)
            return
        raise AssertionError("a home without furniture was ranked")
    ranking = Finder(policy).rank(memory, thing)
    assert json.dumps(memory.to_dict()) == before
    found = [place.probability for place in ranking]
    assert len(found) == memory.num_furniture
    assert found == sorted(found, reverse=True)
    assert all(0 <= p <= 1 and math.isfinite(p) for p in (*found, ranking.elsewhere))
    assert sum(found) + ranking.elsewhere > 1 - 1e-6  # above, where several are meant
    assert str(ranking)


def _search(memory: SceneGraphMemory, thing: str, see: Callable[[], Any], rng: Rng) -> None:
    """Look until it is over: three looks a place at most."""
    search = Finder(Bayesian()).search(memory, thing)
    offered: list[int] = []
    while (look := search.next()) is not None:
        offered.append(look.place.furniture)
        kind = rng.integers(4)
        if kind == 0:
            search.found()
        elif kind == 1:
            search.not_found()
        else:
            search.seen(see(), float(rng.uniform(0.1, 1)))
        if rng.random() < 0.2:
            memory.step()
        assert len(offered) <= 3 * memory.num_furniture
    assert search.outcome
