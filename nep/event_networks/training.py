"""Trains temporal networks on recorded episodes, one step for all homes at a time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from nep.event_networks.episodes import EventEpisode, LookEvents
from nep.event_networks.network import TemporalNetwork
from nep.event_networks.stream import EventStream
from nep.model.loss import listwise_loss
from sgm.policies.policy import compute_probabilities
from sgm.text import load_text
from simulator.tasks.metrics import compute_nll
from simulator.tasks.scores import compute_rank

_GRADIENT_NORM = 1.0


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
    num_steps = sum(_count_questions(episode) for episode in episodes) * epochs
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


def _count_questions(episode: EventEpisode) -> int:
    return sum(not isinstance(happened, LookEvents) for happened in episode.happened)
