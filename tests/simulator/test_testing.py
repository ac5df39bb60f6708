"""The public checks: all that ships passes, and each way to break a contract is found."""

import numpy as np
import pytest

from sgm.policies.heuristics import Bayesian, Random
from sgm.policies.policy import Policy
from simulator.policies import POLICIES
from simulator.testing import check_policy


@pytest.mark.slow
@pytest.mark.parametrize("name", POLICIES)
def test_every_policy_passes(name):
    check_policy(POLICIES[name].make)


class WrongShape(Random):
    def scores(self, memory, queries):
        return super().scores(memory, queries)[:, 0]


class NotANumber(Random):
    def scores(self, memory, queries):
        return super().scores(memory, queries) * np.nan


class NoMask(Random):
    def scores(self, memory, queries):
        return np.zeros((len(queries.home), memory.num_furniture))


class Unsteady(Bayesian):
    def __init__(self):
        self._rng = np.random.default_rng(0)

    def scores(self, memory, queries):
        return super().scores(memory, queries) + self._rng.random()


class OfTheBatch(Bayesian):
    def scores(self, memory, queries):
        return super().scores(memory, queries) * len(queries.home)


class OfTheOthers(Bayesian):
    """Answers every question by itself, but reads the memories of all homes."""

    def scores(self, memory, queries):
        return super().scores(memory, queries) + memory.furniture_num_observed.sum()


class Forgetful(Bayesian):
    """Counts looks, and does not begin anew."""

    def __init__(self):
        self._num_looks = np.zeros(99)

    def observe(self, memory, change):
        self._num_looks[change.home] += 1

    def scores(self, memory, queries):
        return super().scores(memory, queries) + self._num_looks[queries.home, None]


class Scribbler(Bayesian):
    def scores(self, memory, queries):
        memory.objects["num_moved"][:] += 1
        return super().scores(memory, queries)


class Editor(Bayesian):
    def observe(self, memory, change):
        memory.furniture_num_observed[change.home] += 1


@pytest.mark.parametrize(
    ("policy", "message"),
    [
        (WrongShape, r"shape \(Q, F\) = \(6, 8\), got \(6,\) in step 1\. Return one score"),
        (NotANumber, r"numbers or -inf, got nan or inf in step 1\. Return -inf"),
        (NoMask, r"-inf where a home has no furniture, got 0\.0 in column 4 of home 0\. Use"),
        (Unsteady, r"same memory, got others when asked twice in step 1\. Let nothing"),
        (OfTheBatch, r"a question alone, got others for question 0 in step 1\. Answer each"),
        (OfTheOthers, r"same in any batch, got others for home 0 alone in step 2\. Work on"),
        (Forgetful, r"new policy after reset, got others in step 1 .*\. Forget everything"),
        (Scribbler, r"scores must leave the memory alone, got another 'objects num_moved' in st"),
        (Editor, r"observe must leave the memory alone, got another 'furniture num_observed' in"),
    ],
)
def test_every_breach_is_named(policy, message):
    with pytest.raises(AssertionError, match=message):
        check_policy(policy.make)


def test_an_oracle_is_not_asked_to_forget():
    """It holds the homes that it was made for."""

    class Knows(Forgetful):
        needs = frozenset(("transitions",))

    check_policy(Knows.make)


def test_a_policy_may_be_made_in_any_way():
    class WithSetting(Policy):
        def __init__(self, setting):
            self._setting = setting

        def scores(self, memory, queries):
            return np.where(memory.is_furniture[queries.home], self._setting, -np.inf)

    check_policy(lambda homes: WithSetting(3.0), num_homes=2, num_steps=3)
