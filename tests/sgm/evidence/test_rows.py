"""Sums and ranks of rows: by hand, and the same whatever stands beside them."""

import numpy as np
import pytest

from sgm.evidence.rows import add_in_order, rank_rows, share_most, sum_equal


def test_rank_counts_from_the_highest_and_equal_values_share():
    """7 is the first; both 3 are second or third, (1/2 + 1/3) / 2 = 5/12; 1 is the last."""
    values = np.array([[3.0, 7.0, 3.0, 1.0], [0.0, 0.0, 0.0, 0.0], [1.0, 2.0, 3.0, 4.0]])
    is_place = np.array([[True] * 4, [True, True, False, False], [True] * 4])
    found = rank_rows(values, is_place)
    np.testing.assert_allclose(found[0], [5 / 12, 1, 5 / 12, 1 / 4])
    np.testing.assert_allclose(found[1, :2], 3 / 4)
    np.testing.assert_allclose(found[2], [1 / 4, 1 / 3, 1 / 2, 1])
    assert rank_rows(values[:0], is_place[:0]).shape == (0, 4)


def test_the_highest_values_share():
    found = share_most(np.array([[1, 4, 4, 0], [0, 2, 1, 0]]))
    np.testing.assert_array_equal(found, [[0, 1 / 2, 1 / 2, 0], [0, 1, 0, 0]])


@pytest.mark.parametrize("function", [rank_rows, lambda values, _: share_most(values)])
def test_the_order_of_places_changes_nothing(function):
    """Nor do sums that are rounded otherwise, nor columns that are no place."""
    rng = np.random.default_rng(0)
    values = rng.integers(0, 4, (50, 9)).astype(float)
    order = rng.permutation(9)
    is_place = np.ones(values.shape, dtype=bool)
    found = function(values, is_place)
    np.testing.assert_array_equal(function(values[:, order], is_place), found[:, order])
    wider = [np.hstack([part, np.zeros((50, 5), part.dtype)]) for part in (values + 1, is_place)]
    np.testing.assert_array_equal(function(*wider)[:, :9], found)


def test_what_is_equal_but_for_rounding_is_equal():
    values = np.array([[0.1 + 0.2, 0.3, 0.1]])
    np.testing.assert_allclose(
        rank_rows(values, np.ones((1, 3), dtype=bool)), [[3 / 4, 3 / 4, 1 / 3]]
    )


def test_equal_keys_of_a_row_are_summed():
    key = np.array([[2, -1, 2, 0], [2, 2, 0, -1]])
    values = np.array([[1.0, 2.0, 4.0, 8.0], [1.0, 2.0, 4.0, 8.0]])
    np.testing.assert_array_equal(sum_equal(key, values), [[5, 2, 5, 8], [3, 3, 4, 8]])
    assert sum_equal(key[:0], values[:0]).shape == (0, 4)


def test_zeros_behind_a_row_change_no_bit_of_its_sum():
    values = np.random.default_rng(0).random((20, 37))
    longer = np.hstack([values, np.zeros((20, 100))])
    np.testing.assert_array_equal(add_in_order(values), add_in_order(longer))
    np.testing.assert_allclose(add_in_order(values)[:, 0], values.sum(axis=1))
