"""The batched graph: features worked by hand, structure, pruning, switches."""

import dataclasses

import numpy as np
import pytest
import torch

from datamodules.batch_builder import BatchBuilder
from datamodules.feature_config import NODE_FEATURE_DIM, TEXT_DIM, FeatureConfig
from datamodules.snapshot_loader import SnapshotDataset
from sgm.schema import EDGE_TYPES, NODE_TYPES, QUERY_EDGE_TYPES

ON_TOP = ("object", "onTop", "furniture")
INSIDE = ("object", "in", "furniture")


@pytest.fixture(scope="module")
def builder() -> BatchBuilder:
    return BatchBuilder(FeatureConfig())


def test_schema_is_complete_and_counts_are_right(builder, hand_written):
    graph = builder.build(hand_written).to_pyg()
    assert set(graph.edge_types) == set(EDGE_TYPES)
    assert [graph[ntype].num_nodes for ntype in NODE_TYPES] == [1, 1, 1, 2, 2]
    # One remembered edge (mug on table), two hypothetical (apple on table, apple in fridge).
    assert {etype: graph[etype].num_edges for etype in EDGE_TYPES} == {
        ("house", "contains", "floor"): 1,
        ("floor", "in", "house"): 1,
        ("floor", "contains", "room"): 1,
        ("room", "in", "floor"): 1,
        ("room", "contains", "furniture"): 2,
        ("furniture", "in", "room"): 2,
        ("furniture", "contains", "object"): 1,
        INSIDE: 1,
        ON_TOP: 2,
        ("furniture", "under", "object"): 2,
    }


def test_node_features_worked_by_hand(builder, hand_written):
    nodes = builder.build(hand_written).to_pyg()
    # Node scale 200 / (100 * 10) = 0.2. Table: 10 - 8 = 2 steps since, 3 looks -> 0.4, 0.6.
    # Fridge: never looked at, 10 steps since the start -> 2.0, 0.
    torch.testing.assert_close(
        nodes["furniture"]["temporal"], torch.tensor([[0.4, 0.6, 0, 0], [2.0, 0, 0, 0]])
    )
    # Mug: 10 - 6 = 4 steps, seen twice, never seen to move -> 10 steps; moved 0 of 1.
    # Apple: never seen.
    torch.testing.assert_close(
        nodes["object"]["temporal"], torch.tensor([[0.8, 0.4, 2.0, 0.0], [2.0, 0, 2.0, 0]])
    )
    assert nodes["object"]["label"].tolist() == [5, 6]
    # In-degrees: mug 1 (under table), apple 2; table: room, mug, apple; fridge: room, apple.
    assert nodes["object"]["degree"].tolist() == [1, 2]
    assert nodes["furniture"]["degree"].tolist() == [3, 2]
    assert nodes["room"]["degree"].tolist() == [3]  # floor and two furniture nodes


def test_edge_features_worked_by_hand(builder, hand_written):
    batch = builder.build(hand_written)
    text = batch.text / batch.text.norm(dim=1, keepdim=True)
    data = batch.to_pyg()[ON_TOP]
    # Edge scale 500 / (100 * 10) = 0.5. Mug on table: 2 steps since the last look (1.0), 2 since
    # its state changed (1.0), 3 observations (1.5), 2 true (1.0), share 2/3, one change (0.5),
    # last state false, prior 0.1. Apple on table: 10 steps since the start (5.0), prior 0.25.
    torch.testing.assert_close(
        data["feature"],
        torch.tensor(
            [
                [text[5] @ text[3], 1.0, 1.0, 1.5, 1.0, 2 / 3, 0.5, 0.0, 0.1],
                [text[6] @ text[3], 5.0, 5.0, 0, 0, 0, 0, 0, 0.25],
            ]
        ),
    )
    layout = batch.to_pyg()["room", "contains", "furniture"]["feature"]
    expected = torch.tensor([[0, 0, 0, 0, 0, 1, 0, 1, 0.5], [0, 0, 0, 0, 0, 1, 0, 1, 0.125]])
    expected[:, 0] = torch.stack([text[2] @ text[3], text[2] @ text[4]])
    torch.testing.assert_close(layout, expected)


