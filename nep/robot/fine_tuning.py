"""Training that starts from another network, and whether it became better in what a robot saw."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

from datamodules.graph import GraphBuilder
from nep.model.module import NEPModule
from nep.model.settings import group_settings
from nep.players.checkpoints import TrainedModel
from nep.robot.finder import ObjectFinder
from sgm.evidence.adaptive_filter import TASKS_ASK_MOVED
from sgm.finder.adaptation import Adaptation, compute_accuracy, compute_nll

# What belongs to a training, and not to the network that comes out of it; the features say the rest
_NOT_TAKEN = ("dropout", "clock_dropout")


def make_settings(start: TrainedModel) -> dict[str, Any]:
    """Return the part of a config of `nep.fit` by which a network is made like another."""
    settings = group_settings(start.module.hparams)
    network = {name: value for name, value in settings["network"].items() if name not in _NOT_TAKEN}
    return {
        "model": {**{name: settings[name] for name in ("encoder", "playing")}, "network": network},
        "data": {"features": asdict(start.builder.config)},
    }


def take_weights(
    start: TrainedModel, source: str | Path, module: NEPModule, builder: GraphBuilder
) -> None:
    """Copy the weights of a network, of the name `source`, into one that is to be trained.

    Raises:
        ValueError: if features, text vectors, or the parts of the network differ.
    """
    theirs = asdict(start.builder.config) | {"text vectors": start.builder.text_name}
    ours = asdict(builder.config) | {"text vectors": builder.text_name}
    for name, value in theirs.items():
        if ours[name] != value:
            raise ValueError(
                f"data.features must be those of the network to start from, {name} = {value} in "
                f"{source}, got {ours[name]}. Leave them out, or start from another network."
            )
    try:
        module.load_state_dict(start.module.state_dict())
    except RuntimeError as error:
        raise ValueError(
            f"model must have the parts of the network to start from, {source}, got others: "
            f"{_shorten(error)}. Leave model.encoder and the like out of the config: --from names "
            "them."
        ) from None


def _shorten(error: Exception) -> str:
    """Return the first fault of several."""
    lines = [line.strip() for line in str(error).splitlines()]
    return lines[min(1, len(lines) - 1)].rstrip(". ")[:160]


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
