"""Searches of a policy as pictures: where it believed the object was, and where it looked."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from nep.players.contestants import MakePolicy
from sgm.policies.probabilities import compute_probabilities
from simulator.drawing import FloorPlan, draw_belief
from simulator.tasks.answer import Answer
from simulator.tasks.find_object import FindObject
from simulator.world.source import HomeSource
from simulator.world.streams import Streams

_WARM_UP = 10  # searches before those that are drawn, so that the memory is not empty
_SHOWN = 3  # searches
_MOST_LOOKS = 6  # that are drawn


@dataclass(frozen=True)
class SearchStory:
    """One search.

    Attributes:
        plan: of the home.
        description: what was looked for.
        belief: probability of each furniture node before the first look, (F,).
        looks: furniture in the order of the looks.
        true_places: furniture that held it.
    """

    plan: FloorPlan
    description: str
    belief: np.ndarray
    looks: tuple[int, ...]
    true_places: tuple[int, ...]


def play_search_stories(
    make: MakePolicy, source: HomeSource, seed: int, split: str
) -> list[SearchStory]:
    """Let a policy search the first home of a source, and return its last searches.

    There are three, or fewer where the home was recorded for fewer steps.
    """
    homes = source.make(Streams(seed, split, [0]))
    policy = make(homes)
    game = FindObject(homes, policy)
    plan = FloorPlan.of_homes(homes)
    answers: list[Answer] = []
    game.on_answer = answers.append
    num_played = min(_WARM_UP + _SHOWN, source.num_steps or _WARM_UP + _SHOWN)
    found = []
    for search in game.search(num_played):
        first = answers[0]
        belief = compute_probabilities(first.scores, policy.score_kind)[0]
        found.append(
            SearchStory(
                plan,
                homes.object_descriptions.text(int(search.codes[0])),
                belief[: len(plan.furniture)],
                tuple(int(answer.choice[0]) for answer in answers if answer.choice[0] >= 0),
                tuple(np.flatnonzero(first.answers[0]).tolist()),
            )
        )
        answers.clear()
    return found[-_SHOWN:]


def draw_searches(searches: list[SearchStory]) -> Figure:
    """Draw searches side by side: belief before the first look, looks in order, the truth."""
    figure = Figure(figsize=(6.4 * len(searches), 5.2), dpi=100, layout="constrained")
    panels = figure.subplots(1, len(searches), squeeze=False)[0]
    for axes, search in zip(panels, searches, strict=True):
        draw_belief(
            axes, search.plan, search.belief, order=search.looks[:_MOST_LOOKS],
            true_places=search.true_places,
        )  # fmt: skip
        count = len(search.looks)
        title = f"{search.description}: {count} look{'' if count == 1 else 's'}"
        axes.set_title(title, loc="left", fontsize=11)
    return figure
