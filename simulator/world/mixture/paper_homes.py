"""The paper's homes of several sizes, in the words of the mixture, so that both can be mixed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from simulator.world.mixture.source import MixtureSource
from simulator.world.mixture.views import TRUE, MixedHomes
from simulator.world.source import Group
from simulator.world.streams import Streams

# Furniture nodes of each room, every entry equally likely: the paper's eight most often.
_SIZES = (1, 2, 3, 4, 6, 8, 8, 8, 8, 15)
_LIVES = (30, 100, 200)  # time steps


class PaperSizesSource(MixtureSource):
    """Homes by the paper's rules with 4 to 60 places, whose agents know the true prior.

    The mixture seldom draws one, while they are what tables compare policies in: a network that is
    to serve any home learns from both.
    """

    name = "paper sizes"
    title = "homes of the paper's rules and several sizes"

    def list_groups(self, homes: Sequence[int]) -> list[Group]:
        """Share homes out by how long they are lived in."""
        groups = (
            Group(tuple(home for home in homes if home % len(_LIVES) == number), play_steps=life)
            for number, life in enumerate(_LIVES)
        )
        return [group for group in groups if group.homes]

    def make(self, streams: Streams) -> MixedHomes:
        """Draw homes at t = 0; raises ValueError if the prior has nothing for a room."""
        configs = []
        for position in range(len(streams.homes)):
            rng = streams.generator("paper sizes", position)
            size, is_dynamic = int(rng.choice(_SIZES)), bool(rng.random() < 0.5)
            configs.append(replace(self.home, furniture_per_room=size, dynamic_nodes=is_dynamic))
        homes = MixedHomes(self.prior, configs, streams)
        homes.set_views((TRUE,) * len(configs))
        return homes
