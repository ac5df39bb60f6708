"""Whether a fine-tuned network is better than its start, in what a robot has seen since."""

from __future__ import annotations

from pathlib import Path

from nep.players.checkpoints import TrainedModel
from nep.robot.finder import ObjectFinder
from sgm.evidence.adaptive_filter import TASKS_ASK_MOVED
from sgm.finder.adaptation import Adaptation, compute_accuracy, compute_nll


def compare_in_log(start: TrainedModel, own: TrainedModel, log: str | Path) -> tuple[bool, str]:
    """Ask two networks for what the latest looks of a log showed, just before them.

    Other than in a trace of the log, the memory is the robot's own and goes on, and a thing is
    asked for where a look showed it, not where it is taken to be.

    Returns:
        Whether `own` makes them likelier and guesses no fewer, and a line that says so.
    """
    measured = []
    for model in (start, own):
        _, latest = ObjectFinder(model, asks_moved=TASKS_ASK_MOVED).ask_again(log).split()
        measured.append((compute_nll(latest, Adaptation()), compute_accuracy(latest)))
    (nll, accuracy), (own_nll, own_accuracy) = measured
    return (
        own_nll < nll and own_accuracy >= accuracy,
        f"latest looks of {Path(log).name}: NLL {nll:.3f} and {accuracy:.3f} right at the start, "
        f"{own_nll:.3f} and {own_accuracy:.3f} in the best epoch",
    )
