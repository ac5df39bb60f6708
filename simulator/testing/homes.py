"""Check that homes keep the contract of `Homes`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from sgm.schema import NUM_RELATIONS, PlaceCode
from simulator.world.homes import Homes
from simulator.world.sensing import observe
from simulator.world.streams import Streams

State = dict[str, np.ndarray]

_BY_SLOT = ("object_type", "object_code", "object_place", "object_moved")


def check_homes(
    make: Callable[[Streams], Homes], *, num_homes: int = 3, num_steps: int = 8, seed: int = 0
) -> None:
    """Check that homes are what tasks, memories and tables take them for.

    Arrays have their shapes, and say nothing beyond the rooms, furniture and slots of a home; every
    label is one of `labels`; at every step there is an object, it is at furniture of its home, and
    has the type of its description; rows of the true dynamics are distributions over the places of
    a home; equal streams give equal homes; neither the other homes of a group nor looking matter.

    Args:
        make: returns homes at t = 0, given their streams, such as `HomeSource.make`.
        num_homes: how many to try, numbered from 0.
        num_steps: for how long.
        seed: of the streams.

    Raises:
        AssertionError: if one of this does not hold; says which, in which home and step.
    """

    def play(homes: range) -> list[State]:
        made = make(Streams(seed, "test", homes))
        return [_take_state(made, step) for step in range(num_steps + 1)]

    states = play(range(num_homes))
    for step, (first, second) in enumerate(zip(states, play(range(num_homes)), strict=True)):
        for name, values in first.items():
            if not np.array_equal(values, second[name]):
                raise AssertionError(
                    f"homes must be equal for equal streams, got another '{name}' in step {step}. "
                    "Draw from `streams` alone."
                )
    for home in range(num_homes):
        alone = play(range(home, home + 1))
        for step, (both, single) in enumerate(zip(states, alone, strict=True)):
            for name, values in single.items():
                of_home = both[name][home][tuple(map(slice, values[0].shape))]
                if not np.array_equal(of_home, values[0]):
                    raise AssertionError(
                        f"homes must be the same whatever is beside them, got another '{name}' for "
                        f"home {home} alone in step {step}. Draw rows as wide as each home needs, "
                        "for the homes that need them."
                    )


def _take_state(homes: Homes, step: int) -> State:
    """Let a step pass, but for the first, look around, return what can be seen, (H, ...)."""
    if step == 0:
        _check_layout(homes)
    else:
        homes.evolve()
    _check_objects(homes, step)
    present = homes.is_present.argmax(axis=1)
    everyone = np.arange(homes.num_homes)
    codes = homes.object_code[everyone, present]
    rows = homes.transition_rows(everyone, codes)
    _check_rows(homes, rows, step)
    state = {name: getattr(homes, name).copy() for name in _BY_SLOT}
    state |= {name: getattr(homes, name) for name in ("room_labels", "furniture_labels")}
    state |= {"furniture_room": homes.furniture_room, "transition_rows": rows}
    numbers = np.array(homes.streams.homes)
    looked = (5 * step + numbers) % homes.home_num_furniture
    seen = observe(homes, np.where((step + numbers) % 3, looked, -1))
    where = homes.object_place.copy()
    _expect(
        all(np.array_equal(getattr(homes, name), state[name]) for name in _BY_SLOT)
        and np.array_equal(where, state["object_place"]),
        "be the same after a look",
        "changed",
        step,
    )
    state["coverage"] = np.zeros((homes.num_homes, 1))
    state["coverage"][seen.home, 0] = seen.coverage
    state["seen"] = np.zeros((homes.num_homes, homes.object_descriptions.num_descriptions))
    np.add.at(state["seen"], (seen.seen_home, seen.seen_code), 1 + seen.seen_relation)
    return state


def _check_layout(homes: Homes) -> None:
    """Check what does not change."""
    num_homes, width = homes.num_homes, homes.num_furniture
    _expect_shape("furniture_labels", homes.furniture_labels, (num_homes, width))
    _expect_shape("furniture_room", homes.furniture_room, (num_homes, width))
    _expect_shape("home_num_slots", homes.home_num_slots, (num_homes,))
    _expect_shape("configs", homes.configs, (num_homes,))
    _expect_shape("move_freq", homes.move_freq, (len(homes.object_labels),))
    if homes.clock is not None:
        _expect_shape("clock", homes.clock, (num_homes, 2))
    labels = homes.labels
    _expect(len(set(labels)) == len(labels), "have each label once in labels", "two")
    _expect(set(homes.object_labels) <= set(labels), "have object labels in labels", "others")
    known = [object_type.label for object_type in homes.prior.objects]
    _expect(list(homes.object_labels[: len(known)]) == known, "have the prior's types first", "not")
    for home in range(num_homes):
        rooms = [label for label in homes.room_labels[home] if label]
        count = int(homes.home_num_furniture[home])
        furniture_labels = homes.furniture_labels[home]
        _expect(all(homes.room_labels[home, : len(rooms)]), "have rooms first", "gaps", home=home)
        _expect(count > 0, "have furniture", "none", home=home)
        _expect(homes.is_furniture[home, :count].all(), "have furniture first", "gaps", home=home)
        _expect(
            not any(furniture_labels[count:]) and all(furniture_labels[:count]),
            "have labels for its furniture alone",
            "others",
            home=home,
        )
        _expect(
            set(rooms) | set(furniture_labels[:count]) <= set(labels),
            "have its labels in labels",
            "others",
            home=home,
        )
        of_room = homes.furniture_room[home, :count]
        _expect(of_room.max() < len(rooms), "have its furniture in its rooms", "others", home=home)


def _check_objects(homes: Homes, step: int) -> None:
    """Check what is where in one step."""
    shape = (homes.num_homes, homes.num_slots)
    for name in _BY_SLOT:
        _expect_shape(name, getattr(homes, name), shape)
    place, is_present = homes.object_place, homes.is_present
    most = PlaceCode.count(homes.home_num_furniture)
    is_slot = np.arange(homes.num_slots) < homes.home_num_slots[:, None]
    _expect(is_present.any(axis=1).all(), "hold an object at every step", "none", step)
    _expect((place < most[:, None]).all(), "have objects at their own furniture", "others", step)
    _expect((place >= -1).all(), "have -1 in empty slots", "less", step)
    _expect(not (is_present & ~is_slot).any(), "have objects in their own slots", "others", step)
    _expect(not (homes.object_moved & ~is_present).any(), "move what is there", "others", step)
    types = homes.object_descriptions.type_of_code[homes.object_code[is_present]]
    _expect(
        np.array_equal(types, homes.object_type[is_present]),
        "have objects of the type of their description",
        "others",
        step,
    )


def _check_rows(homes: Homes, rows: np.ndarray, step: int) -> None:
    _expect_shape("transition_rows", rows, (homes.num_homes, PlaceCode.count(homes.num_furniture)))
    total = rows.sum(axis=1)
    is_place = np.repeat(homes.is_furniture, NUM_RELATIONS, axis=1)
    _expect((rows >= 0).all() and not rows[~is_place].any(), "go to own places", "others", step)
    _expect(
        bool((np.isclose(total, 1, atol=1e-4) | (total == 0)).all()),
        "have rows of T that sum to one or zero",
        f"{total}",
        step,
    )


def _expect_shape(name: str, values: Any, shape: tuple[int, ...]) -> None:
    found = np.asarray(values, dtype=object).shape
    if found != shape:
        raise AssertionError(
            f"{name} of homes must have the shape {shape}, got {found}. Pad it to the largest home."
        )


def _expect(
    holds: object, rule: str, found: str, step: int | None = None, *, home: int | None = None
) -> None:
    if not holds:
        where = "" if step is None else f" in step {step}"
        noun = "homes" if home is None else f"home {home}"
        raise AssertionError(f"{noun} must {rule}, got {found}{where}. See `Homes`.")
