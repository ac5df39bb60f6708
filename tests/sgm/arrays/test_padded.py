import numpy as np

from sgm.arrays.padded import sum_rows


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
