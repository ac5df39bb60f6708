"""Pictures and tables for the loggers that show them: TensorBoard, and Weights & Biases."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import lightning.pytorch as pl
from lightning.pytorch.loggers import TensorBoardLogger, WandbLogger
from matplotlib.figure import Figure

Board = TensorBoardLogger | WandbLogger


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
                board.experiment.add_image(name, pixels, global_step=step, dataformats="HWC")
            else:
                board.log_image(name, [pixels], step=step)


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
            board.experiment.add_text(name, text, global_step=step)
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
