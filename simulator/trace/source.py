"""Recorded homes as a source: loaded, cut into steps, played in lockstep."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from sgm.checks import check_at_least
from sgm.memory.clock import DEFAULT_STEP_SECONDS
from sgm.prior.prior_graph import PriorGraph
from simulator.trace.episode import Episode, make_episode, split_days
from simulator.trace.layout import LAYOUT_FILE
from simulator.trace.recorded_homes import RecordedHomes, RecordedTypes
from simulator.trace.trace import Trace, find_traces, load_trace
from simulator.world.config import HomeConfig
from simulator.world.source import TRUE_TRANSITIONS, Group, HomeSource
from simulator.world.streams import Streams

MOST_STEP_SECONDS = 1e9  # thirty years
_SOURCES_KEPT = 4  # of a worker: training and validation homes, and some to spare


class RecordedSource(HomeSource):
    """Recorded homes, by their own rules.

    Any of them can be played in lockstep. What happens in a home does not depend on the others.
    Workers are sent the names of the folders, and read each trace once.

    Attributes:
        traces: the recordings.
        episodes: one per home.
    """

    def __init__(
        self,
        prior: PriorGraph | None = None,
        home: HomeConfig | None = None,
        folders: Sequence[str] = (),
        step_seconds: float | None = None,
        by_day: bool = False,
        replays: int = 1,
    ) -> None:
        """Read traces and cut them into steps.

        Args:
            prior: what can be known of homes beforehand; None for the one that ships with the
                package.
            home: rules of sensing, where a trace does not come from simulated homes.
            folders: traces, or folders of traces (docs/traces.md).
            step_seconds: length of a step; None for an hour, or what the homes were simulated
                with.
            by_day: whether each day from midnight to midnight is a home of its own, with an empty
                memory at first, instead of all days being one.
            replays: how often each home is played, as a home of its own: with other looks and
                questions, and other things that detection misses. Replays of a home have numbers
                one after the other.

        Raises:
            ValueError: if there is no trace, one is broken (the file and the row are named) or too
                short, has a step without objects, or was simulated with steps of another length.
        """
        if not folders:
            raise ValueError("traces must be one or more folders, got none. Name a folder.")
        check_step_seconds(step_seconds)
        traces = [load_trace(folder) for folder in find_traces(folders)]
        self._folders = tuple(str(Path(folder).absolute()) for folder in folders)
        self._prepare(traces, prior, home, (step_seconds, by_day, replays))

    @classmethod
    def from_traces(
        cls,
        traces: Sequence[Trace],
        prior: PriorGraph | None = None,
        step_seconds: float | None = None,
        by_day: bool = False,
    ) -> RecordedSource:
        """Cut traces that are loaded already into steps; see the constructor."""
        check_step_seconds(step_seconds)
        source = cls.__new__(cls)
        source._folders = ()
        source._prepare(traces, prior, None, (step_seconds, by_day, 1))
        return source

    def _prepare(
        self,
        traces: Sequence[Trace],
        prior: PriorGraph | None,
        home: HomeConfig | None,
        options: tuple[float | None, bool, int],
    ) -> None:
        super().__init__(prior, home)
        self._options = step_seconds, by_day, replays = options
        check_at_least(1, replays=replays)
        self.traces = list(traces)
        self._types = RecordedTypes(self.prior, traces)
        self.episodes: list[Episode] = []
        self._left_out: list[str] = []
        self._configs: list[HomeConfig] = []
        for trace in traces:
            seconds = _choose_step(trace, step_seconds)
            whole = make_episode(trace, seconds)
            episodes, left_out = split_days(trace, seconds) if by_day else ([whole], [])
            self._left_out += left_out
            self.episodes += episodes * replays
            self._configs += [make_rules(whole, self.home)] * len(episodes) * replays

    def __reduce__(self) -> tuple[Callable[..., RecordedSource], tuple[Any, ...]]:
        """Send a worker what it needs to have the same homes."""
        if self._folders:
            checksums = tuple(trace.checksum for trace in self.traces)
            return _load, (checksums, self.prior, self.home, self._folders, *self._options)
        step_seconds, by_day, replays = self._options
        given = (self.traces, self.prior, step_seconds, by_day, self.home, replays)
        return RecordedSource.from_traces, given

    @property
    def num_homes(self) -> int:
        """Number of homes."""
        return len(self.episodes)

    @property
    def num_steps(self) -> int:
        """Steps that all homes were recorded for."""
        return min(episode.num_steps for episode in self.episodes)

    @property
    def labels(self) -> Sequence[str]:
        """What the prior names, and what the traces do besides."""
        return self._types.labels

    @property
    def has_clock(self) -> bool:
        """Whether all layouts say when they start."""
        return all(trace.start is not None for trace in self.traces)

    @property
    def left_out(self) -> Sequence[str]:
        """Days that were recorded in part, a line each."""
        return self._left_out

    @property
    def knows(self) -> frozenset[str]:
        """Transitions, which are counted; all of the truth if all homes were simulated."""
        if all(trace.truth is not None for trace in self.traces):
            return super().knows
        return frozenset((TRUE_TRANSITIONS,))

    def list_units(self, homes: Sequence[int]) -> tuple[str, ...]:
        """Name the recording of each home: its days, replays and copies are of one household."""
        checksums = (self.episodes[home].trace.checksum for home in homes)
        return tuple(f"recording {checksum[:12]}" for checksum in checksums)

    def check_clock(self) -> None:
        """Raise ValueError if the layout of some home does not say when it starts."""
        for trace in self.traces:
            if trace.start is None:
                raise ValueError(
                    f"recorded homes must have a clock for features.clock, got no start in the "
                    f'{LAYOUT_FILE} of {trace.name}. Add a line like "start": "2024-05-06T07:30", '
                    "or switch the feature off."
                )

    def list_unknown_types(self) -> list[str]:
        """List the object types that the prior does not know."""
        return self._types.object_labels[len(self.prior.objects) :]

    def check_steps(self, num_steps: int) -> None:
        """Raise ValueError if some home was recorded for fewer steps."""
        shortest = min(self.episodes, key=lambda episode: episode.num_steps)
        if not 1 <= num_steps <= shortest.num_steps:
            raise ValueError(
                f"steps must be at least 1 and at most the {shortest.num_steps} steps of "
                f"{shortest.step_seconds:g} s that {shortest.name} was recorded for, got "
                f"{num_steps}. Play fewer, or take shorter steps."
            )

    def check_homes(self, homes: Sequence[int]) -> None:
        """Raise ValueError if there is no home of such a number."""
        if max(homes, default=0) >= self.num_homes:
            raise ValueError(
                f"home must be one of the {self.num_homes} that were recorded, got {max(homes)}. "
                "Numbers start at 0."
            )

    def check_disjoint(self, other: HomeSource) -> None:
        """Raise ValueError if a trace is also one of another source; it is named."""
        if not isinstance(other, RecordedSource):
            return
        names = {trace.checksum: trace.name for trace in other.traces}
        for checksum in {trace.checksum for trace in self.traces} & names.keys():
            raise ValueError(
                f"homes to validate on must differ from those to train on, got {names[checksum]} "
                "in trace and val_trace. Take it out of one."
            )

    def list_groups(self, homes: Sequence[int]) -> list[Group]:
        """Return all homes as one group; ValueError if there is no home of such a number."""
        self.check_homes(homes)
        steps = [self.episodes[home].num_steps for home in homes]
        return [Group(tuple(homes), min(steps))] if steps else []

    def make(self, streams: Streams) -> RecordedHomes:
        """Return the homes at t = 0; ValueError if there is no home of such a number."""
        self.check_homes(streams.homes)
        episodes = [self.episodes[home] for home in streams.homes]
        configs = [self._configs[home] for home in streams.homes]
        return RecordedHomes(episodes, self._types, configs, streams)

    def describe(self) -> dict[str, Any]:
        """Return everything that a replay depends on."""
        clocks = [episode.clock for episode in self.episodes]
        return {
            "source": "recorded",
            "prior": self.prior.checksum,
            "checksums": [trace.checksum for trace in self.traces],
            "step_seconds": [episode.step_seconds for episode in self.episodes],
            "start_s": [episode.start_s for episode in self.episodes],
            "starts": [None if clock is None else clock.start.isoformat() for clock in clocks],
        }

    def make_title(self, num_homes: int, split: str) -> str:
        """Say how many homes were recorded, and how often they are played."""
        num_recorded = len(set(self.list_units(range(num_homes))))
        title = f"{num_recorded} recorded home{'' if num_recorded == 1 else 's'}"
        return title if num_recorded == num_homes else f"{num_homes} plays of {title}"


def check_step_seconds(step_seconds: float | None) -> None:
    """Raise ValueError unless a step is a positive time, of at most `MOST_STEP_SECONDS`."""
    if step_seconds is not None and not 0 < step_seconds <= MOST_STEP_SECONDS:
        rule = f"<= {MOST_STEP_SECONDS:g}" if step_seconds > MOST_STEP_SECONDS else "> 0"
        raise ValueError(f"step must be a number of seconds {rule}, got {step_seconds}. Take 3600.")


def make_rules(whole: Episode, home: HomeConfig) -> HomeConfig:
    """Return the rules of a home: the simulator's, or what its whole recording says.

    Counted are the share of objects that move in a step, the objects per furniture node at t = 0,
    and whether objects come and go, or move to other rooms. The robot looks as in `home`, and its
    detector errs so in homes that were not simulated.
    """
    layout = whole.trace.layout
    truth = whole.trace.truth
    if truth is not None:
        return replace(truth.config, looks=home.looks, looks_per_step=home.looks_per_step)
    num_initial = int(((whole.step == 0) & (whole.place >= 0)).sum())
    return replace(
        home,
        rooms=layout.room_labels,
        furniture_per_room=tuple(max(size, 1) for size in layout.room_sizes),
        objects_per_furniture=max(round(num_initial / len(layout.furniture)), 1),
        move_share=float(np.mean(whole.num_moves / whole.num_present)),
        dynamic_nodes=whole.is_dynamic,
        cross_room_moves=whole.crosses_rooms,
    )


@lru_cache(maxsize=_SOURCES_KEPT)
def _load(checksums: tuple[str, ...], *arguments: Any) -> RecordedSource:
    """Read the homes of a command once more, in a worker; files must be as they were."""
    source = RecordedSource(*arguments)
    if tuple(trace.checksum for trace in source.traces) != checksums:
        raise ValueError(
            f"traces must stay as they are while they are played, got changed files in "
            f"{', '.join(source._folders)}. Run the command again."
        )
    return source


def _choose_step(trace: Trace, step_seconds: float | None) -> float:
    if trace.truth is None:
        return DEFAULT_STEP_SECONDS if step_seconds is None else step_seconds
    true_step = trace.truth.step_seconds
    if step_seconds not in (None, true_step):
        raise ValueError(
            f"step must be the {true_step:g} s that {trace.name} was simulated with, got "
            f"{step_seconds:g} s. Leave it out, or delete simulation.json to replay the home like "
            "a recorded one."
        )
    return true_step
