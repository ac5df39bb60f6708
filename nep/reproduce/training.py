"""A training of the paper's tables: its options, its folder, and whether it is done."""

from __future__ import annotations

import json
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from datamodules.feature_config import FEATURE_SCHEMA_VERSION
from nep.config_files import CONFIG_FOLDER, list_files
from nep.fit import FitCLI, main
from nep.reproduce.experiments import Contestant
from sgm.files import compute_checksum, write_whole
from sgm.prior.prior_graph import PriorGraph

_MARKER = "finished.json"
_NEVER = 10**6  # epochs


@dataclass(frozen=True, slots=True)
class Training:
    """The training of a contestant.

    Attributes:
        contestant: setting and configs.
        seed: of weights, shuffling and training homes, unless a config says another.
        options: further options of `nep.fit`, after the configs.
        runs: folder of all runs.
        data: folder of the collections.
        source: name of where homes come from, see `simulator.home_options.SOURCES`.
    """

    contestant: Contestant
    seed: int
    options: tuple[str, ...]
    runs: Path
    data: Path
    source: str = "sampled"

    @property
    def title(self) -> str:
        """Setting, title and seed, by which tables list their checkpoints."""
        return f"{self.contestant.setting.name}, {self.contestant.title}, seed {self.seed}"

    @property
    def folder(self) -> Path:
        """Folder of this run."""
        return self.runs / self.contestant.key

    @property
    def checkpoint(self) -> Path:
        """The network of the last epoch."""
        return self.folder / "checkpoints" / "last.ckpt"

    @property
    def configs(self) -> list[Path]:
        """Its configs; a name is that of a packaged one, not of a file in the working directory."""
        return [CONFIG_FOLDER / config for config in self.contestant.configs]

    def list_options(self, *, has_paths: bool = False) -> list[str]:
        """Return the options of `nep.fit` that its result depends on.

        The seed goes before the configs, which may say another; of what a config says, only the
        setting is overridden. Configs stand here by name, unless it `has_paths`: the lines in them
        are compared, not where they lie.
        """
        setting = self.contestant.setting
        return [
            f"--seed_everything={self.seed}",
            f"--data.seed={self.seed}",
            *(f"--config={path if has_paths else path.name}" for path in self.configs),
            f"--data.task={setting.task}",
            f"--data.home.dynamic_nodes={str(setting.dynamic_nodes).lower()}",
            *([] if self.source == "sampled" else [f"--data.homes={self.source}"]),
            *self.options,
        ]

    def list_all_options(self) -> list[str]:
        """Return `list_options`, and where to put what, without heuristics beside it."""
        logger = "--trainer.logger.init_args."
        return [
            *self.list_options(has_paths=True),
            f"--data.data_dir={self.data}",
            "--data.workers=1",
            "--threads=1",
            "--online.policies=[]",
            f"--online.every_n_epochs={_NEVER}",  # the last epoch is always evaluated
            f"{logger}save_dir={self.folder.parent}",
            f"{logger}name={self.folder.name}",
            f"{logger}version=",
            "--trainer.enable_progress_bar=false",
        ]

    def describe(self) -> dict[str, Any]:
        """Return everything that the network depends on, as JSON values."""
        return {
            "options": self.list_options(),
            "configs": {
                file.name: [
                    line
                    for line in file.read_text(encoding="utf-8").splitlines()
                    if not line.lstrip().startswith("#")
                ]
                for config in self.configs
                for file in list_files(config)
            },
            "feature_schema": FEATURE_SCHEMA_VERSION,
            "prior": PriorGraph.default().checksum,
        }

    def is_done(self) -> bool:
        """Tell whether the folder holds the network of these settings, whole and unaltered."""
        marker = self.folder / _MARKER
        if not marker.is_file() or not self.checkpoint.is_file():
            return False
        return json.loads(marker.read_text(encoding="utf-8")) == self._make_marker()

    def run(self) -> None:
        """Train from the start.

        What an interrupted training left is deleted: its last checkpoint may be one of other
        settings or of other code, and a training takes minutes.
        """
        if self.folder.exists():
            shutil.rmtree(self.folder)
        main(self.list_all_options())
        marker = json.dumps(self._make_marker(), indent=1) + "\n"
        write_whole(self.folder / _MARKER, marker.encode())

    def _make_marker(self) -> dict[str, Any]:
        return {"settings": self.describe(), "checkpoint": compute_checksum(self.checkpoint)}


def collect_data(trainings: Sequence[Training]) -> None:
    """Collect, one after the other, what trainings learn from; what is there is left alone."""
    for training in trainings:
        # Without a logger: the folder of a training that was stopped is no fault here.
        options = [*training.list_all_options(), "--trainer.logger=false"]
        FitCLI(options).datamodule.prepare_data()
