"""Trains a Node Edge Predictor: `python -m nep.fit --config heat.yaml`."""

from __future__ import annotations

import argparse
import logging
import os
import signal
import sys
import warnings
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Any, NoReturn

import torch
from jsonargparse import Namespace
from jsonargparse.typing import PositiveInt
from lightning.fabric.plugins import CheckpointIO
from lightning.fabric.utilities.exceptions import MisconfigurationException
from lightning.pytorch import Trainer
from lightning.pytorch.callbacks import (
    Callback,
    LearningRateMonitor,
    ModelCheckpoint,
    RichProgressBar,
)
from lightning.pytorch.cli import ArgsType, LightningArgumentParser, LightningCLI
from lightning.pytorch.utilities.exceptions import SIGTERMException

from datamodules.feature_config import FeatureConfig
from datamodules.sgm_datamodule import SGMDataModule
from nep.callbacks.epoch_lines import EpochLines
from nep.callbacks.fit_messages import FitMessages
from nep.callbacks.online_config import OnlineConfig
from nep.callbacks.resume import RandomStates, WholeCheckpoints
from nep.callbacks.saved_config import SavedConfig, has_own_folder
from nep.config_files import find_configs, read_classes
from nep.paper.encoders import load_all
from nep.paper.nep_module import NEPModule
from nep.players.checkpoints import check_resumable
from nep.training.training_module import TrainingModule
from sgm.messages import shorten, shorten_text
from simulator.command_line import BAD_INPUT, normalise, one_line_errors, use_plain_yaml
from simulator.process import run_main

_BEST = "val/hits_at_1"  # by which the best epoch is chosen
_GO_ON = "Go on from a checkpoint with --ckpt_path."
_MOST_CHARACTERS = 2000  # of a message; some repeat a whole file


class _Parser(LightningArgumentParser):
    """Cuts what a message repeats of a config."""

    def error(self, message: str, ex: Exception | None = None) -> NoReturn:
        """End with a message."""
        super().error(shorten_text(message, _MOST_CHARACTERS), ex)


