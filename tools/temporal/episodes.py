"""What a collecting policy saw and was asked in homes, kept in memory to be played again."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sgm.arrays.grouped import sum_relations
from sgm.checks import check_at_least
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Change, Queries
from simulator.policies import make_policy
from simulator.tasks.answer import Answer
from simulator.tasks.predict_location import PredictLocation
from simulator.world.homes import Homes
from simulator.world.source import HomeSource
from simulator.world.streams import Streams
from tools.temporal.stream import NewEvents, StreamQuestions


@dataclass(frozen=True, slots=True)
class LookEvents:
    """Events of one look in each of some homes, and how many things were known after it."""

    events: NewEvents
    num_things: int
    time: int


@dataclass(frozen=True, slots=True)
class EpisodeQuestions:
    """Questions that were asked at once, in each home one.

    Attributes:
        asked: what was asked.
        answers: true places, bool (Q, F).
        num_things: things that were known when they were asked.
    """

    asked: StreamQuestions
    answers: np.ndarray
    num_things: int


@dataclass(frozen=True, slots=True)
class EventEpisode:
    """What happened in homes that were played together, in order.

    Attributes:
        labels: texts that `thing_label` and `furniture_label` name.
        furniture_label: (H, F), -1 for none.
        thing_home, thing_label: of every row of the memory's objects, (O,).
        happened: looks and questions.
    """

    labels: tuple[str, ...]
    furniture_label: np.ndarray
    thing_home: np.ndarray
    thing_label: np.ndarray
    happened: tuple[LookEvents | EpisodeQuestions, ...]


def record_episodes(
    source: HomeSource, streams: Streams, num_steps: int, most_homes: int | None = None
) -> list[EventEpisode]:
    """Let the policy `bayesian` play Predict Object Location, and keep what happened.

    Args:
        source: homes.
        streams: which of them.
        num_steps: time steps.
        most_homes: of an episode, which is what a step of the optimiser learns from; None for all
            of a group.

    Returns:
        One or more episodes for each group of homes.
    """
    check_at_least(1, most_homes=1 if most_homes is None else most_homes)
    chunks = [
        group.homes[first : first + (most_homes or len(group.homes))]
        for group in source.list_groups(streams.homes)
        for first in range(0, len(group.homes), most_homes or len(group.homes))
    ]
    return [_record(source.make(streams.select(chunk)), num_steps) for chunk in chunks]


def _record(homes: Homes, num_steps: int) -> EventEpisode:
    game = PredictLocation(homes, make_policy("bayesian", homes))
    memory = game.rollout.memory
    happened: list[LookEvents | EpisodeQuestions] = []

    def note_answer(answer: Answer) -> None:
        asked = make_asked(memory, answer.queries)
        happened.append(EpisodeQuestions(asked, answer.answers.copy(), memory.objects.num_rows))

    def note_change(change: Change) -> None:
        happened.append(
            LookEvents(make_events(memory, change), memory.objects.num_rows, memory.time)
        )

    game.on_answer, game.rollout.on_change = note_answer, note_change
    for _ in game.run(num_steps):
        pass
    objects = memory.objects
    return EventEpisode(
        tuple(memory.labels),
        memory.furniture_label.copy(),
        objects["home"].copy(),
        objects["label"].copy(),
        tuple(happened),
    )


def make_asked(memory: MemoryBatch, queries: Queries) -> StreamQuestions:
    """Return questions as networks read them."""
    prior = sum_relations(queries.prior).astype(np.float32)
    is_place = memory.is_furniture[queries.home]
    return StreamQuestions(queries.home.copy(), queries.object.copy(), prior, is_place, memory.time)


def make_events(memory: MemoryBatch, change: Change) -> NewEvents:
    """Return what a look has shown as events."""
    edges, rows = memory.edges, change.edges
    home = edges["home"][rows]
    coverage = np.ones(memory.num_homes)
    coverage[change.home] = change.coverage
    return NewEvents(
        home.copy(),
        edges["object"][rows].copy(),
        edges["furniture"][rows].copy(),
        edges["relation"][rows].copy(),
        change.is_seen.astype(bool),
        coverage[home],
        np.where(change.is_seen, edges["confidence"][rows], 0.0),
    )
