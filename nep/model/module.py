"""Training of a Node Edge Predictor."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from io import BytesIO
from typing import Any

import lightning.pytorch as pl
import torch
from lightning.pytorch.utilities.types import OptimizerLRScheduler
from torch import Tensor
from torchmetrics import MetricCollection
from torchmetrics.classification import BinaryAUROC, BinaryAveragePrecision

from datamodules.batch import Batch
from datamodules.features import check_groups
from nep.encoders.encoder import Encoder
from nep.model.hits_at_1 import HitsAtOne
from nep.model.loss import balanced_bce, listwise_loss, relevance_loss
from nep.model.node_edge_predictor import NodeEdgePredictor
from nep.model.settings import (
    LossConfig,
    NetworkConfig,
    OptimiserConfig,
    PlayingConfig,
    flatten_settings,
    group_settings,
)


class NEPModule(pl.LightningModule):
    """Node Edge Predictor with its loss, metrics and optimiser.

    A checkpoint holds tensors and plain data alone, with the encoder by class path and arguments,
    so that `NEPModule.load_from_checkpoint(path, weights_only=True)` rebuilds the model.

    Args:
        encoder: message passing between embedding and fusion, one of `nep.encoders` or your own.
        network: what it is made of besides.
        loss: what the training minimises.
        optimiser: how.
        playing: what is done with its answers.
        reads: groups of features beyond the paper's that it reads; follows `data.features`.

    Raises:
        ValueError: if there is no such group.

    Source: paper section 4.3 and appendix C.
    """

    def __init__(
        self,
        encoder: Encoder,
        network: NetworkConfig = NetworkConfig(),
        loss: LossConfig = LossConfig(),
        optimiser: OptimiserConfig = OptimiserConfig(),
        playing: PlayingConfig = PlayingConfig(),
        reads: Sequence[str] = (),
    ) -> None:
        super().__init__()
        check_groups(reads)
        settings = {"network": network, "loss": loss, "optimiser": optimiser, "playing": playing}
        self.save_hyperparameters(
            {
                "encoder": encoder.config(),
                **flatten_settings(settings),
                "reads": list(reads),
                # Lightning's name for what turns the plain encoder entry back into an encoder
                "_instantiator": "lightning.pytorch.cli.instantiate_module",
            }
        )
        self.loss = loss
        self.optimiser = optimiser
        self.playing = playing
        self.predictor = NodeEdgePredictor(encoder, network, reads)
        # The curve of the training metric is binned: an exact one would keep every training edge.
        self.train_metrics = MetricCollection(
            {"auroc": BinaryAUROC(thresholds=200)}, prefix="train/"
        )
        self.train_hits_at_1 = HitsAtOne()
        self.val_metrics = MetricCollection(
            {"auroc": BinaryAUROC(), "average_precision": BinaryAveragePrecision()}, prefix="val/"
        )
        self.val_hits_at_1 = HitsAtOne()

    @classmethod
    def load_from_checkpoint(cls, checkpoint_path: Any, *args: Any, **kwargs: Any) -> NEPModule:
        """Load a checkpoint as Lightning does, of version 0.1 too."""
        content = torch.load(checkpoint_path, "cpu", weights_only=True)
        settings = group_settings(content[cls.CHECKPOINT_HYPER_PARAMS_KEY])
        encoder = settings["encoder"]
        module, _, name = encoder["class_path"].rpartition(".")
        encoder_class: type[Encoder] = getattr(import_module(module), name)
        arguments = encoder_class.read_arguments(encoder["init_args"])
        settings["encoder"] = {**encoder, "init_args": arguments}
        content[cls.CHECKPOINT_HYPER_PARAMS_KEY] = settings
        buffer = BytesIO()
        torch.save(content, buffer)
        buffer.seek(0)
        return super().load_from_checkpoint(buffer, *args, **kwargs)

    @property
    def num_hops(self) -> int:
        """How many hops of neighbours of the query edges the model reads."""
        return self.predictor.encoder.num_hops

    def forward(self, batch: Batch) -> Tensor:
        """Score the query edges: logits (Q,) in query order."""
        return self.predictor(batch)

    def training_step(self, batch: Batch, batch_idx: int) -> Tensor:
        """Loss of one batch; updates the training metrics."""
        return self._step(batch, "train", self.train_metrics, self.train_hits_at_1)

    def validation_step(self, batch: Batch, batch_idx: int) -> Tensor:
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
        optimizer = torch.optim.Adam(self.parameters(), lr=self.optimiser.learning_rate, fused=True)
        if self.optimiser.schedule == "constant":
            return optimizer
        num_steps = int(self.trainer.estimated_stepping_batches)
        schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, num_steps)
        return {
            "optimizer": optimizer,
            "lr_scheduler": {"scheduler": schedule, "interval": "step"},
        }

    def _step(
        self,
        batch: Batch,
        stage: str,
        metrics: MetricCollection,
        hits_at_1: HitsAtOne,
    ) -> Tensor:
        batch = batch.to(self.device)
        of_members = self.predictor.score_members(batch)
        losses = [self._compute_loss(batch, logits) for logits in of_members.unbind(dim=1)]
        loss = torch.stack(losses).mean()
        known = ~batch.query_target.isnan()
        if known.any():
            target = batch.query_target[known]
            known_logits = self.predictor.join_answers(batch, of_members.detach())[known]
            metrics.update(known_logits, target.long())
            hits_at_1.update(known_logits, target, batch.query_snapshot[known])
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

    def _compute_loss(self, batch: Batch, logits: Tensor) -> Tensor:
        """Return the loss of the answers, or of the relevance of places where it is given."""
        if batch.query_relevance is not None:
            return relevance_loss(
                logits, batch.query_relevance, batch.query_snapshot, batch.num_snapshots
            )
        loss = logits.sum() * 0
        if self.loss.paper_loss:
            loss = balanced_bce(logits, batch.query_target)
        if self.loss.listwise_weight:
            loss = loss + self.loss.listwise_weight * listwise_loss(
                logits,
                batch.query_target,
                batch.query_snapshot,
                batch.num_snapshots,
                self.loss.listwise_best,
            )
        return loss
