"""What a page shows: a story that may go on while it is shown, and who may be asked."""

from __future__ import annotations

import inspect
from collections import OrderedDict
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from threading import Lock
from typing import Any

import numpy as np

from nep.view.plan_shapes import PlanShapes
from sgm.finder.finder import Finder
from sgm.layout.furniture import read_position
from sgm.messages import shorten
from sgm.network.shipped import find_trained, list_shipped, split_name
from simulator.policies import POLICIES, find_policy
from simulator.story.story import Story

_PLANS_KEPT = 32


class Stage:
    """A story, read again when it has changed.

    `story` is shown, `version` counts the changes, `problem` says why it could not be read again.
    """

    def __init__(
        self,
        load: Callable[[], Story],
        get_state: Callable[[], Any] | None = None,
        doors: Iterable[Sequence[float]] = (),
    ) -> None:
        """Read the story.

        Args:
            load: reads it.
            get_state: returns something that differs when it has changed; None if it never does.
            doors: x, y of doors between rooms in metres, beside those that the story knows.

        Raises:
            ValueError: if it cannot be read, or a door is no two numbers.
        """
        self._doors = np.array([read_position(door) for door in doors], float).reshape(-1, 2)
        self._load, self._get_state = load, get_state
        self._lock = Lock()
        self._state = get_state() if get_state is not None else None
        self.story = load()
        self._plans: OrderedDict[int, tuple[int, PlanShapes]] = OrderedDict()
        self._num_plans = 0
        self.is_live = get_state is not None
        self.version = 0
        self.problem = ""

    def refresh(self) -> None:
        """Read the story again if it has changed; what cannot be read leaves it as it was."""
        if self._get_state is None:
            return
        with self._lock:
            try:
                state = self._get_state()
                if state == self._state:
                    return
                self.story, self._state, self.problem = self._load(), state, ""
                self.version += 1
            except (ValueError, OSError) as error:  # in the middle of being written
                self.problem = str(error)

    def get_shapes(self, step: int, story: Story | None = None) -> PlanShapes:
        """Return what stands where at a step."""
        return self.get_plan(step, story)[1]

    def get_plan(self, step: int, story: Story | None = None) -> tuple[int, PlanShapes]:
        """Return the number of the layout at a step, and what stands where in it.

        Another layout has another number. It is made once as long as it stays as it is; `story` is
        one that was shown, None for what is shown now.
        """
        story = story or self.story
        plan = story.plan
        memory = story.memory_at(step)
        layout = memory.layout
        key = hash((id(plan), *layout.rooms.items(), *layout.furniture.items()))
        with self._lock:
            if key not in self._plans:
                shapes = PlanShapes.of_memory(memory) if plan is None else PlanShapes.of_plan(plan)
                shapes = replace(shapes, doors=np.concatenate([shapes.doors, self._doors]))
                self._plans[key] = self._num_plans, shapes
                self._num_plans += 1
                while len(self._plans) > _PLANS_KEPT:
                    self._plans.popitem(last=False)
            return self._plans[key]


class Judges:
    """Finders by name, each made when it is first asked."""

    def __init__(self, checkpoints: Sequence[str] = ()) -> None:
        """Offer the policies that need no true homes, and the networks.

        Args:
            checkpoints: networks beside those that ship: checkpoints of `nep.fit`, or exported
                folders; NAME=SOURCE gives one a name.

        Raises:
            ValueError: if there is no such file, or the name is empty.
        """
        self._sources: dict[str, str | Path] = {name: name for name in list_shipped()}
        for text in checkpoints:
            name, source = split_name(text)
            self._sources[name or source] = find_trained(source)
        self.names = [*self._sources, *filter(_is_free, POLICIES)]
        self._finders: dict[str, Finder] = {}
        self._lock = Lock()

    def get(self, name: str) -> Finder:
        """Return the finder of one of `names`.

        Raises:
            ValueError: if it is none of them, or its files are damaged.
        """
        if name not in self.names:
            raise ValueError(
                f"policy must be one of {', '.join(self.names)}, got {shorten(name)}. Choose one "
                "of these; --checkpoint adds a network."
            )
        with self._lock:
            if name not in self._finders:
                self._finders[name] = self._make(name)
            return self._finders[name]

    def _make(self, name: str) -> Finder:
        if name not in self._sources:
            return Finder(find_policy(name)())
        from nep.robot.finder import ObjectFinder  # torch takes seconds

        return ObjectFinder.load(self._sources[name])


def _is_free(name: str) -> bool:
    """Tell whether a policy can be made without true homes."""
    policy = find_policy(name)
    parameters = inspect.signature(policy).parameters.values()
    return not policy.needs and all(
        parameter.default is not parameter.empty
        or parameter.kind in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD)
        for parameter in parameters
    )
