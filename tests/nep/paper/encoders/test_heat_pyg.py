"""Our HEAT layer is PyTorch Geometric's, where that is installed (extra `bench`)."""

from pathlib import Path

import pytest
import torch
from torch import nn

from nep.paper.encoders.heat import HEATConv

pytest.importorskip("torch_geometric", reason="torch_geometric is not installed: extra bench")
BENCHMARKS = Path(__file__).resolve().parents[4] / "benchmarks"


@pytest.fixture
def beside(monkeypatch):
    """The comparison that `benchmarks/heat_conv.py` makes."""
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    import _pyg

    return _pyg


@pytest.mark.parametrize("heads", [1, 2, 4])
@pytest.mark.parametrize("root_weight", [False, True])
def test_equal_for_equal_weights(heads, root_weight, beside, random_batch):
    torch.manual_seed(heads)
    layer = HEATConv((6, 8, 5), heads, (3, 4), root_weight)
    for constant in (layer.bias, layer.node_bias):
        nn.init.normal_(constant)  # zero at first, which would hide it
    graph = random_batch(0)
    node, edge = torch.randn(graph.num_nodes, 6), torch.randn(graph.num_edges, 5)
    assert beside.compute_difference(layer, graph, node, edge) < 1e-10
    with torch.no_grad():  # the comparison sees a weight that differs
        theirs = beside.PyGLayer(layer)
        layer.message_edge[0, 0, 0] += 0.1
        got = theirs.take_shares(theirs(graph, node, edge))
        entered = graph.edge_dst.unique()
        assert (got - layer(graph.homogeneous, node, edge))[entered].abs().max() > 1e-4


def test_they_differ_where_no_edge_enters(beside, random_batch, edit_edges):
    layer = HEATConv((6, 8, 5), 1, (3, 4), False)
    nn.init.normal_(layer.bias)
    batch = edit_edges(random_batch(0), lambda etype, src, dst: dst != 0)
    node, edge = torch.randn(batch.num_nodes, 6), torch.randn(batch.num_edges, 5)
    lonely = torch.ones(batch.num_nodes, dtype=torch.bool)
    lonely[batch.edge_dst] = False
    assert lonely.sum() >= 5  # the first node of each type
    assert torch.equal(
        layer(batch.homogeneous, node, edge)[lonely], layer.bias.expand(lonely.sum(), -1)
    )
    assert not beside.PyGLayer(layer)(batch, node, edge)[lonely].any()
