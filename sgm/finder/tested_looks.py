"""The latest looks as tests of what similar moments before each of them had said."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sgm.evidence.similar_moments import PastMoments, compare_moments
from sgm.memory.moments import SHOWN

_TOGETHER = 32  # questions in one pass
_MOST_MOMENTS = 8  # times as many as the looks wanted; the others tested no answer


class _Test(NamedTuple):
    """A moment of a thing that may test what was said before it."""

    ago: float
    part: int
    query: int


class TestedLooks:
    """Looks at the place where similar moments before each held its thing for the likeliest.

    Nothing is kept while a robot looks: the moments of a memory are those that it had before each
    of them, but for the oldest. So a look costs nothing, and files hold no more.

    Attributes:
        num_looks: how many there were, after `score`.
    """

    __test__ = False  # no test of pytest

    def __init__(self, most: int) -> None:
        """Test the latest `most` looks."""
        self.num_looks = 0
        self._most = most
        self._parts: list[PastMoments] = []
        self._tests: list[_Test] = []

    def add(self, past: PastMoments) -> None:
        """Add the moments of some things."""
        cell, column = np.nonzero(past.states)
        ago, query = past.ago[cell, column], past.query[cell]
        latest = np.argsort(ago, kind="stable")[: _MOST_MOMENTS * self._most]
        moments = set(zip(ago[latest].tolist(), query[latest].tolist(), strict=True))
        self._tests += [
            _Test(ago=when, part=len(self._parts), query=thing) for when, thing in moments
        ]
        self._parts.append(past)

    def score(self) -> tuple[float, float]:
        """Return the mean probability that was said, and the share that was right; nan of none."""
        sure: list[float] = []
        right: list[bool] = []
        tests = sorted(self._tests)[: _MOST_MOMENTS * self._most]
        for begin in range(0, len(tests), _TOGETHER):
            if len(sure) >= self._most:
                break
            for said, is_right in self._ask(tests[begin : begin + _TOGETHER]):
                sure.append(said)
                right.append(is_right)
        sure, right = sure[: self._most], right[: self._most]
        self.num_looks = len(sure)
        if not sure:
            return float("nan"), float("nan")
        return float(np.mean(sure)), float(np.mean(right))

    def _ask(self, tests: list[_Test]) -> list[tuple[float, bool]]:
        """Return what was said before some moments and whether it was right, where they show."""
        asked = [known for test in tests if (known := _go_back(self._parts, test)) is not None]
        if not asked:
            return []
        shares = compare_moments(_join([before for before, _ in asked])).join()[0]
        answers = []
        for row, (past, outcome) in enumerate(asked):
            place = int(shares[row].argmax())
            seen = outcome[past.place == place]  # none for elsewhere
            if seen.size and seen[0]:
                answers.append((float(shares[row, place]), bool(seen[0] == SHOWN)))
        return answers


def _go_back(parts: list[PastMoments], test: _Test) -> tuple[PastMoments, np.ndarray] | None:
    """Return what was known of a thing before a moment, and what that said at each place, (C,).

    None if the thing had not been seen before.
    """
    past = parts[test.part]
    begin, end = np.searchsorted(past.query, [test.query, test.query + 1])
    place, ago, states = past.place[begin:end], past.ago[begin:end], past.states[begin:end]
    outcome = np.where(ago == test.ago, states, 0).max(axis=1)
    states = np.where(ago > test.ago, states, 0)
    was_there = (states == SHOWN).any(axis=1)
    if not was_there.any():
        return None
    place, ago, states = place[was_there], ago[was_there] - test.ago, states[was_there]
    lag = np.where(states == SHOWN, ago, np.inf).min(axis=1)
    last, question = int(lag.argmin()), slice(test.query, test.query + 1)
    before = PastMoments(
        query=np.zeros(len(place), dtype=np.int64),
        place=place,
        ago=ago,
        states=states,
        now=np.mod(past.now[question] - test.ago, 7 * 24),
        lag=lag[last : last + 1],
        last=place[last : last + 1],
        detection=past.detection[question],
        is_place=past.is_place[question],
    )
    return before, outcome[was_there]


def _join(asked: list[PastMoments]) -> PastMoments:
    """Return the moments of several questions, each one number after the other."""
    query = np.repeat(np.arange(len(asked)), [len(past.query) for past in asked])
    names = ("place", "ago", "states", "now", "lag", "last", "detection", "is_place")
    columns = {name: np.concatenate([getattr(past, name) for past in asked]) for name in names}
    return PastMoments(query=query, **columns)
