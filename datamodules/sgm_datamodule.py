"""Lightning data module: collects snapshots if there are none, loads them as batched graphs."""

from __future__ import annotations

import hashlib
import json
import os
from dataclasses import asdict, replace
from pathlib import Path
from typing import cast

import lightning.pytorch as pl
import torch
from torch.utils.data import DataLoader, Dataset, Subset

from datamodules.batch import SGMBatch
from datamodules.features import FEATURE_SCHEMA_VERSION, FeatureConfig
from datamodules.graph import GraphBuilder
from datamodules.snapshot_dataset import SnapshotDataset
from simulator.collect import CollectConfig, collect
from simulator.trace.recordings import Recordings, TraceConfig
from simulator.world.config import HomeConfig


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
        dynamic_nodes: bool = True,
        prior: str | None = None,
        seed: int = 0,
        batch_size: int = 100,
        grades: bool = False,
        features: FeatureConfig | None = None,
        num_hops: int | None = None,
        workers: int | None = None,
        trace: list[str] | None = None,
        val_trace: list[str] | None = None,
        step_seconds: float | None = None,
        by_day: bool = False,
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
            dynamic_nodes: whether objects are added and removed.
            prior: prior file; None for the shipped default.
            seed: of homes and collection, and of the shuffling.
            batch_size: snapshots per batch.
            grades: learn what each place is worth instead of where the object is, for a task that
                grades places (`relative_likelihood`); the other tasks stay what they are.
            features: which features the model sees; None for all of the paper's.
            num_hops: prune graphs to this many hops around the query edges; None keeps all.
            workers: processes for collecting; None for one per core.
            trace: train in all recorded homes and steps of these traces, or folders of traces
                (docs/traces.md), by their own rules; None to sample homes. `homes`, `steps`,
                `num_val_homes` and `dynamic_nodes` are of sampled homes.
            val_trace: the same for validation; other homes than `trace`.
            step_seconds: length of a step of recorded homes; None for an hour, or what they were
                simulated with.
            by_day: whether each recorded day is a home of its own, with an empty memory at first.

        Raises:
            ValueError: if a count or a name is out of range, a trace is broken, recorded homes are
                to train on and to validate on, or it is not known of all homes what time it was
                and `features.clock` needs it.
        """
        super().__init__()
        for name, value in (
            ("batch_size", batch_size), ("train_snapshots", train_snapshots),
            ("val_snapshots", val_snapshots),
        ):  # fmt: skip
            if value is not None and value < 1:
                raise ValueError(f"{name} must be at least 1, got {value}. Raise it.")
        self.train_config = CollectConfig(
            num_homes=num_homes,
            steps=steps,
            policy=policy,
            task=task,
            seed=seed,
            home=HomeConfig(dynamic_nodes=dynamic_nodes),
            prior=prior,
            belief=features is not None and features.belief,
            evidence=features is not None and features.evidence,
            grades=grades,
        )
        self.val_config = replace(self.train_config, split="val", num_homes=num_val_homes)
        if (trace, val_trace, step_seconds, by_day) != (None, None, None, False):
            if trace is None or val_trace is None:
                raise ValueError(
                    "trace and val_trace must come together, and step_seconds and by_day with them,"
                    f" got trace {trace} and val_trace {val_trace}. Name folders for both."
                )
            recorded = TraceConfig(tuple(trace), step_seconds, by_day)
            to_validate = replace(recorded, folders=tuple(val_trace))
            self.train_config, recordings = _record(self.train_config, recorded)
            self.val_config, val_recordings = _record(self.val_config, to_validate)
            _check_recordings(recordings, val_recordings, features)
        elif features is not None and features.clock:
            raise ValueError(
                "homes must have a clock for features.clock, got sampled homes, in which no time "
                "of day means anything. Name recorded homes by trace and val_trace, or switch the "
                "feature off."
            )
        self.data_dir = Path(data_dir)
        self.batch_size = batch_size
        self.train_snapshots = train_snapshots
        self.val_snapshots = val_snapshots
        self.workers = workers if workers is not None else os.cpu_count() or 1
        features = features or FeatureConfig()
        self.builder = GraphBuilder(features, num_hops, seed)
        # What a checkpoint needs to be used without this data module, and what a model card says.
        self.save_hyperparameters(
            {
                "features": asdict(features),
                "feature_schema": FEATURE_SCHEMA_VERSION,
                "text": self.builder.text_name,
                "training": {
                    "num_homes": self.train_config.num_homes,
                    "steps": self.train_config.steps,
                    "is_recorded": trace is not None,
                    "task": task,
                    "policy": policy,
                    "seed": seed,
                    "snapshots": train_snapshots,
                },
            },
            logger=False,
        )

    def get_folder(self, config: CollectConfig) -> Path:
        """Return the folder of a collection."""
        prior = config.load_prior().checksum[:8]
        recordings = config.load_recordings(config.load_prior())
        if recordings is None:
            nodes = "dynamic" if config.home.dynamic_nodes else "static"
        else:
            described = json.dumps(recordings.describe()).encode()
            nodes = f"trace{hashlib.sha256(described).hexdigest()[:8]}"
        name = f"{config.task}-{config.policy}-{nodes}-{config.steps}steps-seed{config.seed}"
        extras = (
            "-belief" * config.belief + "-evidence" * config.evidence + "-grades" * config.grades
        )
        return (
            self.data_dir
            / f"{name}-prior{prior}{extras}"
            / f"{config.split}-{config.num_homes}homes"
        )

    def prepare_data(self) -> None:
        """Collect what is not on disk yet; an interrupted collection is finished."""
        progress = self.trainer is None or self.trainer.progress_bar_callback is not None
        for config in (self.train_config, self.val_config):
            collect(config, self.get_folder(config), self.workers, progress)

    def setup(self, stage: str | None = None) -> None:
        """Load both collections; damaged files are named in the error."""
        self.train_dataset = self._load(self.train_config, self.train_snapshots)
        self.val_dataset = self._load(self.val_config, self.val_snapshots)

    def train_dataloader(self) -> DataLoader[SGMBatch]:
        """Shuffled batches of training snapshots."""
        generator = torch.Generator().manual_seed(self.train_config.seed)
        return self._make_loader(self.train_dataset, generator)

    def val_dataloader(self) -> DataLoader[SGMBatch]:
        """Batches of validation snapshots in order."""
        return self._make_loader(self.val_dataset, None)

    def _load(self, config: CollectConfig, limit: int | None) -> Dataset[SGMBatch]:
        dataset = SnapshotDataset(self.get_folder(config), self.builder)
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


def _record(config: CollectConfig, trace: TraceConfig) -> tuple[CollectConfig, Recordings]:
    """Return what collects all homes and steps of traces instead of sampled homes, and these."""
    recordings = trace.load(config.load_prior())
    config = replace(
        config, trace=trace, num_homes=recordings.num_homes, steps=recordings.num_steps
    )
    return config, recordings


def _check_recordings(train: Recordings, val: Recordings, features: FeatureConfig | None) -> None:
    """Check that homes to validate on are others, and have a clock if the features read one."""
    if features is not None and features.clock:
        train.check_clock()
        val.check_clock()
    names = {trace.checksum: trace.name for trace in val.traces}
    for checksum in {trace.checksum for trace in train.traces} & names.keys():
        raise ValueError(
            f"homes to validate on must differ from those to train on, got {names[checksum]} in "
            "trace and val_trace. Take it out of one."
        )


def _keep(batch: object) -> SGMBatch:
    """Hand on a batch that is whole already."""
    return cast("SGMBatch", batch)