def test_query_edges_are_marked_with_their_answers(builder, hand_written):
    edges = builder.build(hand_written).to_pyg()
    assert edges[ON_TOP]["query"].tolist() == [-1, 0]  # the mug is not asked for
    assert edges[INSIDE]["query"].tolist() == [0]
    assert edges[ON_TOP]["target"].isnan().tolist() == [True, False]
    assert edges[ON_TOP]["target"][1] == 0
    assert edges[INSIDE]["target"].tolist() == [1]  # the apple is in the fridge


def test_both_directions_carry_the_same_features(builder, collection):
    graph = SnapshotDataset(collection, builder).__getitems__(range(10)).to_pyg()
    pairs = [
        (INSIDE, ("furniture", "contains", "object")),
        (ON_TOP, ("furniture", "under", "object")),
    ]
    for forth, back in pairs:
        src, dst = graph[forth].edge_index
        back_src, back_dst = graph[back].edge_index
        assert src.equal(back_dst)
        assert dst.equal(back_src)
        assert graph[forth]["feature"].equal(graph[back]["feature"])


def test_remembered_edges_of_the_query_are_not_proposed_again(builder, hand_written):
    asked_for_mug = dataclasses.replace(
        hand_written,
        query_object=np.array([0]),
        query_prior=np.array([[0.0, 0.1], [0.2, 0.0]], dtype=np.float32),
    )
    graph = builder.build(asked_for_mug).to_pyg()
    assert graph[ON_TOP].num_edges == 1  # remembered
    assert graph[INSIDE].num_edges == 1  # hypothetical: in the fridge
    assert graph[ON_TOP]["query"].tolist() == [0]


def test_an_object_that_the_prior_does_not_know_may_be_anywhere(builder, hand_written):
    unknown = dataclasses.replace(hand_written, query_prior=np.zeros((2, 2), dtype=np.float32))
    graph = builder.build(unknown).to_pyg()
    assert graph[ON_TOP]["query"].tolist() == [-1, 0, 0]


def test_without_absence_edges_count_sightings_alone(hand_written):
    # The mug was looked for on the table at 2, 6 and 8 and seen at 2 and 6: two sightings, the
    # last 4 steps ago. In the fridge it was looked for once and not seen: no edge.
    looked_in_fridge = dataclasses.replace(
        hand_written,
        edges={
            name: np.append(hand_written.edges[name], value)
            for name, value in {
                "snapshot": 0,
                "object": 0,
                "furniture": 1,
                "relation": 0,
                "prior": np.float32(0.2),
                "num_observed": 1,
                "num_true": 0,
                "num_changed": 0,
                "last_observed": 4,
                "last_changed": -1,
                "last_true": -1,
                "is_true": False,
            }.items()
        },
    )
    whole, sightings = (
        BatchBuilder(FeatureConfig(absence=absence)).build(looked_in_fridge).to_pyg()
        for absence in (True, False)
    )
    assert (whole[INSIDE].num_edges, sightings[INSIDE].num_edges) == (2, 1)  # one is the apple's
    mug = sightings[ON_TOP]["feature"][sightings[ON_TOP]["query"] < 0]
    # since observed 4 / 2, never changed 10 / 2, twice seen 2 / 2, always true, now true
    assert mug[0, 1:8].tolist() == [2.0, 5.0, 1.0, 1.0, 1.0, 0.0, 1.0]


def test_batch_equals_its_snapshots_one_by_one(builder, collection):
    dataset = SnapshotDataset(collection, builder)
    indices = [30, 3, 14, 14]
    whole = dataset.__getitems__(indices)
    parts = [dataset[index] for index in indices]
    assert whole.num_snapshots == 4
    for etype in QUERY_EDGE_TYPES:
        query = whole.to_pyg()[etype]["query"]
        for position, part in enumerate(parts):
            own = part.to_pyg()[etype]
            for name in ("feature", "target"):
                found = whole.to_pyg()[etype][name][query == position]
                expected = own[name][own["query"] == 0]
                torch.testing.assert_close(found, expected)
    for ntype in NODE_TYPES:
        count = sum(part.to_pyg()[ntype].num_nodes for part in parts)
        assert whole.to_pyg()[ntype].num_nodes == count


