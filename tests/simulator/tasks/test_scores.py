"""The columns that a policy's answers leave, and every metric of them, by hand."""

from itertools import permutations

import numpy as np
import pytest

from sgm.policies.policy import Policy
from simulator.tasks.evaluation import play_task
from simulator.tasks.metrics import METRICS, STEP_METRICS
from simulator.tasks.registry import TASKS
from simulator.tasks.scores import TaskScores, compute_away, compute_hours, compute_rank


def test_away_means_seen_before_and_gone(make_tiny_memory):
    memory = make_tiny_memory(3)
    memory.step()
    home, keys = np.arange(3), np.full(3, 7)
    rows = memory.ensure_objects(home, keys, keys * 0, keys * 0)
    # Homes 0 and 1 saw the object on furniture 2; home 2 never saw it.
    memory.observe(home[:2], np.array([2, 2]), rows[:2], np.array([1, 1]))
    memory.step()
    queries = memory.query(home, keys, keys * 0, keys * 0)
    answers = np.zeros((3, 6), dtype=bool)
    answers[0, [2, 4]] = True  # one such object is still there
    answers[1, 4] = True
    answers[2, 4] = True
    assert compute_away(memory, queries, answers).tolist() == [False, True, False]


def test_hours_run_over_midnight_and_are_unknown_without_a_clock(make_tiny_memory):
    memory = make_tiny_memory(2)
    assert compute_hours(memory, np.array([0, 1])).tolist() == [-1, -1]
    # Home 0: step 0 is Sunday 23:30, a step is 45 minutes. Home 1 has no clock.
    memory.clock = np.array([[6 * 86400 + 23.5 * 3600, 2700.0], [np.nan, np.nan]])
    hours = []
    for _ in range(3):  # 23:30, 0:15, 1:00
        hours.append(compute_hours(memory, np.array([0, 1, 0])).tolist())
        memory.step()
    assert hours == [[23, -1, 23], [0, -1, 0], [1, -1, 1]]


@pytest.fixture
def scores():
    """Two homes of three steps and two answers each."""
    return TaskScores(
        values=np.array([[3.0, 1.0, 2.0], [5.0, 5.0, 8.0]]),
        is_correct=np.array([[True, False], [False, False]]),
        has_candidate=np.array([[True, True], [False, True]]),
        is_away=np.array([[True, True], [False, True]]),
        confidence=np.full((2, 2), 0.55),
        likelihood=np.array([[0.5, 0.25], [0.5, 0.25]]),
        rank=np.array([[1, 2], [4, 3]]),
        is_out_of_place=np.array([[True, True], [False, False]]),
        hour=np.array([[7, 8], [7, 8]]),
    )


def test_metrics_of_answers_by_hand(scores):
    assert {name: metric.compute(scores) for name, metric in METRICS.items()} == pytest.approx(
        {
            "accuracy": 0.25,  # homes 0.5 and 0
            "away_accuracy": 1 / 3,
            "out_of_place_accuracy": 1 / 2,
            "calibration_error": 0.55 - 0.25,  # one bin
            "nll": 1.5 * np.log(2),
            "candidate_recall": 0.75,
        }
    )
    assert {name for name, metric in METRICS.items() if not metric.is_higher_better} == {
        "calibration_error",
        "nll",
    }


def test_metrics_of_steps_by_hand(scores):
    assert scores.home_values.tolist() == [2, 6]
    for metric in STEP_METRICS.values():
        assert metric.compute(scores) == 4


def test_every_task_is_scored_with_a_metric_by_name():
    found = {task.metric: STEP_METRICS[task.metric].is_higher_better for task in TASKS.values()}
    assert found == {"accuracy": True, "ndcg": True, "looks": False}


