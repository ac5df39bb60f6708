"""The columns that a policy's answers leave, and every metric of them, by hand."""

import numpy as np
import pytest

from simulator.policies import Policy
from simulator.tasks.evaluation import play_task
from simulator.tasks.metrics import METRICS, STEP_METRICS
from simulator.tasks.registry import TASKS
from simulator.tasks.scores import TaskScores, compute_away, compute_hours


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
        "calibration_error", "nll"
    }  # fmt: skip


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


def test_the_rank_of_an_answer_counts_the_places_before_it(make_tiny_homes):
    seen = play_task(lambda homes: ByPlace(), make_tiny_homes(4), 12)
    np.testing.assert_array_equal(seen.is_correct, seen.rank == 1)
    # An object at furniture p alone has rank 5 - p; the last place has no score and rank 6.
    assert set(np.unique(seen.rank)) <= set(range(1, 7))
    np.testing.assert_array_equal(seen.has_candidate, seen.rank < 6)
