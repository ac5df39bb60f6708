"""The source of mixed homes."""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any, ClassVar

import numpy as np

from sgm.memory.clock import Clock, make_clock_rows
from sgm.prior.prior_graph import PriorGraph
from simulator.world.config import HomeConfig
from simulator.world.homes import list_labels
from simulator.world.mixture.mixture import Mixture
from simulator.world.mixture.views import MixedHomes, draw_views
from simulator.world.mixture.words import list_words
from simulator.world.source import TRUE_PLACE_WEIGHTS, Group, HomeSource
from simulator.world.streams import Streams


class MixtureSource(HomeSource):
    """Homes of all sizes, rules and lengths, drawn from one distribution, as many as wanted.

    Homes of training, validation and test share no stream; test homes use words and a view of the
    prior that no other home has. For how long a home is lived in is drawn from its number.
    """

    default_mixture: ClassVar[Mixture] = Mixture()

    def __init__(
        self, prior: PriorGraph | None = None, home: HomeConfig | None = None,
        mixture: Mixture | None = None,
    ) -> None:  # fmt: skip
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
            Group(tuple(own), play_steps=num_steps) for num_steps, own in sorted(groups.items())
        ]

    def make(self, streams: Streams) -> MixedHomes:
        """Draw homes at t = 0; raises ValueError if the prior has nothing for a room."""
        drawn = [self.draw_home(streams, i) for i in range(len(streams.homes))]
        homes = MixedHomes(self.prior, [config for config, _ in drawn], streams)
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
        for name in ("carrying_share", "resettling_share"):
            if not mixture[name]:
                del mixture[name]  # these homes are what they were before it existed
        prior, home = self.prior.checksum, self.home.describe()
        return {"homes": "mixed", "prior": prior, "home": home, "mixture": mixture}

    def make_title(self, num_homes: int, split: str) -> str:
        """Say how many homes of which split."""
        return f"{num_homes} {split} homes of a mixture"
