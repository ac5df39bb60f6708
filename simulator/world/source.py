"""Where homes come from: an interface, and homes that are sampled from a prior."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

from sgm.checks import check_at_least
from sgm.prior.prior_graph import PriorGraph
from simulator.world.config import HomeConfig
from simulator.world.homes import Homes, list_labels
from simulator.world.sampled_homes import SampledHomes
from simulator.world.streams import Streams

# What policies may need to know of the true homes (`Policy.needs`), and a source says it knows.
TRUE_TRANSITIONS = "transitions"  # `Homes.transition_rows`: where objects go
TRUE_PLACE_WEIGHTS = "place weights"  # `Homes.get_place_weights`: what class noise has left
TRUE_SCHEDULES = "schedules"  # `SampledHomes.sample_hours`: how people may live on


@dataclass(frozen=True, slots=True)
class Group:
    """Homes that are played in lockstep.

    Attributes:
        homes: their numbers.
        num_steps: steps that can be played in all of them; None for as many as wanted.
        play_steps: steps for which they are lived in when snapshots are collected: the questions
            that are kept are spread over them; None to keep every question.
    """

    homes: tuple[int, ...]
    num_steps: int | None = None
    play_steps: int | None = None


class HomeSource(ABC):
    """Homes, numbered from 0, and all that is known of them before they are made.

    Made once by a command and handed on to whatever collects, trains, evaluates or plays. It is
    sent to workers with every job: a subclass that holds much defines `__reduce__`. One of your own
    is named by its import path, `--homes my_module.MySource`; it is called with the prior and the
    rules, and its further arguments are options: `--homes.my_argument 3`.

    Attributes:
        prior: what can be known of homes beforehand.
        home: the rules, where the source does not say otherwise.
        kept_share: where homes are lived in for longer than is kept of them, keep at least so much
            of the questions of each life, however long it is.
    """

    kept_share: ClassVar[float] = 0.0

    def __init__(self, prior: PriorGraph | None = None, home: HomeConfig | None = None) -> None:
        """Keep prior and rules.

        Args:
            prior: what homes look like; None for the prior that ships with the package.
            home: the rules; None for the paper's.
        """
        self.prior = PriorGraph.default() if prior is None else prior
        self.home = HomeConfig() if home is None else home

    @property
    def num_homes(self) -> int | None:
        """Number of homes; None if there are as many as wanted."""
        return None

    @property
    def num_steps(self) -> int | None:
        """Steps that every home can be played for; None for as many as wanted."""
        return None

    @property
    def has_clock(self) -> bool:
        """Whether it is known of all homes what time it is."""
        return False

    @property
    def left_out(self) -> Sequence[str]:
        """What was not taken of recorded homes, a line each."""
        return ()

    @property
    def knows(self) -> frozenset[str]:
        """What is known of the true homes, of what policies may need."""
        return frozenset((TRUE_TRANSITIONS, TRUE_PLACE_WEIGHTS))

    def list_units(self, homes: Sequence[int]) -> tuple[str, ...] | None:
        """Name what each home is a play of; None if all of them were drawn independently.

        Homes of one name, such as replays of a recording, count as one in statistics.
        """
        return None

    @property
    @abstractmethod
    def labels(self) -> Sequence[str]:
        """Every label of all homes once: equal to `labels` of whatever `make` returns."""

    @abstractmethod
    def list_groups(self, homes: Sequence[int]) -> list[Group]:
        """Share homes out into groups that `make` can make at once."""

    @abstractmethod
    def make(self, streams: Streams) -> Homes:
        """Return the homes that the streams are for, at t = 0; equal streams give equal homes.

        What happens in a home depends on its own streams alone, not on the others.
        """

    @abstractmethod
    def describe(self) -> dict[str, Any]:
        """Return all that the homes depend on besides their streams, as JSON values.

        Its "source" is a word for the kind of homes, as in "sampled homes".
        """

    @abstractmethod
    def make_title(self, num_homes: int, split: str) -> str:
        """Say in a few words which homes are played, for titles of tables."""

    def check_homes(self, homes: Sequence[int]) -> None:
        """Raise ValueError if there is no home of one of the numbers."""
        if self.num_homes is not None and max(homes, default=0) >= self.num_homes:
            raise ValueError(
                f"home must be one of the {self.num_homes} that there are, got {max(homes)}. "
                "Numbers start at 0."
            )

    def check_disjoint(self, other: HomeSource) -> None:
        """Raise ValueError if a home of a limited number is also one of another source."""
        if self.num_homes is not None and self.describe() == other.describe():
            raise ValueError(
                f"homes to validate on must differ from those to train on, got the same "
                f"{self.num_homes} for both. Name others."
            )

    def check_steps(self, num_steps: int) -> None:
        """Raise ValueError if steps are below 1, or more than some home can be played for."""
        check_at_least(1, steps=num_steps)
        if self.num_steps is not None and num_steps > self.num_steps:
            raise ValueError(
                f"steps must be at most the {self.num_steps} that there are of every home, got "
                f"{num_steps}. Play fewer."
            )

    def check_clock(self) -> None:
        """Raise ValueError unless it is known of all homes what time it is."""
        if not self.has_clock:
            raise ValueError(
                f"homes must have a clock for features.clock, got {self.describe()['source']} "
                "homes, in which no time of day means anything. Name recorded homes (trace), or "
                "switch the feature off."
            )


class SampledSource(HomeSource):
    """Homes that are sampled from the prior by the rules, as many as wanted.

    Source: paper section 4.1, appendix A.
    """

    @property
    def knows(self) -> frozenset[str]:
        """What is known of the true homes: class weights mean something where T is all there is."""
        dynamics, known = self.home.dynamics, super().knows
        known = known if dynamics.follows_transitions else known - {TRUE_PLACE_WEIGHTS}
        return known | {TRUE_SCHEDULES} if dynamics.has_schedules else known

    @property
    def labels(self) -> list[str]:
        """House, floor, and all that the prior names."""
        return list_labels(self.prior)

    def list_groups(self, homes: Sequence[int]) -> list[Group]:
        """Return all homes as one group."""
        return [Group(tuple(homes))] if homes else []

    def make(self, streams: Streams) -> SampledHomes:
        """Sample homes at t = 0; raises ValueError if the prior has nothing for a room."""
        return SampledHomes(self.prior, self.home, streams)

    def describe(self) -> dict[str, Any]:
        """Return the rules and the checksum of the prior."""
        prior, home = self.prior.checksum, self.home.describe()
        return {"source": "sampled", "prior": prior, "home": home}

    def make_title(self, num_homes: int, split: str) -> str:
        """Say how many homes of which split, and whether objects come and go."""
        nodes = "on" if self.home.dynamic_nodes else "off"
        return f"dynamic nodes {nodes}, {num_homes} {split} homes"


class PaperSource(SampledSource):
    """Homes of the sizes in the paper's released code, which differ from those in its text.

    A room has 6 furniture nodes and each of them 5 objects at first, 24 places and 120 objects in
    all; a search ends after 10 looks. All other rules are those of the text.
    """

    def __init__(self, prior: PriorGraph | None = None, home: HomeConfig | None = None) -> None:
        """Keep prior and rules; the sizes are the released code's."""
        super().__init__(prior, home)
        self.home = replace(self.home, furniture_per_room=6, objects_per_furniture=5, max_looks=10)

    def make_title(self, num_homes: int, split: str) -> str:
        """Say what the homes are, how many of which split, and whether objects come and go."""
        return f"homes of the released code, {super().make_title(num_homes, split)}"
