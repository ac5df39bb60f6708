"""Pictures and tables for the loggers that show them: TensorBoard, and Weights & Biases."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

import lightning.pytorch as pl
from lightning.pytorch.loggers import TensorBoardLogger, WandbLogger
from matplotlib.figure import Figure

Board = TensorBoardLogger | WandbLogger

# Where TensorBoard shows what is logged: groups in the order in which they are read. `(\w+)` names
# a curve. What is in no row comes after them, under its own name.
_TAGS = (
    (r"(train|val)/loss", r"1_loss/\1"),
    (r"(train|val)/hits_at_1", r"2_hits_at_1/\1"),
    (r"online/(candidate_recall|gap_closed_.+)", r"4_more_online/\1"),
    (r"online/(.+)", r"3_online/\1"),
    (r"online_heuristics/(.+)", r"3_online/\1"),
    (r"online_kinds/(.+)", r"4_more_online/\1"),
    (r"(train|val)/(.+)", r"5_more_metrics/\1_\2"),
    (r"lr-(.+)", r"6_learning_rate/\1"),
)
_COUNTERS = {"epoch"}  # a staircase that every point has as its step


class OrderedTensorBoard(TensorBoardLogger):
    """TensorBoard with what matters first: loss, hits, then the online score beside the rules."""

    _is_shown = False  # whether the points that come with the settings are there already

    def log_metrics(self, metrics: Mapping[str, float], step: int | None = None) -> None:
        """Add a point to each curve."""
        if not self._is_shown:
            placed = {place_tag(name): x for name, x in metrics.items() if name not in _COUNTERS}
            super().log_metrics(placed, step)

    def log_hyperparams(
        self,
        params: Any,
        metrics: dict[str, Any] | None = None,
        step: int | None = None,
    ) -> None:
        """Keep the settings, with the last points of some curves as what came of them."""
        placed = metrics and {place_tag(name): value for name, value in metrics.items()}
        self._is_shown = bool(placed)
        super().log_hyperparams(params, placed, step)
        self._is_shown = False


def place_tag(name: str) -> str:
    """Return the tag of TensorBoard for what is logged under a name."""
    for pattern, tag in _TAGS:
        if found := re.fullmatch(pattern, name):
            return found.expand(tag)
    return name


def list_boards(trainer: pl.Trainer) -> list[Board]:
    """Return the loggers of a training that show pictures."""
    return [logger for logger in trainer.loggers if isinstance(logger, Board)]


def log_figures(boards: Sequence[Board], figures: Mapping[str, Figure], step: int) -> None:
    """Show figures by name, at a step of the training."""
    for name, figure in figures.items():
        from simulator.drawing import draw_pixels  # with matplotlib

        pixels = draw_pixels(figure)
        for board in boards:
            if isinstance(board, TensorBoardLogger):
                board.experiment.add_image(
                    place_tag(name), pixels, global_step=step, dataformats="HWC"
                )
            else:
                board.log_image(name, [pixels], step=step)


def log_layout(boards: Sequence[Board], metric: str, rules: Sequence[str]) -> None:
    """Put curves that belong together into one chart each: TensorBoard's tab "Custom scalars".

    Args:
        boards: the loggers.
        metric: score of the online evaluation.
        rules: policies that play beside the network.
    """
    online = [f"online/{metric}", *(f"online_heuristics/{name}" for name in rules)]
    charts = {
        "loss": ["train/loss", "val/loss"],
        "hits at 1": ["train/hits_at_1", "val/hits_at_1"],
        f"{metric} in unseen homes, beside the rules": online,
    }
    lines = {
        title: ["Multiline", [f"^{re.escape(place_tag(name))}$" for name in names]]
        for title, names in charts.items()
    }
    for board in boards:
        if isinstance(board, OrderedTensorBoard):
            board.experiment.add_custom_scalars({"training": lines})


def log_table(
    boards: Sequence[Board],
    name: str,
    header: Sequence[str],
    cells: Sequence[Sequence[str]],
    text: str,
    step: int,
) -> None:
    """Show a table: header and rows of cells, or `text` on boards that have texts alone."""
    for board in boards:
        if isinstance(board, TensorBoardLogger):
            board.experiment.add_text(place_tag(name), text, global_step=step)
        else:
            board.log_table(name, list(header), [list(line) for line in cells], step=step)


def log_final(
    boards: Sequence[Board], settings: Mapping[str, Any], scores: Mapping[str, float], step: int
) -> None:
    """Show the settings of a training with what came of them."""
    for board in boards:
        if isinstance(board, TensorBoardLogger):
            board.log_hyperparams(dict(settings), dict(scores), step=step)
        else:  # which has the settings from the start, and keeps the last value of each score
            board.log_metrics(scores, step=step)
