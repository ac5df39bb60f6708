"""What may be done to a memory, for tests of laws that hold for any session."""

from __future__ import annotations

import json
from datetime import datetime, timedelta
from fractions import Fraction

import numpy as np
from hypothesis import strategies as st

from sgm.layout.box import Box
from sgm.memory.clock import Clock
from sgm.memory.memory_content import MemoryContent
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting

ROOMS = ("kitchen", "Living_Room", "Küche")
FURNITURE = ("fridge", "counter top", "hammock", "本棚")
THINGS = ("large red mug", "Milk", "the flux_capacitor", "氷", "small mug", "MUG")
NAMES = (*THINGS, "a", "")  # and an id
# What no file holds there, and what no call expects.
VALUES = (
    None, True, False, 0, -1, 1, 2**31, 2**63, 10**30, 3e9, 1e300, -1e300, 0.5, 1e-300,
    float("nan"), float("inf"), "", "x", "x" * 5000, "a\nb", "[red]x[/nope]", "\u0000", "../x", [],
    {}, [[]], [0], ["x"], {"x": 0},
)  # fmt: skip
ODD = (*VALUES, -5, 7, 1.5, b"mug", ("mug",), datetime(2026, 1, 1), object())
# A share as detectors give it.
shares = st.sampled_from((1.0, 0.6, np.float32(0.7), Fraction(1, 3), 1, np.int64(1), True))

sightings = st.lists(
    st.builds(
        Sighting, st.sampled_from(THINGS), st.sampled_from(("in", "onTop")),
        st.sampled_from((1.0, 0.8, 0.3, 0.1 + 0.2)), id=st.sampled_from((None, None, "a", "b")),
        embedding=st.sampled_from(((), (1.0, 0.1 + 0.2))),
        position=st.sampled_from((None, (1.0, 0.1 + 0.2, 1.0), (1, 2, 1.05), (-3.3, 4, 0))),
    ) | st.builds(
        Sighting, st.sampled_from(THINGS), position=st.just((1.5, 2.5, 1)),
        position_sd=st.sampled_from((None, 0, 0.1 + 0.2)),
    ),
    max_size=4,
)  # fmt: skip
places = st.integers(0, 4)  # ids of rooms and furniture, some of which there are
positions = st.none() | st.tuples(st.floats(-9, 9), st.integers(-9, 9))
coverages = st.sampled_from((1.0, 0.5, 0.3, 1 / 3))
by_relation = st.sampled_from(
    ({"in": 0, "onTop": 1}, {"in": 0.6, "onTop": 0.3}, {"on top": 1 / 3}, {"in": 0}, {"by": 1})
)
boxes = st.none() | st.sampled_from(
    (Box((1, 2, 0.5), (0.6, 1.2, 1.0), 0.3, "door"), Box.of_floor((0, 0), (4, 3)), "large")
)

# Every call that writes, with arguments of which some are refused.
CALLS = {
    "add_room": st.tuples(st.sampled_from((*ROOMS, ""))),
    "rename_room": st.tuples(places, st.sampled_from((*ROOMS, "\n"))),
    "add_furniture": st.tuples(
        st.sampled_from((*FURNITURE, "\n")),
        places,
        st.none() | st.just("old thing"),
        positions | st.just((1, "x")),
        boxes,
        st.sampled_from((None, 0, 2.5, -1)),
    ),
    "move_furniture": st.tuples(places, st.none() | places, positions | st.just("here"), boxes),
    "name_furniture": st.tuples(
        places, st.sampled_from((*FURNITURE, "\n")), st.sampled_from((None, "white one", "\n"))
    ),
    "merge_furniture": st.tuples(places, places),
    "remove_room": st.tuples(places),
    "remove_furniture": st.tuples(places),
    "remove_object": st.tuples(st.sampled_from((*THINGS, "unicorn", ""))),
    "observe": st.tuples(
        places,
        sightings | st.just(["mug"]),
        coverages | by_relation | st.just(0),
        st.lists(st.sampled_from((*THINGS, "unicorn", "")), max_size=2),
    ),
    "note_absent": st.tuples(places, st.sampled_from((*THINGS, "")), coverages | st.just(2)),
    "note_found": st.tuples(
        places,
        st.sampled_from((*NAMES, "unicorn")),
        st.sampled_from(("in", "under")),
        coverages | st.just(2),
    ),
    "query": st.tuples(st.sampled_from((*THINGS, ""))),
    "note_moved": st.tuples(
        st.sampled_from(NAMES),
        places,
        st.sampled_from(("anna", "Tom", "")),
        st.sampled_from(("in", "on", "under")),
        st.sampled_from((None, 0.75, 1, 0.3)),
        st.none() | places,
    ),
    "picked_up": st.tuples(
        st.sampled_from(NAMES), st.none() | places, st.sampled_from((None, 0.8, 2))
    ),
    "put_down": st.tuples(st.sampled_from(NAMES), places, st.sampled_from(("in", "on", "under"))),
    "rename": st.tuples(st.sampled_from(NAMES), st.sampled_from((*THINGS, "new name", ""))),
    "merge": st.tuples(st.sampled_from(NAMES), st.sampled_from((*NAMES, "b"))),
    "split": st.tuples(st.sampled_from((*NAMES, "b")))
    | st.tuples(st.sampled_from(NAMES), places, st.sampled_from((*THINGS, "other name", ""))),
    "transform": st.tuples(
        st.floats(-4, 4), positions | st.just("far"), st.sampled_from(("", "new map", "\n"))
    ),
    "forget": st.tuples(places | st.sampled_from((*NAMES, "unicorn"))),
    "step": st.tuples(st.integers(-1, 3) | st.just(2**31)),
    "step_to": st.tuples(st.integers(0, 12) | st.sampled_from((10**9, 2**40))),
    "start_clock": st.tuples(st.sampled_from((600.0, 3600.0))),
}


def call(memory: SceneGraphMemory, name: str, arguments: tuple) -> Exception | None:
    """Make a call, and return what it raised, if it may."""
    try:
        if name == "start_clock":
            arguments = (Clock(datetime(2026, 11, 16), *arguments),)
        if name == "step_to" and memory.clock is not None and isinstance(arguments[0], int):
            seconds = arguments[0] * memory.clock.step_seconds
            if seconds < timedelta(days=999).total_seconds():
                arguments = (memory.clock.start + timedelta(seconds=seconds),)
        getattr(memory, name)(*arguments)
    except (ValueError, KeyError, TypeError, OSError) as error:
        return error
    return None


def dump(memory: SceneGraphMemory) -> str:
    """Return all that a memory holds, to the bit; as `save` writes it."""
    content: MemoryContent = memory._state.get_content_to_save()
    return json.dumps(content.to_json())
