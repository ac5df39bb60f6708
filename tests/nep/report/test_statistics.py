"""Intervals, tests and what is detectable: numbers worked by hand, a plain loop, coverage."""

import numpy as np
import pytest
from scipy import stats

from nep.report.statistics import (
    average_units,
    compute_detectable,
    compute_error,
    compute_gap_closed,
    compute_interval,
    compute_p_value,
    correct_holm,
    smooth,
)


def resample_plainly(values, units, num_resamples, tail):
    """Cluster bootstrap in a loop: draw households, take all plays of each."""
    rng = np.random.default_rng(0)
    plays = [
        [v for v, own in zip(values, units, strict=True) if own == unit]
        for unit in dict.fromkeys(units)
    ]
    means = []
    for _ in range(num_resamples):
        drawn = [plays[number] for number in rng.integers(0, len(plays), len(plays))]
        means.append(np.mean([value for own in drawn for value in own]))
    return np.quantile(means, [tail, 1 - tail])


def cover(draw, num_trials, true_mean=0.0):
    """Share of the trials in which the interval of what is drawn holds the true mean."""
    hits = 0
    for _ in range(num_trials):
        low, high = compute_interval(draw(), num_resamples=1000)
        hits += low <= true_mean <= high
    return hits / num_trials


def test_plays_of_one_household_are_averaged_in_order_of_appearance():
    values = np.array([1.0, 5.0, 3.0, 0.0])
    assert average_units(values, ["b", "a", "b", "c"]).tolist() == [2.0, 5.0, 0.0]
    both = np.stack([values, values + 1])
    assert average_units(both, ["b", "a", "b", "c"]).tolist() == [[2, 5, 0], [3, 6, 1]]
    assert average_units(values, None) is values
    with pytest.raises(ValueError, match="home of each of 4 values, got 3 names"):
        average_units(values, ["a", "b", "c"])


def test_cluster_bootstrap_is_that_of_a_plain_loop():
    rng = np.random.default_rng(5)
    units = np.repeat([f"household {n}" for n in range(12)], 4)
    values = np.repeat(rng.normal(0, 1.0, 12), 4) + rng.normal(0, 0.2, 48)
    # Expanded percentiles of 12 units: sf(sqrt(12 / 11) x 2.201) = sf(2.299) = .0108, not .025.
    tail = stats.norm.sf(np.sqrt(12 / 11) * stats.t.ppf(0.975, 11))
    assert tail == pytest.approx(0.0108, abs=1e-4)
    plain = resample_plainly(values, units, 20_000, tail)
    found = compute_interval(average_units(values, units), num_resamples=20_000)
    error = compute_error(average_units(values, units))[0]
    assert found == pytest.approx(plain, abs=0.06 * error)
    alone = compute_interval(values)  # as if 48 homes had been drawn
    assert found[1] - found[0] > 1.8 * (alone[1] - alone[0])


def test_few_units_have_a_t_interval_by_hand():
    # 1, 2, 3, 6: mean 3, squares 4 + 1 + 0 + 9 = 14, s = sqrt(14 / 3), error s / 2 = 1.0801;
    # t of three degrees of freedom 3.1824: 3 -+ 3.4374.
    values = np.array([1.0, 2.0, 3.0, 6.0])
    assert compute_error(values) == pytest.approx((1.0801, 3), abs=1e-4)
    assert compute_interval(values) == pytest.approx((-0.4374, 6.4374), abs=1e-4)
    # p of t = 3 / 1.0801 = 2.7775 is .0691; detectable (3.1824 + .9785) x 1.0801 = 4.4943
    assert compute_p_value(values) == pytest.approx(0.0691, abs=1e-4)
    assert compute_detectable(values) == pytest.approx(4.4943, abs=1e-3)
    assert compute_p_value(values) == pytest.approx(stats.ttest_1samp(values, 0).pvalue)


def test_interval_of_equal_values_is_a_point():
    assert compute_interval(np.full(20, 0.3)) == pytest.approx((0.3, 0.3))
    assert (compute_p_value(np.zeros(5)), compute_p_value(np.full(5, 0.5))) == (1.0, 0.0)


def test_one_unit_tells_nothing():
    for found in (
        compute_interval(np.ones(1)),
        [compute_p_value(np.ones(1))],
        [compute_detectable(np.ones(1))],
    ):
        assert np.isnan(found).all()


def test_interval_of_many_values_is_the_standard_one():
    values = np.random.default_rng(0).normal(5.0, 2.0, 400)
    low, high = compute_interval(values)
    error = values.std() / np.sqrt(400)  # the central limit: mean -+ 1.96 standard errors
    assert low == pytest.approx(values.mean() - 1.96 * error, abs=0.1 * error)
    assert high == pytest.approx(values.mean() + 1.96 * error, abs=0.1 * error)