def test_away_accuracy_is_nan_where_nothing_is_away():
    nothing = np.zeros((1, 2), dtype=bool)
    share = np.zeros((1, 2))
    scores = TaskScores(share, nothing, nothing, nothing, share, share, share, nothing, share)
    assert np.isnan(METRICS["away_accuracy"].compute(scores))
    assert np.isnan(METRICS["out_of_place_accuracy"].compute(scores))


def test_the_first_steps_are_skipped(scores):
    rest = scores.skip(1)  # of three steps; of two answers, one and a third
    assert rest.values.tolist() == [[1, 2], [5, 8]]
    assert rest.rank.tolist() == [[2], [3]]


def test_groups_are_joined_in_the_order_of_their_homes(scores):
    joined = TaskScores.join([[5, 1], [3, 0]], [scores, scores])
    assert joined.home_values.tolist() == [6, 6, 2, 2]  # homes 0, 1, 3, 5
    assert joined.rank.tolist() == [[4, 3], [4, 3], [1, 2], [1, 2]]


class ByPlace(Policy):
    """Scores furniture 0, 1, 2 and so on; none has an opinion of the last one."""

    def scores(self, memory, queries):
        row = np.arange(float(memory.num_furniture))
        return np.tile(np.where(row == row[-1], -np.inf, row), (len(queries.home), 1))


def test_ranks_by_hand():
    none = -np.inf
    scores = np.array(
        [
            [3, 2, 1, 0, none],  # the second of four that have a score
            [1, 1, 1, 1, none],  # four tie: (4 + 1) / 2
            [2, 1, 1, 1, none],  # one before three that tie, two of which are right: 1 + 4 / 3
            [2, none, none, none, none],  # no opinion of it: one before three that tie
        ]
    )
    answers = np.zeros((4, 5), dtype=bool)
    answers[0, 1] = answers[1, 3] = answers[2, 1] = answers[2, 2] = answers[3, 2] = True
    is_place = np.tile([True, True, True, True, False], (4, 1))  # the last one is of no home
    found = compute_rank(scores, answers, is_place)
    assert found.tolist() == pytest.approx([2, 2.5, 1 + 4 / 3, 1 + 2])


def test_ranks_are_the_means_over_all_orders_of_ties():
    rng = np.random.default_rng(0)
    scores = rng.integers(0, 3, (40, 5)).astype(float)
    answers = rng.random((40, 5)) < 0.4
    answers[np.arange(40), rng.integers(5, size=40)] = True
    found = compute_rank(scores, answers, np.ones((40, 5), dtype=bool))
    for row in range(40):
        ranks = []
        for order in permutations(range(5)):  # who comes first among equals
            ranked = sorted(order, key=lambda place: -scores[row, place])  # a stable sort
            ranks.append(1 + min(ranked.index(place) for place in np.flatnonzero(answers[row])))
        assert found[row] == pytest.approx(np.mean(ranks))


def test_who_has_no_opinion_gets_the_rank_of_chance(make_tiny_homes):
    """Not the first one, as when only higher scores counted."""

    class Silent(Policy):
        def scores(self, memory, queries):
            return np.zeros((len(queries.home), memory.num_furniture))

    seen = play_task(lambda homes: Silent(), make_tiny_homes(4), 12)
    # One of six places: (6 + 1) / 2. Where the same thing lies at two of them, 7 / 3.
    assert set(np.unique(seen.rank)) <= {3.5, 7 / 3, 7 / 4, 7 / 5, 7 / 6, 1.0}
    assert seen.rank.mean() > 2


def test_the_rank_of_an_answer_counts_the_places_before_it(make_tiny_homes):
    seen = play_task(lambda homes: ByPlace(), make_tiny_homes(4), 12)
    np.testing.assert_array_equal(seen.is_correct, seen.rank == 1)
    # An object at furniture p alone has rank 5 - p; the last place has no score and rank 6.
    assert set(np.unique(seen.rank)) <= set(range(1, 7))
    np.testing.assert_array_equal(seen.has_candidate, seen.rank < 6)
