"""Bootstrap intervals, gap closed, smoothing: numbers worked by hand."""

import numpy as np
import pytest

from nep.report.statistics import compute_bootstrap_interval, compute_gap_closed, smooth


def test_interval_of_equal_values_is_a_point():
    assert compute_bootstrap_interval(np.full(20, 0.3)) == pytest.approx((0.3, 0.3))


def test_interval_of_normal_values_is_the_standard_one():
    values = np.random.default_rng(0).normal(5.0, 2.0, 400)
    low, high = compute_bootstrap_interval(values)
    error = values.std() / np.sqrt(400)  # the central limit: mean -+ 1.96 standard errors
    assert low == pytest.approx(values.mean() - 1.96 * error, abs=0.1 * error)
    assert high == pytest.approx(values.mean() + 1.96 * error, abs=0.1 * error)


def test_interval_covers_the_true_mean_about_as_often_as_it_says():
    rng = np.random.default_rng(1)
    hits = 0
    for _ in range(200):
        low, high = compute_bootstrap_interval(rng.exponential(1.0, 60), num_resamples=1000)
        hits += low <= 1.0 <= high
    assert 0.88 <= hits / 200 <= 0.99


def test_interval_of_trainings_and_homes_is_that_of_both():
    # Effects of 40 trainings and of 50 homes add up: the variance of the mean is that of the means
    # over homes and of the means over trainings, together.
    rng = np.random.default_rng(2)
    trainings, homes = rng.normal(0, 1.0, (40, 1)), rng.normal(0, 2.0, (1, 50))
    low, high = compute_bootstrap_interval(trainings + homes, num_resamples=4000)
    error = np.sqrt(trainings.var() / 40 + homes.var() / 50)
    mean = trainings.mean() + homes.mean()
    assert low == pytest.approx(mean - 1.96 * error, abs=0.15 * error)
    assert high == pytest.approx(mean + 1.96 * error, abs=0.15 * error)


def test_interval_of_one_training_is_that_over_homes():
    values = np.random.default_rng(3).normal(size=30)
    both = compute_bootstrap_interval(values), compute_bootstrap_interval(values[None])
    assert both[0] == pytest.approx(both[1], abs=0.02)


def test_gap_closed_worked_by_hand():
    # Paper, table 1: (0.351 - 0.286) / (0.454 - 0.286) = 0.065 / 0.168 = 0.387
    assert compute_gap_closed(0.351, 0.286, 0.454) == pytest.approx(0.387, abs=5e-4)
    assert np.isnan(compute_gap_closed(0.3, 0.2, 0.2))


def test_smooth_worked_by_hand():
    # Windows of two: 1, (1 + 3) / 2, (3 + 8) / 2, (8 + 0) / 2
    assert smooth(np.array([1, 3, 8, 0]), window=2).tolist() == [1.0, 2.0, 5.5, 4.0]
    assert smooth(np.array([[1, 3], [2, 2]]), window=10).tolist() == [[1.0, 2.0], [2.0, 2.0]]
