"""Query edges of several snapshots share the rows of a table and attend to their own alone."""

import pytest
import torch

from nep.paper.query_attention import QueryPadding


def test_rows_are_shared_by_hand():
    # 3, 1, 0 and 2 query edges, six in all: one row of six slots. The largest snapshot comes first:
    # snapshot 0 gets slots 0 to 2, snapshot 3 slots 3 and 4, snapshot 1 slot 5.
    padding = QueryPadding.from_snapshots(torch.tensor([3, 0, 1, 0, 3, 0]), 4)
    assert padding.slot.tolist() == [3, 0, 5, 1, 4, 2]
    assert padding.source.tolist() == [1, 3, 5, 0, 4, 2]
    owner = torch.tensor([0, 0, 0, 3, 3, 1])
    is_open = padding.bias == 0
    assert padding.bias.shape == (1, 6, 6)
    assert torch.equal(is_open[0], owner.unsqueeze(1) == owner)
    assert (padding.bias[~is_open] == -torch.inf).all()


@pytest.mark.parametrize("most", [1, 7, 20, 32, 45])
def test_each_query_edge_has_a_slot_and_sees_its_snapshot_alone(most):
    generator = torch.Generator().manual_seed(most)
    counts = torch.randint(most + 1, (60,), generator=generator)
    counts[:2] = torch.tensor([most, 0])
    snapshot = torch.repeat_interleave(counts)
    snapshot = snapshot[torch.randperm(len(snapshot), generator=generator)]
    padding = QueryPadding.from_snapshots(snapshot, 60)
    num_rows, num_slots, _ = padding.bias.shape
    assert num_slots == max(most, min(32, len(snapshot)))
    assert len(padding.slot.unique()) == len(snapshot)
    assert torch.equal(padding.source[padding.slot], torch.arange(len(snapshot)))
    # Two rows that are half empty would be one, unless the snapshots are longer than half a row.
    assert num_rows <= 2 * len(snapshot) / num_slots + 1

    row, column = padding.slot // num_slots, padding.slot % num_slots
    is_same = snapshot.unsqueeze(1) == snapshot
    is_open = padding.bias[row.unsqueeze(1), column.unsqueeze(1), column] == 0
    is_open &= row.unsqueeze(1) == row
    assert torch.equal(is_open, is_same)
    # Nobody attends to padding, and every slot of padding attends to something.
    is_filled = torch.zeros(num_rows * num_slots, dtype=torch.bool)
    is_filled[padding.slot] = True
    seen = (padding.bias == 0) & ~is_filled.view(num_rows, 1, num_slots)
    assert not seen[row, column].any()
    assert (padding.bias == 0).any(dim=2).all()
