"""Lightning data module: collects snapshots if there are none, loads them as batches."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Sequence, Sized
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, cast

import lightning.pytorch as pl
import torch
from torch.utils.data import DataLoader, Dataset, Subset

from datamodules.batch import Batch
from datamodules.batch_builder import BatchBuilder
from datamodules.collection_plan import make_sources, plan_collections
from datamodules.features import FEATURE_SCHEMA_VERSION, FeatureConfig, list_recorded
from datamodules.snapshot_dataset import SnapshotDataset
from sgm.checks import check_at_least
from sgm.messages import shorten
from simulator.collect.folder import collect
from simulator.collect.settings import EXTRAS, CollectConfig
from simulator.home_options import HomeOptions, MakeSource
from simulator.tasks.question_shares import QuestionShares
from simulator.tasks.registry import make_file_name
from simulator.world.config import HomeConfig
from simulator.world.source import SampledSource


class SGMDataModule(pl.LightningDataModule):
    """Snapshots of training and validation homes.

    What is missing on disk is collected first, into a folder whose name states the settings, so
    that other settings never meet. Training and validation homes are never the same.
    """

    def __init__(
        self,
        homes: MakeSource = SampledSource,
        also_homes: list[MakeSource] | None = None,
        val_homes: MakeSource | None = None,
        home: HomeConfig = HomeConfig(),  # noqa: B008 - frozen
        prior: str | None = None,
        trace: list[str] | None = None,
        val_trace: list[str] | None = None,
        step_seconds: float | None = None,
        by_day: bool = False,
        replays: int = 1,
        data_dir: str = "data",
        num_homes: int = 100,
        steps: int = 100,
        num_val_homes: int = 20,
        policy: str = "bayesian",
        task: str = "predict_location",
        also_policies: list[str] | None = None,
        also_tasks: list[str] | None = None,
        asked: QuestionShares | None = None,
        relevance: bool = False,
        seed: int = 0,
        workers: int | None = None,
        features: FeatureConfig = FeatureConfig(),
        batch_size: int = 100,
        train_snapshots: int | None = None,
        val_snapshots: int | None = None,
        num_hops: int | None = None,
    ) -> None:
        """Set what to load.

        Args:
            homes: where homes come from: gets the prior and the rules, as the class of a source
                does.
            also_homes: further sources, with the same words as `homes`; `num_homes` homes of each
                are trained on, too, in all tasks.
            val_homes: the same for validation; None for other homes of the same source.
            home: rules of the homes.
            prior: a shipped prior, "default" or "household", or a file; None for the default.
            trace: train in all recorded homes and steps of these traces, or folders of traces
                (docs/traces.md), by their own rules, instead of `homes`; `num_homes`, `steps`,
                `num_val_homes` are then what was recorded.
            val_trace: the same for validation; other homes than `trace`.
            step_seconds: length of a step of recorded homes; None for an hour, or what they were
                simulated with.
            by_day: whether each recorded day is a home of its own, with an empty memory at first.
            replays: how often each recorded home is played, every time with other looks and
                questions.
            data_dir: folder that holds the collections.
            num_homes: training homes.
            steps: time steps per home; `predict_location` takes one snapshot a step,
                `relative_likelihood` five, `find_object` one per look.
            num_val_homes: validation homes.
            policy: the policy that collects.
            task: the task it plays.
            also_policies: further policies that collect, each in as many other homes; of a trained
                network, `nep.players.policy:NEPPolicy=FILE`.
            also_tasks: further tasks, played in as many other homes, whose snapshots are trained
                on, too.
            asked: shares of the kinds of questions, of the tasks that take them
                (`simulator.tasks.ask_anything:AskAnything`); None for those of the task.
            relevance: learn the relevance of each place instead of where the object is, for a task
                that knows it (`relative_likelihood`); the other tasks stay what they are.
            seed: of homes and collection, and of the shuffling.
            workers: processes for collecting; None for one per core.
            features: which features the model sees.
            batch_size: snapshots per batch.
            train_snapshots: train on so many of the snapshots, drawn once by `seed`, where there
                are more; None for all.
            val_snapshots: the same for validation.
            num_hops: prune graphs to this many hops around the query edges; None keeps all.

        Raises:
            ValueError: if a count or a name is out of range, or a trace is broken; if recorded
                homes are both to train on and to validate on; if `features.clock` is on and the
                time of a home is unknown.
        """
        super().__init__()
        limits = {"train_snapshots": train_snapshots, "val_snapshots": val_snapshots}
        check_at_least(1, batch_size=batch_size, **limits)
        where = None if trace is None else tuple(trace)
        source, val_source, also_sources = make_sources(
            HomeOptions(homes, home, prior, where, step_seconds, by_day, replays),
            also_homes or [],
            val_homes,
            val_trace,
        )
        recorded: dict[str, Any] = dict.fromkeys(list_recorded(features), True)
        first = CollectConfig(
            homes=source,
            num_homes=source.num_homes or num_homes,
            steps=source.num_steps or steps,
            policy=policy,
            task=task,
            seed=seed,
            **{"relevance": relevance, **recorded},
        )
        self.train_config, *self.also_configs = plan_collections(
            first,
            also_sources,
            [policy, *(also_policies or [])],
            [task, *(also_tasks or [])],
            asked,
        )
        self.val_config = replace(
            self.train_config,
            homes=val_source,
            split="val",
            num_homes=val_source.num_homes or num_val_homes,
            steps=val_source.num_steps or steps,
        )
        if features.clock:
            source.check_clock()
            val_source.check_clock()
        self.data_dir, self.workers, self.batch_size = data_dir, workers, batch_size
        self._train_snapshots, self._val_snapshots = train_snapshots, val_snapshots
        self._order: torch.Generator | None = None  # of the training batches
        self._order_state: torch.Tensor | None = None  # that a checkpoint has kept
        self.builder = BatchBuilder(features, num_hops, seed)
        # What a checkpoint needs to be used without this data module, what a model card says, and
        # what loggers show beside the settings of the model.
        self.save_hyperparameters(
            {
                "features": asdict(features),
                "feature_schema": FEATURE_SCHEMA_VERSION,
                "text": self.builder.text_name,
                "training": {
                    "num_homes": first.num_homes,
                    "steps": first.steps,
                    "homes": source.describe(),
                    "also_homes": [config.homes.describe() for config in self.also_configs],
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

    def get_folder(self, config: CollectConfig) -> Path:
        """Return the folder of a collection."""
        settings = config.describe()
        homes = json.dumps(settings["homes"], sort_keys=True).encode()
        digest = hashlib.sha256(homes).hexdigest()[:8]
        policy, loads, checksum = settings["policy"].partition("=")
        if loads:
            policy = f"{policy}-{checksum[:8]}"
        name = f"{make_file_name(config.task)}-{policy}-{config.steps}steps-seed{config.seed}"
        extras = "".join(  # those of which there are versions with theirs
            f"-{extra}" if settings[extra] is True else f"-{extra}{settings[extra]}"
            for extra in EXTRAS
            if extra in settings
        )
        folder = Path(self.data_dir) / f"{name}-homes{digest}{extras}"
        return folder / f"{config.split}-{config.num_homes}homes"

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
        return self._make_loader(self.train_dataset, self._order)

    def val_dataloader(self) -> DataLoader[Batch]:
        """Batches of validation snapshots in order."""
        return self._make_loader(self.val_dataset, None)

    def _load(
        self, config: CollectConfig, limit: int | None, more: Sequence[Path]
    ) -> Dataset[Batch]:
        dataset = SnapshotDataset(self.get_folder(config), self.builder, *more)
        if limit is None or limit >= len(dataset):
            return dataset
        generator = torch.Generator().manual_seed(config.seed)
        chosen = torch.randperm(len(dataset), generator=generator)[:limit]
        return Subset(dataset, chosen.sort().values.tolist())

    def _make_loader(
        self, dataset: Dataset[Batch], shuffle: torch.Generator | None
    ) -> DataLoader[Batch]:
        return DataLoader(
            dataset,
            batch_size=self.batch_size,
            shuffle=shuffle is not None,
            generator=shuffle,
            collate_fn=_keep,  # `SnapshotDataset.__getitems__` gives a whole batch
        )


def _keep(batch: object) -> Batch:
    """Hand on a batch that is whole already."""
    return cast("Batch", batch)
