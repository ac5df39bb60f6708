"""Plays the task of the data on unseen homes during training, beside the heuristics."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path

import lightning.pytorch as pl
import numpy as np
from rich.console import Console

from datamodules.sgm_datamodule import SGMDataModule
from nep.callbacks.online_config import OnlineConfig
from nep.players.contestants import MakePolicy
from nep.players.policy import NEPPolicy
from nep.report.boards import list_boards, log_figures, log_final, log_layout, log_table
from nep.report.figures import draw_calibration, draw_searches, draw_task, play_search_stories
from nep.report.results import ScoreSummary
from nep.report.statistics import compute_gap_closed
from nep.report.tables import (
    BOUNDED,
    Row,
    compute_rows,
    describe_policies,
    format_table,
    make_markdown,
    make_rich_table,
)
from nep.training.training_module import TrainingModule
from sgm.files import write_whole
from simulator.policies import POLICIES, find_policy, make_policy
from simulator.policies.registry import ORACLES
from simulator.tasks.evaluation import evaluate_policy
from simulator.tasks.registry import TASKS, find_task
from simulator.tasks.scores import TaskScores
from simulator.tasks.task import Task
from simulator.world.source import HomeSource, SampledSource
from simulator.world.streams import Streams


class OnlineEvaluation(pl.Callback):
    """Lets the model in training play, on validation homes, the task that it learns.

    All homes run in lockstep, one forward pass per time step. Where the data are recorded homes,
    the recorded validation homes are played, all of them and all their steps. Heuristics and
    oracles play the same homes once, before the model does so for the first time. Logs the score,
    candidate recall and the share of the gap between Bayesian and each oracle that is closed.
    Draws the score over steps, how well the probabilities are calibrated, and three searches.
    Ends with a table, which is also written beside the checkpoints (`online_evaluation.md`,
    `.json`). TensorBoard and Weights & Biases show the figures and the table, and the settings with
    the final score.

    Source: paper sections 5.2 and 6.1.
    """

    def __init__(self, config: OnlineConfig) -> None:
        """Set the size of the evaluation."""
        self.num_homes = config.num_homes
        self.steps = config.steps
        self.every_n_epochs = config.every_n_epochs
        self.name = config.name
        self.policies = tuple(POLICIES if config.policies is None else config.policies)
        self.task: type[Task] = TASKS["predict_location"]
        self.homes: HomeSource = SampledSource()
        self.scores: dict[str, ScoreSummary] = {}
        self._kinds: list[str] | None = None  # of every home

    def on_fit_start(self, trainer: pl.Trainer, pl_module: pl.LightningModule) -> None:
        """Start without scores, with the task and the homes of the data."""
        self.scores, self._kinds = {}, None
        config = _get_datamodule(trainer).val_config
        self.task = find_task(config.task)
        self.homes = config.homes
        self.num_homes = self.homes.num_homes or self.num_homes
        self.steps = self.homes.num_steps or self.steps
        if trainer.fast_dev_run:  # type: ignore[attr-defined]
            self.num_homes, self.steps, self.policies = 1, 2, ()

    def on_train_epoch_end(self, trainer: pl.Trainer, pl_module: pl.LightningModule) -> None:
        """Let the model play every few epochs."""
        epoch = trainer.current_epoch + 1
        if trainer.is_global_zero and (
            epoch % self.every_n_epochs == 0 or epoch == trainer.max_epochs
        ):
            self._evaluate_model(trainer, pl_module)

    def on_fit_end(self, trainer: pl.Trainer, pl_module: pl.LightningModule) -> None:
        """Print the table and write it to disk."""
        folder = trainer.log_dir if trainer.logger is not None else None  # asked by all processes
        if trainer.is_global_zero and self.name in self.scores:
            self.print_table()
            self._log_end(trainer, pl_module)
            if folder is not None:
                self._save(Path(folder))

    def print_table(self) -> None:
        """Print the score of every policy and its distance to the model, the worst first."""
        console = Console()
        console.print(make_rich_table(self.task, self._compute_rows(), self._get_title()))
        console.print(self._summarise())

    def _compute_rows(self) -> list[Row]:
        return compute_rows(self.task, self.scores, references=(self.name,))

    def _get_title(self) -> str:
        homes = self.homes.make_title(self.num_homes, "unseen")
        return f"{self.task.title}, {homes} x {self.steps} steps"

    def _summarise(self) -> str:
        """Say in words what the table has in names and numbers."""
        names = [name for name in self.scores if name != self.name]
        sentences = [describe_policies(names)] if names else []
        closed = {top: share for top, share in self._compute_gaps().items() if share > 0}
        if closed:
            parts = " and ".join(
                f"{share:.0%} of the way to {top}" for top, share in closed.items()
            )
            sentences.append(f"From bayesian up, {self.name} goes {parts}.")
        elif self._compute_gaps():
            sentences.append(f"{self.name} does not reach bayesian.")
        recall = self.scores[self.name].metrics["candidate_recall"]
        sentences.append(f"In {recall:.1%} of the questions the true place was among those scored.")
        return " ".join(sentences)

    def _play(self, trainer: pl.Trainer, make: MakePolicy) -> TaskScores:
        config = _get_datamodule(trainer).val_config
        streams = Streams(config.seed, config.split, range(self.num_homes))
        return evaluate_policy(make, self.homes, streams, self.steps, task=config.task)

    def _compute(self, played: TaskScores) -> ScoreSummary:
        return ScoreSummary.of(played, self.homes.list_units(range(self.num_homes)))

    def _list_metrics(self, scores: ScoreSummary) -> dict[str, float]:
        return {
            f"online/{self.task.metric}": float(scores.home_values.mean()),
            "online/candidate_recall": scores.metrics["candidate_recall"],
        }

    def _play_heuristics(self, trainer: pl.Trainer) -> None:
        """Let the heuristics and oracles play, once, as late as possible: it takes seconds."""
        policies = [name for name in self.policies if find_policy(name).needs <= self.homes.knows]
        if policies and trainer.progress_bar_callback is not None:
            print(f"{len(policies)} rules and oracles play {self.num_homes} validation homes, once")
        for name in policies:
            self.scores[name] = self._compute(self._play(trainer, partial(make_policy, name)))

    def _evaluate_model(self, trainer: pl.Trainer, pl_module: pl.LightningModule) -> None:
        assert isinstance(pl_module, TrainingModule)
        if not self.scores:
            self._play_heuristics(trainer)
            log_layout(list_boards(trainer), self.task.metric, list(self.scores))
        player = NEPPolicy(pl_module, _get_datamodule(trainer).builder)
        played = self._play(trainer, player.play_in)
        scores = self.scores[self.name] = self._compute(played)
        metrics = self._list_metrics(scores)
        metrics |= {f"online/gap_closed_{top}": gap for top, gap in self._compute_gaps().items()}
        pl_module.log_dict(metrics, rank_zero_only=True)
        for name, other in self.scores.items():
            if name != self.name:
                score = float(other.home_values.mean())
                pl_module.log(f"online_heuristics/{name}", score, rank_zero_only=True)
        figure = draw_task(self.task, self.scores, self.name)
        boards = list_boards(trainer)
        if boards:  # pictures take seconds
            title = f"{self.name} on unseen homes"
            config = _get_datamodule(trainer).val_config
            searches = play_search_stories(player.play_in, self.homes, config.seed, config.split)
            figures = {
                f"online/{self.task.metric}_over_steps": figure,
                "online/calibration": draw_calibration(
                    played.confidence.ravel(), played.is_correct.ravel(), title
                ),
                "online/searches": draw_searches(searches),
            }
            log_figures(boards, figures, trainer.global_step)
        pl_module.log_dict(self._score_kinds(trainer, scores), rank_zero_only=True)

    def _score_kinds(self, trainer: pl.Trainer, scores: ScoreSummary) -> dict[str, float]:
        """Return the score in the homes of each kind, if there are several: by how they change."""
        if self._kinds is None:
            config = _get_datamodule(trainer).val_config
            streams = Streams(config.seed, config.split, range(self.num_homes))
            rules = self.homes.make(streams).configs
            self._kinds = [type(rule.dynamics).__name__ for rule in rules]
        if len(set(self._kinds)) == 1:
            return {}
        kinds, values = np.array(self._kinds), scores.home_values
        return {
            f"online_kinds/{self.task.metric}_{dynamics}": float(values[kinds == dynamics].mean())
            for dynamics in sorted(set(self._kinds))
        }

    def _log_end(self, trainer: pl.Trainer, pl_module: pl.LightningModule) -> None:
        """Show the table, and the settings with what came of them."""
        metrics = self._list_metrics(self.scores[self.name])
        boards, step = list_boards(trainer), trainer.global_step
        header, cells = format_table(self.task, self._compute_rows())
        log_table(boards, "online/table", header, cells, self._make_markdown(), step)
        settings = {**pl_module.hparams, **_get_datamodule(trainer).hparams}
        log_final(boards, settings, metrics, step)

    def _compute_gaps(self) -> dict[str, float]:
        """Return the share of the gap from Bayesian that is closed, for each oracle that played."""
        if self.task.metric not in BOUNDED:
            return {}
        means = {name: float(scores.home_values.mean()) for name, scores in self.scores.items()}
        return {
            top: compute_gap_closed(means[self.name], means["bayesian"], means[top])
            for top in ORACLES
            if {"bayesian", top} <= means.keys()
        }

    def _save(self, folder: Path) -> None:
        content = {
            name: {
                self.task.metric: float(scores.home_values.mean()),
                "std_over_homes": float(scores.home_values.std()),
                "candidate_recall": scores.metrics["candidate_recall"],
                f"{self.task.metric}_per_home": scores.home_values.tolist(),
                f"{self.task.metric}_per_step": scores.values.mean(axis=0).tolist(),
            }
            for name, scores in self.scores.items()
        }
        write_whole(
            folder / "online_evaluation.json", (json.dumps(content, indent=1) + "\n").encode()
        )
        write_whole(folder / "online_evaluation.md", self._make_markdown().encode())

    def _make_markdown(self) -> str:
        table = make_markdown(self.task, self._compute_rows(), self._get_title())
        return f"{table}\n{self._summarise()}\n"


def _get_datamodule(trainer: pl.Trainer) -> SGMDataModule:
    """Return the data module whose homes are played."""
    data = getattr(trainer, "datamodule", None)
    if not isinstance(data, SGMDataModule):
        raise TypeError(
            f"OnlineEvaluation must run with an SGMDataModule, got {type(data).__name__}. "
            "Fit with one, or leave the callback out."
        )
    return data
