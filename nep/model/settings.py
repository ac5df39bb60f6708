"""Settings of a network, its training and its answers, with their defaults and checks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from sgm.checks import check_at_least, check_shares
from sgm.messages import shorten


@dataclass(frozen=True)
class NetworkConfig:
    """What a Node Edge Predictor is made of beside its encoder.

    Attributes:
        transformer: whether the query edges of a snapshot attend to each other.
        transformer_layers: encoder layers of that attention.
        transformer_heads: heads of each layer.
        feed_forward_units: hidden width of each layer's feed-forward network.
        dropout: probability in those layers; PyTorch's default, which the paper keeps.
        clock_dropout: share of the training questions whose evidence hides the clock, see
            `EvidenceEmbedding`.
        elsewhere: whether it also says how likely what is asked for is at no place: a logit more
            for each question. It takes evidence.
    """

    transformer: bool = True
    transformer_layers: int = 2
    transformer_heads: int = 2
    feed_forward_units: int = 64
    dropout: float = 0.1
    clock_dropout: float = 0.5
    elsewhere: bool = False

    def __post_init__(self) -> None:
        """Check the sizes and shares."""
        check_at_least(
            1,
            transformer_layers=self.transformer_layers,
            transformer_heads=self.transformer_heads,
            feed_forward_units=self.feed_forward_units,
        )
        check_shares(dropout=self.dropout, clock_dropout=self.clock_dropout)


@dataclass(frozen=True)
class LossConfig:
    """What a training minimises.

    Attributes:
        paper_loss: whether the paper's loss is there at all.
        listwise_weight: how much `listwise_loss` weighs beside it.
        listwise_best: its `best`: of several right places, the one with the greatest share counts.
    """

    paper_loss: bool = True
    listwise_weight: float = 0.0
    listwise_best: bool = False

    def __post_init__(self) -> None:
        """Check the weight, and that something is minimised."""
        check_at_least(0, listwise_weight=self.listwise_weight)
        if not self.paper_loss and self.listwise_weight == 0:
            raise ValueError(
                "listwise_weight must be above 0 where paper_loss is off, got "
                f"{shorten(self.listwise_weight)}: nothing would be learnt. Give it a weight, or "
                "leave paper_loss on."
            )


@dataclass(frozen=True)
class OptimiserConfig:
    """How a training minimises it.

    Attributes:
        learning_rate: of Adam.
        schedule: "constant", or "cosine": the rate falls to zero over the training.
    """

    learning_rate: float = 1e-4
    schedule: Literal["constant", "cosine"] = "constant"

    def __post_init__(self) -> None:
        """Check the rate."""
        check_at_least(0, learning_rate=self.learning_rate)
        if self.learning_rate == 0:
            raise ValueError(
                f"learning_rate must be above 0, got {shorten(self.learning_rate)}: nothing would "
                "be learnt. Give a rate such as 1e-4."
            )
