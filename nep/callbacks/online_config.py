"""Settings of the evaluation during training."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from sgm.checks import check_at_least
from simulator.policies.registry import check_policies


@dataclass(frozen=True)
class OnlineConfig:
    """Which homes are played during training, how often, and who plays.

    Attributes:
        num_homes: validation homes that are sampled.
        steps: time steps per home, likewise.
        every_n_epochs: epochs between evaluations; the last epoch is always evaluated.
        name: of the model in figures and tables.
        policies: heuristics and oracles that play beside it, if they can in such homes; None for
            all. Without Bayesian and an oracle nothing is said of the gap between them.
    """

    num_homes: int = 20
    steps: int = 100
    every_n_epochs: int = 5
    name: str = "NEP"
    policies: Sequence[str] | None = None

    def __post_init__(self) -> None:
        """Raise ValueError if a count is below 1 or a policy unknown."""
        check_at_least(
            1, num_homes=self.num_homes, steps=self.steps, every_n_epochs=self.every_n_epochs
        )
        check_policies(self.policies or ())
