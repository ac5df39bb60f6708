"""Calls of a memory that tell it what was seen, and that time passes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import datetime

import numpy as np

from sgm.checks import check_kind
from sgm.layout.viewpoint import Viewpoint
from sgm.memory.clock import MAX_JUMP, count_steps
from sgm.memory.memory_layout import MemoryLayout
from sgm.memory.score_calibration import ScoreCalibration
from sgm.memory.sighting import Sighting, read_coverage, read_hidden, read_share, read_sightings
from sgm.memory.step_log import LookWatch, StepLook
from sgm.messages import shorten
from sgm.names.words import read_words
from sgm.schema import MAX_TIME


class MemoryLooks(MemoryLayout):
    """The part of `SceneGraphMemory` for looks and for time."""

    _watch: LookWatch

    def observe(
        self,
        furniture: int,
        seen: Sequence[Sighting],
        coverage: float | Mapping[str, float] = 1.0,
        hidden: Sequence[str] = (),
        viewpoint: Viewpoint | None = None,
    ) -> None:
        """Fold one look at a furniture node into the memory.

        Every remembered edge of `furniture` is updated: seen ones become true, the others false.
        What was not in view is not counted as absent: the parts of looks that do not show an object
        are added up until they make most of a look (`MemoryBatch`).
        A look at another furniture node leaves them alone: an object that was seen at two places
        is believed at both until one of them is looked at again.

        Args:
            furniture: id from `add_furniture`.
            seen: what was detected there; detection may have missed objects. Sightings of the
                same description are several things of a kind.
            coverage: share of the furniture that was in view, above 0 and at most 1; the detector
                may have missed what was in view. Or shares of what is "in" and "onTop" of it, 0
                for one that was not in view: {"in": 0, "onTop": 0.8} of a fridge that is shut.
            hidden: descriptions of things whose own spots were out of view, behind something else:
                that they were not seen is not counted against them.
            viewpoint: from where the camera looked, for the log and the page that shows it; the
                memory does not use it.

        Looks must lie some time apart: a memory that seems to get every frame of a video
        warns once (`LookPerFrameWarning`), and counts ten looks at a place in a time step and those
        that show something new.

        Raises:
            KeyError: if `furniture` is not a furniture node of this memory.
            TypeError: if `seen` holds something else than sightings, `hidden` is no list, or the
                viewpoint none.
            ValueError: if the coverage is out of range, or something hidden has no name.

        Source: paper section 4.2, appendix B. Differs: negative evidence is counted (released
        code does not).
        """
        with self._lock:
            state = self._state
            place = state.furniture.names[state.find_place(furniture)]
        sightings = read_sightings(seen, place)  # may take its time: others go on meanwhile
        share, names = read_coverage(coverage, place), read_hidden(hidden, place)
        if viewpoint is not None:
            hint = "Take that of a BuiltLook, or leave it out."
            check_kind("viewpoint", viewpoint, Viewpoint, hint)
        look = StepLook(int(furniture), sightings, share, names)  # an id is any kind of number
        with self._lock:
            state = self._state
            state.find_place(furniture)
            num_in_step = state.step.num_looks.get(look.furniture, 0.0)
            calibration = state.score_calibration
            self._watch.note(look, place, num_in_step, state.clock, calibration is not None)
            if self._log is not None:
                self._write(
                    "look", furniture=look.furniture, coverage=share,
                    seen=[sighting.to_row() for sighting in sightings],
                    hidden=tuple(name.text for name in names), viewpoint=viewpoint,
                )  # fmt: skip
            if calibration is not None:
                sure = [replace(one, confidence=calibration(one.confidence)) for one in sightings]
                look = replace(look, seen=tuple(sure))
            state.look(look)

    @property
    def score_calibration(self) -> ScoreCalibration | None:
        """What the confidences of sightings mean; None if they are probabilities."""
        with self._lock:
            return self._state.score_calibration

    def note_absent(self, furniture: int, description: str, coverage: float = 1.0) -> None:
        """Note that a look for one thing did not find it, and say nothing of all others there.

        Args:
            furniture: id from `add_furniture`.
            description: what was looked for, seen before or not.
            coverage: share of the furniture that was in view.

        Raises:
            KeyError: if `furniture` is not a furniture node of this memory.
            ValueError: if the description is no name, or the coverage out of range.
        """
        with self._lock:
            place = self._state.layout.describe(furniture)
            words = read_words("description", description)
            coverage = read_share("coverage", coverage, place)
            furniture = int(furniture)
            self._write("absent", furniture=furniture, description=words, coverage=coverage)
            self._state.note_absent(furniture, words, coverage)

    def step(self, num_steps: int = 1) -> None:
        """Let time pass.

        Args:
            num_steps: time steps, 0 or more. The shipped network was trained on homes where one
                object in twenty moves in a step.

        Raises:
            ValueError: if it is negative, no whole number, or time would exceed `MAX_TIME` or the
                dates that the clock can tell.
        """
        if not isinstance(num_steps, (int, np.integer)) or num_steps < 0:
            raise ValueError(
                f"num_steps must be a whole number, 0 or more, got {shorten(num_steps)}. Time only "
                "goes forward."
            )
        with self._lock:
            now, clock = self._state.time, self._state.clock
            if now + num_steps > MAX_TIME:
                raise ValueError(
                    f"time must be at most {MAX_TIME}, got {num_steps} steps at time {now}. "
                    "Choose a longer time step."
                )
            if clock is not None:
                clock.get_time(now + int(num_steps))
            if num_steps:
                self._write("step", now + int(num_steps), num_steps=int(num_steps))
                self._state.let_pass(int(num_steps))

    def step_to(self, time: datetime, *, accept_jump: bool = False) -> None:
        """Let time pass until a date and time: the last step that has begun by then.

        Time never goes back, so that a date that was wrong once would stay. More than `MAX_JUMP`
        at once is therefore believed only when it is said to be right.

        Args:
            time: local, not before the present step.
            accept_jump: whether the time is right, however far ahead.

        Raises:
            ValueError: if the memory has no clock, the time lies before the present step, or more
                than `MAX_JUMP` after it and is not accepted.
        """
        with self._lock:
            now, clock = self._state.time, self._state.clock
            num_steps = count_steps(time, now, clock)
            seconds = 0.0 if clock is None else num_steps * clock.step_seconds
            if clock is not None and not accept_jump and seconds > MAX_JUMP.total_seconds():
                raise ValueError(
                    f"time must be at most {MAX_JUMP.days} days after the present step, got "
                    f"{clock.get_time(now + num_steps)} at {clock.get_time(now)}. Check the clock "
                    "of the robot; if it is right, say accept_jump=True."
                )
            self.step(num_steps)
