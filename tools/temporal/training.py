"""Trains temporal networks on recorded episodes, and chooses their settings: Optuna, seeded."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor

from nep.model.loss import listwise_loss
from sgm.policies.policy import compute_probabilities
from sgm.text import load_text
from simulator.tasks.metrics import compute_nll
from simulator.tasks.scores import compute_rank
from tools.temporal.episodes import EpisodeQuestions, EventEpisode, LookEvents
from tools.temporal.network import TemporalNetwork
from tools.temporal.registry import make_network
from tools.temporal.stream import EventStream

_GRADIENT_NORM = 1.0
_DEFAULT = {"learning_rate": 2e-3}
_SEED = 0
_UNPRUNED = 2  # first trials that run to their end, to compare with


@dataclass(frozen=True, slots=True)
class Validation:
    """How a network answers recorded questions.

    Attributes:
        first_guess: share of right first guesses, ties shared.
        mean_reciprocal_rank: ties averaged.
        nll: of the true places together, in nats.
    """

    first_guess: float
    mean_reciprocal_rank: float
    nll: float


def train_network(
    network: TemporalNetwork,
    episodes: Sequence[EventEpisode],
    *,
    sightings_alone: bool,
    epochs: int,
    learning_rate: float,
    on_epoch: Callable[[int], None] = lambda epoch: None,
) -> None:
    """Train with Adam and `listwise_loss` over all places of the home.

    Every time step of an episode is a step of the optimiser, over the questions of all its homes.
    Random numbers are torch's: seed them before the network is made.

    Args:
        network: of random weights.
        episodes: in order; all are played in every epoch.
        sightings_alone: whether the network is not told that things were not seen.
        epochs: how often.
        learning_rate: at first; it falls to zero along a cosine.
        on_epoch: called with the number of epochs that are done.
    """
    optimizer = torch.optim.Adam(network.parameters(), lr=learning_rate)
    everything = [happened for episode in episodes for happened in episode.happened]
    num_steps = epochs * sum(isinstance(each, EpisodeQuestions) for each in everything)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, max(num_steps, 1))
    for epoch in range(epochs):
        network.train()
        for episode in episodes:

            def learn(logits: Tensor, is_place: np.ndarray, answers: np.ndarray) -> None:
                query, place = np.nonzero(is_place)
                loss = listwise_loss(
                    logits[query, place],
                    torch.from_numpy(answers[query, place].astype(np.float32)),
                    torch.from_numpy(query),
                    len(answers),
                )
                optimizer.zero_grad()
                loss.backward()
                torch.nn.utils.clip_grad_norm_(network.parameters(), _GRADIENT_NORM)
                optimizer.step()
                schedule.step()

            play_episode(network, episode, sightings_alone, learn)
        on_epoch(epoch + 1)


@torch.no_grad()
def validate(
    network: TemporalNetwork, episodes: Sequence[EventEpisode], sightings_alone: bool
) -> Validation:
    """Answer the questions of recorded episodes."""
    guesses, ranks, shares = [], [], []

    def note(logits: Tensor, is_place: np.ndarray, answers: np.ndarray) -> None:
        scores = np.where(is_place, logits.double().numpy(), -np.inf)
        is_best = scores == scores.max(axis=1, keepdims=True)
        guesses.append((is_best & answers).sum(axis=1) / is_best.sum(axis=1))
        ranks.append(compute_rank(scores, answers, is_place))
        probability = compute_probabilities(scores, "logits", is_place)
        shares.append((probability * answers).sum(axis=1))

    network.eval()
    for episode in episodes:
        play_episode(network, episode, sightings_alone, note)
    rank = np.concatenate(ranks)
    return Validation(
        float(np.concatenate(guesses).mean()),
        float((1 / rank).mean()),
        compute_nll(np.concatenate(shares)),
    )


def play_episode(
    network: TemporalNetwork,
    episode: EventEpisode,
    sightings_alone: bool,
    on_answer: Callable[[Tensor, np.ndarray, np.ndarray], None],
) -> None:
    """Ask a network every question of an episode, with the events that came before it.

    Args:
        network: its state is that of the episode afterwards.
        episode: what happened.
        sightings_alone: whether the network is not told that things were not seen.
        on_answer: called with logits (Q, F), which of them are places and which are true.
    """
    stream = EventStream(episode.furniture_label, sightings_alone)
    network.reset(stream, load_text().vectors(list(episode.labels)))
    for happened in episode.happened:
        known = slice(0, happened.num_things)
        stream.know_things(episode.thing_home[known], episode.thing_label[known])
        if isinstance(happened, LookEvents):
            network.note(stream.append(happened.events, happened.time))
        else:
            logits = network(happened.asked)
            on_answer(logits, happened.asked.is_place, happened.answers)


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
            "optuna must be installed for trials, got none. Install the extra, pip install ./core "
            "'.[sweep]', or give --trials 0."
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
            network,
            train,
            sightings_alone=sightings_alone,
            epochs=epochs,
            learning_rate=rate,
            on_epoch=report,
        )
        return found[-1]

    study.optimize(attempt, n_trials=num_trials)
    trials = [
        {"settings": trial.params, "nll": trial.value, "state": trial.state.name}
        for trial in study.trials
    ]
    return {"settings": dict(study.best_params), "trials": trials}
