"""Write down what happens in simulated homes, as traces that replay to the same scores."""

from __future__ import annotations

from collections import Counter
from datetime import datetime

import numpy as np

from sgm.layout.furniture import Furniture, Room
from sgm.layout.layout import Layout
from sgm.memory.clock import DEFAULT_STEP_SECONDS
from sgm.schema import PlaceCode
from simulator.trace.events import GONE, Event
from simulator.trace.layout import number_names
from simulator.trace.trace import Trace, Truth, list_weights
from simulator.world.sampled_homes import SampledHomes


class TraceRecorder:
    """Follows simulated homes and turns each into a trace.

    Call `record` at t = 0 and after every step, then `finish`. Besides layout and events, the
    trace keeps what only the simulator knows: the rules, the dynamics T of every description, and
    how many objects the home can hold. So a replay draws the same random numbers, and oracles
    know the same.
    """

    def __init__(
        self,
        homes: SampledHomes,
        step_seconds: float = DEFAULT_STEP_SECONDS,
        start: datetime | None = None,
    ) -> None:
        """Note homes at t = 0; see `record_homes`."""
        self._homes = homes
        clocks = [config.dynamics.clock for config in homes.configs]
        self._step_seconds = [clock.step_seconds if clock else step_seconds for clock in clocks]
        self._starts = [clock.start if clock else start for clock in clocks]
        keeps_slots = [config.dynamics.keeps_slots for config in homes.configs]
        self._keeps_slots = np.array(keeps_slots)[:, None]
        self._time = 0
        shape = (homes.num_homes, homes.num_slots)
        self._place = np.full(shape, -1)
        self._name = np.full(shape, "", dtype=object)
        numbers = range(homes.num_homes)
        self._counts: list[Counter[str]] = [Counter() for _ in numbers]
        self._codes: list[set[int]] = [set() for _ in numbers]
        self._events: list[list[Event]] = [[] for _ in numbers]
        self._code = np.full(shape, -1)  # description of what is in a slot
        self.record()

    def record(self) -> None:
        """Note what has changed in the step before: what left, what moved, what came."""
        homes = self._homes
        place, code = homes.object_place, homes.object_code
        was_here, is_here = self._place >= 0, place >= 0
        # What takes a slot that has just become free is another object, and it did not move.
        is_same = was_here & is_here & (code == self._code)
        is_same &= homes.object_moved | (place == self._place) | self._keeps_slots
        for home, slot in np.argwhere(was_here & ~is_same):
            self._add(home, slot, GONE)
        for home, slot in np.argwhere(is_same & (place != self._place)):
            self._add(home, slot, int(place[home, slot]))
        for home, slot in np.argwhere(is_here & ~is_same):
            if not (self._keeps_slots[home, 0] and self._name[home, slot]):
                self._name_object(home, slot)
            self._add(home, slot, int(place[home, slot]))
        self._place = place.copy()
        self._time += 1

    def finish(self) -> list[Trace]:
        """Return one trace per home, named after its number."""
        return [
            Trace(
                f"home_{number:06d}",
                _describe_layout(self._homes, home),
                tuple(self._events[home]),
                self._describe_truth(home),
                self._starts[home],
                (self._time - 1) * self._step_seconds[home] or None,
            )
            for home, number in enumerate(self._homes.streams.homes)
        ]

    def _name_object(self, home: int, slot: int) -> None:
        homes = self._homes
        label = homes.object_labels[homes.object_type[home, slot]]
        self._counts[home][label] += 1
        self._name[home, slot] = f"{label} {self._counts[home][label]}"
        self._code[home, slot] = homes.object_code[home, slot]
        self._codes[home].add(int(self._code[home, slot]))

    def _add(self, home: int, slot: int, place: int) -> None:
        furniture, relation = PlaceCode.split(place) if place >= 0 else (GONE, 0)
        text = self._homes.object_descriptions.text(int(self._code[home, slot]))
        time = self._time * self._step_seconds[home]
        self._events[home].append(Event(time, self._name[home, slot], text, furniture, relation))

    def _describe_truth(self, home: int) -> Truth:
        homes = self._homes
        codes = np.array(sorted(self._codes[home]))
        rows = homes.transition_rows(np.full(len(codes), home), codes)
        weights = homes.get_place_weights()[home]
        texts = [homes.object_descriptions.text(int(code)) for code in codes]
        return Truth(
            homes.configs[home],
            self._step_seconds[home],
            int(homes.home_num_slots[home]),
            dict(zip(texts, map(list_weights, rows), strict=True)),
            dict(zip(homes.object_labels, map(list_weights, weights), strict=True)),
        )


def record_homes(
    homes: SampledHomes,
    num_steps: int,
    step_seconds: float = DEFAULT_STEP_SECONDS,
    start: datetime | None = None,
) -> list[Trace]:
    """Let simulated homes evolve and return what happened, one trace per home.

    Args:
        homes: homes at t = 0; they are used up.
        num_steps: T.
        step_seconds: how long a time step is said to be, in homes without a clock.
        start: when t = 0 is said to be, local date and time; None for no time.
    """
    recorder = TraceRecorder(homes, step_seconds, start)
    for _ in range(num_steps):
        homes.evolve()
        recorder.record()
    return recorder.finish()


def _describe_layout(homes: SampledHomes, home: int) -> Layout:
    """Return the layout of a home; rooms and furniture of one label are numbered."""
    labels = homes.furniture_labels[home, homes.is_furniture[home]].tolist()
    room, code = homes.furniture_room[home].tolist(), homes.furniture_code[home].tolist()
    describe = homes.furniture_descriptions.text
    furniture = map(Furniture, labels, room, map(describe, code), number_names(labels))
    rooms = homes.configs[home].rooms
    return Layout.of(map(Room, rooms, number_names(rooms)), furniture)
