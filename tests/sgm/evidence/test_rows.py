"""Sums and ranks of rows: by hand, and the same whatever stands beside them."""

import numpy as np

from sgm.evidence.rows import add_in_order, rank_rows, sum_equal


def test_rank_counts_from_the_highest():
    found = rank_rows(np.array([[3.0, 7.0, 3.0, 1.0]]))
    np.testing.assert_allclose(found, [[1 / 2, 1, 1 / 3, 1 / 4]])


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
