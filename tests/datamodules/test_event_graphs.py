"""Events and batches as objects of other graph libraries."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from datamodules.batch_builder import BatchBuilder
from datamodules.event_graphs import to_temporal_data, to_tgm
from datamodules.feature_config import FeatureConfig
from datamodules.snapshot_loader import SnapshotDataset
from simulator.events import collect_events
from simulator.world.config import HomeConfig
from simulator.world.source import SampledSource
from simulator.world.streams import Streams

SOURCE = SampledSource(home=HomeConfig(furniture_per_room=3, objects_per_furniture=4))


@pytest.fixture(scope="module")
def table():
    return collect_events(SOURCE, Streams(0, "train", range(2)), 8)


def test_temporal_data_has_every_event_in_order(table):
    data = to_temporal_data(table)
    assert data.num_events == len(table.events.home)
    np.testing.assert_array_equal(data.src, table.events.thing)
    np.testing.assert_array_equal(data.dst, table.events.place)
    assert (data.t.diff() >= 0).all()
    assert data.msg.shape == (data.num_events, 4)
    np.testing.assert_array_equal(data.msg[:, 0].bool(), table.events.is_seen)
    np.testing.assert_array_equal(data.msg[:, 1], table.events.relation)
    mask = torch.from_numpy(table.split_time(0.25, 0.25)["test"])
    late = data[mask]
    assert late.t.min() == 7
    assert late.num_events == late.order.numel() == int(mask.sum())
    seen = to_temporal_data(table, sightings_alone=True)
    assert seen.num_events == int(table.events.is_seen.sum()) < data.num_events
    assert (seen.y == 1).all()


def test_tgm_reads_the_same_graph(table):
    tgm = pytest.importorskip("tgm.data", reason="tgm is not installed")
    data = to_tgm(table)
    assert isinstance(data, tgm.DGData)
    np.testing.assert_array_equal(data.edge_index[:, 0], table.events.thing)
    np.testing.assert_array_equal(data.edge_type, 2 * table.events.relation + table.events.is_seen)
    assert data.node_type.tolist() == table.nodes.kind.tolist()


@pytest.mark.dgl
def test_a_batch_is_a_hetero_graph_of_pyg(collection):
    builder = BatchBuilder(FeatureConfig())
    batch = SnapshotDataset(collection, builder).__getitems__([0, 5])
    data = batch.to_pyg()
    assert sorted(data.node_types) == sorted(batch.graph.ntypes)
    assert set(data.edge_types) == set(batch.graph.canonical_etypes)
    data.validate()
    for etype in batch.graph.canonical_etypes:
        src, dst = batch.graph.edges(etype=etype, order="eid")
        assert torch.equal(data[etype].edge_index, torch.stack([src, dst]))
        for name, values in batch.graph.edges[etype].data.items():
            assert torch.equal(data[etype][name].nan_to_num(), values.nan_to_num())
    assert torch.equal(data["object"].batch, batch.graph.nodes["object"].data["snapshot"])
    assert data["furniture"].num_nodes == batch.graph.num_nodes("furniture")
    assert torch.equal(data.text, batch.text)
