"""Homes that people live in for weeks, seen as tasks see them: one look a step, at the answer."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from sgm.memory.clock import Clock
from simulator.world.config import HomeConfig
from simulator.world.mixture.source import Mixture, MixtureSource
from simulator.world.streams import Streams


class LivedInSource(MixtureSource):
    """Homes of all sizes with people and a clock, in which an agent looks where it answers.

    Of the mixture's homes one in fifty is like that and lasts for weeks, while it is what a robot
    is for: a network that is to know when a thing is not where it usually is learns from these,
    too. What a home shows only after weeks is learnt from the questions of long lives, a tenth of
    which is kept.
    """

    name = "lived in"
    title = "homes that people live in"
    kept_share = 0.1
    default_mixture = Mixture(
        routine_share=1.0,
        max_looks_per_step=1,
        step_seconds=(600, 1200, 1800, 3600, 7200),
        lives=(100, 300, 1000),
    )

    def draw_home(self, streams: Streams, position: int) -> tuple[HomeConfig, Clock | None]:
        """Draw the rules of the home at a position of the streams, and what time it is there."""
        rng = streams.generator("lived in", position)
        config, clock = self.mixture.draw_home(rng, self.home)
        return replace(config, looks="policy"), clock

    def describe(self) -> dict[str, Any]:
        """Return the distribution and the checksum of the prior."""
        return {**super().describe(), "kept_share": self.kept_share}
