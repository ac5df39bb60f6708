"""Recorded homes as an experiment needs them: loaded, cut into steps, played in lockstep."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from simulator.memory.clock import DEFAULT_STEP_SECONDS
from simulator.priors.prior_graph import PriorGraph
from simulator.trace.episode import Episode, make_episode, split_days
from simulator.trace.layout import LAYOUT_FILE
from simulator.trace.recorded_homes import RecordedHomes
from simulator.trace.trace import Trace, find_traces, load_trace
from simulator.trace.types import RecordedTypes
from simulator.world.config import HomeConfig
from simulator.world.streams import Streams


@dataclass(frozen=True, slots=True)
class TraceConfig:
    """Which recorded homes, and how they are cut into steps.

    Attributes:
        folders: traces, or folders of traces.
        step_seconds: length of a step; None for an hour, or what the homes were simulated with.
        by_day: whether each day from midnight to midnight is a home of its own, with an empty
            memory at first, instead of all days being one.
    """

    folders: tuple[str, ...]
    step_seconds: float | None = None
    by_day: bool = False

    def __post_init__(self) -> None:
        """Check every value.

        Raises:
            ValueError: if there is no folder, or the step is not positive.
        """
        if not self.folders:
            raise ValueError("traces must be one or more folders, got none. Name a folder.")
        if self.step_seconds is not None and not 0 < self.step_seconds < float("inf"):
            raise ValueError(
                f"step must be a number of seconds > 0, got {self.step_seconds}. Take 3600."
            )

    def load(self, prior: PriorGraph) -> Recordings:
        """Read the traces.

        Raises:
            ValueError: if there is none, or a file is broken; names the file and the row.
        """
        traces = [load_trace(folder) for folder in find_traces(self.folders)]
        return Recordings(traces, prior, self.step_seconds, self.by_day)


class Recordings:
    """Recorded homes, numbered from 0.

    Any of them can be played in lockstep. What happens in a home does not depend on the others.

    Attributes:
        traces: the recordings.
        episodes: one per home.
        left_out: what was not taken, a line each.
    """

    def __init__(
        self,
        traces: Sequence[Trace],
        prior: PriorGraph,
        step_seconds: float | None = None,
        by_day: bool = False,
    ) -> None:
        """Cut traces into steps.

        Args:
            traces: one or more.
            prior: what can be known of homes beforehand.
            step_seconds: length of a step; None for an hour, or what the homes were simulated
                with.
            by_day: whether each day is a home of its own.

        Raises:
            ValueError: if a trace is too short, has a step without objects, or was simulated with
                steps of another length.
        """
        self.traces = list(traces)
        self._types = RecordedTypes(prior, traces)
        self.episodes: list[Episode] = []
        self.left_out: list[str] = []
        self._configs: list[HomeConfig] = []
        for trace in traces:
            seconds = _choose_step(trace, step_seconds)
            whole = make_episode(trace, seconds)
            episodes = [whole]
            if by_day:
                episodes, left_out = split_days(trace, seconds)
                self.left_out += left_out
            self.episodes += episodes
            self._configs += [make_rules(whole)] * len(episodes)

    @property
    def num_homes(self) -> int:
        """Number of homes."""
        return len(self.episodes)

    @property
    def num_steps(self) -> int:
        """Steps that all homes were recorded for."""
        return min(episode.num_steps for episode in self.episodes)

    @property
    def has_truth(self) -> bool:
        """Whether all homes were simulated, so that their true dynamics are known."""
        return all(trace.truth is not None for trace in self.traces)

    def check_clock(self) -> None:
        """Check that it is known of all homes what time it is.

        Raises:
            ValueError: if the layout of some home does not say when it starts.
        """
        for trace in self.traces:
            if trace.layout.start is None:
                raise ValueError(
                    f"recorded homes must have a clock for features.clock, got no start in the "
                    f'{LAYOUT_FILE} of {trace.name}. Add a line like "start": "2024-05-06T07:30", '
                    "or switch the feature off."
                )

    def list_unknown_types(self) -> list[str]:
        """List the object types that the prior does not know."""
        return self._types.object_labels[len(self._types.prior.objects) :]

    def check_steps(self, num_steps: int) -> None:
        """Check a number of steps.

        Raises:
            ValueError: if some home was recorded for fewer.
        """
        shortest = min(self.episodes, key=lambda episode: episode.num_steps)
        if not 1 <= num_steps <= shortest.num_steps:
            raise ValueError(
                f"steps must be at least 1 and at most the {shortest.num_steps} steps of "
                f"{shortest.step_seconds:g} s that {shortest.name} was recorded for, got "
                f"{num_steps}. Play fewer, or take shorter steps."
            )

    def list_groups(self, homes: Sequence[int] | None = None) -> list[list[int]]:
        """Group homes (all if None) that can be in lockstep: all of them.

        Raises:
            ValueError: if there is no home of such a number.
        """
        homes = range(self.num_homes) if homes is None else homes
        if max(homes, default=0) >= self.num_homes:
            raise ValueError(
                f"home must be one of the {self.num_homes} that were recorded, got {max(homes)}. "
                "Numbers start at 0."
            )
        return [list(homes)]

    def make_homes(self, streams: Streams) -> RecordedHomes:
        """Return the homes that the streams are for, at t = 0.

        Raises:
            ValueError: if there is no home of such a number.
        """
        (homes,) = self.list_groups(streams.homes)
        episodes = [self.episodes[home] for home in homes]
        configs = [self._configs[home] for home in homes]
        return RecordedHomes(episodes, self._types, configs, streams)

    def describe(self) -> dict[str, Any]:
        """Return everything that a replay depends on, as JSON values."""
        clocks = [episode.clock for episode in self.episodes]
        return {
            "checksums": [trace.checksum for trace in self.traces],
            "step_seconds": [episode.step_seconds for episode in self.episodes],
            "start_s": [episode.start_s for episode in self.episodes],
            "starts": [None if clock is None else clock.start.isoformat() for clock in clocks],
        }


def make_rules(whole: Episode) -> HomeConfig:
    """Return the rules of a home: the simulator's, or what its whole recording says.

    Counted are the share of objects that move in a step, the objects per furniture node at t = 0,
    and whether objects come and go, or move to other rooms. Detection errs as in simulated homes.

    Args:
        whole: all of a trace.
    """
    layout = whole.trace.layout
    truth = whole.trace.truth
    if truth is not None:
        return truth.config
    num_initial = int(((whole.step == 0) & (whole.place >= 0)).sum())
    return replace(
        HomeConfig(
            rooms=layout.room_labels,
            furniture_per_room=tuple(max(size, 1) for size in layout.room_sizes),
        ),
        objects_per_furniture=max(round(num_initial / len(layout.furniture)), 1),
        move_share=float(np.mean(whole.num_moves / whole.num_present)),
        dynamic_nodes=whole.is_dynamic,
        cross_room_moves=whole.crosses_rooms,
    )


def _choose_step(trace: Trace, step_seconds: float | None) -> float:
    if trace.truth is None:
        return DEFAULT_STEP_SECONDS if step_seconds is None else step_seconds
    own = trace.truth.step_seconds
    if step_seconds not in (None, own):
        raise ValueError(
            f"step must be the {own:g} s that {trace.name} was simulated with, got "
            f"{step_seconds:g} s. Leave it out, or delete simulation.json to replay the home like "
            "a recorded one."
        )
    return own
