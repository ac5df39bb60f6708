import numpy as np
import pytest
from scipy import stats

from sgm.policies.heuristics import Random
from sgm.policies.policy import Policy
from simulator.tasks.relative_likelihood import (
    RelativeLikelihood,
    compute_relevance,
    list_looks,
    sample_queries,
)


class FromDynamics(Policy):
    """Ranks by the true T, which is what the metric asks for."""

    def __init__(self, homes):
        self._homes = homes

    def scores(self, memory, queries):
        return compute_relevance(self._homes, queries.home, memory.objects["key"][queries.object])


class Fixed(Policy):
    """Gives the same scores to everything."""

    def __init__(self, scores):
        self._scores = np.array(scores, dtype=float)

    def scores(self, memory, queries):
        return np.tile(self._scores, (len(queries.home), 1))


def play(task, num_steps):
    """Scores (H, T) and everything that was answered."""
    answered = []
    task.on_answer = answered.append
    return np.stack(list(task.run(num_steps)), axis=1), answered


def test_each_home_is_asked_five_different_descriptions(make_default_homes):
    homes = make_default_homes(8)
    rows = np.arange(8)[:, None]
    for _ in range(30):
        homes.evolve()
        slots = sample_queries(homes, 5)
        assert slots.shape == (8, 5)
        assert homes.is_present[rows, slots].all()
        codes = np.sort(homes.object_code[rows, slots], axis=1)
        assert (np.diff(codes, axis=1) > 0).all()


def test_where_everything_was_asked_for_it_is_asked_again(make_tiny_homes):
    homes = make_tiny_homes(3)
    homes.object_place[:, 4:] = -1  # at most four descriptions are left
    slots = sample_queries(homes, 9)
    for home in range(3):
        codes = homes.object_code[home, slots[home]]
        present = set(homes.object_code[home, :4].tolist())
        assert set(codes[: len(present)].tolist()) == present  # each once before any twice
        assert set(codes.tolist()) == present


def test_the_first_query_is_drawn_like_a_single_one(make_tiny_homes):
    """One mover among 2000 homes: asked for with 1/2 + 1/2 of an even share of 36 objects."""
    homes = make_tiny_homes(2000)
    homes.object_moved[:, 0] = True
    homes.move_freq = np.zeros(10)
    first = sample_queries(homes, 2)[:, 0]
    share = 0.5 + 0.5 / 36
    assert stats.binomtest(int((first == 0).sum()), 2000, share).pvalue > 0.01


def test_relevance_are_the_row_of_the_true_dynamics(make_tiny_homes):
    homes = make_tiny_homes(2)
    codes = homes.object_code[[0, 1], [3, 5]]
    relevance = compute_relevance(homes, np.array([0, 1]), codes)
    for query, (home, code) in enumerate(zip([0, 1], codes, strict=True)):
        row = homes.transition_rows(np.array([home]), np.array([code]))[0]
        for furniture in range(6):  # places 2 f ("in") and 2 f + 1 ("onTop")
            expected = row[2 * furniture] + row[2 * furniture + 1]
            assert relevance[query, furniture] == pytest.approx(expected)
    np.testing.assert_allclose(relevance.sum(axis=1), 1, atol=1e-6)


def test_ranking_by_the_dynamics_scores_one(make_default_homes):
    homes = make_default_homes(3)
    values, _ = play(RelativeLikelihood(homes, FromDynamics(homes)), 5)
    np.testing.assert_allclose(values, 1)


def test_the_score_of_a_home_is_the_mean_over_its_queries(make_tiny_homes):
    homes = make_tiny_homes(2)
    task = RelativeLikelihood(homes, Fixed([5, 4, 3, 2, 1, 0]), num_queries=3)
    discounts = 1 / np.log2([2, 3, 4, 5, 6, 7])
    relevance = []

    def keep(answered):
        codes = task.rollout.memory.objects["key"][answered.queries.object]
        relevance.append(compute_relevance(homes, answered.queries.home, codes))

    task.on_answer = keep
    (values,) = task.run(1)
    ideal = -np.sort(-relevance[0], axis=1)
    ndcg = (relevance[0] @ discounts) / (ideal @ discounts)  # (6,), three of each home
    np.testing.assert_allclose(values, ndcg.reshape(2, 3).mean(axis=1))


def test_the_best_place_of_each_query_is_looked_at_once(make_tiny_homes):
    homes = make_tiny_homes(2, detection_error=0)
    task = RelativeLikelihood(homes, Random(), num_queries=4)
    looks = np.zeros((2, 6), dtype=int)

    def expect(answered):
        # All answers of a step come before any of its looks.
        memory = task.rollout.memory
        np.testing.assert_array_equal(memory.furniture_num_observed, looks)
        assert answered.queries.home.tolist() == [0] * 4 + [1] * 4
        for home in range(2):
            for furniture in set(answered.choice.reshape(2, 4)[home].tolist()):
                looks[home, furniture] += 1

    task.on_answer = expect
    for number, _ in enumerate(task.run(12), start=1):
        assert task.rollout.memory.time == number
    np.testing.assert_array_equal(task.rollout.memory.furniture_num_observed, looks)


def test_looks_of_a_step_by_hand():
    choice = np.array([[3, 3, 1], [0, 2, 0]])
    assert [look.tolist() for look in list_looks(choice)] == [[3, 0], [-1, 2], [1, -1]]


def test_fewer_than_one_query_is_refused(make_tiny_homes):
    with pytest.raises(ValueError, match=r"num_queries must be at least 1, got 0\. Raise it"):
        RelativeLikelihood(make_tiny_homes(1), Random(), num_queries=0)
