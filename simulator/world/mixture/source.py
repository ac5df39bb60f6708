"""The source of mixed homes, and their distribution: what is drawn for each, in which bounds."""

from __future__ import annotations

import json
import math
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from datetime import datetime, timedelta
from typing import Any, ClassVar

import numpy as np

from sgm.checks import check_at_least, check_shares
from sgm.memory.clock import Clock, make_clock_rows
from sgm.prior.prior_graph import PriorGraph
from simulator.world.config import HomeConfig
from simulator.world.homes import list_labels
from simulator.world.mixture.copies import HomesWithCopies
from simulator.world.mixture.views import (
    DEFAULT_VIEWS,
    VIEWS,
    MixedHomes,
    draw_views,
    list_words,
)
from simulator.world.routine.dynamics import RoutineDynamics
from simulator.world.rules import LOOKS
from simulator.world.sensing import ConstantMisses, PartialViews
from simulator.world.source import TRUE_PLACE_WEIGHTS, Group, HomeSource
from simulator.world.streams import Streams

_ROOM_KINDS = ("kitchen", "living room", "bedroom", "bathroom")
_MORE_ROOMS = (0.05, 0.2, 0.5, 0.25)  # of which kind a fifth room and those after it are
_CARRIED = (0.5, 1.0)  # bounds of how often what is carried goes along, where people do so
_NEW = (0.02, 0.5)  # bounds of how often what is put back gets a new place for good, likewise
_TIDY = (0.0, 0.7)  # and of how much of what lies about is put back in the evening
EARLIEST = datetime(2024, 1, 1)


