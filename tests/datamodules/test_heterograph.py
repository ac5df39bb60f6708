"""The fast way to a heterogeneous graph gives what `dgl.heterograph` gives."""

import dgl
import numpy as np
import torch

from datamodules.batch import EDGE_TYPES, NODE_TYPES
from datamodules.heterograph import make_heterograph


def test_equal_to_dgl_with_and_without_edges():
    rng = np.random.default_rng(0)
    for seed in range(5):
        num_nodes = {ntype: int(rng.integers(1, 20)) for ntype in NODE_TYPES}
        edges = {}
        for src, name, dst in EDGE_TYPES:
            count = rng.integers(0, 30) if seed else 0
            ends = [rng.integers(0, num_nodes[ntype], count) for ntype in (src, dst)]
            edges[src, name, dst] = tuple(map(torch.from_numpy, ends))
        node_data = {
            ntype: {"label": torch.arange(count), "temporal": torch.rand(count, 4)}
            for ntype, count in num_nodes.items()
        }
        edge_data = {
            etype: {"feature": torch.rand(len(ends[0]), 9)} for etype, ends in edges.items()
        }
        ours = make_heterograph(edges, num_nodes, node_data, edge_data)
        theirs = dgl.heterograph(edges, num_nodes_dict=num_nodes)
        for ntype, columns in node_data.items():
            theirs.nodes[ntype].data.update(columns)
        for etype, columns in edge_data.items():
            theirs.edges[etype].data.update(columns)
        assert ours.ntypes == theirs.ntypes
        assert ours.canonical_etypes == theirs.canonical_etypes
        assert ours.formats() == theirs.formats()
        assert ours.idtype == theirs.idtype
        for ntype in NODE_TYPES:
            assert ours.num_nodes(ntype) == theirs.num_nodes(ntype)
            assert dict(ours.nodes[ntype].data).keys() == {"label", "temporal"}
            for name, column in theirs.nodes[ntype].data.items():
                assert torch.equal(ours.nodes[ntype].data[name], column)
        for etype in EDGE_TYPES:
            for mine, other in zip(ours.edges(etype=etype), theirs.edges(etype=etype), strict=True):
                assert torch.equal(mine, other)
            assert torch.equal(ours.in_degrees(etype=etype), theirs.in_degrees(etype=etype))
            features = (graph.edges[etype].data["feature"] for graph in (ours, theirs))
            assert torch.equal(*features)
