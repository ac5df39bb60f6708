"""The graph of the model in TensorBoard, and histograms of its weights and attention."""

from __future__ import annotations

import warnings
from dataclasses import fields, replace
from functools import partial
from typing import Any

import lightning.pytorch as pl
import torch
from lightning.pytorch.loggers import TensorBoardLogger
from torch import Tensor, nn

from datamodules.batch import Batch
from nep.training.training_module import TrainingModule

ATTENTION = "attention"  # name of the modules that shares of attention pass through


class ModelBoard(pl.Callback):
    """Writes the graph once, and histograms after each epoch.

    Those of attention are of the first validation batch: what each module called "attention" hands
    on, the shares by which nodes attend to neighbours and query edges to each other.
    """

    def __init__(self) -> None:
        """Start without a graph."""
        self._is_drawn = False
        self._shares: dict[str, list[Tensor]] = {}
        self._handles: list[Any] = []

    def on_fit_start(self, trainer: pl.Trainer, pl_module: pl.LightningModule) -> None:
        """Check that there is a TensorBoard to write to; see `check_boards`."""
        check_boards(trainer)

    def on_train_batch_start(
        self, trainer: pl.Trainer, pl_module: pl.LightningModule, batch: Batch, batch_idx: int
    ) -> None:
        """Draw the graph that the first batch goes through."""
        if self._is_drawn or not trainer.is_global_zero:
            return
        self._is_drawn = True
        assert isinstance(pl_module, TrainingModule)
        shown = _TracedPredictor(pl_module.predictor, batch).eval()
        with warnings.catch_warnings(), torch.no_grad():
            warnings.simplefilter("ignore")  # the sizes of this batch become constants of the trace
            traced = torch.jit.trace(shown, shown.inputs, strict=False, check_trace=False)
            for board in _list_boards(trainer):
                board.experiment.add_graph(traced, shown.inputs)
        pl_module.predictor.train()

    def on_validation_batch_start(
        self,
        trainer: pl.Trainer,
        pl_module: pl.LightningModule,
        batch: Batch,
        batch_idx: int,
        dataloader_idx: int = 0,
    ) -> None:
        """Listen to the attention in the first batch."""
        if batch_idx == 0 and not trainer.sanity_checking:
            for name, module in pl_module.named_modules():
                if name.rpartition(".")[2] == ATTENTION and isinstance(module, nn.Identity):
                    tag = f"{ATTENTION}/{name.removesuffix(f'.{ATTENTION}')}"
                    self._handles.append(module.register_forward_hook(partial(self._keep, tag)))

    def _keep(self, tag: str, module: nn.Module, inputs: Any, shares: Tensor) -> None:
        shares = shares.detach().flatten()
        self._shares.setdefault(tag, []).append(shares[shares > 0])  # padding gets none

    def on_validation_batch_end(
        self,
        trainer: pl.Trainer,
        pl_module: pl.LightningModule,
        outputs: Any,
        batch: Batch,
        batch_idx: int,
        dataloader_idx: int = 0,
    ) -> None:
        """Stop listening."""
        while self._handles:
            self._handles.pop().remove()

    def on_validation_epoch_end(self, trainer: pl.Trainer, pl_module: pl.LightningModule) -> None:
        """Write the histograms."""
        shares, self._shares = self._shares, {}
        if trainer.sanity_checking or not trainer.is_global_zero:
            return
        weights = {f"weights/{name}": value for name, value in pl_module.named_parameters()}
        found = {name: torch.cat(parts) for name, parts in shares.items()}
        for board in _list_boards(trainer):
            for name, values in {**weights, **found}.items():
                if values.numel():
                    board.experiment.add_histogram(
                        name, values.detach().float(), trainer.global_step
                    )


def check_boards(trainer: pl.Trainer) -> None:
    """Raise ValueError unless a training logs to TensorBoard."""
    if not _list_boards(trainer):
        raise ValueError(
            "model_board must have a logger of TensorBoard to write to, got none. Leave the "
            "option out, or the loggers as they are."
        )


def _list_boards(trainer: pl.Trainer) -> list[TensorBoardLogger]:
    return [logger for logger in trainer.loggers if isinstance(logger, TensorBoardLogger)]


class _TracedPredictor(nn.Module):
    """A predictor that takes the tensors of a batch, as a trace of torch does."""

    def __init__(self, predictor: nn.Module, batch: Batch) -> None:
        super().__init__()
        self.predictor, self._batch = predictor, batch
        found = {field.name: getattr(batch, field.name) for field in fields(batch)}
        self._names = [name for name, value in found.items() if isinstance(value, Tensor)]
        self.inputs = tuple(found[name] for name in self._names)

    def forward(self, *tensors: Tensor) -> Tensor:
        """Score the query edges."""
        given: dict[str, Any] = dict(zip(self._names, tensors, strict=True))
        batch = replace(self._batch, **given)
        logits: Tensor = self.predictor(batch)
        return logits
