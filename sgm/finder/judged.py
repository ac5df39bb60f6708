"""Beliefs of a policy about one state of a memory, each computed once, several in one pass.

A policy gives each place that was never looked at a share. In a home of few places that is much,
and other numbers that it reads change with how many places there are. So what is asked for is
believed with U places that have nothing to do with it and without them, and for all other answers

    P = P_without + min(1, b U / d) (P_with - P_without),   d = max |P_with - P_without|

A place that is added to the map then changes an answer by about b, `UNRELATED`, at most.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import chain

import numpy as np

from sgm.belief import Belief
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.memory_questions import Asked
from sgm.memory.queries import Queries

MOST_TOGETHER = 16  # things in one pass: twice the time of one in a home
_MOST_PAIRS = 2_000  # of a thing and a place in one pass: with more, each thing takes its own time
_MOST_BELIEFS = 2000  # that are kept of a state
_MOST_LATELY = 500  # things of a home, or asked for, among which is chosen what comes along
UNRELATED = 0.03  # most that a place changes of a probability that has nothing to do with a thing
_MOST_UNRELATED = 10  # of more such places, none changes as much by itself

_Thing = tuple[int, str, int]  # row, label and type: what a belief depends on
_Things = tuple[_Thing, ...]  # of one question; how many they are, the evidence shows
Judge = Callable[[MemoryBatch, Queries], Belief]


class JudgedBeliefs:
    """Beliefs about the memory before the looks of a time step, which these do not change.

    A pass of a network for sixteen things takes twice the time of one for one. So other questions
    come along with what is asked for: of as many things as are known of this state already, so that
    who asks for one thing a step waits for no other. Where many were asked for in the state
    before, the first pass is of as many as any.
    """

    def __init__(self) -> None:
        """Know nothing."""
        self._origin: object = None
        self._time = -1
        self._settings: tuple[object, ...] = ()
        self._asked: set[_Things] = set()  # in this state
        self._least_together = 0  # things to come along, however few are known of this state
        self._beliefs: dict[_Things, Belief] = {}
        self._lately: dict[_Things, None] = {}  # what was asked for, the latest last

    def recall(
        self, asked: Asked, settings: tuple[object, ...], judge: Judge, comes_along: bool
    ) -> Belief:
        """Return the belief about what is asked for, computed if it is not known.

        Args:
            asked: K things.
            settings: what `judge` reads besides; beliefs of others do not count.
            judge: returns the belief of a memory about such things.
            comes_along: whether other things may be judged in one pass: their beliefs, and those
                of what is asked for, must be the same to the bit.
        """
        pairs = zip(self._settings, settings, strict=False)
        is_same = [before is now for before, now in pairs]
        is_state = self._origin is asked.origin and self._time == asked.batch.time
        if not (is_state and is_same and all(is_same)):  # the very same settings
            self._origin, self._time, self._settings = asked.origin, asked.batch.time, settings
            self._least_together = MOST_TOGETHER if len(self._asked) >= MOST_TOGETHER else 0
            self._beliefs, self._asked = {}, set()
        things = _list_things(asked)
        if len(self._asked) < MOST_TOGETHER:
            self._asked.add(things)
        belief = self._beliefs.get(things)
        if belief is None:
            more = self._choose_more(asked, things) if comes_along else []
            belief = self._judge(asked, things, more, judge)
        if len(things) < MOST_TOGETHER:
            self._lately.pop(things, None)
            self._lately[things] = None
            if len(self._lately) > _MOST_LATELY:
                del self._lately[next(iter(self._lately))]
        return belief

    def _judge(self, asked: Asked, things: _Things, more: list[_Things], judge: Judge) -> Belief:
        questions = [things, *more]
        ends = np.cumsum([len(question) for question in questions]).tolist()
        joined = believe_bounded(judge, asked.batch, _add_questions(asked, more)).log_weights
        if len(self._beliefs) + len(more) >= _MOST_BELIEFS:
            self._beliefs.clear()
        for question, end in zip(questions, ends, strict=True):
            self._beliefs[question] = Belief(joined[end - len(question) : end])
        return self._beliefs[things]

    def _choose_more(self, asked: Asked, things: _Things) -> list[_Things]:
        """Choose what is judged along: the latest that was asked for, then the latest seen."""
        if not asked.was_seen.all():
            return []
        objects, labels = asked.batch.objects, asked.batch.labels

        def is_known(thing: int, label: str, kind: int) -> bool:
            """Whether it is a thing of this memory, still."""
            return (
                thing < objects.num_rows
                and objects["type"][thing] == kind
                and labels[objects["label"][thing]] == label
            )

        known = max(sum(map(len, self._beliefs)), self._least_together)
        together = min(MOST_TOGETHER, _MOST_PAIRS // len(asked.furniture_ids))
        most = min(known, together - len(things))
        more, num_more = dict[_Things, None](), 0
        for others in chain(reversed(self._lately), _list_seen(asked)):
            if num_more >= most:
                break
            is_judged = others in self._beliefs or others == things or others in more
            has_room = num_more + len(others) <= most
            if has_room and not is_judged and all(is_known(*thing) for thing in others):
                more[others] = None
                num_more += len(others)
        return list(more)


def _list_seen(asked: Asked) -> Iterator[_Things]:
    """List the things of a home, the latest seen first; of one with thousands of things, none."""
    batch, objects = asked.batch, asked.batch.objects
    if objects.num_rows > _MOST_LATELY:
        return
    rows = np.flatnonzero((objects["num_observed"] > 0) & (objects["same_as"] < 0))
    rows = rows[np.argsort(-objects["last_observed"][rows], kind="stable")]
    for thing in rows.tolist():
        yield ((thing, batch.labels[objects["label"][thing]], int(objects["type"][thing])),)


def _list_things(asked: Asked) -> _Things:
    batch, rows = asked.batch, asked.queries.object
    labels = [batch.labels[label] for label in batch.objects["label"][rows].tolist()]
    types = batch.objects["type"][rows].tolist()
    return tuple(zip(rows.tolist(), labels, types, strict=True))


def _add_questions(asked: Asked, more: list[_Things]) -> Queries:
    """Put more questions, each as if it were put alone, after the same ones before it."""
    if not more:
        return asked.queries
    rows = np.array([row for things in more for row, *_ in things])
    home = np.zeros(len(rows), dtype=np.int64)
    prior = asked.batch.place_prior.rows(home, asked.batch.objects["type"][rows])
    num_asked = np.array([len(things) for things in more for _ in things])
    return asked.queries.join(Queries(home, rows, prior, num_asked))


def believe_bounded(judge: Judge, memory: MemoryBatch, queries: Queries) -> Belief:
    """Ask a policy where objects may be, (Q, F + 1), and bound what unrelated places take.

    Args:
        judge: returns the belief of a memory about such things.
        memory: that is asked.
        queries: what is asked for.
    """
    is_unrelated = find_unrelated(memory, queries)
    number = is_unrelated.sum(axis=1)
    rows = np.flatnonzero((number > 0) & (number <= _MOST_UNRELATED))
    if not len(rows):
        return judge(memory, queries)
    left_out, num_queries = is_unrelated[rows], len(number)
    joined = judge(memory, queries.join(replace(queries.take(rows), left_out=left_out)))
    log_weights = joined.log_weights[:num_queries].copy()
    without = joined.probabilities[num_queries:]
    change = joined.probabilities[rows] - without
    is_other = np.column_stack([~left_out, np.ones(len(rows), dtype=bool)])
    most = np.abs(change * is_other).max(axis=1)
    bound = UNRELATED * number[rows]
    is_beyond = most > bound
    share = bound[is_beyond] / most[is_beyond]
    with np.errstate(divide="ignore"):
        bounded = np.log(without[is_beyond] + share[:, None] * change[is_beyond])
    log_weights[rows[is_beyond]] = bounded
    return Belief(log_weights)


def find_unrelated(memory: MemoryBatch, queries: Queries) -> np.ndarray:
    """Mark the places that have nothing to do with what is asked for, bool (Q, F).

    They were never looked at, the prior does not keep the thing there, and it is where it was seen
    last, for all that looks have shown. What was missed there, or never seen, may be anywhere.
    """
    is_unrelated = memory.is_furniture[queries.home] & ~queries.prior.any(axis=2)
    is_unrelated &= memory.furniture["num_observed"][queries.home] == 0
    if not is_unrelated.any():
        return is_unrelated
    edges, (query, edge) = memory.edges, memory.edges_of(queries)
    is_there = np.zeros(len(queries.home), dtype=bool)
    is_there[query[edges["is_true"][edge]]] = True
    is_unrelated &= is_there[:, None]
    is_unrelated[query, edges["furniture"][edge]] = False
    if (lone := memory.find_lone_looks(queries.object)) is not None:
        is_unrelated &= lone.num_looks == 0
    return is_unrelated