class FitCLI(LightningCLI):
    """Lightning's command line with our model, data and callbacks, for training alone."""

    def __init__(
        self,
        args: ArgsType = None,
        model_class: type[TrainingModule] = NEPModule,
        data_class: type[SGMDataModule] = SGMDataModule,
    ) -> None:
        """Parse `args` (the command line if None) and build model, data and trainer.

        Args:
            args: the command line.
            model_class: what is trained; a subclass of one's own may have further arguments.
            data_class: what it is trained on, likewise.
        """
        load_all()  # for encoders that are named without their module
        super().__init__(
            model_class,
            data_class,
            parser_class=_Parser,
            # dgl's wheels on PyPI have no CUDA; at this size two CPU cores are enough.
            trainer_defaults={
                "accelerator": "cpu",
                "max_epochs": 25,
                "log_every_n_steps": 10,
                "enable_model_summary": False,  # whose operations are not counted
            },
            seed_everything_default=0,
            save_config_callback=SavedConfig,
            args=args,
            run=False,
            auto_configure_optimizers=False,  # Adam with `model.learning_rate`
            parser_kwargs={
                "prog": "python -m nep.fit",
                "usage": "%(prog)s --config NAME.yaml [--OPTION VALUE ...]",  # not all 200
                "description": __doc__,
                "parser_mode": use_plain_yaml(),
            },
        )

    def add_arguments_to_parser(self, parser: LightningArgumentParser) -> None:
        """Add our own arguments and tie pruning to the encoder."""
        parser.add_argument(
            "--base", type=str | None, help="In a config file: packaged config that it changes."
        )
        parser.add_argument(
            "--model_class", type=str | None, help="What is trained; null for the paper's network."
        )
        parser.add_argument("--data_class", type=str | None, help="What it is trained on.")
        parser.add_argument("--ckpt_path", type=str | None, help="Checkpoint to resume from.")
        parser.add_argument(
            "--threads", type=PositiveInt | None, help="CPU threads; null for all cores."
        )
        parser.add_argument(
            "--model_board",
            type=bool,
            default=False,
            help="Write the model's graph, and histograms of its weights and attention after each "
            "epoch, to TensorBoard.",
        )
        parser.add_class_arguments(OnlineConfig, "online")
        parser.link_arguments("data.features", "model.reads", compute_fn=_list_groups)
        parser.link_arguments("model.num_hops", "data.num_hops", apply_on="instantiate")

    def parse_arguments(self, parser: LightningArgumentParser, args: ArgsType) -> None:
        """Parse, after configs have been found, and what they build on."""
        if args is None:
            args = sys.argv[1:]
        if isinstance(args, list):
            try:
                _refuse_workers(args)
                args = normalise(parser, find_configs(args), prefix="data.")
                self.config = parser.parse_args(args)
                self.config.pop("base")  # what it says has been taken over
                seed = self.config.seed_everything
                # numpy takes no other seed; True and False choose one or none
                if not isinstance(seed, bool) and not 0 <= seed < 2**32:
                    raise ValueError(
                        f"seed_everything must lie in 0 to 4294967295, got {shorten(seed)}. "
                        "Choose another."
                    )
            except (UnicodeDecodeError, RecursionError) as error:
                parser.error(f"--config must be a YAML file in UTF-8, got {_shorten(error)}.")
            except (FileNotFoundError, ValueError) as error:
                parser.error(_shorten(error))
        else:
            super().parse_arguments(parser, args)

    def before_instantiate_classes(self) -> None:
        """Collect no more than `fast_dev_run` trains on: it is there to take seconds."""
        num_batches, data = int(self.config.trainer.fast_dev_run), self.config.data
        if num_batches:
            most = -(-num_batches * data.batch_size // data.steps)  # homes
            data.num_homes, data.num_val_homes = (
                min(number, most) for number in (data.num_homes, data.num_val_homes)
            )

    def instantiate_classes(self) -> None:
        """Build model, data and trainer; a value out of range ends with its message alone."""
        if self.config.threads is not None:
            torch.set_num_threads(self.config.threads)
        try:
            self._check_trainer()
            super().instantiate_classes()
            self.model.check_data(self.datamodule)
            self._check_new_run()
            if self.config.model_board:
                import_module("nep.callbacks.model_board").check_boards(self.trainer)
        # The last two are what Lightning raises for settings of its own.
        except (*BAD_INPUT, TypeError, RuntimeError, MisconfigurationException) as error:
            self.parser.error(_shorten(error))

    def _check_trainer(self) -> None:
        """Check what Lightning would try, and fail with late."""
        devices, cores = self.config.trainer.devices, os.cpu_count() or 1
        if self.config.trainer.accelerator == "cpu" and str(devices).isdecimal():
            if int(devices) > cores:
                raise ValueError(
                    f"trainer.devices must be at most {cores}, the cores of this machine, got "
                    f"{devices}. Ask for fewer."
                )
        loggers = self.config.trainer.logger
        for logger in loggers if isinstance(loggers, list) else [loggers]:
            folder = getattr(getattr(logger, "init_args", None), "save_dir", None)
            # its first part that exists must be a folder
            paths = (Path(folder), *Path(folder).absolute().parents) if folder else ()
            if not next((path.is_dir() for path in paths if path.exists()), True):
                raise ValueError(
                    f"save_dir must be a folder, got a file at {folder}. Choose another one."
                )

    def _check_new_run(self) -> None:
        """Check that no run is in the folder: Lightning would end in a traceback."""
        if self.trainer.logger is None or not has_own_folder(self.trainer):
            return
        config = Path(self.trainer.log_dir or "") / "config.yaml"
        if config.exists():
            raise ValueError(
                f"run must have a folder of its own, got that of another run, {config.parent}. "
                "Choose another name or version of the logger, or leave the version out."
            )

    def instantiate_trainer(self, **kwargs: Any) -> Trainer:
        """Build the trainer with progress bar and checkpoints, unless they are switched off."""
        self.states = RandomStates(self.config.seed_everything)
        callbacks: list[Callback] = [_make_online(self.config_init.online), self.states]
        if self.config.model_board:
            callbacks.append(import_module("nep.callbacks.model_board").ModelBoard())
        if self.config.trainer.logger is not False:
            callbacks.append(LearningRateMonitor(logging_interval="step"))
        if self.config.trainer.enable_progress_bar is not False:
            callbacks.append(RichProgressBar() if sys.stdout.isatty() else EpochLines())
        best: ModelCheckpoint | None = None
        if self.config.trainer.enable_checkpointing is not False:
            best = ModelCheckpoint(
                monitor=_BEST, mode="max", filename="best", enable_version_counter=False
            )
            # Two callbacks: with `save_last` the last epoch is only saved where it is the best.
            callbacks += [best, ModelCheckpoint(filename="last", enable_version_counter=False)]
        callbacks.append(FitMessages(self.config_init.online.name, best))
        self.trainer_defaults["callbacks"] = callbacks
        plugins = self.config_init.trainer.plugins or []
        plugins = plugins if isinstance(plugins, list) else [plugins]
        if not any(isinstance(plugin, CheckpointIO) for plugin in plugins):
            kwargs["plugins"] = [*plugins, WholeCheckpoints()]
        return super().instantiate_trainer(**kwargs)


def _make_online(config: OnlineConfig) -> Callback:
    """Make what plays homes; it is loaded with the trainer, not with the command line."""
    found: Callback = import_module("nep.callbacks.online_evaluation").OnlineEvaluation(config)
    return found


def _refuse_workers(arguments: Sequence[str]) -> None:
    """Raise ValueError for an option that asks for processes that load data."""
    for argument in arguments:
        name = argument.partition("=")[0].lstrip("-").replace("-", "_")
        if argument.startswith("--") and name in ("data.num_workers", "num_workers"):
            raise ValueError(
                f"data must be loaded by the training itself, got {shorten_text(argument)}. Leave "
                "it out: a batch is arrays of mapped files, made in a tenth of the time of a step, "
                "and a thread that makes it gained nothing (benchmarks/README.md). --data.workers "
                "is of processes that collect."
            )


def _list_groups(features: Namespace | FeatureConfig) -> list[str]:
    """List the groups of features beyond the paper's that are on."""
    if isinstance(features, Namespace):
        features = FeatureConfig(**features.as_dict())
    return list(features.extra_groups)


def find_classes(args: Sequence[str]) -> dict[str, Any]:
    """Import the classes of `--model_class` and `--data_class`, which configs may name, too.

    Args:
        args: command line; values are import paths, such as my_module.MyData.

    Returns:
        The classes by argument of `FitCLI`.

    Raises:
        OSError: if a config cannot be read.
        ValueError: if there is no such class, or it is no subclass of ours, or no such config.
    """
    bases = {"model_class": TrainingModule, "data_class": SGMDataModule}
    parser = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
    for name in bases:
        parser.add_argument(f"--{name}", nargs="?", const="", default=argparse.SUPPRESS)
    given, others = parser.parse_known_args(args)
    classes = {}
    for name, path in {**read_classes(find_configs(others)), **vars(given)}.items():
        base = bases[name]
        module, _, attribute = path.rpartition(".")
        try:
            found = getattr(import_module(module), attribute, None)
        except (ImportError, ValueError):
            found = None
        if not (isinstance(found, type) and issubclass(found, base)):
            raise ValueError(
                f"{name} must be the import path of a subclass of {base.__name__}, got "
                f"{shorten(path)}. Check the path, and run the command in the folder of the module."
            )
        classes[name] = found
    return classes


def main(args: ArgsType = None) -> FitCLI:
    """Train; the online evaluation ends the run with its table."""
    # of other people: a cloud to log to, a GPU that is not there, an interval of ours
    logging.getLogger("lightning.pytorch.utilities.rank_zero").setLevel(logging.WARNING)
    warnings.filterwarnings("ignore", message=".*smaller than the logging interval")
    # lightning 2.6 tests torch's tree specifications in a way that torch 2.13 deprecated
    warnings.filterwarnings("ignore", message=".isinstance.treespec, LeafSpec")
    args = sys.argv[1:] if args is None else args
    classes: dict[str, Any] = {}
    if isinstance(args, list):
        with one_line_errors(status=2):
            classes = find_classes(args)
    cli = FitCLI(args, **classes)
    cli.datamodule.trainer = cli.trainer  # for whether to show progress
    try:  # Lightning does both again, at no cost: what can be wrong with data is said here
        if cli.config.ckpt_path is not None:
            seed = {"seed_everything": cli.config.seed_everything}
            check_resumable(
                Path(cli.config.ckpt_path), cli.model, {**cli.datamodule.hparams, **seed}
            )
        cli.datamodule.prepare_data()
        cli.datamodule.setup()
    except BAD_INPUT as error:
        cli.parser.error(_shorten(error))
    try:
        cli.trainer.fit(
            cli.model,
            datamodule=cli.datamodule,
            ckpt_path=cli.config.ckpt_path,
            weights_only=True if cli.config.ckpt_path else None,
        )
    except BrokenPipeError:
        raise
    except SIGTERMException:  # which would end the process with status 0
        print(f"error: training must run to its end, got SIGTERM. {_GO_ON}", file=sys.stderr)
        sys.exit(128 + signal.SIGTERM)
    except (OSError, MisconfigurationException) as error:  # a full disk; settings at odds
        sys.exit(f"error: {_shorten(error)}")
    except Exception as error:
        if cli.states.has_begun or cli.config.ckpt_path is None:
            raise
        if isinstance(error, ValueError):
            sys.exit(f"error: {_shorten(error)}")
        sys.exit(  # a state of another kind than the one that is restored from it
            "error: checkpoint must be one that a training can go on from, got "
            f"{type(error).__name__}: {shorten_text(_shorten(error))} in {cli.config.ckpt_path}. "
            "Check --ckpt_path, or leave it out."
        )
    if cli.trainer.fit_loop.skip and not cli.states.has_begun:
        sys.exit(f"error: {_describe_skipped(cli)}")
    return cli


def _describe_skipped(cli: FitCLI) -> str:
    """Say why no epoch was trained: else the command would end well, without its table."""
    trainer = cli.trainer
    if cli.config.ckpt_path is not None and trainer.limit_train_batches != 0:
        return (
            f"checkpoint must have epochs left, got one of {trainer.current_epoch} of "
            f"{trainer.max_epochs} epochs in {cli.config.ckpt_path}. Raise --trainer.max_epochs, "
            "or leave --ckpt_path out."
        )
    return (
        f"training must have an epoch and a batch, got max_epochs {trainer.max_epochs}, max_steps "
        f"{trainer.max_steps} and limit_train_batches {trainer.limit_train_batches}. Raise them."
    )


def _shorten(error: Exception) -> str:
    return shorten_text(" ".join(str(error).split()), _MOST_CHARACTERS)


if __name__ == "__main__":
    run_main(main)
