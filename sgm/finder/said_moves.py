"""What was said of a thing, as evidence about that thing alone: it left where it was."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sgm.memory.asking import Asked, Looks
from sgm.memory.home_history import BOTH, NUM_LOOKS_KEPT


@dataclass(frozen=True, slots=True)
class SaidMove:
    """That one of the things that are asked for was moved, by the newest word about it.

    Attributes:
        row: which of the K things.
        places: furniture where it was until then, by position, (n,).
        time: time step.
    """

    row: int
    places: np.ndarray
    time: int

    def show(self, asked: Asked) -> Asked:
        """Return the question about that thing alone, as if a look had missed it where it was.

        The look is in its memory, for policies, and alone in `looks`, for Bayes' rule.
        """
        batch = asked.batch.share()
        batch.derived = {}
        batch.furniture = batch.furniture.copy()
        batch.count_history(batch.history.copy())
        column = batch.furniture["num_observed"][0, self.places] % NUM_LOOKS_KEPT
        batch.history.look_times[0, self.places, column] = self.time
        if batch.history.look_relations is not None:
            batch.history.look_relations[0, self.places, column] = BOTH
        batch.furniture["num_observed"][0, self.places] += 1
        last = batch.furniture["last_observed"]
        last[0, self.places] = np.maximum(last[0, self.places], self.time)
        looks = asked.looks.take([self.row], [False])
        steps_ago = np.full((*looks.negative.shape, 1), np.inf)
        steps_ago[0, self.places] = asked.current.time - self.time
        nothing = np.zeros_like(looks.negative)
        return replace(
            take_thing(asked, self.row),
            batch=batch,
            origin=object(),
            looks=Looks(
                negative=nothing, steps_ago=steps_ago, sought=nothing,
                sought_ago=np.full_like(nothing, np.inf), seen=nothing,
                is_remembered=looks.is_remembered,
            ),
        )  # fmt: skip


def list_said_moves(asked: Asked) -> list[SaidMove]:
    """List the things that were said in an earlier step to be elsewhere, and not seen since."""
    return [
        SaidMove(row, np.flatnonzero(np.isin(asked.furniture_ids, said.was_at)), said.time)
        for row, said in enumerate(asked.said)
        if said is not None and said.furniture is not None and said.was_at
        and said.time < asked.current.time
    ]  # fmt: skip


def take_thing(asked: Asked, row: int) -> Asked:
    """Return what a policy is asked about one of several things."""
    return replace(
        asked,
        queries=asked.queries.take(np.array([row])),
        rows=asked.rows[[row]],
        said=(asked.said[row],),
        statements=(asked.statements[row],),
        looks=asked.looks.take([row], [False]),
        num_instances=asked.num_instances[[row]],
    )
