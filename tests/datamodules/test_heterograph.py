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
        ours = make_heterograph(edges, num_nodes)
        theirs = dgl.heterograph(edges, num_nodes_dict=num_nodes)
        assert ours.ntypes == theirs.ntypes
        assert ours.canonical_etypes == theirs.canonical_etypes
        assert ours.formats() == theirs.formats()
        assert ours.idtype == theirs.idtype
        for ntype in NODE_TYPES:
            assert ours.num_nodes(ntype) == theirs.num_nodes(ntype)
        for etype in EDGE_TYPES:
            for mine, other in zip(ours.edges(etype=etype), theirs.edges(etype=etype), strict=True):
                assert torch.equal(mine, other)
            assert torch.equal(ours.in_degrees(etype=etype), theirs.in_degrees(etype=etype))
