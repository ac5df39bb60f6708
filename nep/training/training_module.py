"""Training of a network that answers where things are: steps, metrics, optimiser."""

from __future__ import annotations

from abc import abstractmethod
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, Protocol

import lightning.pytorch as pl
import torch
from lightning.pytorch.utilities.types import OptimizerLRScheduler
from torch import Tensor
from torchmetrics import MetricCollection
from torchmetrics.classification import BinaryAUROC, BinaryAveragePrecision

from datamodules.batch import Batch
from nep.training.hits_at_one import HitsAtOne
from nep.training.logits import Logits
from sgm.checks import check_at_least
from sgm.messages import shorten

if TYPE_CHECKING:
    from datamodules.sgm_datamodule import SGMDataModule

Schedule = Literal["constant", "cosine"]


class ScoredAnswers(NamedTuple):
    """Answers about the snapshots of a batch, A of them, with the truth of each.

    Attributes:
        logits: (A,).
        target: (A,) 1 or 0, nan where the truth is unknown.
        snapshot: (A,) int64, the snapshot of each.
    """

    logits: Tensor
    target: Tensor
    snapshot: Tensor


class Predictor(Protocol):
    """A network: a `torch.nn.Module` with this."""

    def answer(self, batch: Batch) -> Logits:
        """Score the query edges, and elsewhere if it can."""


class TrainingModule(pl.LightningModule):
    """A network with its loss, metrics and optimiser; a subclass is of one network.

    A checkpoint holds tensors and plain data alone, from which `nep.players.checkpoints` rebuilds
    the network.

    Args:
        learning_rate: of Adam.
        schedule: "constant", or "cosine": the rate falls to zero over the training.

    Attributes:
        predictor: the network.
        num_hops: how many hops of neighbours of the query edges it reads.

    Raises:
        ValueError: if the rate is not above zero.
    """

    predictor: Any
    num_hops: int

    def __init__(self, learning_rate: float, schedule: Schedule) -> None:
        super().__init__()
        check_at_least(0, learning_rate=learning_rate)
        if learning_rate == 0:
            raise ValueError(
                f"learning_rate must be above 0, got {shorten(learning_rate)}: nothing would be "
                "learnt. Give a rate such as 1e-4."
            )
        self.learning_rate, self.schedule = learning_rate, schedule
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

    @abstractmethod
    def compute_loss(self, batch: Batch) -> tuple[Tensor, ScoredAnswers]:
        """Return the loss of a batch, and what was answered."""

    @staticmethod
    @abstractmethod
    def check_data(data: SGMDataModule) -> None:
        """Raise ValueError if the data have what the network would not read."""

    def forward(self, batch: Batch) -> Tensor:
        """Score the query edges: logits (Q,) in query order."""
        logits: Tensor = self.predictor(batch)
        return logits

    def setup(self, stage: str) -> None:
        """Refuse a module that was compiled as a whole.

        Raises:
            ValueError: if it was.
        """
        if self._compiler_ctx is not None:  # set by Lightning, which takes `torch.compile(module)`
            raise ValueError(
                "module must not be compiled as a whole, got torch.compile(module): its steps log "
                "and keep metrics, and every batch has another size. Train it as it is."
            )

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

    def on_load_checkpoint(self, checkpoint: dict[str, Any]) -> None:
        """Check that a training that goes on ends where its cosine schedule does.

        Raises:
            ValueError: if it has another number of steps.
        """
        schedules = checkpoint.get("lr_schedulers") or []
        if self.schedule == "constant" or self._trainer is None or not schedules:
            return
        steps, most = int(self.trainer.estimated_stepping_batches), schedules[0].get("T_max")
        if steps != most:
            raise ValueError(
                f"a cosine schedule must end as it began, after {shorten(most)} steps, got "
                f"{steps} steps. Go on with the same --trainer.max_epochs and --data.batch_size, "
                "or begin anew without --ckpt_path."
            )

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

    def _step(self, batch: Batch, stage: str, metrics: MetricCollection) -> Tensor:
        loss, (logits, target, snapshot) = self.compute_loss(batch)
        known = ~target.isnan()
        if known.any():
            logits = logits.detach()[known]
            metrics.update(logits, target[known].long(), snapshot=snapshot[known])
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
