"""Training of the paper's Node Edge Predictor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING

from torch import Tensor

from datamodules.batch import Batch
from datamodules.feature_config import check_groups
from nep.paper.encoders.encoder import Encoder
from nep.paper.loss import balanced_bce
from nep.paper.predictor import NodeEdgePredictor
from nep.paper.query_attention import AttentionConfig
from nep.training.listwise_loss import listwise_loss, relevance_loss
from nep.training.training_module import Schedule, ScoredAnswers, TrainingModule
from sgm.checks import check_at_least

if TYPE_CHECKING:
    from datamodules.sgm_datamodule import SGMDataModule


class NEPModule(TrainingModule):
    """Node Edge Predictor with the paper's loss: weighted binary cross-entropy of query edges.

    Args:
        encoder: message passing between embedding and fusion, one of `nep.paper.encoders` or your
            own.
        transformer: whether the query edges of a snapshot attend to each other.
        attention: sizes of that.
        learning_rate: of Adam.
        schedule: "constant", or "cosine": the rate falls to zero over the training.
        listwise_weight: how much `listwise_loss` weighs beside the paper's loss.
        reads: groups of features beyond the paper's that it reads; follows `data.features`.

    Raises:
        ValueError: if there is no such group, or a number is out of range.

    Source: paper section 4.3 and appendix C.
    """

    def __init__(
        self,
        encoder: Encoder,
        transformer: bool = True,
        attention: AttentionConfig = AttentionConfig(),
        learning_rate: float = 1e-4,
        schedule: Schedule = "constant",
        listwise_weight: float = 0.0,
        reads: Sequence[str] = (),
    ) -> None:
        super().__init__(learning_rate, schedule)
        check_groups(reads)
        check_at_least(0, listwise_weight=listwise_weight)
        self.listwise_weight, self.num_hops = listwise_weight, encoder.num_hops
        self.save_hyperparameters(
            {
                "encoder": encoder.config(),
                "transformer": transformer,
                "attention": asdict(attention),
                "learning_rate": learning_rate,
                "schedule": schedule,
                "listwise_weight": listwise_weight,
                "reads": list(reads),
                # Lightning's name for what turns the plain encoder entry back into an encoder
                "_instantiator": "lightning.pytorch.cli.instantiate_module",
            }
        )
        self.predictor = NodeEdgePredictor(encoder, attention if transformer else None, reads)

    def compute_loss(self, batch: Batch) -> tuple[Tensor, ScoredAnswers]:
        """Return the weighted BCE, or the loss of the relevance of places where that is given."""
        logits, target, snapshot = self.predictor(batch), batch.query_target, batch.query_snapshot
        if batch.query_relevance is not None:
            loss = relevance_loss(logits, batch.query_relevance, snapshot, batch.num_snapshots)
        else:
            loss = balanced_bce(logits, target)
            if self.listwise_weight:
                which = listwise_loss(logits, target, snapshot, batch.num_snapshots)
                loss = loss + self.listwise_weight * which
        return loss, ScoredAnswers(logits, target, snapshot)

    @staticmethod
    def check_data(data: SGMDataModule) -> None:
        """Raise ValueError if the data have evidence: the network for any home reads that."""
        if data.builder.config.evidence:
            raise ValueError(
                "features.evidence must be off for the paper's network, got true. Leave it out, "
                "or train the network for any home: --config any_home.yaml."
            )
