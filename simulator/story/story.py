"""What a robot saw and what was true, step by step, whatever it comes from."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import defaultdict
from collections.abc import Collection
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sgm.arrays.week import HOUR_SECONDS
from sgm.finder.finder import Finder
from sgm.layout.viewpoint import Viewpoint
from sgm.memory.clock import Clock
from sgm.memory.look import Coverage
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.names.words import read_name
from sgm.store.event_kinds import PLACED
from simulator.drawing.floor_plan import FloorPlan
from simulator.drawing.history import History
from simulator.story.past_things import PastThings


@dataclass(frozen=True)
class TruePlaces:
    """The objects of one home over T + 1 steps, in C slots.

    Attributes:
        furniture: index of the furniture node that holds the object of each slot, -1 for none,
            int32 (T + 1, C).
        code: its description, a row of `descriptions`, int32 (T + 1, C).
        descriptions: every description that came up.
    """

    furniture: np.ndarray
    code: np.ndarray
    descriptions: tuple[str, ...]

    @property
    def num_steps(self) -> int:
        """Steps after the first, T."""
        return len(self.furniture) - 1

    def list_there(self, step: int, furniture: int) -> list[str]:
        """List what is at a furniture node, each object once."""
        slots = np.flatnonzero(self.furniture[step] == furniture)
        return sorted(self.descriptions[code] for code in self.code[step, slots])

    def find(self, descriptions: Collection[str], num_furniture: int) -> np.ndarray:
        """Return where any object of some descriptions is, bool (T + 1, F)."""
        names = {read_name(text) for text in descriptions}
        codes = [code for name in names for code in self._codes.get(name, ())]
        is_there = np.zeros((len(self.furniture), num_furniture), dtype=bool)
        step, slot = np.nonzero(np.isin(self.code, codes) & (self.furniture >= 0))
        is_there[step, self.furniture[step, slot]] = True
        return is_there

    @cached_property
    def _codes(self) -> dict[tuple[str, ...], list[int]]:
        codes = defaultdict(list)
        for code, text in enumerate(self.descriptions):
            codes[read_name(text)].append(code)
        return codes


MOST_PLACES = 12  # of a history
_WORTH_SHOWING = 0.03  # probability of a place that a history shows


@dataclass(frozen=True, slots=True)
class PastLook:
    """A look at furniture.

    Attributes:
        step: when.
        furniture: id of the furniture node.
        seen: what was detected there.
        missed: what was truly there and was not detected; None if it is unknown.
        sought: the one thing that was looked for; None for all.
        coverage: share of the furniture that was in view, or shares by relation.
        viewpoint: from where it was; None if it is unknown.
    """

    step: int
    furniture: int
    seen: tuple[str, ...]
    missed: tuple[str, ...] | None = None
    sought: str | None = None
    coverage: Coverage = 1.0
    viewpoint: Viewpoint | None = None


@dataclass(frozen=True, slots=True)
class PastStatement:
    """What was said, or the robot did, instead of looking.

    Attributes:
        step: when.
        kind: as an event calls it: "moved", "picked_up", "put_down", "rename", "merge", "split",
            "split_off", "remove_object", "remove_furniture", "name" or "merge_furniture".
        thing: description of the thing; empty of furniture.
        by: who said so; "robot" for what it did itself, empty where it was not said.
        furniture: id of the place that it is about; None without one.
        place: name of that place, as it was then; empty without one.
        other: the new name, or the thing or place that it is one with; empty without one.
        num_looks: looks of the story before it.
        merged: id of the furniture that is one with `furniture` from then on; None without one.
    """

    step: int
    kind: str
    thing: str
    by: str
    furniture: int | None = None
    place: str = ""
    other: str = ""
    num_looks: int = 0
    merged: int | None = None


@dataclass(frozen=True, slots=True)
class PastQuestion:
    """What a robot was asked for in a run.

    Attributes:
        step: when.
        description: what.
        furniture: id of the furniture node that it answered.
        is_right: whether it was there.
    """

    step: int
    description: str
    furniture: int
    is_right: bool


class Story(ABC):
    """A memory over time.

    Attributes:
        title: of the home or the file.
        first_step, num_steps: first and last step that there is a memory of, 0 <= first <= T.
        looks: all looks that are known, in order.
        statements: what was said or done instead, in order.
        things: which thing each look showed, over all its names.
        questions: what was asked in a run, in order.
        truth: where everything was; None if it is unknown.
        plan: floor plan, for homes that have one of their own; None to make it from the memory.
        clock: of step 0; None if there is none.
    """

    title: str
    first_step: int
    num_steps: int
    things: PastThings
    looks: tuple[PastLook, ...] = ()
    statements: tuple[PastStatement, ...] = ()
    questions: tuple[PastQuestion, ...] = ()
    truth: TruePlaces | None = None
    plan: FloorPlan | None = None
    clock: Clock | None = None

    @abstractmethod
    def memory_at(self, step: int) -> SceneGraphMemory:
        """Return the memory after all looks of a step; it is to be read, not changed.

        Raises:
            ValueError: if there is no memory of that step.
        """

    @property
    def step_hours(self) -> float:
        """Length of a step in hours; 1 without a clock, so that steps count."""
        return 1.0 if self.clock is None else self.clock.step_seconds / HOUR_SECONDS

    def get_time(self, step: int) -> str:
        """Say what time it is at a step: "Mon 06 May 07:30", or "step 12" without a clock."""
        if self.clock is None:
            return f"step {step}"
        return f"{self.clock.get_time(step):%a %d %b %H:%M}"

    def choose_steps(self, most: int) -> list[int]:
        """Return steps that tell the story best, ascending: all of them, if they are few.

        The first and the last step, then those in which something was said, then those with looks,
        then any; of too many of one kind, some at even distances.

        Args:
            most: of how many, 2 or more.
        """
        first, last = self.first_step, self.num_steps
        chosen = {first, last}
        kinds = (
            {said.step for said in self.statements},
            {look.step for look in self.looks},
            set(np.linspace(first, last, most).astype(int).tolist()),
        )
        for group in kinds:
            new = sorted(step for step in group - chosen if first <= step <= last)
            left = most - len(chosen)
            if len(new) > left:
                new = [new[n] for n in np.linspace(0, len(new) - 1, left).astype(int)]
            chosen.update(new)
        return sorted(chosen)

    def trace_object(
        self, description: str, finder: Finder | None = None, num_points: int = 48
    ) -> History:
        """Return where one thing was seen, truly was, and was believed to be.

        Args:
            description: what, in words.
            finder: whose belief; None for none.
            num_points: steps at which the finder is asked, at even distances.
        """
        first, last = self.first_step, self.num_steps
        steps = np.unique(np.linspace(first, last, num_points).astype(int))
        now = self.memory_at(last)
        index = {number: node for node, number in enumerate(now.furniture_ids)}
        matches = now.resolve(description).matches or (description,)
        wanted = self.things.find(matches, last)
        belief = None
        if finder is not None:
            belief = np.full((len(steps), len(index)), np.nan)
            for point, step in enumerate(steps.tolist()):
                memory = self.memory_at(step)
                if memory.num_furniture:
                    name = self.things.get_name(wanted, step) or description
                    for guess in finder.rank(memory, name):
                        if guess.furniture in index:
                            belief[point, index[guess.furniture]] = guess.probability
        truth = None if self.truth is None else self.truth.find(matches, len(index))[steps]
        looks = [
            (look, index[look.furniture], not wanted.isdisjoint(seen))
            for look, seen in zip(self.looks, self.things.seen, strict=True)
            if look.furniture in index
        ]
        said = [
            (statement, index[statement.furniture])
            for statement, number in zip(self.statements, self.things.spoken_of, strict=True)
            if number in wanted and statement.kind in PLACED and statement.furniture in index
        ]
        weight = np.zeros(len(index))
        if belief is not None and len(index):
            most = np.nan_to_num(belief).max(axis=0)
            weight += np.where(most >= _WORTH_SHOWING, most, 0)
        if truth is not None:
            weight += 2 * truth.mean(axis=0) + truth.any(axis=0)
        for _, place, is_found in looks:
            weight[place] += is_found
        for _, place in said:
            weight[place] += 1
        order = np.argsort(-weight, kind="stable")
        shown = order[weight[order] > 0][:MOST_PLACES]
        looks = [entry for entry in looks if entry[1] in shown]
        said = [entry for entry in said if entry[1] in shown]
        position = {place: turn for turn, place in enumerate(shown.tolist())}
        return History(
            description=description,
            places=tuple(now.describe(now.furniture_ids[place]) for place in shown),
            hours=steps * self.step_hours,
            belief=None if belief is None else belief[:, shown],
            truth=None if truth is None else truth[:, shown],
            look_hour=np.array([look.step * self.step_hours for look, _, _ in looks], dtype=float),
            look_place=np.array([position[place] for _, place, _ in looks], dtype=np.int64),
            is_found=np.array([is_found for _, _, is_found in looks], dtype=bool),
            unit="steps" if self.clock is None else "hours",
            said_hour=np.array(
                [statement.step * self.step_hours for statement, _ in said], dtype=float
            ),
            said_place=np.array([position[place] for _, place in said], dtype=np.int64),
            said_by=tuple(statement.by for statement, _ in said),
        )