@pytest.mark.parametrize("num_hops", [0, 1, 2, 3])
def test_pruning_keeps_the_neighbourhood_of_query_edges(collection, num_hops):
    """Against a breadth-first search over the full graph, node by node."""
    full = (
        SnapshotDataset(collection, BatchBuilder(FeatureConfig())).__getitems__(range(20)).to_pyg()
    )
    pruned = SnapshotDataset(collection, BatchBuilder(FeatureConfig(), num_hops))
    small = pruned.__getitems__(range(20)).to_pyg()
    reached = {
        (ntype, int(node))
        for etype in QUERY_EDGE_TYPES
        for ends, ntype in zip(full[etype].edge_index, (etype[0], etype[2]), strict=True)
        for node in ends[full[etype]["query"] >= 0]
    }
    kept_edges = 0
    for _ in range(num_hops):
        before = set(reached)
        kept_edges = 0
        for etype in EDGE_TYPES:
            for src, dst in zip(*(ends.tolist() for ends in full[etype].edge_index), strict=True):
                if (etype[2], dst) in before:
                    kept_edges += 1
                    reached.add((etype[0], src))
    for ntype in NODE_TYPES:
        assert small[ntype].num_nodes == sum(kind == ntype for kind, _ in reached)
    if num_hops:
        assert sum(small[etype].num_edges for etype in EDGE_TYPES) == kept_edges
    else:
        assert sum(small[etype].num_edges for etype in EDGE_TYPES) == sum(
            int((full[etype]["query"] >= 0).sum()) for etype in QUERY_EDGE_TYPES
        )


@pytest.mark.parametrize(
    ("switch", "zero_columns"), [("temporal", range(1, 8)), ("semantic", [0]), ("prior", [8])]
)
def test_a_group_that_is_off_is_zero_and_the_others_stay(
    builder, hand_written, switch, zero_columns
):
    on = builder.build(hand_written)
    off = BatchBuilder(FeatureConfig(**{switch: False})).build(hand_written)
    others = [column for column in range(9) if column not in zero_columns]
    for etype in EDGE_TYPES:
        feature = off.to_pyg()[etype]["feature"]
        assert not feature[:, list(zero_columns)].any()
        assert feature[:, others].equal(on.to_pyg()[etype]["feature"][:, others])
    assert off.text.shape[1] == (TEXT_DIM if switch != "semantic" else 0)
    for ntype in NODE_TYPES:
        width = off.to_pyg()[ntype]["temporal"].shape[1]
        assert width == (NODE_FEATURE_DIM if switch != "temporal" else 0)


def test_without_memory_there_is_the_layout_and_the_question(hand_written):
    """What was seen changes nothing: the mug, its edge, the looks and the time are gone."""
    config = FeatureConfig(memory=False)
    graph = BatchBuilder(config).build(hand_written).to_pyg()
    assert [graph[ntype].num_nodes for ntype in NODE_TYPES] == [1, 1, 1, 2, 1]
    # The apple's hypothetical edges: on the table (0.25) and in the fridge (0.75).
    on_top, inside = graph[ON_TOP], graph[INSIDE]
    assert on_top["feature"][:, 8].tolist() == [0.25]
    assert inside["feature"][:, 8].tolist() == [0.75]
    assert (on_top["query"].tolist(), inside["query"].tolist()) == ([0], [0])
    assert (on_top["target"].tolist(), inside["target"].tolist()) == ([0], [1])
    assert not on_top["feature"][:, 1:8].any()
    for ntype in ("furniture", "object"):
        assert not graph[ntype]["temporal"].any()
    later = dataclasses.replace(
        hand_written,
        time=hand_written.time + 50,
        furniture={**hand_written.furniture, "num_observed": np.array([9, 9])},
    )
    again = BatchBuilder(config).build(later).to_pyg()
    for etype in EDGE_TYPES:
        assert again[etype]["feature"].equal(graph[etype]["feature"])


def test_random_candidates_ignore_the_prior(hand_written):
    config = FeatureConfig(prior=False, candidates="random", random_candidates=1)
    places = set()
    for seed in range(20):
        graph = BatchBuilder(config, seed=seed).build(hand_written).to_pyg()
        _, dst = graph[ON_TOP].edge_index
        marked = graph[ON_TOP]["query"] >= 0
        assert marked.sum() == 1
        assert graph[INSIDE].num_edges == 0
        places.add(int(dst[marked]))
    assert places == {0, 1}