@dataclass(frozen=True)
class Mixture:
    """A distribution over homes; every home is drawn from it with its own stream.

    Counts and rates are drawn evenly on a logarithmic scale, so that small homes and seldom moves
    are as frequent as large ones and many.

    Attributes:
        max_rooms: a home has 1 to so many rooms, each number equally likely; from the fifth on
            there are several of one kind.
        min_places, max_places: bounds of the number of furniture nodes.
        min_objects, max_objects: bounds of the number of objects at first.
        routine_share: share of the homes that people with routines live in; in all others objects
            move as in the paper's homes.
        carrying_share: share of the homes with people who carry things out and back; of half of
            these, no name tells which.
        resettling_share: share of the homes with people who often keep a thing at a new place for
            good, and tidy up less: what is found elsewhere tends to stay there.
        clock_share: share of these others whose agents know some time of day.
        min_moves, max_moves: bounds of the share of objects that move in a step in these others.
        coming_share: share of the homes in which objects come and go.
        crossing_share: share of the paper-like homes in which a move may lead to another room.
        max_miss: a look misses an object with a probability between 0 and so much, evenly.
        partial_share: share of the homes in which a look has a part of the furniture in view.
        max_looks_per_step: a robot has 1 to so many looks a step, each number equally likely; the
            policy, a patrol or chance chooses them, each equally likely.
        step_seconds: lengths of steps, each equally likely.
        lives: numbers of steps for which a home is lived in, each equally likely.
        views: weight of each way in which an agent may know the prior (`VIEWS`).
        has_copies: whether there are as many things of each type and description as homes have
            (`sgm.prior.copies`), or as the paper's homes draw.
    """

    max_rooms: int = 8
    min_places: int = 4
    max_places: int = 60
    min_objects: int = 5
    max_objects: int = 300
    routine_share: float = 0.5
    carrying_share: float = 0.0
    resettling_share: float = 0.0
    clock_share: float = 0.5
    min_moves: float = 0.002
    max_moves: float = 0.2
    coming_share: float = 0.5
    crossing_share: float = 0.3
    max_miss: float = 0.4
    partial_share: float = 0.3
    max_looks_per_step: int = 3
    step_seconds: tuple[float, ...] = (600, 1200, 1800, 3600, 7200, 14400, 43200, 86400)
    lives: tuple[int, ...] = (10, 30, 100, 300, 1000)
    views: Mapping[str, float] = field(default_factory=DEFAULT_VIEWS.copy)
    has_copies: bool = False

    def __post_init__(self) -> None:
        """Raise ValueError if a value is out of range; names it."""
        for name in ("places", "objects", "moves"):
            least, most = getattr(self, f"min_{name}"), getattr(self, f"max_{name}")
            if not 0 < least <= most:
                raise ValueError(
                    f"min_{name} must be above 0 and at most max_{name}, got {least} and {most}. "
                    "Correct the bounds."
                )
        check_at_least(1, max_rooms=self.max_rooms, max_looks_per_step=self.max_looks_per_step)
        for each in fields(self):
            if each.name.endswith(("_share", "_moves", "_miss")):
                check_shares(**{each.name: getattr(self, each.name)})
        if not self.step_seconds or min(self.step_seconds) <= 0:
            raise ValueError(
                f"step_seconds must be one or more lengths above 0, got {self.step_seconds}. "
                "Take 3600."
            )
        if not self.lives or min(self.lives) < 1:
            raise ValueError(
                f"lives must be one or more numbers of steps above 0, got {self.lives}. Take 100."
            )
        if not set(self.views) <= set(VIEWS) or not sum(self.views.values()) > 0:
            raise ValueError(
                f"views must have weights for some of {', '.join(VIEWS)}, got {dict(self.views)}. "
                "Correct the names, or give one a weight above 0."
            )

    def draw_home(
        self, rng: np.random.Generator, rules: HomeConfig
    ) -> tuple[HomeConfig, Clock | None]:
        """Draw the rules of a home, and what time it is there; None if it is unknown.

        Args:
            rng: the home's own.
            rules: those that are not drawn.
        """
        num_rooms = int(rng.integers(1, self.max_rooms + 1))
        num_places = max(_draw_count(rng, self.min_places, self.max_places), num_rooms)
        rooms = [*rng.permutation(_ROOM_KINDS), *rng.choice(_ROOM_KINDS, 8, p=_MORE_ROOMS)]
        rooms = sorted((str(room) for room in rooms[:num_rooms]), key=_ROOM_KINDS.index)
        sizes = 1 + rng.multinomial(num_places - num_rooms, rng.dirichlet(np.full(num_rooms, 4.0)))
        least = max(self.min_objects, num_places)  # one each, as a rule
        num_objects = _draw_count(rng, least, max(self.max_objects, least))
        step_seconds = float(rng.choice(self.step_seconds))
        start = EARLIEST + timedelta(hours=int(rng.integers(0, 366 * 24)))
        has_routine = rng.random() < self.routine_share
        has_clock = has_routine or rng.random() < self.clock_share
        config = replace(
            rules,
            rooms=tuple(rooms),
            furniture_per_room=tuple(int(size) for size in sizes),
            objects_per_furniture=max(
                min(round(num_objects / num_places), self.max_objects // num_places),
                math.ceil(self.min_objects / num_places),
                1,
            ),
            move_share=draw_rate(rng, self.min_moves, self.max_moves),
            detection_error=float(rng.uniform(0, self.max_miss)),
            dynamic_nodes=bool(rng.random() < self.coming_share),
            cross_room_moves=bool(rng.random() < self.crossing_share),
            looks=str(rng.choice(LOOKS)),
            looks_per_step=int(rng.integers(1, self.max_looks_per_step + 1)),
            sensing=PartialViews() if rng.random() < self.partial_share else ConstantMisses(),
        )
        if has_routine:
            dynamics = RoutineDynamics(start_time=start.isoformat(), step_seconds=step_seconds)
            if rng.random() < self.carrying_share:
                carried = float(rng.uniform(*_CARRIED))
                dynamics = replace(
                    dynamics, carry_share=carried, carries_anything=bool(rng.random() < 0.5)
                )
            if rng.random() < self.resettling_share:
                tidied = float(rng.uniform(*_TIDY))
                dynamics = replace(dynamics, new_share=draw_rate(rng, *_NEW), tidy_share=tidied)
            return replace(config, dynamics=dynamics), dynamics.clock
        return config, Clock(start, step_seconds) if has_clock else None

    def draw_num_steps(self, rng: np.random.Generator) -> int:
        """Draw for how many steps a home is lived in."""
        return int(rng.choice(self.lives))


def draw_rate(rng: np.random.Generator, least: float, most: float) -> float:
    """Draw a number evenly on a logarithmic scale."""
    return float(np.exp(rng.uniform(math.log(least), math.log(most))))


def _draw_count(rng: np.random.Generator, least: int, most: int) -> int:
    return min(int(draw_rate(rng, least, most + 1)), most)


class MixtureSource(HomeSource):
    """Homes of all sizes, rules and lengths, drawn from one distribution, as many as wanted.

    Homes of training, validation and test share no stream; test homes use words and a view of the
    prior that no other home has. For how long a home is lived in is drawn from its number.

    Attributes:
        name: what descriptions call the homes.
        title: likewise in titles of tables, after how many of which split.
    """

    name: ClassVar[str] = "mixed"
    title: ClassVar[str] = "homes of a mixture"
    default_mixture: ClassVar[Mixture] = Mixture()

    def __init__(
        self,
        prior: PriorGraph | None = None,
        home: HomeConfig | None = None,
        mixture: Mixture | None = None,
    ) -> None:
        """Keep the distribution.

        Args:
            prior: what homes look like; None for the prior that ships with the package.
            home: the rules that the mixture does not draw: noise of the prior.
            mixture: the distribution; None for `default_mixture`.
        """
        super().__init__(prior, home)
        self.mixture = self.default_mixture if mixture is None else mixture

    @property
    def has_clock(self) -> bool:
        """Whether it is known of all homes what time it is: it is known of most."""
        return True

    @property
    def knows(self) -> frozenset[str]:
        """What is known of the true homes: transitions, of which oracles make use."""
        return super().knows - {TRUE_PLACE_WEIGHTS}

    @property
    def labels(self) -> list[str]:
        """House, floor, all that the prior names, and every word that a home may use instead."""
        return list_labels(self.prior, list_words())

    def list_groups(self, homes: Sequence[int]) -> list[Group]:
        """Share homes out by how long they are lived in."""
        groups: dict[int, list[int]] = defaultdict(list)
        for home in homes:
            groups[self.mixture.draw_num_steps(np.random.default_rng(home))].append(home)
        return [
            Group(tuple(members), play_steps=num_steps)
            for num_steps, members in sorted(groups.items())
        ]

    def make(self, streams: Streams) -> MixedHomes:
        """Draw homes at t = 0; raises ValueError if the prior has nothing for a room."""
        drawn = [self.draw_home(streams, i) for i in range(len(streams.homes))]
        make = HomesWithCopies if self.mixture.has_copies else MixedHomes
        homes = make(self.prior, [config for config, _ in drawn], streams)
        homes.clock = make_clock_rows([clock for _, clock in drawn])
        homes.set_views(draw_views(streams, dict(self.mixture.views)))
        return homes

    def draw_home(self, streams: Streams, position: int) -> tuple[HomeConfig, Clock | None]:
        """Draw the rules of the home at a position of the streams, and what time it is there."""
        return self.mixture.draw_home(streams.generator("mixture", position), self.home)

    def describe(self) -> dict[str, Any]:
        """Return the distribution and the checksum of the prior."""
        mixture = json.loads(json.dumps(asdict(self.mixture)))
        mixture["abstract_share"] = 0.0  # of homes that were made once; checksums count it
        for name in ("carrying_share", "resettling_share", "has_copies"):
            if not mixture[name]:
                del mixture[name]  # these homes are what they were before it existed
        prior, home = self.prior.checksum, self.home.describe()
        return {"homes": self.name, "prior": prior, "home": home, "mixture": mixture}

    def make_title(self, num_homes: int, split: str) -> str:
        """Say how many homes of which split."""
        return f"{num_homes} {split} {self.title}"
