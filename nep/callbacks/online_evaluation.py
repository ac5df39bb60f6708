"""Plays Predict Object Location on unseen homes during training, beside the heuristics."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path

import lightning.pytorch as pl
from lightning.pytorch.loggers import TensorBoardLogger
from matplotlib.figure import Figure
from rich.console import Console
from rich.progress import Progress

from datamodules.sgm_datamodule import SGMDataModule
from nep.figures import draw_accuracy_over_steps
from nep.module import NEPModule
from nep.policy import NEPPolicy
from nep.statistics import compute_gap_closed
from nep.tables import Row, compute_rows, make_markdown, make_rich_table
from simulator.evaluation import TaskScores, evaluate_policy
from simulator.houses import Houses
from simulator.policies import POLICIES, Policy, make_policy
from simulator.shards import write_whole
from simulator.streams import Streams
from simulator.tasks.registry import TASKS

_TASK = TASKS["predict_location"]


class OnlineEvaluation(pl.Callback):
    """Lets the model in training play the online task on validation homes.

    All homes run in lockstep, one forward pass per time step. Heuristics and oracles play the
    same homes once, when training starts. Logs accuracy, candidate recall and the share of the
    gap between Bayesian and each oracle that is closed, draws accuracy over steps, and ends with
    a table, which is also written beside the checkpoints (`online_evaluation.md`, `.json`).

    Source: paper sections 5.2 and 6.1.
    """

    def __init__(
        self, houses: int = 20, steps: int = 100, every_n_epochs: int = 5, name: str = "NEP"
    ) -> None:
        """Set the size of the evaluation.

        Args:
            houses: validation homes.
            steps: time steps per home.
            every_n_epochs: epochs between evaluations; the last epoch is always evaluated.
            name: of the model in figures and tables.

        Raises:
            ValueError: if a count is below 1.
        """
        for what, value in (
            ("houses", houses), ("steps", steps), ("every_n_epochs", every_n_epochs)
        ):  # fmt: skip
            if value < 1:
                raise ValueError(f"{what} must be at least 1, got {value}. Raise it.")
        self.houses = houses
        self.steps = steps
        self.every_n_epochs = every_n_epochs
        self.name = name
        self.scores: dict[str, TaskScores] = {}

    def on_fit_start(self, trainer: pl.Trainer, pl_module: pl.LightningModule) -> None:
        """Let every heuristic and oracle play."""
        if not trainer.is_global_zero:
            return
        is_quiet = trainer.progress_bar_callback is None
        with Progress(transient=True, disable=is_quiet) as progress:
            task = progress.add_task("heuristics on validation homes", total=len(POLICIES))
            for name in POLICIES:
                progress.update(task, description=f"{name} on validation homes")
                self.scores[name] = self._play(trainer, partial(make_policy, name))
                progress.advance(task)

    def on_train_epoch_end(self, trainer: pl.Trainer, pl_module: pl.LightningModule) -> None:
        """Let the model play every few epochs."""
        epoch = trainer.current_epoch + 1
        if trainer.is_global_zero and (
            epoch % self.every_n_epochs == 0 or epoch == trainer.max_epochs
        ):
            self._evaluate_model(trainer, pl_module)

    def on_fit_end(self, trainer: pl.Trainer, pl_module: pl.LightningModule) -> None:
        """Print the table and write it to disk."""
        if trainer.is_global_zero and self.name in self.scores:
            self.print_table()
            if trainer.logger is not None and trainer.log_dir is not None:
                self._save(Path(trainer.log_dir))

    def print_table(self) -> None:
        """Print accuracy of every policy and its distance to the model, the worst first."""
        console = Console()
        console.print(make_rich_table(_TASK, self._compute_rows(), self._get_title()))
        console.print(self._summarise())

    def _compute_rows(self) -> list[Row]:
        return compute_rows(_TASK, self.scores, references=(self.name,))

    def _get_title(self) -> str:
        return f"{_TASK.title}, {self.houses} unseen homes x {self.steps} steps"

    def _summarise(self) -> str:
        return (
            f"candidate recall {self.scores[self.name].candidate_recall:.3f}; "
            f"Bayesian-to-Oracle gap closed {self._gap_closed('oracle'):.0%}, "
            f"Bayesian-to-Ceiling gap closed {self._gap_closed('ceiling'):.0%}"
        )

    def _play(self, trainer: pl.Trainer, make: Callable[[Houses], Policy]) -> TaskScores:
        data = _get_datamodule(trainer)
        config = data.val_config
        streams = Streams(config.seed, config.split, range(self.houses))
        return evaluate_policy(make, config.load_prior(), config.house, streams, self.steps)

    def _evaluate_model(self, trainer: pl.Trainer, pl_module: pl.LightningModule) -> None:
        assert isinstance(pl_module, NEPModule)

        def make(houses: Houses) -> Policy:
            return NEPPolicy(pl_module, _get_datamodule(trainer).builder)

        scores = self.scores[self.name] = self._play(trainer, make)
        metrics = {
            "online/accuracy": float(scores.accuracy.mean()),
            "online/candidate_recall": scores.candidate_recall,
            "online/gap_closed_oracle": self._gap_closed("oracle"),
            "online/gap_closed_ceiling": self._gap_closed("ceiling"),
        }
        pl_module.log_dict(metrics, rank_zero_only=True)
        for name, other in self.scores.items():
            if name != self.name:
                pl_module.log(
                    f"online_heuristics/{name}", float(other.accuracy.mean()), rank_zero_only=True
                )
        self._log_figure(trainer, draw_accuracy_over_steps(self.scores, highlight=self.name))

    def _log_figure(self, trainer: pl.Trainer, figure: Figure) -> None:
        for logger in trainer.loggers:
            if isinstance(logger, TensorBoardLogger):
                logger.experiment.add_figure(
                    "online/accuracy_over_steps", figure, global_step=trainer.global_step
                )

    def _gap_closed(self, top: str) -> float:
        accuracy = {name: float(s.accuracy.mean()) for name, s in self.scores.items()}
        return compute_gap_closed(accuracy[self.name], accuracy["bayesian"], accuracy[top])

    def _save(self, folder: Path) -> None:
        content = {
            name: {
                "accuracy": float(scores.accuracy.mean()),
                "std_over_homes": float(scores.accuracy.std()),
                "candidate_recall": scores.candidate_recall,
                "accuracy_per_home": scores.accuracy.tolist(),
                "accuracy_per_step": scores.is_correct.mean(axis=0).tolist(),
            }
            for name, scores in self.scores.items()
        }
        write_whole(
            folder / "online_evaluation.json", (json.dumps(content, indent=1) + "\n").encode()
        )
        table = make_markdown(_TASK, self._compute_rows(), self._get_title())
        markdown = f"{table}\n{self._summarise()}\n"
        write_whole(folder / "online_evaluation.md", markdown.encode())


def _get_datamodule(trainer: pl.Trainer) -> SGMDataModule:
    """Return the data module whose homes are played.

    Raises:
        TypeError: if the trainer fits on something else.
    """
    data = getattr(trainer, "datamodule", None)
    if not isinstance(data, SGMDataModule):
        raise TypeError(
            f"OnlineEvaluation must run with an SGMDataModule, got {type(data).__name__}. "
            "Fit with one, or leave the callback out."
        )
    return data
