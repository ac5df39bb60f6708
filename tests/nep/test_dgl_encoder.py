"""Encoders written with DGL: equal to ours for equal weights, and clear where DGL cannot go."""

import subprocess
import sys

import pytest
import torch

from datamodules.features import FeatureConfig
from datamodules.graph import GraphBuilder
from nep.encoders import DGLHGT, HGT, DGLEncoder
from nep.model.module import NEPModule
from nep.model.node_edge_predictor import NodeEdgePredictor
from nep.players.policy import NEPPolicy
from sgm.policies.heuristics import Bayesian
from sgm.schema import EDGE_TYPES, NODE_TYPES
from simulator import HomeConfig, PriorGraph, SampledHomes, Streams
from simulator.snapshots.taken import take_snapshots
from simulator.tasks.predict_location import predict_locations
from simulator.tasks.rollout import Rollout

pytestmark = pytest.mark.dgl


def copy_weights(ours, theirs, graph):
    """DGL numbers the types in its own order, and keeps the weights of each head apart."""
    ntypes = [NODE_TYPES.index(ntype) for ntype in graph.ntypes]
    etypes = [EDGE_TYPES.index(etype) for etype in graph.canonical_etypes]
    with torch.no_grad():
        for one, other in zip(ours.convolutions, theirs.convolutions, strict=True):
            for name, weight in (
                ("linear_k", one.key),
                ("linear_q", one.query),
                ("linear_v", one.value),
                ("linear_a", one.output),
            ):
                getattr(other, name).W.copy_(weight[ntypes])
            other.skip.copy_(one.skip[ntypes])
            for head in range(one.heads):
                other.relation_pri[head].copy_(one.importance[etypes, head])
                other.relation_att[head].W.copy_(one.attend[etypes, head])
                other.relation_msg[head].W.copy_(one.message[etypes, head])


@pytest.mark.parametrize("num_convolutions", [1, 2])
def test_dgl_hgt_equals_ours(random_batch, num_convolutions):
    torch.manual_seed(0)
    batch = random_batch(0)
    ours, theirs = (make(16, 4, num_convolutions) for make in (HGT, DGLHGT))
    with torch.no_grad():
        for convolution in ours.convolutions:
            convolution.importance.uniform_(0.5, 2)
            convolution.skip.normal_()
    copy_weights(ours, theirs, batch.graph)
    node = torch.randn(batch.num_nodes, 16)
    found, expected = theirs(batch, node, None), ours(batch, node, None)
    assert (expected - node).abs().max() > 0.1
    torch.testing.assert_close(found, expected, rtol=1e-5, atol=1e-5)


class MeanOfNeighbours(DGLEncoder):
    """One graph convolution per edge type; it also reads the edges and the graph's own data."""

    num_hops = 1
    uses_edges = True

    def __init__(self, units: int = 16) -> None:
        from dgl.nn import GraphConv, HeteroGraphConv

        super().__init__(units)
        self.convolution = HeteroGraphConv(
            {etype: GraphConv(units, units, allow_zero_in_degree=True) for etype in EDGE_TYPES}
        )

    def forward_graph(self, graph, node, edge):
        """Sum over edge types; furniture gets the mean of its snapshot, too."""
        import dgl

        assert edge.keys() == set(EDGE_TYPES)
        graph.nodes["furniture"].data["x"] = node["furniture"]
        mean = dgl.mean_nodes(graph, "x", ntype="furniture")
        encoded = self.convolution(graph, node)
        own = graph.nodes["furniture"].data["snapshot"]
        return {**encoded, "furniture": encoded["furniture"] + mean[own]}


def test_an_encoder_of_dgl_modules_plays_as_it_trains():
    """The online path gives the logits of the batch, and nothing stays on the graph."""
    torch.manual_seed(0)
    homes = SampledHomes(PriorGraph.default(), HomeConfig(), Streams(0, "val", range(2)))
    rollout = Rollout(homes, Bayesian())
    for _ in predict_locations(rollout, 6):
        pass
    _, queries = rollout.ask()
    module, builder = NEPModule(MeanOfNeighbours()).eval(), GraphBuilder(FeatureConfig(), 1)
    batch = builder.build(take_snapshots(rollout.memory, queries))
    logits = module(batch)
    assert "x" not in batch.graph.nodes["furniture"].data
    places, _ = NEPPolicy(module, builder).score_places(rollout.memory, queries)
    found = torch.from_numpy(places[places > -torch.inf]).float()
    torch.testing.assert_close(found.sort().values, logits.detach().sort().values)


def test_what_is_left_out_stays(random_batch):
    class Furniture(DGLEncoder):
        num_hops, uses_edges = 0, False

        def forward_graph(self, graph, node, edge):
            assert edge == {}
            return {"furniture": node["furniture"] * 2}

    graph = random_batch(0)
    node = torch.randn(graph.num_nodes, 4)
    factor = (Furniture(4)(graph, node, None) / node).split(graph.node_counts)
    assert [float(part.mean().round()) for part in factor] == [1, 1, 1, 2, 1]


def test_where_dgl_does_not_go_is_named(random_batch):
    batch = random_batch(0).to(torch.device("meta"))
    with pytest.raises(ValueError, match=r"must be one that DGL was built for, got meta\. Install"):
        NodeEdgePredictor(DGLHGT(16)).to("meta")(batch)


def test_bad_heads_are_named():
    with pytest.raises(ValueError, match="heads of DGLHGT must divide its units, got 3 heads"):
        DGLHGT(16, 3)


def test_without_dgl_its_encoders_say_what_to_do(monkeypatch):
    monkeypatch.setitem(sys.modules, "dgl", None)
    for encoder in (DGLHGT, MeanOfNeighbours):
        with pytest.raises(ModuleNotFoundError, match=f"{encoder.__name__} must have DGL, got"):
            encoder(16)


@pytest.mark.slow
def test_training_imports_no_dgl():
    code = "import sys, nep.fit, nep.encoders; sys.exit('dgl' in sys.modules)"
    assert not subprocess.run([sys.executable, "-c", code]).returncode
