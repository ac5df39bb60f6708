"""DGL in a training step, and encoders of one's own written with its modules."""

import pytest
import torch

from datamodules.batch_builder import BatchBuilder
from datamodules.feature_config import FeatureConfig
from nep.fit import main
from nep.paper.encoders import Encoder, HeteroEncoder
from nep.paper.loss import balanced_bce
from nep.paper.nep_module import NEPModule
from nep.players.policy import NEPPolicy
from sgm.policies.heuristics import Bayesian
from sgm.schema import EDGE_TYPES, NODE_TYPES
from simulator import HomeConfig, PriorGraph, SampledHomes, Streams
from simulator.snapshots.taken import take_snapshots
from simulator.tasks.predict_location import predict_locations
from simulator.tasks.rollout import Rollout

pytestmark = pytest.mark.dgl


class MeanOfNeighbours(HeteroEncoder):
    """One graph convolution per edge type; it also reads the edges and the graph's own data."""

    num_hops = 1
    uses_edges = True

    def __init__(self, units: int = 16) -> None:
        from dgl.nn import GraphConv, HeteroGraphConv

        super().__init__(units)
        self.convolution = HeteroGraphConv(
            {etype: GraphConv(units, units, allow_zero_in_degree=True) for etype in EDGE_TYPES}
        )

    def forward(self, graph, node, edge):
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
    module, builder = NEPModule(MeanOfNeighbours()).eval(), BatchBuilder(FeatureConfig(), 1)
    batch = builder.build(take_snapshots(rollout.memory, queries))
    logits = module(batch)
    assert "x" not in batch.graph.nodes["furniture"].data
    places, _ = NEPPolicy(module, builder).score_places(rollout.memory, queries)
    found = torch.from_numpy(places[places > -torch.inf]).float()
    torch.testing.assert_close(found.sort().values, logits.detach().sort().values)


def test_a_layer_of_dgl_is_an_encoder(random_batch):
    """On the homogeneous graph: every weight learns, and what no edge enters gets nothing."""
    from dgl.nn import GATConv

    class Attention(Encoder):
        num_hops, uses_edges = 1, False

        def __init__(self, units: int = 8) -> None:
            super().__init__(units)
            self.layer = GATConv(units, units // 2, 2, allow_zero_in_degree=True)

        def forward(self, graph, node, edge):
            return self.layer(graph, node).flatten(1)

    batch, module = random_batch(0), NEPModule(Attention())
    loss, _ = module.compute_loss(batch)
    loss.backward()
    assert all(part.grad.abs().sum() > 0 for part in module.predictor.encoder.parameters())
    node = torch.randn(batch.num_nodes, 8)
    encoded = module.predictor.encoder.encode(batch, node, None)
    is_entered = torch.bincount(batch.edge_dst, minlength=batch.num_nodes) > 0
    assert (encoded.abs().sum(dim=1) > 0).equal(is_entered)


def test_what_is_left_out_stays(random_batch):
    class Furniture(HeteroEncoder):
        num_hops, uses_edges = 0, False

        def forward(self, graph, node, edge):
            assert edge == {}
            return {"furniture": node["furniture"] * 2}

    graph = random_batch(0)
    node = torch.randn(graph.num_nodes, 4)
    factor = (Furniture(4).encode(graph, node, None) / node).split(graph.node_counts)
    assert [float(part.mean().round()) for part in factor] == [1, 1, 1, 2, 1]


@pytest.mark.slow
def test_a_training_step_of_heat_runs_dgl(tmp_path, monkeypatch):
    """`nep.fit --config heat.yaml`: edge softmax and both sums are DGL's."""
    import dgl

    called = []
    for module, name in ((dgl.ops, "edge_softmax"), (dgl.DGLGraph, "update_all")):
        original = getattr(module, name)

        def note(*args, original=original, name=name, **more):
            called.append(name)
            return original(*args, **more)

        monkeypatch.setattr(module, name, note)
    monkeypatch.chdir(tmp_path)
    steps = []
    training_step = NEPModule.training_step

    def count(self, batch, batch_idx):
        assert isinstance(batch.homogeneous, dgl.DGLGraph)
        called.clear()
        loss = training_step(self, batch, batch_idx)
        steps.append(list(called))
        edges = batch.edge_dst.numel(), batch.homogeneous.num_edges(), batch.graph.num_edges()
        assert len(set(edges)) == 1
        torch.testing.assert_close(
            loss, balanced_bce(self(batch), batch.query_target), rtol=0.2, atol=0.2
        )
        return loss

    monkeypatch.setattr(NEPModule, "training_step", count)
    main(
        "--config heat.yaml --data.num_homes 2 --data.steps 4 --data.num_val_homes 1 "
        "--data.batch_size 4 --trainer.max_epochs 1 --online.policies [] --online.num_homes 1 "
        "--online.steps 1 --threads 1".split()
    )
    assert steps == [["edge_softmax", "update_all", "update_all"]] * 2


def test_the_homogeneous_view_is_that_of_dgl(random_batch):
    """Of the heterogeneous graph: the same edges of the same types, which DGL numbers otherwise."""
    import dgl

    batch = random_batch(0)
    ours, theirs = batch.homogeneous, dgl.to_homogeneous(batch.graph, ndata=["degree"])
    ntype = torch.tensor([NODE_TYPES.index(name) for name in batch.graph.ntypes])
    etype = torch.tensor([EDGE_TYPES.index(name) for name in batch.graph.canonical_etypes])
    node_type = ntype[theirs.ndata[dgl.NTYPE]]
    order = torch.argsort(node_type, stable=True)  # DGL's node that each of ours is
    assert torch.equal(node_type[order], ours.ndata[dgl.NTYPE])
    assert torch.equal(theirs.ndata["degree"][order], ours.ndata["degree"])
    number = order.argsort()
    found = [number[end.long()] for end in theirs.edges()] + [etype[theirs.edata[dgl.ETYPE]]]
    want = [end.long() for end in ours.edges()] + [ours.edata[dgl.ETYPE]]
    rows, expected = (torch.stack(columns, dim=1).tolist() for columns in (found, want))
    assert sorted(rows) == sorted(expected)
