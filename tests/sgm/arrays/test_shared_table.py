"""Tables that share their rows: what is added to one is not in the other."""

import numpy as np
import pytest

from sgm.arrays.table import Table


@pytest.mark.parametrize("num_rows", [3, 16, 40])
def test_rows_added_to_a_shared_table_are_its_own(num_rows):
    table = Table({"a": np.int32, "b": np.int32, "c": np.float64}, {"b": -1})
    table.append(num_rows, a=np.arange(num_rows))
    shared = table.share()
    assert np.shares_memory(shared["a"], table["a"])
    table.append(2, a=7, c=0.5)
    shared.append(1, a=8)
    more = shared.copy()
    more.append(3)
    for own, expected in ((table, [7, 7]), (shared, [8]), (more, [8, 0, 0, 0])):
        assert own["a"].tolist() == [*range(num_rows), *expected]
        assert own["b"].tolist() == [-1] * own.num_rows
    assert shared["c"].tolist() == [0.0] * (num_rows + 1)
    assert more["c"].tolist() == [0.0] * (num_rows + 4)
    assert table["c"].tolist() == [0.0] * num_rows + [0.5, 0.5]
