"""Chooses the settings of a temporal network in validation homes: Optuna, seeded, with pruning."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import torch

from nep.event_networks.episodes import EventEpisode
from nep.event_networks.registry import make_network
from nep.event_networks.training import train_network, validate

_DEFAULT = {"learning_rate": 2e-3}
_SEED = 0
_UNPRUNED = 2  # first trials that run to their end, to compare with


def tune(
    name: str,
    sightings_alone: bool,
    train: Sequence[EventEpisode],
    val: Sequence[EventEpisode],
    num_trials: int,
    epochs: int,
) -> dict[str, Any]:
    """Return the settings with the lowest negative log likelihood of the true places.

    Every network is tried equally often, in the same space.

    Without trials they are those of the constructor. Epochs are those of a trial that is not
    pruned.

    Returns:
        `settings`, with the learning rate among them, and `trials`, what was tried.

    Raises:
        ModuleNotFoundError: if optuna is not installed (extra `sweep`) and there are trials.
    """
    if not num_trials:
        return {"settings": _DEFAULT, "trials": []}
    try:
        import optuna
    except ModuleNotFoundError:
        raise ModuleNotFoundError(
            "optuna must be installed for trials, got none. Install the extra, pip install "
            "'scene-graph-memory[sweep]', or give --trials 0."
        ) from None

    optuna.logging.set_verbosity(optuna.logging.WARNING)
    study = optuna.create_study(
        sampler=optuna.samplers.TPESampler(seed=_SEED),
        pruner=optuna.pruners.MedianPruner(n_startup_trials=_UNPRUNED),
    )

    def attempt(trial: optuna.Trial) -> float:
        settings = {
            "units": trial.suggest_categorical("units", [16, 32]),
            "num_events": trial.suggest_categorical("num_events", [8, 16]),
            "dropout": trial.suggest_categorical("dropout", [0.0, 0.1]),
        }
        rate = trial.suggest_float("learning_rate", 5e-4, 5e-3, log=True)
        torch.manual_seed(_SEED)
        network = make_network(name, settings)
        found = [float("inf")]

        def report(epoch: int) -> None:
            found.append(validate(network, val, sightings_alone).nll)
            trial.report(found[-1], epoch)
            if trial.should_prune():
                raise optuna.TrialPruned

        train_network(
            network, train, sightings_alone=sightings_alone, epochs=epochs, learning_rate=rate,
            on_epoch=report,
        )  # fmt: skip
        return found[-1]

    study.optimize(attempt, n_trials=num_trials)
    trials = [
        {"settings": trial.params, "nll": trial.value, "state": trial.state.name}
        for trial in study.trials
    ]
    return {"settings": dict(study.best_params), "trials": trials}
