"""What policies and similar moments said to questions of which the answer is known, in a file."""

from __future__ import annotations

import io
from collections.abc import Iterable, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from sgm.evidence.similar_moments import PastMoments
from sgm.files import write_whole
from sgm.network.network import Network
from sgm.network.policy import NetworkPolicy
from sgm.network.shipped import find_trained
from sgm.policies import Adaptive, Policy
from tools.rhythm.habits import begin_by_habits, live_by_habits
from tools.rhythm.lives import LifeQuestion, live

POLICIES = ("network", "adaptive")
LIVES = {  # kinds of homes, by name
    "people": live,
    "habits": live_by_habits,
    "first days": begin_by_habits,
}
MOST_PLACES = 63  # of a home

Arrays = Mapping[str, np.ndarray]


def collect_answers(questions: Iterable[LifeQuestion]) -> dict[str, np.ndarray]:
    """Ask the shipped network and `Adaptive` all questions of a home.

    Returns:
        By policy, probability of each place and of elsewhere, float32 (n, MOST_PLACES + 1); the
        columns of `PastMoments`, with ago in half hours; and "answer", which of these is right,
        (n,).
    """
    network = Network.load(find_trained("any_home"))
    players: dict[str, Policy] = {
        "network": NetworkPolicy(network, 0.0, uses_rhythm=False),
        "adaptive": Adaptive(uses_rhythm=False).for_questions(0.0),
    }
    rows: dict[str, list[Any]] = {}
    for row, question in enumerate(questions):
        asked = question.memory.ask((question.thing,), at=question.at)
        past, ids = PastMoments.gather(asked.batch, asked.queries), asked.furniture_ids
        place = question.place
        values = {field.name: getattr(past, field.name) for field in fields(past)}
        values |= {
            "query": past.query + row,
            "ago": np.round(past.ago * 2).astype(np.int16),
            "is_place": _widen(past.is_place),
            "answer": [MOST_PLACES if place is None else ids.index(place)],
        }
        for name, policy in players.items():
            policy.reset(asked.batch)
            said = policy.believe(asked.batch, asked.queries).probabilities.astype(np.float32)
            values[name] = np.concatenate([_widen(said[:, :-1]), said[:, -1:]], axis=1)
        for key, value in values.items():
            rows.setdefault(key, []).append(value)
    return {key: np.concatenate(values) for key, values in rows.items()}


def _widen(columns: np.ndarray) -> np.ndarray:
    """Return columns of places, (n, F) -> (n, MOST_PLACES)."""
    return np.pad(columns, ((0, 0), (0, MOST_PLACES - columns.shape[1])))


def load_answers(kind: str, number: int, folder: Path) -> dict[str, np.ndarray]:
    """Return the answers in a home of one of `LIVES`, from their file; else they are collected."""
    name = kind.replace(" ", "_")
    path = folder / f"{name}_{number}.npz"
    if not path.exists():
        file = io.BytesIO()
        answers: dict[str, Any] = {**collect_answers(LIVES[kind](number))}
        np.savez_compressed(file, **answers)
        write_whole(path, file.getvalue())
    with np.load(path) as saved:
        return dict(saved)


def read_past(answers: Arrays) -> PastMoments:
    """Return the moments of answers."""
    values = {field.name: answers[field.name] for field in fields(PastMoments)}
    return PastMoments(**values | {"ago": answers["ago"] / 2})
