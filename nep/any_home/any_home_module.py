"""Training of the network for any home."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import torch
from torch import Tensor

from datamodules.batch import Batch
from nep.any_home.elsewhere import find_elsewhere
from nep.any_home.network import AnyHomeNetwork
from nep.training.listwise_loss import listwise_loss
from nep.training.training_module import ScoredAnswers, TrainingModule
from sgm.checks import check_at_least, check_shares
from sgm.messages import shorten

if TYPE_CHECKING:
    from datamodules.sgm_datamodule import SGMDataModule

READS = ("evidence",)


class AnyHomeModule(TrainingModule):
    """The network for any home, which learns where a thing is, and whether it is there at all.

    Its loss is `listwise_loss` of the places and elsewhere, for the best of several right places.
    The learning rate falls to zero along a cosine.

    Args:
        units: width of all layers.
        num_rounds: how often places are compared with each other.
        members: networks in an ensemble, whose probabilities are averaged.
        clock_dropout: share of the training questions whose evidence hides the clock.
        learning_rate: of Adam, at first.
        reads: groups of features beyond the paper's that are on: evidence; follows `data.features`.

    Raises:
        ValueError: if a number is out of range, or `reads` names other groups.

    Source: not in the paper; docs/any_home.md.
    """

    num_hops = 0

    def __init__(
        self,
        units: int = 64,
        num_rounds: int = 2,
        members: int = 3,
        clock_dropout: float = 0.5,
        learning_rate: float = 2e-3,
        reads: Sequence[str] = READS,
    ) -> None:
        super().__init__(learning_rate, "cosine")
        check_at_least(1, units=units, num_rounds=num_rounds, members=members)
        check_shares(clock_dropout=clock_dropout)
        if tuple(reads) != READS:
            raise ValueError(
                f"reads must be evidence alone for the network for any home, got "
                f"{shorten(list(reads))}. Set data.features.evidence, and no belief or clock."
            )
        self.save_hyperparameters(
            {
                "units": units,
                "num_rounds": num_rounds,
                "members": members,
                "clock_dropout": clock_dropout,
                "learning_rate": learning_rate,
                "reads": list(reads),
            }
        )
        self.predictor = AnyHomeNetwork(units, num_rounds, members, clock_dropout)

    def compute_loss(self, batch: Batch) -> tuple[Tensor, ScoredAnswers]:
        """Return the mean loss of the members, and what all of them answer together."""
        logits, snapshot = self.predictor.score_members(batch)
        target = torch.cat([batch.query_target, find_elsewhere(batch)])
        num_snapshots = batch.num_snapshots
        losses = [
            listwise_loss(of_member, target, snapshot, num_snapshots, best=True)
            for of_member in logits.unbind(dim=1)
        ]
        joined = self.predictor.join_members(logits.detach(), snapshot, num_snapshots)
        return torch.stack(losses).mean(), ScoredAnswers(joined, target, snapshot)

    @staticmethod
    def check_data(data: SGMDataModule) -> None:
        """Raise ValueError if the data have what it would not read."""
        features = data.builder.config
        for name in ("temporal", "semantic"):
            if getattr(features, name):
                raise ValueError(
                    f"features.{name} must be off for the network for any home, got true: it reads "
                    f"evidence. Set data.features.{name} to false."
                )
        if data.train_config.relevance:
            raise ValueError(
                "relevance must be off for the network for any home, got true: it learns where "
                "things are. Leave data.relevance out."
            )
