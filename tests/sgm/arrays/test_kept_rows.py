"""Rows by key, of which only so many are kept."""

import numpy as np
import pytest

from sgm.arrays.kept_rows import KeptRows


def make(most):
    """Rows of whole numbers, and what was computed."""
    computed = []

    def compute(keys):
        computed.append(list(keys))
        return np.array([[key, key * key] for key in keys])

    rows = KeptRows(most)
    return lambda keys: rows.take(keys, compute), computed, rows


def test_a_row_is_computed_once():
    take, computed, _ = make(10)
    assert [row.tolist() for row in take([2, 3, 2])] == [[2, 4], [3, 9], [2, 4]]
    assert [row.tolist() for row in take([3, 5])] == [[3, 9], [5, 25]]
    assert take([]) == []
    assert computed == [[2, 3], [5]]


@pytest.mark.parametrize("most", [1, 7, 100])
def test_no_more_are_kept_than_there_may_be(most):
    take, _, rows = make(most)
    for key in range(1000):
        assert take([key, key // 2])[0].tolist() == [key, key * key]
        assert len(rows) <= max(most, 8)


def test_what_is_asked_for_at_once_is_kept_however_much_it_is():
    take, computed, _ = make(3)
    take(range(50))
    take([*range(50), 50])
    assert computed == [list(range(50)), [50]]
