"""The flat view of a batch: the same from arrays as from the DGL graph made of them."""

from dataclasses import fields, replace

import numpy as np
import pytest
import torch

from datamodules.features import FeatureConfig
from datamodules.graph import GraphBuilder
from nep.layers.flat_graph import FlatGraph
from simulator import HomeConfig, PriorGraph, SampledHomes, Streams
from simulator.policies import Bayesian
from simulator.snapshots.snapshots import take_snapshots
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
    rng = np.random.default_rng(0)
    relevance = rng.random((3, homes.num_furniture))
    return take_snapshots(
        rollout.memory, queries, answers=relevance > 0.8, extras={"relevance": relevance}
    )


@pytest.mark.parametrize("num_hops", [None, 0, 1, 2])
@pytest.mark.parametrize("has_answers", [True, False])
def test_arrays_and_dgl_graph_give_the_same(snapshots, num_hops, has_answers):
    if not has_answers:
        snapshots = replace(snapshots, answers=None, extras={})
    builder = GraphBuilder(FeatureConfig(), num_hops)
    found = FlatGraph.from_arrays(builder.build_arrays(snapshots))
    expected = FlatGraph.from_batch(builder.build(snapshots))
    assert len(found.query_edge) > 3
    assert (found.heterograph is None, expected.heterograph is None) == (True, False)
    for field in fields(FlatGraph):
        one, other = getattr(found, field.name), getattr(expected, field.name)
        if isinstance(one, torch.Tensor):
            assert one.dtype == other.dtype
            torch.testing.assert_close(one, other, rtol=0, atol=0, equal_nan=True)
        elif field.name != "heterograph":
            assert one == other


def test_query_edges_say_where_they_lead(snapshots):
    arrays = GraphBuilder(FeatureConfig(), 1).build_arrays(snapshots)
    furniture = arrays.edge_dst[arrays.query_edge] - arrays.first_node[3]
    assert arrays.furniture_index[furniture].tolist() == arrays.query_furniture.tolist()
    first = snapshots.first_furniture[arrays.query_snapshot]
    answers = snapshots.answers[first + arrays.query_furniture]
    assert arrays.query_target.tolist() == answers.astype(float).tolist()
    on_top = arrays.query_edge >= arrays.first_edge[8]  # the type object onTop furniture
    assert arrays.query_relation.tolist() == on_top.astype(int).tolist()


def test_a_graph_stays_itself_on_its_own_device(snapshots):
    graph = FlatGraph.from_arrays(GraphBuilder(FeatureConfig()).build_arrays(snapshots))
    assert graph.to(torch.device("cpu")) is graph
    moved = graph.to(torch.device("meta"))
    assert moved.edge_feature.device.type == moved.text.device.type == "meta"
    assert moved.edge_counts == graph.edge_counts
