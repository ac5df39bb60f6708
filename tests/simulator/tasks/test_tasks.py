"""What holds for every task behind the one interface."""

from dataclasses import fields

import numpy as np
import pytest

from simulator.policies import POLICIES, make_policy
from simulator.tasks.evaluation import evaluate_policy
from simulator.tasks.metrics import METRICS
from simulator.tasks.registry import TASKS
from simulator.world.source import SampledSource
from simulator.world.streams import Streams


@pytest.fixture(params=TASKS)
def task_name(request):
    return request.param


def play(homes, policy, task, num_steps):
    """Scores (H, T) and everything that was answered."""
    game = TASKS[task](homes, make_policy(policy, homes))
    answered = []
    game.on_answer = answered.append
    return np.stack(list(game.run(num_steps)), axis=1), answered


@pytest.mark.slow
def test_a_home_is_played_the_same_whatever_is_played_beside_it(make_default_homes, task_name):
    """For every policy: results must not depend on how homes are split over workers."""
    for policy in POLICIES:
        many, _ = play(make_default_homes(4, seed=8), policy, task_name, 6)
        few, _ = play(make_default_homes(homes=[3, 0], seed=8), policy, task_name, 6)
        np.testing.assert_allclose(few, many[[3, 0]], err_msg=policy)


def test_the_same_seed_gives_the_same_scores(make_default_homes, task_name):
    first, _ = play(make_default_homes(3), "bayesian", task_name, 8)
    again, _ = play(make_default_homes(3), "bayesian", task_name, 8)
    np.testing.assert_array_equal(first, again)


@pytest.mark.parametrize("dynamic_nodes", [True, False])
def test_homes_and_queries_do_not_depend_on_the_policy(
    make_default_homes, task_name, dynamic_nodes
):
    asked = []
    for policy in ("random", "bayesian"):
        homes = make_default_homes(3, dynamic_nodes=dynamic_nodes)
        _, answered = play(homes, policy, task_name, 6)
        asked.append([part.answers for part in answered if not part.is_repeat])
    for first, second in zip(*asked, strict=True):
        np.testing.assert_array_equal(first, second)


def test_answers_are_whole_and_in_order(make_default_homes, task_name):
    _, answered = play(make_default_homes(3), "bayesian", task_name, 6)
    for part in answered:
        count = len(part.queries.home)
        assert part.answers.shape == part.scores.shape == (count, 32)
        assert (np.diff(part.queries.home) >= 0).all()
        assert part.answers.any(axis=1).all()  # what is asked for is present
        assert part.is_correct.tolist() == [
            bool(part.answers[query, part.choice[query]]) for query in range(count)
        ]


def test_a_search_is_answered_until_it_ends(make_default_homes):
    values, answered = play(make_default_homes(3), "bayesian", "find_object", 10)
    # Every look of every home is one answer; the last one of a search is right, no other one.
    assert sum(len(part.queries.home) for part in answered) == values.sum()
    assert sum(part.is_correct.sum() for part in answered) == values.size
    assert [part.is_repeat for part in answered].count(False) == 10
    first = [part for part in answered if not part.is_repeat]
    np.testing.assert_array_equal(
        np.stack([part.is_correct for part in first], axis=1), values == 1
    )


def test_scores_of_an_evaluation_fit_together(default_prior, task_name):
    ticks = []
    scores = evaluate_policy(
        POLICIES["bayesian"].make,
        SampledSource(default_prior),
        Streams(2, "val", range(3)),
        10,
        on_step=lambda: ticks.append(1),
        task=task_name,
    )
    assert len(ticks) == 10
    assert scores.values.shape == (3, 10)
    num_answers = 50 if task_name == "relative_likelihood" else 10
    for field in fields(scores):
        if field.name != "values":
            assert getattr(scores, field.name).shape == (3, num_answers), field.name
    assert (scores.confidence <= 1 + 1e-12).all()
    assert (scores.likelihood <= 1 + 1e-12).all()
    if task_name == "predict_location":
        np.testing.assert_array_equal(scores.values, scores.is_correct)
    if task_name == "find_object":
        np.testing.assert_array_equal(scores.values == 1, scores.is_correct)
        assert 1 <= scores.values.min() <= scores.values.max() <= 32


def test_myopic_is_never_right_about_what_is_away(default_prior):
    """Where the object was last seen is the one place that it is not at."""
    scores = evaluate_policy(
        POLICIES["myopic"].make, SampledSource(default_prior), Streams(1, "val", range(5)), 40
    )
    assert scores.is_away.sum() > 20
    assert METRICS["away_accuracy"].compute(scores) == 0


def test_an_unknown_task_is_refused(default_prior):
    with pytest.raises(
        ValueError, match=r"predict_location, relative_likelihood, find_object, got"
    ):
        evaluate_policy(
            POLICIES["random"].make,
            SampledSource(default_prior),
            Streams(0, "val", [0]),
            1,
            task="dance",
        )
