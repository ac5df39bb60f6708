"""Write down what happens in simulated homes, as traces that replay to the same scores."""

from __future__ import annotations

from collections import Counter
from datetime import datetime

import numpy as np

from simulator.homes import NUM_RELATIONS
from simulator.houses import Houses
from simulator.memory.clock import DEFAULT_STEP_SECONDS
from simulator.trace.events import GONE, Event
from simulator.trace.layout import Furniture, Layout, Room
from simulator.trace.trace import Trace
from simulator.trace.truth import Truth, list_weights


class TraceRecorder:
    """Follows simulated homes and turns each into a trace.

    Call `record` at t = 0 and after every step, then `finish`. Besides layout and events, the
    trace keeps what only the simulator knows: the rules, the dynamics T of every description, and
    how many objects the home can hold. So a replay draws the same random numbers, and oracles
    know the same.
    """

    def __init__(
        self,
        houses: Houses,
        step_seconds: float = DEFAULT_STEP_SECONDS,
        start: datetime | None = None,
    ) -> None:
        """Start with nothing recorded.

        Args:
            houses: homes at t = 0.
            step_seconds: how long a time step is said to be.
            start: when t = 0 is said to be, local date and time; None for no time.
        """
        self._houses = houses
        self._step_seconds = step_seconds
        self._start = start
        self._time = 0
        shape = (houses.num_houses, houses.num_slots)
        self._place = np.full(shape, -1)
        self._name = np.full(shape, "", dtype=object)
        self._counts: list[Counter[str]] = [Counter() for _ in range(houses.num_houses)]
        self._codes: list[set[int]] = [set() for _ in range(houses.num_houses)]
        self._events: list[list[Event]] = [[] for _ in range(houses.num_houses)]
        self._code = np.full(shape, -1)  # description of what is in a slot
        self.record()

    def record(self) -> None:
        """Note what has changed in the step before: what left, what moved, what came."""
        houses = self._houses
        place, code = houses.object_place, houses.object_code
        was_here, is_here = self._place >= 0, place >= 0
        # Who takes a slot that somebody has just left is another object, and it did not move.
        is_same = was_here & is_here & (code == self._code)
        is_same &= houses.object_moved | (place == self._place)
        for house, slot in np.argwhere(was_here & ~is_same):
            self._add(house, slot, GONE)
        for house, slot in np.argwhere(is_same & (place != self._place)):
            self._add(house, slot, int(place[house, slot]))
        for house, slot in np.argwhere(is_here & ~is_same):
            label = houses.object_labels[houses.object_type[house, slot]]
            self._counts[house][label] += 1
            self._name[house, slot] = f"{label} {self._counts[house][label]}"
            self._codes[house].add(int(code[house, slot]))
            self._code[house, slot] = code[house, slot]
            self._add(house, slot, int(place[house, slot]))
        self._place = place.copy()
        self._time += 1

    def finish(self) -> list[Trace]:
        """Return one trace per home, named after its number."""
        houses = self._houses
        traces = []
        for house, number in enumerate(houses.streams.houses):
            last = (self._time - 1) * self._step_seconds
            layout = _describe_layout(houses, house, self._start, last if last > 0 else None)
            traces.append(
                Trace(
                    f"home_{number:06d}", layout, tuple(self._events[house]),
                    self._describe_truth(house),
                )
            )  # fmt: skip
        return traces

    def _add(self, house: int, slot: int, place: int) -> None:
        furniture, relation = divmod(place, NUM_RELATIONS) if place >= 0 else (GONE, 0)
        text = self._houses.object_descriptions.text(int(self._code[house, slot]))
        self._events[house].append(
            Event(
                self._time * self._step_seconds, self._name[house, slot], text, furniture, relation
            )
        )

    def _describe_truth(self, house: int) -> Truth:
        houses = self._houses
        codes = np.array(sorted(self._codes[house]))
        rows = houses.transition_rows(np.full(len(codes), house), codes)
        weights = houses.get_place_weights()[house]
        return Truth(
            houses.config,
            self._step_seconds,
            houses.num_slots,
            {
                houses.object_descriptions.text(int(code)): list_weights(row)
                for code, row in zip(codes, rows, strict=True)
            },
            {
                label: list_weights(row)
                for label, row in zip(houses.object_labels, weights, strict=True)
            },
        )


def record_homes(
    houses: Houses,
    num_steps: int,
    step_seconds: float = DEFAULT_STEP_SECONDS,
    start: datetime | None = None,
) -> list[Trace]:
    """Let simulated homes evolve and return what happened, one trace per home.

    Args:
        houses: homes at t = 0; they are used up.
        num_steps: T.
        step_seconds: how long a time step is said to be.
        start: when t = 0 is said to be, local date and time; None for no time.
    """
    recorder = TraceRecorder(houses, step_seconds, start)
    for _ in range(num_steps):
        houses.evolve()
        recorder.record()
    return recorder.finish()


def _describe_layout(
    houses: Houses, house: int, start: datetime | None, end_s: float | None
) -> Layout:
    """Return the layout of a home; furniture of one label is numbered."""
    labels = houses.furniture_labels[house].tolist()
    total, count = Counter(labels), Counter[str]()
    furniture = []
    for index, label in enumerate(labels):
        count[label] += 1
        furniture.append(
            Furniture(
                name=label if total[label] == 1 else f"{label} {count[label]}",
                label=label,
                room=int(houses.furniture_room[index]),
                description=houses.furniture_descriptions.text(
                    int(houses.furniture_code[house, index])
                ),
            )
        )
    rooms = tuple(Room(room, room) for room in houses.room_labels)
    return Layout(rooms, tuple(furniture), start, end_s)
