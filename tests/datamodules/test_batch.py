"""A batch and its DGL graph say the same; the graph is made when it is asked for."""

import sys
from dataclasses import fields, replace

import pytest
import torch

from datamodules.batch import Batch
from datamodules.batch_builder import BatchBuilder
from datamodules.edited_graph import read_batch
from datamodules.feature_config import FeatureConfig
from sgm.policies.heuristics import Bayesian
from sgm.schema import EDGE_TYPES, NODE_TYPES
from simulator import HomeConfig, PriorGraph, SampledHomes, Streams
from simulator.snapshots.taken import take_snapshots
from simulator.tasks.predict_location import predict_locations
from simulator.tasks.rollout import Rollout


@pytest.fixture(scope="module")
def snapshots():
    """Three homes after twelve looks, with answers and relevance."""
    config = HomeConfig(furniture_per_room=4)
    homes = SampledHomes(PriorGraph.default(), config, Streams(0, "val", range(3)))
    rollout = Rollout(homes, Bayesian())
    for _ in predict_locations(rollout, 12):
        pass
    _, queries = rollout.ask()
    relevance = torch.rand(3, homes.num_furniture, generator=torch.manual_seed(0)).numpy()
    return take_snapshots(
        rollout.memory, queries, answers=relevance > 0.8, extras={"relevance": relevance}
    )


@pytest.mark.parametrize("library", [pytest.param("dgl", marks=pytest.mark.dgl), "pyg"])
@pytest.mark.parametrize("num_hops", [None, 0, 1, 2])
@pytest.mark.parametrize("has_answers", [True, False])
def test_a_batch_is_read_back_from_its_graph(snapshots, num_hops, has_answers, library):
    if not has_answers:
        snapshots = replace(snapshots, answers=None, extras={})
    batch = BatchBuilder(FeatureConfig(), num_hops).build(snapshots)
    graph = batch.graph if library == "dgl" else batch.to_pyg()
    again = read_batch(graph, batch.text, batch.num_snapshots)
    assert (again.__dict__.get("graph") is graph) == (library == "dgl")
    assert len(batch.query_edge) > 3
    for field in fields(Batch):
        one, other = getattr(batch, field.name), getattr(again, field.name)
        if isinstance(one, torch.Tensor):
            assert one.dtype == other.dtype
            torch.testing.assert_close(one, other, rtol=0, atol=0, equal_nan=True)
        else:
            assert one == other


def test_without_dgl_the_graph_says_what_to_do(snapshots, monkeypatch):
    monkeypatch.setitem(sys.modules, "dgl", None)
    batch = BatchBuilder(FeatureConfig()).build(snapshots)
    with pytest.raises(ModuleNotFoundError, match=r"batch\.graph must have DGL.*batch\.to_pyg\(\)"):
        batch.graph  # noqa: B018
    assert batch.to_pyg()["object"].num_nodes == batch.node_counts[-1]


def test_the_graph_has_every_edge_of_the_arrays(snapshots):
    """Type by type, ids and data, against a loop over the flat arrays."""
    batch = BatchBuilder(FeatureConfig(), 1).build(snapshots)
    graph = batch.to_pyg()
    starts = torch.tensor([0, *batch.node_counts[:-1]]).cumsum(0)
    first_node = dict(zip(NODE_TYPES, starts, strict=True))
    first = 0
    for (src, name, dst), count in zip(EDGE_TYPES, batch.edge_counts, strict=True):
        edges = slice(first, first + count)
        ends = graph[src, name, dst].edge_index
        assert (ends[0] + first_node[src]).equal(batch.edge_src[edges])
        assert (ends[1] + first_node[dst]).equal(batch.edge_dst[edges])
        feature = graph[src, name, dst].feature
        assert feature.equal(batch.edge_feature[edges])
        first += count
    assert first == batch.num_edges


def test_query_edges_say_where_they_lead(snapshots):
    batch = BatchBuilder(FeatureConfig(), 1).build(snapshots)
    furniture = batch.edge_dst[batch.query_edge] - batch.furniture.start
    assert batch.furniture_index[furniture].equal(batch.query_furniture)
    first = snapshots.find_first("furniture")[batch.query_snapshot]
    answers = snapshots.answers[first + batch.query_furniture.numpy()]
    assert batch.query_target.tolist() == answers.astype(float).tolist()
    on_top = batch.query_edge >= sum(batch.edge_counts[:8])  # the type object onTop furniture
    assert batch.query_relation.equal(on_top.long())
    assert 0 < on_top.sum() < len(on_top)


@pytest.mark.dgl
def test_a_graph_is_made_when_it_is_asked_for(snapshots, monkeypatch):
    import dgl

    made = []
    heterograph = dgl.heterograph
    monkeypatch.setattr(
        dgl, "heterograph", lambda *args, **kwargs: made.append(1) or heterograph(*args, **kwargs)
    )
    batch = BatchBuilder(FeatureConfig()).build(snapshots)
    assert not made
    assert batch.graph is batch.graph
    assert len(made) == 1


def test_a_batch_stays_itself_on_its_own_device(snapshots):
    batch = BatchBuilder(FeatureConfig()).build(snapshots)
    assert batch.to(torch.device("cpu")) is batch
    assert batch.to(torch.device("cpu"), torch.float64).degrees.dtype == torch.float64
    moved = batch.to(torch.device("meta"))
    assert moved.edge_feature.device.type == moved.text.device.type == "meta"
    assert moved.edge_counts == batch.edge_counts


@pytest.mark.dgl
def test_a_graph_that_was_made_stays_where_it_is(snapshots):
    batch = BatchBuilder(FeatureConfig()).build(snapshots)
    graph = batch.graph
    assert batch.to(torch.device("meta")).graph is graph
