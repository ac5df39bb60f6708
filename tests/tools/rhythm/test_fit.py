"""The weights of what similar moments say are fitted to answers, and measured on others."""

import numpy as np
import pytest

from sgm.policies.rhythm import TERMS, RhythmTerms
from tools.rhythm.fit import Problem, Quality, fit_weights

NUM_TERMS = len(TERMS)


def draw_problem(weights, num_questions, seed):
    """Questions of three answers, the thing seen last at one, and moved as the weights say."""
    rng = np.random.default_rng(seed)
    believed = rng.dirichlet(np.ones(3), num_questions)
    last = rng.integers(0, 3, num_questions)
    others = believed.copy()
    others[np.arange(num_questions), last] = 0
    terms = RhythmTerms(
        last,
        rng.normal(size=(num_questions, NUM_TERMS)),
        others / others.sum(axis=1, keepdims=True),
        np.zeros(believed.shape),
        np.zeros(num_questions),
    )
    problem = Problem(terms, believed, last, np.zeros(num_questions, dtype=bool))
    likely = problem.weigh(weights)
    answer = (rng.random(num_questions)[:, None] > likely.cumsum(axis=1)).sum(axis=1)
    return problem._replace(answer=answer, has_moved=answer != last)


def test_a_fit_finds_the_weights_that_answers_were_drawn_by():
    """But for the bias of what had moved, which counts more: no term here is constant."""
    weights = np.linspace(-1, 1, NUM_TERMS)
    found = fit_weights(draw_problem(weights, 6000, seed=0))
    assert np.abs(found - weights).max() < 0.2
    apart = draw_problem(weights, 2000, seed=1)
    alone, fitted = (Quality.of(apart, apart.weigh(each)) for each in (0 * weights, found))
    assert fitted.nats < alone.nats - 0.1
    assert fitted.right > alone.right


def test_weights_of_zero_are_the_policy():
    problem = draw_problem(np.ones(NUM_TERMS), 50, seed=2)
    assert problem.weigh(np.zeros(NUM_TERMS)) == pytest.approx(problem.believed)


def test_quality_by_hand():
    """Two questions: .75 for what is right, and .25 for what is right and had moved."""
    problem = draw_problem(np.zeros(NUM_TERMS), 2, seed=0)._replace(
        answer=np.array([0, 1]), has_moved=np.array([False, True])
    )
    said = np.array([[0.75, 0.25, 0.0], [0.75, 0.25, 0.0]])
    right, nats, right_moved, nats_moved = Quality.of(problem, said)
    assert (right, right_moved) == (0.5, 0.0)
    assert nats == pytest.approx(-(np.log(0.75) + np.log(0.25)) / 2)
    assert nats_moved == pytest.approx(-np.log(0.25))
