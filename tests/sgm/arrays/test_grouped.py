import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from sgm.arrays.grouped import (
    compute_rank_in_group,
    compute_starts,
    concatenate_ranges,
    number_keys,
    sum_rows,
)


def test_ranks_count_from_zero_in_every_run():
    ranks = compute_rank_in_group(np.array([2, 2, 2, 5, 7, 7]))
    assert ranks.tolist() == [0, 1, 2, 0, 0, 1]


def test_groups_start_where_the_one_before_ends():
    assert compute_starts(np.array([3, 0, 2])).tolist() == [0, 3, 3, 5]
    assert compute_starts(np.zeros(0, dtype=np.int64)).tolist() == [0]


def test_nothing_has_no_ranks_and_no_ranges():
    none = np.zeros(0, dtype=np.int64)
    assert compute_rank_in_group(none).tolist() == []
    assert concatenate_ranges(none, none).tolist() == []


def test_ranges_follow_each_other_and_may_be_empty():
    # 10, 11, 12 | nothing | 3 | 7, 8
    found = concatenate_ranges(np.array([10, 50, 3, 7]), np.array([3, 0, 1, 2]))
    assert found.tolist() == [10, 11, 12, 3, 7, 8]


@given(st.lists(st.tuples(st.integers(0, 50), st.integers(0, 6)), max_size=12))
def test_ranges_equal_a_loop(ranges):
    starts = np.array([start for start, _ in ranges], dtype=np.int64)
    counts = np.array([count for _, count in ranges], dtype=np.int64)
    expected = [start + i for start, count in ranges for i in range(count)]
    assert concatenate_ranges(starts, counts).tolist() == expected


@given(st.lists(st.integers(0, 5), max_size=30))
def test_ranks_equal_a_loop(groups):
    groups = sorted(groups)
    expected = [groups[:i].count(group) for i, group in enumerate(groups)]
    assert compute_rank_in_group(np.array(groups, dtype=np.int64)).tolist() == expected


def test_number_keys_by_hand():
    found, number = number_keys(8, np.array([5, 2, 5]), np.array([7]))
    assert found.tolist() == [2, 5, 7]
    assert number[[2, 5, 7]].tolist() == [0, 1, 2]
    assert number_keys(3, np.zeros(0, dtype=int))[0].tolist() == []


def test_sum_rows_adds_the_first_entries():
    values = np.array([[1.0, 2, 4], [8, 16, 32], [64, 128, 256]])
    assert sum_rows(values, np.array([2, 3, 0])).tolist() == [3, 56, 0]
    deeper = np.stack([values, 10 * values], axis=1)  # (3, 2, 3)
    assert sum_rows(deeper, np.array([1, 2, 3])).tolist() == [[1, 10], [24, 240], [448, 4480]]


def test_longer_rows_beside_it_do_not_change_how_a_row_is_rounded():
    rng = np.random.default_rng(0)
    row = rng.random(23)
    wide = np.zeros((2, 61))
    wide[0, :23], wide[1] = row, rng.random(61)
    assert sum_rows(wide, np.array([23, 61]))[0] == row.sum()
