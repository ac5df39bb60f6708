"""What `FEATURES` declares is what batches, networks, collections and the docs have."""

from dataclasses import replace
from pathlib import Path

import pytest

from datamodules import feature_config
from datamodules.batch_builder import BatchBuilder
from datamodules.feature_config import (
    EDGE_FEATURE_DIM,
    FEATURES,
    NODE_FEATURE_DIM,
    PAPER_GROUPS,
    FeatureConfig,
    check_groups,
    count_columns,
    list_columns,
    list_recorded,
)
from datamodules.paper_features import TABLES, Feature
from datamodules.sgm_datamodule import SGMDataModule
from datamodules.snapshot_loader import SnapshotDataset
from nep.paper.encoders import MLP
from nep.paper.nep_module import NEPModule

ROOT = Path(__file__).resolve().parents[2]


def test_columns_of_the_paper_come_first_and_others_where_they_are_on():
    assert (NODE_FEATURE_DIM, EDGE_FEATURE_DIM) == (4, 9)
    assert count_columns("edge", ["belief"]) == 9 + 5
    assert count_columns("edge", ["clock", "belief"]) == 9 + 5 + 8
    for table in TABLES:
        columns = list_columns(table, ["belief", "clock", "evidence"])
        starts = [rows.start for _, rows in columns]
        assert starts == [0, *(rows.stop for _, rows in columns[:-1])][: len(columns)]
        extra = [feature.group not in PAPER_GROUPS for feature, _ in columns]
        assert extra == sorted(extra)


def test_switches_say_what_is_recorded_and_read():
    assert list_recorded(FeatureConfig()) == []
    config = FeatureConfig(belief=True, evidence=True, clock=True, prior=False)
    assert list_recorded(config) == ["belief", "evidence"]
    assert config.extra_groups == ("belief", "clock", "evidence")
    assert "prior" not in config.groups
    data = SGMDataModule(num_homes=1, features=replace(config, clock=False))
    train, val = data.train_config, data.val_config
    assert train.belief
    assert val.evidence
    assert not train.relevance


def test_a_group_that_there_is_not_is_named():
    with pytest.raises(ValueError, match="must be some of belief, clock, evidence, got 'smell'"):
        NEPModule(MLP(units=4), reads=["smell"])
    with pytest.raises(ValueError, match="got 'temporal'"):  # the paper's need no name
        check_groups(["temporal"])


class OffConfig(FeatureConfig):
    own = False


class OwnConfig(FeatureConfig):
    own = True


@pytest.fixture
def own_features(monkeypatch):
    """Each number its own: of furniture, edges of objects and query edges."""

    def count_rows(nodes):
        return nodes.rows + 1

    def count_places(edges):
        return edges["furniture"] + 1

    added = (
        Feature("one", "own", "furniture", count_rows),
        Feature("two", "own", "object edge", count_places),
        Feature("three", "own", "query edge", lambda edges: -count_places(edges)),
    )
    monkeypatch.setattr(feature_config, "FEATURES", (*added, *FEATURES))
    monkeypatch.setattr(feature_config, "_GROUPS", ("own", *feature_config._GROUPS))
    return OwnConfig()


def test_an_entry_is_all_that_a_feature_takes(own_features, collection):
    """It is computed for the rows that it is of, zero elsewhere, and a network reads it."""
    batch = SnapshotDataset(collection, BatchBuilder(own_features)).__getitems__(range(6))
    plain = SnapshotDataset(collection, BatchBuilder(OffConfig())).__getitems__(range(6))
    assert batch.node_feature[:, :4].equal(plain.node_feature)
    assert batch.edge_feature[:, :9].equal(plain.edge_feature)
    one = batch.node_feature[:, 4]
    assert one[batch.furniture].tolist() == list(range(1, batch.node_counts[3] + 1))
    assert not one[: batch.furniture.start].any()
    assert not one[batch.furniture.stop :].any()
    two, three = batch.edge_feature[:, 9:].unbind(dim=1)
    first_joined = sum(batch.edge_counts[:6])
    assert not two[:first_joined].any()
    assert (two[first_joined:] > 0).all()
    place = batch.edge_dst[batch.query_edge] - batch.furniture.start + 1
    assert three[batch.query_edge].equal(-place.float())
    assert int((three != 0).sum()) == len(batch.query_edge)

    module = NEPModule(MLP(units=32), transformer=False, reads=["own"])
    logits = module(batch)
    logits.sum().backward()
    node, edge = module.predictor.node_embedding.first, module.predictor.edge_embedding.first
    assert (node.in_features, edge.in_features) == (96 + 5 + 4 + 1, 9 + 2 + 4)
    assert node.weight.grad[:, -1].any()
    assert edge.weight.grad[:, 9].any()
    assert edge.weight.grad[:, 10].any()


def test_without_convolutions_others_are_left_out_if_no_feature_reads_them():
    assert not BatchBuilder(FeatureConfig(), 0).reads_asked_alone
    assert BatchBuilder(FeatureConfig(temporal=False), 0).reads_asked_alone
    assert not BatchBuilder(FeatureConfig(temporal=False), 1).reads_asked_alone
