"""Lightning data module: collects snapshots if there are none, loads them as batched graphs."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Sequence, Sized
from dataclasses import asdict, replace
from itertools import product
from pathlib import Path
from typing import Any, cast

import lightning.pytorch as pl
import torch
from torch.utils.data import DataLoader, Dataset, Subset

from datamodules.batch import SGMBatch
from datamodules.features import FEATURE_SCHEMA_VERSION, FeatureConfig
from datamodules.graph import GraphBuilder
from datamodules.snapshot_dataset import SnapshotDataset
from sgm.checks import check_at_least
from sgm.messages import shorten
from simulator.collect import EXTRAS, CollectConfig, collect
from simulator.home_options import HomeOptions, MakeSource
from simulator.tasks.registry import make_file_name
from simulator.world.config import HomeConfig
from simulator.world.source import SampledSource

_PAPER = HomeConfig()


class SGMDataModule(pl.LightningDataModule):
    """Snapshots of training and validation homes.

    What is missing on disk is collected first, into a folder whose name states the settings, so
    that other settings never meet. Training and validation homes are never the same.
    """

    def __init__(
        self,
        data_dir: str = "data",
        num_homes: int = 100,
        steps: int = 100,
        num_val_homes: int = 20,
        train_snapshots: int | None = None,
        val_snapshots: int | None = None,
        policy: str = "bayesian",
        task: str = "predict_location",
        also_tasks: list[str] | None = None,
        also_policies: list[str] | None = None,
        homes: MakeSource = SampledSource,
        also_homes: list[MakeSource] | None = None,
        val_homes: MakeSource | None = None,
        home: HomeConfig = _PAPER,
        prior: str | None = None,
        seed: int = 0,
        batch_size: int = 100,
        relevance: bool = False,
        features: FeatureConfig | None = None,
        num_hops: int | None = None,
        workers: int | None = None,
        trace: list[str] | None = None,
        val_trace: list[str] | None = None,
        step_seconds: float | None = None,
        by_day: bool = False,
        replays: int = 1,
    ) -> None:
        """Set what to load.

        Args:
            data_dir: folder that holds the collections.
            num_homes: training homes.
            steps: time steps per home; `predict_location` takes one snapshot a step,
                `relative_likelihood` five, `find_object` one per look.
            num_val_homes: validation homes.
            train_snapshots: train on so many of the snapshots, drawn once by `seed`, where there
                are more; None for all.
            val_snapshots: the same for validation.
            policy: the policy that collects.
            task: the task it plays.
            also_tasks: further tasks, played in as many other homes, whose snapshots are trained
                on, too.
            also_policies: further policies that collect, each in as many other homes; of a trained
                network, `nep.players.policy:NEPPolicy=FILE`.
            homes: where homes come from: gets the prior and the rules, as the class of a source
                does.
            also_homes: further sources with the same words, as many homes of each of which are
                trained on, too, in all tasks.
            val_homes: the same for validation; None for other homes of the same source.
            home: rules of the homes.
            prior: a shipped prior, "default" or "household", or a file; None for the default.
            seed: of homes and collection, and of the shuffling.
            batch_size: snapshots per batch.
            relevance: learn the relevance of each place instead of where the object is, for a task
                that knows it (`relative_likelihood`); the other tasks stay what they are.
            features: which features the model sees; None for all of the paper's.
            num_hops: prune graphs to this many hops around the query edges; None keeps all.
            workers: processes for collecting; None for one per core.
            trace: train in all recorded homes and steps of these traces, or folders of traces
                (docs/traces.md), by their own rules, instead of `homes`; `num_homes`, `steps`,
                `num_val_homes` are then what was recorded.
            val_trace: the same for validation; other homes than `trace`.
            step_seconds: length of a step of recorded homes; None for an hour, or what they were
                simulated with.
            by_day: whether each recorded day is a home of its own, with an empty memory at first.
            replays: how often each recorded home is played, every time with other looks and
                questions.

        Raises:
            ValueError: if a count or a name is out of range, a trace is broken, recorded homes are
                to train on and to validate on, or it is not known of all homes what time it was
                and `features.clock` needs it.
        """
        super().__init__()
        check_at_least(
            1, batch_size=batch_size, train_snapshots=train_snapshots, val_snapshots=val_snapshots
        )
        if (trace is None) != (val_trace is None):
            raise ValueError(
                "trace and val_trace must come together, and step_seconds and by_day with them,"
                f" got trace {trace} and val_trace {val_trace}. Name folders for both."
            )
        folders = None if trace is None else tuple(trace)
        options = HomeOptions(homes, home, prior, folders, step_seconds, by_day, replays)
        source = val_source = options.make()
        if val_trace is not None or val_homes is not None:
            val_source = replace(
                options,
                homes=val_homes or homes,
                trace=None if val_trace is None else tuple(val_trace),
            ).make()
        self.train_config = CollectConfig(
            homes=source,
            num_homes=source.num_homes or num_homes,
            steps=source.num_steps or steps,
            policy=policy,
            task=task,
            seed=seed,
            belief=features is not None and features.belief,
            evidence=features is not None and features.evidence,
            relevance=relevance,
        )
        self.val_config = replace(
            self.train_config,
            homes=val_source,
            split="val",
            num_homes=val_source.num_homes or num_val_homes,
            steps=val_source.num_steps or steps,
        )
        sources = [source]
        sources += [replace(options, homes=own, trace=None).make() for own in also_homes or ()]
        policies, tasks = (policy, *(also_policies or ())), (task, *(also_tasks or ()))
        self.also_configs = [
            replace(self.train_config, homes=own, policy=who, task=name, seed=seed + number)
            for own in sources
            for number, (who, name) in enumerate(product(policies, tasks))
        ][1:]
        self._check_sources(features)
        self.data_dir = Path(data_dir)
        self.batch_size = batch_size
        self.train_snapshots = train_snapshots
        self.val_snapshots = val_snapshots
        self.workers = workers if workers is not None else os.cpu_count() or 1
        self._order: torch.Generator | None = None  # of the training batches
        self._order_state: torch.Tensor | None = None  # that a checkpoint has kept
        features = features or FeatureConfig()
        self.builder = GraphBuilder(features, num_hops, seed)
        # What a checkpoint needs to be used without this data module, what a model card says, and
        # what loggers show beside the settings of the model.
        self.save_hyperparameters(
            {
                "features": asdict(features),
                "feature_schema": FEATURE_SCHEMA_VERSION,
                "text": self.builder.text_name,
                "training": {
                    "num_homes": self.train_config.num_homes,
                    "steps": self.train_config.steps,
                    "homes": source.describe(),
                    "is_recorded": trace is not None,
                    "task": task,
                    "also_tasks": also_tasks or [],
                    "policy": policy,
                    "also_policies": also_policies or [],
                    "seed": seed,
                    "snapshots": train_snapshots,
                    "batch_size": batch_size,
                },
            }
        )

    def _check_sources(self, features: FeatureConfig | None) -> None:
        """Check that homes to validate on are others, and have a clock if the features read one."""
        train, val = self.train_config.homes, self.val_config.homes
        if features is not None and features.clock:
            train.check_clock()
            val.check_clock()
        train.check_disjoint(val)

    def get_folder(self, config: CollectConfig) -> Path:
        """Return the folder of a collection."""
        settings = config.describe()
        homes = json.dumps(settings["homes"], sort_keys=True).encode()
        digest = hashlib.sha256(homes).hexdigest()[:8]
        policy, loads, checksum = settings["policy"].partition("=")
        if loads:
            policy = f"{policy}-{checksum[:8]}"
        name = f"{make_file_name(config.task)}-{policy}-{config.steps}steps-seed{config.seed}"
        extras = [  # those of which there are versions with theirs
            f"-{extra}" if settings[extra] is True else f"-{extra}{settings[extra]}"
            for extra in EXTRAS
            if extra in settings
        ]
        return (
            self.data_dir
            / "".join([f"{name}-homes{digest}", *extras])
            / f"{config.split}-{config.num_homes}homes"
        )

    def prepare_data(self) -> None:
        """Collect what is not on disk yet; an interrupted collection is finished."""
        progress = self.trainer is None or self.trainer.progress_bar_callback is not None
        for config in (self.train_config, *self.also_configs, self.val_config):
            collect(config, self.get_folder(config), self.workers, progress)

    def setup(self, stage: str | None = None) -> None:
        """Load the collections; damaged files are named in the error."""
        more = [self.get_folder(config) for config in self.also_configs]
        self.train_dataset = self._load(self.train_config, self.train_snapshots, more)
        num_memories = len(cast("Sized", self.train_dataset))
        self.hparams["training"]["num_memories"] = num_memories  # for the model card
        self.val_dataset = self._load(self.val_config, self.val_snapshots, [])

    def transfer_batch_to_device(
        self, batch: SGMBatch, device: torch.device, dataloader_idx: int
    ) -> SGMBatch:
        """Leave the batch: the model moves plain tensors, which needs no DGL for the device."""
        return batch

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

    def train_dataloader(self) -> DataLoader[SGMBatch]:
        """Shuffled batches of training snapshots; of a training that goes on, those that follow."""
        self._order = torch.Generator().manual_seed(self.train_config.seed)
        if self._order_state is not None:
            self._order.set_state(self._order_state)
            self._order_state = None
        return self._make_loader(self.train_dataset, self._order)

    def val_dataloader(self) -> DataLoader[SGMBatch]:
        """Batches of validation snapshots in order."""
        return self._make_loader(self.val_dataset, None)

    def _load(
        self, config: CollectConfig, limit: int | None, more: Sequence[Path]
    ) -> Dataset[SGMBatch]:
        dataset = SnapshotDataset(self.get_folder(config), self.builder, *more)
        if limit is None or limit >= len(dataset):
            return dataset
        generator = torch.Generator().manual_seed(config.seed)
        chosen = torch.randperm(len(dataset), generator=generator)[:limit]
        return Subset(dataset, chosen.sort().values.tolist())

    def _make_loader(
        self, dataset: Dataset[SGMBatch], shuffle: torch.Generator | None
    ) -> DataLoader[SGMBatch]:
        return DataLoader(
            dataset,
            batch_size=self.batch_size,
            shuffle=shuffle is not None,
            generator=shuffle,
            collate_fn=_keep,  # `SnapshotDataset.__getitems__` gives a whole batch
        )


def _keep(batch: object) -> SGMBatch:
    """Hand on a batch that is whole already."""
    return cast("SGMBatch", batch)
