"""Lightning data module: collects snapshots if there are none, loads them as batches."""

from __future__ import annotations

import os
from collections.abc import Sequence, Sized
from dataclasses import asdict
from pathlib import Path
from typing import Any, cast

import lightning.pytorch as pl
import torch
from torch.utils.data import DataLoader, Dataset

from datamodules.batch import Batch
from datamodules.batch_builder import BatchBuilder
from datamodules.collection_plan import CollectionPlan
from datamodules.feature_config import FEATURE_SCHEMA_VERSION, FeatureConfig, list_recorded
from datamodules.snapshot_loader import SnapshotDataset, draw_share, make_loader
from sgm.checks import check_at_least
from sgm.messages import shorten
from simulator.collect.folder import collect
from simulator.collect.settings import CollectConfig


class SGMDataModule(pl.LightningDataModule):
    """Snapshots of training and validation homes.

    What is missing on disk is collected first, into a folder whose name states the settings, so
    that other settings never meet. Training and validation homes are never the same.
    """

    def __init__(
        self,
        features: FeatureConfig = FeatureConfig(),
        batch_size: int = 100,
        train_snapshots: int | None = None,
        val_snapshots: int | None = None,
        num_hops: int | None = None,
        data_dir: str = "data",
        workers: int | None = None,
        **collected: Any,
    ) -> None:
        """Set what to load.

        Args:
            features: which features the model sees.
            batch_size: snapshots per batch.
            train_snapshots: train on so many of the snapshots, drawn once by `seed`, where there
                are more; None for all.
            val_snapshots: the same for validation.
            num_hops: prune graphs to this many hops around the query edges; None keeps all.
            data_dir: folder that holds the collections.
            workers: processes for collecting; None for one per core.
            collected: homes, policies and tasks: options of `CollectionPlan` and `HomeOptions`.

        Raises:
            ValueError: as `CollectionPlan` does, or if a count is out of range; if
                `features.clock` is on and the time of a home is unknown.
        """
        super().__init__()
        limits = {"train_snapshots": train_snapshots, "val_snapshots": val_snapshots}
        check_at_least(1, batch_size=batch_size, **limits)
        plan = CollectionPlan(extras=list_recorded(features), **collected)
        self.train_config, self.also_configs, self.val_config = plan.train, plan.also, plan.val
        if features.clock:
            plan.train.homes.check_clock()
            plan.val.homes.check_clock()
        self.data_dir, self.workers, self.batch_size = data_dir, workers, batch_size
        self._train_snapshots, self._val_snapshots = train_snapshots, val_snapshots
        self._order: torch.Generator | None = None  # of the training batches
        self._order_state: torch.Tensor | None = None  # that a checkpoint has kept
        self.builder = BatchBuilder(features, num_hops, plan.train.seed)
        # What a checkpoint needs to be used without this data module, what a model card says, and
        # what loggers show beside the settings of the model.
        self.save_hyperparameters(
            {
                "features": asdict(features),
                "feature_schema": FEATURE_SCHEMA_VERSION,
                "text": self.builder.text_name,
                "training": {
                    "num_homes": plan.train.num_homes,
                    "steps": plan.train.steps,
                    "homes": plan.train.homes.describe(),
                    "also_homes": [config.homes.describe() for config in plan.also],
                    "is_recorded": collected.get("trace") is not None,
                    "task": plan.train.task,
                    "also_tasks": collected.get("also_tasks") or [],
                    "policy": plan.train.policy,
                    "also_policies": collected.get("also_policies") or [],
                    "seed": plan.train.seed,
                    "snapshots": train_snapshots,
                    "batch_size": batch_size,
                },
            }
        )

    def get_folder(self, config: CollectConfig) -> Path:
        """Return the folder of a collection."""
        return Path(self.data_dir) / config.name_folder()

    def prepare_data(self) -> None:
        """Collect what is not on disk yet; an interrupted collection is finished."""
        progress = self.trainer is None or self.trainer.progress_bar_callback is not None
        workers = os.cpu_count() or 1 if self.workers is None else self.workers
        for config in (self.train_config, *self.also_configs, self.val_config):
            collect(config, self.get_folder(config), workers, progress)

    def setup(self, stage: str | None = None) -> None:
        """Load the collections; damaged files are named in the error."""
        more = [self.get_folder(config) for config in self.also_configs]
        self.train_dataset = self._load(self.train_config, self._train_snapshots, more)
        num_memories = len(cast("Sized", self.train_dataset))
        self.hparams["training"]["num_memories"] = num_memories  # for the model card
        self.val_dataset = self._load(self.val_config, self._val_snapshots, [])

    def transfer_batch_to_device(
        self, batch: Batch, device: torch.device, dataloader_idx: int
    ) -> Batch:
        """Move the plain tensors of a batch, which needs no DGL for the device."""
        return batch.to(device)

    def state_dict(self) -> dict[str, Any]:
        """Return the state of the generator that orders the batches, for a checkpoint."""
        return {} if self._order is None else {"order": self._order.get_state()}

    def load_state_dict(self, state_dict: dict[str, Any]) -> None:
        """Let the next training batches be those that follow a checkpoint.

        Raises:
            ValueError: if its state is not that of a generator.
        """
        try:
            torch.Generator().set_state(state_dict["order"])
        except (LookupError, TypeError, AttributeError, RuntimeError) as error:
            raise ValueError(
                "order of a checkpoint must be the state of a generator, got "
                f"{type(error).__name__}: {shorten(str(error))}. Check --ckpt_path, or leave it "
                "out."
            ) from error
        self._order_state = state_dict["order"]

    def train_dataloader(self) -> DataLoader[Batch]:
        """Shuffled batches of training snapshots; of a training that goes on, those that follow."""
        self._order = torch.Generator().manual_seed(self.train_config.seed)
        if self._order_state is not None:
            self._order.set_state(self._order_state)
            self._order_state = None
        return make_loader(self.train_dataset, self.batch_size, self._order)

    def val_dataloader(self) -> DataLoader[Batch]:
        """Batches of validation snapshots in order."""
        return make_loader(self.val_dataset, self.batch_size, None)

    def _load(
        self, config: CollectConfig, limit: int | None, more: Sequence[Path]
    ) -> Dataset[Batch]:
        dataset = SnapshotDataset(self.get_folder(config), self.builder, *more)
        return draw_share(dataset, limit, config.seed)
