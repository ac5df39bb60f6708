"""Beliefs about one state of a memory, each computed once, and those that come along."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import chain

import numpy as np

from sgm.belief import Belief
from sgm.memory.asking import Asked
from sgm.memory.queries import Queries

MOST_TOGETHER = 16  # things in one pass: less than twice the time of one
_MOST_BELIEFS = 2000  # that are kept of a state
_MOST_LATELY = 500  # things of a home, or asked for, among which is chosen what comes along

# Row, label and type of a thing, and whether a look has shown it last: what a belief depends on.
_Thing = tuple[int, str, int, bool]
Judge = Callable[[Asked, np.ndarray], Belief]


class JudgedBeliefs:
    """Beliefs about the memory before the looks of a time step, which these do not change.

    A pass of a network for sixteen things takes little more time than for one. So other things come
    along with what is asked for: as many as are known of this state already, so that who asks for
    one thing a step waits for no other.
    """

    def __init__(self) -> None:
        """Know nothing."""
        self._origin: object = None
        self._time = -1
        self._settings: tuple[object, ...] = ()
        self._beliefs: dict[tuple[_Thing, ...], Belief] = {}
        self._lately: dict[_Thing, None] = {}  # what was asked for, the latest last

    def recall(
        self, asked: Asked, settings: tuple[object, ...], judge: Judge, comes_along: bool
    ) -> Belief:
        """Return the belief about what is asked for, computed if it is not known.

        Args:
            asked: K things.
            settings: what `judge` reads besides; beliefs of others do not count.
            judge: returns the belief about such things, and whether the last sighting of each was a
                look, bool (K,).
            comes_along: whether other things may be judged in one pass: their beliefs, and those
                of what is asked for, must be the same to the bit.
        """
        if not self._is_of(asked.origin, asked.batch.time, settings):
            self._origin, self._time, self._settings = asked.origin, asked.batch.time, settings
            self._beliefs = {}
        things = _list_things(asked)
        belief = self._beliefs.get(things)
        if belief is None:
            more = self._choose_more(asked, things) if comes_along else []
            belief = self._judge(asked, things, more, judge)
        if len(things) == 1 and asked.said[0] is None:
            self._lately.pop(things[0], None)
            self._lately[things[0]] = None
            if len(self._lately) > _MOST_LATELY:
                del self._lately[next(iter(self._lately))]
        return belief

    def _is_of(self, origin: object, time: int, settings: tuple[object, ...]) -> bool:
        """Tell whether beliefs are about that state, with the very same settings."""
        is_same = [own is one for own, one in zip(self._settings, settings, strict=False)]
        return self._origin is origin and self._time == time and any(is_same) and all(is_same)

    def _judge(
        self, asked: Asked, things: tuple[_Thing, ...], more: list[_Thing], judge: Judge
    ) -> Belief:
        is_looked = np.array([is_looked for *_, is_looked in (*things, *more)])
        joined = judge(_add_things(asked, more), is_looked).log_weights
        if len(self._beliefs) + len(more) >= _MOST_BELIEFS:
            self._beliefs.clear()
        belief = self._beliefs[things] = Belief(joined[: len(things)])
        for row, thing in enumerate(more, len(things)):
            self._beliefs[(thing,)] = Belief(joined[row : row + 1])
        return belief

    def _choose_more(self, asked: Asked, things: tuple[_Thing, ...]) -> list[_Thing]:
        """Choose what is judged along: the latest that were asked for, then the latest seen.

        Not what was spoken of last, which is judged by itself, nor with several of one name:
        they count as several questions, which the evidence shows.
        """
        if len(things) > 1 or asked.said[0] is not None or not asked.was_seen.all():
            return []
        objects, labels = asked.batch.objects, asked.batch.labels

        def is_here(row: int, label: str, kind: int, _: bool) -> bool:
            """Whether it is a thing of this memory, still."""
            return (
                row < len(objects)
                and objects["type"][row] == kind
                and labels[objects["label"][row]] == label
            )

        most, more = min(len(self._beliefs), MOST_TOGETHER - 1), dict[_Thing, None]()
        for thing in chain(reversed(self._lately), _list_seen(asked)):
            if len(more) == most:
                break
            if (thing,) not in self._beliefs and thing not in things and is_here(*thing):
                more[thing] = None
        return list(more)


def _list_seen(asked: Asked) -> Iterator[_Thing]:
    """List the things of a home, the latest seen first; of one with thousands of things, none."""
    batch, objects = asked.batch, asked.batch.objects
    if len(objects) > _MOST_LATELY:
        return
    rows = np.flatnonzero((objects["num_observed"] > 0) & (objects["same_as"] < 0))
    rows = rows[np.argsort(-objects["last_observed"][rows], kind="stable")]
    for row in rows.tolist():
        yield row, batch.labels[objects["label"][row]], int(objects["type"][row]), True


def _list_things(asked: Asked) -> tuple[_Thing, ...]:
    batch, rows = asked.batch, asked.queries.object
    labels = [batch.labels[label] for label in batch.objects["label"][rows].tolist()]
    types = batch.objects["type"][rows].tolist()
    is_looked = [said is None for said in asked.said]
    return tuple(zip(rows.tolist(), labels, types, is_looked, strict=True))


def _add_things(asked: Asked, more: list[_Thing]) -> Asked:
    """Ask for more things, which are counted as no questions."""
    if not more:
        return asked
    rows = np.array([row for row, *_ in more])
    home = np.zeros(len(rows), dtype=np.int64)
    prior = asked.batch.place_prior.rows(home, asked.batch.objects["type"][rows])
    return replace(
        asked,
        queries=asked.queries.join(Queries(home, rows, prior)),
        rows=np.append(asked.rows, rows),
        said=(*asked.said, *[None] * len(more)),
    )
