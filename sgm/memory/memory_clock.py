"""The part of a memory for its time, which only goes forward."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime

import numpy as np

from sgm.memory.clock import MAX_JUMP, MOST_AHEAD, Clock, check_ahead, count_steps
from sgm.memory.memory_state import MemoryState
from sgm.messages import shorten
from sgm.schema import HOME_LABELS, MAX_TIME


class MemoryClock:
    """The time of a memory; `SceneGraphMemory` says what each call does, takes and raises."""

    def __init__(self, state: MemoryState) -> None:
        """Begin with the state that all parts share."""
        self._state = state

    @property
    def clock(self) -> Clock | None:
        """What time it is at every time step; None if it was not given."""
        with self._state.lock:
            return self._state.clock

    @property
    def time(self) -> int:
        """Steps since the start."""
        with self._state.lock:
            return self._state.time

    def step(self, num_steps: int = 1, *, accept_jump: bool = False) -> None:
        """Let time pass."""
        if not isinstance(num_steps, (int, np.integer)) or num_steps < 0:
            raise ValueError(
                f"num_steps must be a whole number, 0 or more, got {shorten(num_steps)}. Time only "
                "goes forward."
            )
        num_steps = int(num_steps)
        with self._state.lock:
            now, clock = self._state.time, self._state.clock
            if now + num_steps > MAX_TIME:
                raise ValueError(
                    f"time must be at most {MAX_TIME}, got {num_steps} steps at time {now}. "
                    "Choose a longer time step."
                )
            if not accept_jump:
                remedy = "A step is of step_seconds; if so much has passed, say accept_jump=True."
                check_ahead(num_steps, now, clock, "num_steps", MOST_AHEAD, remedy)
            if clock is not None:
                clock.get_time(now + num_steps)
            if num_steps:
                self._state.write("step", now + num_steps, num_steps=num_steps)
                _forget_questions(self._state)
                self._state.let_pass(num_steps)

    def step_to(self, time: datetime, *, accept_jump: bool = False) -> None:
        """Let time pass until a date and time: the last step that has begun by then."""
        with self._state.lock:
            now, clock = self._state.time, self._state.clock
            num_steps = count_steps(time, now, clock)
            if clock is not None and not accept_jump:
                clock.get_time(now + num_steps)  # is a date
                remedy = "Check the clock of the robot; if it is right, say accept_jump=True."
                check_ahead(num_steps, now, clock, "time", MAX_JUMP, remedy)
            self.step(num_steps, accept_jump=True)


def _forget_questions(state: MemoryState) -> None:
    """Leave out objects that were asked for in this step and neither seen nor looked for.

    Nothing of them stays, nor of what they are called.
    """
    is_there = state.batch.objects["num_observed"] > 0  # or was said to be
    is_there[state.batch.edges["object"]] = True
    is_there[state.batch.lone_looks["object"]] = True
    never = np.flatnonzero(~is_there)
    if len(never):
        batch, label = state.batch, state.batch.objects["label"]
        used = np.concatenate([label[is_there], batch.room_label[0], batch.furniture_label[0]])
        gone = {batch.labels[index] for index in np.setdiff1d(label[never], used)}
        content = state.get_content().remove(objects=never.tolist())
        kept = (text for text in content.labels[len(HOME_LABELS) :] if text not in gone)
        state.take(replace(content, labels=(*HOME_LABELS, *kept)))
