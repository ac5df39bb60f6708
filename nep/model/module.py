"""Training of a Node Edge Predictor."""

from __future__ import annotations

from typing import Literal

import lightning.pytorch as pl
import torch
from lightning.pytorch.utilities.types import OptimizerLRScheduler
from torch import Tensor
from torchmetrics import MetricCollection
from torchmetrics.classification import BinaryAUROC, BinaryAveragePrecision

from datamodules.batch import SGMBatch
from nep.encoders.encoder import Encoder
from nep.layers.flat_graph import FlatGraph
from nep.model.hits_at_1 import HitsAtOne
from nep.model.loss import balanced_bce, listwise_loss, relevance_loss
from nep.model.node_edge_predictor import NodeEdgePredictor
from sgm.checks import check_at_least, check_shares


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
        dropout: probability in those layers.
        learning_rate: of Adam.
        schedule: "constant", or "cosine": the rate falls to zero over the training.
        listwise_weight: how much `listwise_loss` weighs beside the paper's loss.
        listwise_best: its `best`: of several right places, the one with the greatest share counts.
        paper_loss: whether the paper's loss is there at all.
        belief: whether edges carry the belief features; follows `data.features.belief`.
        clock: whether edges carry the clock features; follows `data.features.clock`.
        evidence: whether furniture carries evidence; follows `data.features.evidence`.
        clock_dropout: share of the training questions whose evidence hides the clock.
        prior_share: share of a filter of the prior in the answers, see `NEPPolicy`.
        learns_asked: whether it learns from questions of tasks and from those about anything
            (`simulator.tasks.ask_anything`), and reads which it is.

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
        learning_rate: float = 1e-4,
        schedule: Literal["constant", "cosine"] = "constant",
        listwise_weight: float = 0.0,
        listwise_best: bool = False,
        paper_loss: bool = True,
        belief: bool = False,
        clock: bool = False,
        evidence: bool = False,
        clock_dropout: float = 0.5,
        prior_share: float = 0.0,
        learns_asked: bool = False,
    ) -> None:
        super().__init__()
        check_at_least(0, learning_rate=learning_rate, listwise_weight=listwise_weight)
        check_at_least(
            1,
            transformer_layers=transformer_layers,
            transformer_heads=transformer_heads,
            feed_forward_units=feed_forward_units,
        )
        check_shares(dropout=dropout, clock_dropout=clock_dropout, prior_share=prior_share)
        self.save_hyperparameters(
            {
                "encoder": encoder.config(),
                "transformer": transformer,
                "transformer_layers": transformer_layers,
                "transformer_heads": transformer_heads,
                "feed_forward_units": feed_forward_units,
                "dropout": dropout,
                "learning_rate": learning_rate,
                "schedule": schedule,
                "listwise_weight": listwise_weight,
                "listwise_best": listwise_best,
                "paper_loss": paper_loss,
                "belief": belief,
                "clock": clock,
                "evidence": evidence,
                "clock_dropout": clock_dropout,
                "prior_share": prior_share,
                "learns_asked": learns_asked,
                # Lightning's name for what turns the plain encoder entry back into an encoder
                "_instantiator": "lightning.pytorch.cli.instantiate_module",
            }
        )
        self.learning_rate = learning_rate
        self.schedule = schedule
        self.listwise_weight = listwise_weight
        self.listwise_best = listwise_best
        self.paper_loss = paper_loss
        self.prior_share = prior_share
        self.learns_asked = learns_asked
        self.predictor = NodeEdgePredictor(
            encoder,
            transformer=transformer,
            transformer_layers=transformer_layers,
            transformer_heads=transformer_heads,
            feed_forward_units=feed_forward_units,
            dropout=dropout,
            belief=belief,
            clock=clock,
            evidence=evidence,
            clock_dropout=clock_dropout,
        )
        # The curve of the training metric is binned: an exact one would keep every training edge.
        self.train_metrics = MetricCollection(
            {"auroc": BinaryAUROC(thresholds=200)}, prefix="train/"
        )
        self.train_hits_at_1 = HitsAtOne()
        self.val_metrics = MetricCollection(
            {"auroc": BinaryAUROC(), "average_precision": BinaryAveragePrecision()}, prefix="val/"
        )
        self.val_hits_at_1 = HitsAtOne()

    @property
    def num_hops(self) -> int:
        """How many hops of neighbours of the query edges the model reads."""
        return self.predictor.encoder.num_hops

    def forward(self, batch: SGMBatch) -> Tensor:
        """Score the query edges: logits (Q,) in query order."""
        return self.predictor(batch)

    def training_step(self, batch: SGMBatch, batch_idx: int) -> Tensor:
        """Loss of one batch; updates the training metrics."""
        return self._step(batch, "train", self.train_metrics, self.train_hits_at_1)

    def validation_step(self, batch: SGMBatch, batch_idx: int) -> Tensor:
        """Loss of one batch; updates the validation metrics."""
        return self._step(batch, "val", self.val_metrics, self.val_hits_at_1)

    def on_train_epoch_end(self) -> None:
        """Log the training metrics."""
        self._log_metrics("train", self.train_metrics, self.train_hits_at_1)

    def on_validation_epoch_end(self) -> None:
        """Log the validation metrics."""
        self._log_metrics("val", self.val_metrics, self.val_hits_at_1)

    def configure_optimizers(self) -> OptimizerLRScheduler:
        """Adam, as in the paper; with a cosine schedule if asked for."""
        # Fused: one call for the fifty small parameters instead of ten calls for each.
        optimizer = torch.optim.Adam(self.parameters(), lr=self.learning_rate, fused=True)
        if self.schedule == "constant":
            return optimizer
        num_steps = int(self.trainer.estimated_stepping_batches)
        schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, num_steps)
        return {
            "optimizer": optimizer,
            "lr_scheduler": {"scheduler": schedule, "interval": "step"},
        }

    def _step(
        self,
        batch: SGMBatch,
        stage: str,
        metrics: MetricCollection,
        hits_at_1: HitsAtOne,
    ) -> Tensor:
        # Plain tensors go to any device, a DGL graph only where DGL was built for it.
        graph = FlatGraph.from_batch(batch).to(self.device)
        of_members = self.predictor.score_members(graph)
        losses = [self._compute_loss(graph, logits) for logits in of_members.unbind(dim=1)]
        loss = torch.stack(losses).mean()
        known = ~graph.query_target.isnan()
        if known.any():
            target = graph.query_target[known]
            known_logits = self.predictor.join_answers(graph, of_members.detach())[known]
            metrics.update(known_logits, target.long())
            hits_at_1.update(known_logits, target, graph.query_snapshot[known])
        self.log(
            f"{stage}/loss",
            loss,
            prog_bar=True,
            batch_size=batch.num_snapshots,
            sync_dist=stage == "val",  # over the processes of a distributed training
        )
        return loss

    def _log_metrics(self, stage: str, metrics: MetricCollection, hits_at_1: HitsAtOne) -> None:
        """Log the metrics of an epoch; Lightning computes and resets them."""
        self.log(f"{stage}/hits_at_1", hits_at_1, prog_bar=True)
        self.log_dict(metrics)

    def _compute_loss(self, graph: FlatGraph, logits: Tensor) -> Tensor:
        """Return the loss of the answers, or of the relevance of places where it is given."""
        if graph.query_relevance is not None:
            return relevance_loss(
                logits, graph.query_relevance, graph.query_snapshot, graph.num_snapshots
            )
        loss = logits.sum() * 0
        if self.paper_loss:
            loss = balanced_bce(logits, graph.query_target)
        if self.listwise_weight:
            loss = loss + self.listwise_weight * listwise_loss(
                logits,
                graph.query_target,
                graph.query_snapshot,
                graph.num_snapshots,
                self.listwise_best,
            )
        return loss