# Of 1,000 trials of a true coverage of .95 the standard error is .007: four of them.
@pytest.mark.slow
@pytest.mark.parametrize(("num_units", "least"), [(3, 0.92), (5, 0.92), (12, 0.92), (30, 0.92)])
def test_interval_covers_the_true_mean_of_households(num_units, least):
    """Households differ and each is played four times: their plays are no further units."""
    rng = np.random.default_rng(1)
    units = np.repeat([str(n) for n in range(num_units)], 4)

    def draw():
        return np.repeat(rng.normal(0, 1.0, num_units), 4) + rng.normal(0, 0.3, 4 * num_units)

    assert least <= cover(lambda: average_units(draw(), units), 1000) <= 0.98
    if num_units <= 5:  # what the plays would say, were they homes: far too sure
        assert cover(draw, 300) < 0.85


@pytest.mark.parametrize("spread", [0.0, 0.1, 1.0])
def test_interval_covers_the_true_mean_of_few_trainings(spread):
    """Three trainings of a network in fifty homes; trainings differ by `spread`."""
    rng = np.random.default_rng(2)

    def draw():
        effects = rng.normal(0, spread, (3, 1)) + rng.normal(0, 1.0, (1, 50))
        return effects + rng.normal(0, 0.5, (3, 50))

    assert 0.92 <= cover(draw, 1000) <= 0.99


def test_error_of_trainings_and_homes_by_hand():
    # Rows (1, 3) and (3, 9): means of trainings 2, 6, of homes 2, 6, of all 4, and what is left is
    # (1, -1, -1, 1). A = 2 x 8 = 16, B = 2 x 8 = 16, E = 4 / 1 = 4: (16 + 16 - 4) / 4 = 7, of
    # 28 ** 2 / (256 + 256 + 16) = 1.4848 degrees of freedom.
    values = np.array([[1.0, 3.0], [3.0, 9.0]])
    assert compute_error(values) == pytest.approx((np.sqrt(7), 784 / 528))
    # Without an effect of trainings the homes are all that varies: B / 4 of one degree.
    assert compute_error(np.array([[1.0, 3.0], [1.0, 3.0]])) == pytest.approx((1.0, 1))


def test_interval_of_one_training_is_that_over_homes():
    values = np.random.default_rng(3).normal(size=30)
    assert compute_interval(values) == compute_interval(values[None])
    assert compute_p_value(values) == compute_p_value(values[None])


def test_a_detectable_difference_is_found_four_times_in_five():
    rng = np.random.default_rng(4)
    true = compute_detectable(np.array([-1.0, 1.0] * 10) * np.sqrt(19 / 20))  # s = 1 of 20 homes
    found = [compute_p_value(rng.normal(true, 1.0, 20)) < 0.05 for _ in range(2000)]
    assert np.mean(found) == pytest.approx(0.8, abs=0.04)  # four standard errors


def test_holm_by_hand():
    # Sorted .01, .02, .03, .04: 4 x .01 = .04, 3 x .02 = .06, 2 x .03 = .06, then at least .06.
    assert correct_holm([0.04, 0.01, 0.03, 0.02]) == pytest.approx([0.06, 0.04, 0.06, 0.06])
    assert correct_holm([0.6, 0.7]) == [1.0, 1.0]
    corrected = correct_holm([0.02, float("nan"), 0.01])  # of two
    assert corrected[::2] == pytest.approx([0.02, 0.02])
    assert np.isnan(corrected[1])
    assert correct_holm([]) == []


def test_holm_errs_in_no_more_tables_than_it_says():
    rng = np.random.default_rng(6)
    wrong = [min(correct_holm(list(rng.uniform(size=20)))) < 0.05 for _ in range(2000)]
    assert np.mean(wrong) <= 0.05 + 4 * np.sqrt(0.05 * 0.95 / 2000)


def test_gap_closed_worked_by_hand():
    # Paper, table 1: (0.351 - 0.286) / (0.454 - 0.286) = 0.065 / 0.168 = 0.387
    assert compute_gap_closed(0.351, 0.286, 0.454) == pytest.approx(0.387, abs=5e-4)
    assert np.isnan(compute_gap_closed(0.3, 0.2, 0.2))


def test_smooth_worked_by_hand():
    # Windows of two: 1, (1 + 3) / 2, (3 + 8) / 2, (8 + 0) / 2
    assert smooth(np.array([1, 3, 8, 0]), window=2).tolist() == [1.0, 2.0, 5.5, 4.0]
    assert smooth(np.array([[1, 3], [2, 2]]), window=10).tolist() == [[1.0, 2.0], [2.0, 2.0]]
