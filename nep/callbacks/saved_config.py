"""The whole config of a run, beside its checkpoints."""

from __future__ import annotations

from pathlib import Path

from lightning.pytorch import LightningModule, Trainer
from lightning.pytorch.cli import SaveConfigCallback


def has_own_folder(trainer: Trainer) -> bool:
    """Whether the first logger gives each run a folder, as those of TensorBoard and CSV do.

    Others, such as that of Weights & Biases, share their `save_dir` between runs.
    """
    return trainer.logger is None or getattr(trainer.logger, "log_dir", None) is not None


class SavedConfig(SaveConfigCallback):
    """Saves `config.yaml` in the folder of the run: SAVE_DIR/NAME/VERSION where runs share one.

    Differs: Lightning saves it in the folder that they share, and refuses the second run.
    """

    def setup(self, trainer: Trainer, pl_module: LightningModule, stage: str) -> None:
        """Save it once, before anything is trained."""
        self.save_to_log_dir = has_own_folder(trainer)
        super().setup(trainer, pl_module, stage)

    def save_config(self, trainer: Trainer, pl_module: LightningModule, stage: str) -> None:
        """Save it where the checkpoints will be, if not in the folder of the logger."""
        logger = trainer.logger
        if self.save_to_log_dir or logger is None:
            return
        folder = Path(logger.save_dir or trainer.default_root_dir)
        folder = folder / str(logger.name) / str(logger.version)
        folder.mkdir(parents=True, exist_ok=True)
        path = str(folder / self.config_filename)
        self.parser.save(self.config, path, skip_none=False, overwrite=True, multifile=False)
