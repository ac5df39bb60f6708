"""Training of a Node Edge Predictor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Literal

import lightning.pytorch as pl
import torch
from lightning.pytorch.utilities.types import OptimizerLRScheduler
from torch import Tensor
from torchmetrics import Metric, MetricCollection
from torchmetrics.classification import BinaryAUROC, BinaryAveragePrecision

from datamodules.batch import Batch
from datamodules.features import check_groups
from nep.encoders.encoder import Encoder
from nep.layers.segment import segment_max, segment_sum
from nep.model.loss import balanced_bce, listwise_loss, relevance_loss
from nep.model.node_edge_predictor import Logits, NodeEdgePredictor
from nep.model.settings import LossConfig, NetworkConfig, OptimiserConfig


class HitsAtOne(Metric):
    """How often the query edge with a snapshot's highest logit is true.

    A snapshot without a true query edge counts as a miss: the place was not among the candidates.
    One without query edges of known truth does not count. Edges that tie for the highest logit
    share the hit, so that the order of edges does not matter.
    """

    is_differentiable = False
    higher_is_better = True
    full_state_update = False
    hits: Tensor
    total: Tensor

    def __init__(self) -> None:
        super().__init__()
        self.add_state("hits", torch.tensor(0.0, dtype=torch.float64), dist_reduce_fx="sum")
        self.add_state("total", torch.tensor(0.0, dtype=torch.float64), dist_reduce_fx="sum")

    def update(self, logits: Tensor, target: Tensor, snapshot: Tensor) -> None:
        """Count one batch.

        Args:
            logits: (Q,).
            target: (Q,) 1 or 0, no nan.
            snapshot: (Q,) int64, the snapshot of each query edge within the batch.
        """
        names, segment = snapshot.unique(return_inverse=True)
        logits, target = logits.unsqueeze(1), target.unsqueeze(1)
        best = segment_max(logits, segment, len(names))
        is_best = (logits == best[segment]).double()
        count = segment_sum(torch.cat([is_best, is_best * target], dim=1), segment, len(names))
        self.hits += (count[:, 1] / count[:, 0]).sum()
        self.total += len(names)

    def compute(self) -> Tensor:
        """Hit rate over all batches, nan if there was no snapshot."""
        return self.hits / self.total


class NEPModule(pl.LightningModule):
    """Node Edge Predictor with its loss, metrics and optimiser.

    A checkpoint holds tensors and plain data alone, with the encoder by class path and arguments,
    so that `NEPModule.load_from_checkpoint(path, weights_only=True)` rebuilds the model.

    Args:
        encoder: message passing between embedding and fusion, one of `nep.encoders` or your own.
        transformer: whether the query edges of a snapshot attend to each other.
        transformer_layers: encoder layers of that attention.
        transformer_heads: heads of each layer.
        feed_forward_units: hidden width of each layer's feed-forward network.
        dropout: probability in those layers; PyTorch's default, which the paper keeps.
        clock_dropout: share of the training questions whose evidence hides the clock, see
            `EvidenceEmbedding`.
        paper_loss: whether the paper's loss is there at all.
        listwise_weight: how much `listwise_loss` weighs beside it.
        listwise_best: its `best`: of several right places, the one with the greatest share counts.
        learning_rate: of Adam.
        schedule: "constant", or "cosine": the rate falls to zero over the training.
        elsewhere: whether it also says how likely what is asked for is at no place: a logit more
            for each question. It takes evidence.
        reads: groups of features beyond the paper's that it reads; follows `data.features`.

    Raises:
        ValueError: if there is no such group.

    Source: paper section 4.3 and appendix C.
    """

    def __init__(
        self,
        encoder: Encoder,
        transformer: bool = True,
        transformer_layers: int = 2,
        transformer_heads: int = 2,
        feed_forward_units: int = 64,
        dropout: float = 0.1,
        clock_dropout: float = 0.5,
        paper_loss: bool = True,
        listwise_weight: float = 0.0,
        listwise_best: bool = False,
        learning_rate: float = 1e-4,
        schedule: Literal["constant", "cosine"] = "constant",
        elsewhere: bool = False,
        reads: Sequence[str] = (),
    ) -> None:
        super().__init__()
        check_groups(reads)
        network = NetworkConfig(
            transformer=transformer,
            transformer_layers=transformer_layers,
            transformer_heads=transformer_heads,
            feed_forward_units=feed_forward_units,
            dropout=dropout,
            clock_dropout=clock_dropout,
            elsewhere=elsewhere,
        )
        self.loss = LossConfig(
            paper_loss=paper_loss, listwise_weight=listwise_weight, listwise_best=listwise_best
        )
        self.optimiser = OptimiserConfig(learning_rate=learning_rate, schedule=schedule)
        self.save_hyperparameters(
            {
                "encoder": encoder.config(),
                **asdict(network),
                **asdict(self.loss),
                **asdict(self.optimiser),
                "reads": list(reads),
                # Lightning's name for what turns the plain encoder entry back into an encoder
                "_instantiator": "lightning.pytorch.cli.instantiate_module",
            }
        )
        self.predictor = NodeEdgePredictor(encoder, network, reads)
        # The curve of the training metric is binned: an exact one would keep every training edge.
        self.train_metrics = MetricCollection(
            {"auroc": BinaryAUROC(thresholds=200), "hits_at_1": HitsAtOne()}, prefix="train/"
        )
        self.val_metrics = MetricCollection(
            {
                "auroc": BinaryAUROC(),
                "average_precision": BinaryAveragePrecision(),
                "hits_at_1": HitsAtOne(),
            },
            prefix="val/",
        )

    @property
    def num_hops(self) -> int:
        """How many hops of neighbours of the query edges the model reads."""
        return self.predictor.encoder.num_hops

    def forward(self, batch: Batch) -> Tensor:
        """Score the query edges: logits (Q,) in query order."""
        return self.predictor(batch)

    def training_step(self, batch: Batch, batch_idx: int) -> Tensor:
        """Loss of one batch; updates the training metrics."""
        return self._step(batch, "train", self.train_metrics)

    def validation_step(self, batch: Batch, batch_idx: int) -> Tensor:
        """Loss of one batch; updates the validation metrics."""
        return self._step(batch, "val", self.val_metrics)

    def on_train_epoch_end(self) -> None:
        """Log the training metrics."""
        self._log_metrics(self.train_metrics)

    def on_validation_epoch_end(self) -> None:
        """Log the validation metrics."""
        self._log_metrics(self.val_metrics)

    def configure_optimizers(self) -> OptimizerLRScheduler:
        """Adam, as in the paper; with a cosine schedule if asked for."""
        # Fused: one call for the fifty small parameters instead of ten calls for each.
        optimizer = torch.optim.Adam(self.parameters(), lr=self.optimiser.learning_rate, fused=True)
        if self.optimiser.schedule == "constant":
            return optimizer
        num_steps = int(self.trainer.estimated_stepping_batches)
        schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, num_steps)
        return {
            "optimizer": optimizer,
            "lr_scheduler": {"scheduler": schedule, "interval": "step"},
        }

    def _step(self, batch: Batch, stage: str, metrics: MetricCollection) -> Tensor:
        batch = batch.to(self.device)
        of_members = self.predictor.score_members(batch)
        losses = [self._compute_loss(batch, logits) for logits in of_members.split()]
        loss = torch.stack(losses).mean()
        with torch.no_grad():
            answers, snapshot = self.predictor.join_members(batch, of_members).join(batch)
        target = self._list_targets(batch)
        known = ~target.isnan()
        if known.any():
            metrics.update(answers[known], target[known].long(), snapshot=snapshot[known])
        self.log(
            f"{stage}/loss",
            loss,
            prog_bar=True,
            batch_size=batch.num_snapshots,
            sync_dist=stage == "val",  # over the processes of a distributed training
        )
        return loss

    def _log_metrics(self, metrics: MetricCollection) -> None:
        """Log the metrics of an epoch; Lightning computes and resets them."""
        for name, metric in metrics.items(copy_state=False):
            self.log(name, metric, prog_bar=isinstance(metric, HitsAtOne))

    def _compute_loss(self, batch: Batch, logits: Logits) -> Tensor:
        """Return the loss of one member's answers, or of the relevance of places where given."""
        if batch.query_relevance is not None:
            return relevance_loss(
                logits.edges, batch.query_relevance, batch.query_snapshot, batch.num_snapshots
            )
        answers, snapshot = logits.join(batch)
        target = self._list_targets(batch)
        loss = answers.sum() * 0
        if self.loss.paper_loss:
            loss = balanced_bce(answers, target)
        if self.loss.listwise_weight:
            loss = loss + self.loss.listwise_weight * listwise_loss(
                answers, target, snapshot, batch.num_snapshots, self.loss.listwise_best
            )
        return loss

    def _list_targets(self, batch: Batch) -> Tensor:
        """Return what is true of the answers of `Logits.join`."""
        if self.predictor.elsewhere is None:
            return batch.query_target
        return torch.cat([batch.query_target, batch.find_elsewhere()])
