"""Homes of 8, 16 and 32 places in one memory, one collection and one batch: no padding stays."""

from pathlib import Path

import numpy as np
import pytest

from datamodules.batch_builder import BatchBuilder
from datamodules.feature_config import FeatureConfig
from datamodules.snapshot_loader import SnapshotDataset
from sgm.layout.layout import LayoutArrays
from sgm.memory.memory_batch import MemoryBatch
from sgm.prior.place_prior import PlacePrior
from sgm.schema import EDGE_TYPES, NODE_TYPES
from simulator import PriorGraph
from simulator.snapshots.recorder import Recorder
from simulator.snapshots.shards import get_shard_name, save_manifest, save_shard
from simulator.snapshots.snapshots import Snapshots
from simulator.snapshots.taken import take_snapshots
from simulator.snapshots.type_numbers import ENTERING
from tests.snapshot_columns import assert_equal_snapshots, list_columns

PRIOR = PriorGraph.default()
OBJECTS = [row.label for row in PRIOR.objects]
FURNITURE = sorted({row.label for row in PRIOR.furniture})
LABELS = list(dict.fromkeys(["house", "floor", *PRIOR.rooms, *FURNITURE, *OBJECTS]))
SIZES = (8, 16, 32)
STEPS = 9


def make_memory(sizes) -> MemoryBatch:
    """Homes with so many places of 2, 3 or 4 rooms, padded to the largest."""
    num_rooms = [1 + size.bit_length() - 3 for size in sizes]
    rooms = [PRIOR.rooms[:count] for count in num_rooms]
    nodes = [[row for row in PRIOR.furniture if row.room in own] for own in rooms]
    nodes = [
        [own[place % len(own)] for place in range(size)]
        for own, size in zip(nodes, sizes, strict=True)
    ]
    shape = (len(sizes), max(sizes))
    room_label = np.full((len(sizes), max(num_rooms)), -1)
    furniture_label, furniture_room = np.full(shape, -1), np.full(shape, -1)
    texts = np.full(shape, "", dtype=object)
    for home, (own, furniture) in enumerate(zip(rooms, nodes, strict=True)):
        room_label[home, : len(own)] = [LABELS.index(label) for label in own]
        for place, row in enumerate(furniture):
            texts[home, place] = row.label
            furniture_label[home, place] = LABELS.index(row.label)
            furniture_room[home, place] = own.index(row.room)
    padded = [[*own, *[""] * (max(num_rooms) - len(own))] for own in rooms]
    prior = PlacePrior(PRIOR, padded, texts, furniture_room)
    return MemoryBatch(LABELS, LayoutArrays(room_label, furniture_label, furniture_room, prior))


def play(sizes) -> tuple[list[Snapshots], list[dict[str, np.ndarray]]]:
    """Ask and look at random, each home by its own random numbers; snapshots live and recorded."""
    memory = make_memory(sizes)
    recorder = Recorder(memory)
    rngs, home = [np.random.default_rng(size) for size in sizes], np.arange(len(sizes))
    taken = []
    for _ in range(STEPS):
        memory.step()
        keys = np.array([rng.integers(12) for rng in rngs])
        labels = np.array([LABELS.index(OBJECTS[key]) for key in keys])
        queries = memory.query(home, keys, labels, keys)
        answers = np.zeros((len(sizes), max(sizes)), dtype=bool)
        extras = {
            "relevance": np.full(answers.shape, np.nan, dtype=np.float32),
            "evidence": np.full((*answers.shape, 3), np.nan, dtype=np.float16),
        }
        for row, (rng, size) in enumerate(zip(rngs, sizes, strict=True)):
            answers[row, :size] = rng.random(size) < 0.1
            extras["relevance"][row, :size] = rng.random(size)
            extras["evidence"][row, :size] = rng.random((size, 3))
        asked = {"question": np.array([rng.random(2) for rng in rngs], dtype=np.float32)}
        recorder.add_snapshot(queries, answers, extras, asked)
        taken.append(take_snapshots(memory, queries, answers, extras, asked))
        look = np.array([rng.integers(size) for rng, size in zip(rngs, sizes, strict=True)])
        seen = np.array([rng.choice(12, 3, replace=False) for rng in rngs]).ravel()
        labels = np.array([LABELS.index(OBJECTS[key]) for key in seen])
        rows = memory.ensure_objects(np.repeat(home, 3), seen, labels, seen)
        relation = np.concatenate([rng.integers(2, size=3) for rng in rngs])
        recorder.add_change(memory.observe(home, look, rows, relation))
    return taken, recorder.finish()


@pytest.fixture(scope="module")
def together() -> tuple[list[Snapshots], list[dict[str, np.ndarray]]]:
    return play(SIZES)


@pytest.fixture(scope="module")
def alone() -> list[tuple[list[Snapshots], list[dict[str, np.ndarray]]]]:
    return [play([size]) for size in SIZES]


@pytest.fixture(scope="module")
def collection(together, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("sizes")
    shards = {
        name: save_shard(folder / name, shard)
        for name, shard in ((get_shard_name(home), shard) for home, shard in enumerate(together[1]))
    }
    save_manifest(folder, {"num_homes": len(SIZES), "labels": LABELS}, shards)
    return folder


def test_snapshots_hold_nothing_of_the_padding(together):
    for snapshots in together[0]:
        assert np.diff(snapshots.find_first("rooms")).tolist() == [2, 3, 4]
        assert np.diff(snapshots.find_first("furniture")).tolist() == list(SIZES)
        for name, column in list_columns(snapshots).items():
            if name.startswith(("room", "furniture")) and "last" not in name:
                assert column.min() >= 0, name
        assert snapshots.query_prior.shape == (56, 2)
        assert snapshots.extras["evidence"].shape == (56, 3)
        assert not np.isnan(snapshots.extras["evidence"]).any()
        assert (
            snapshots.furniture["snapshot"][snapshots.edges["furniture"]]
            == (snapshots.objects["snapshot"][snapshots.edges["object"]])
        ).all()


def test_a_home_is_recorded_as_if_it_were_alone(together, alone):
    for shard, (_, (own,)) in zip(together[1], alone, strict=True):
        assert shard.keys() == own.keys()
        for name, array in shard.items():
            np.testing.assert_array_equal(array, own[name], err_msg=name)
            assert array.dtype == own[name].dtype
    first = together[1][0]
    assert first["furniture_label"].shape == (8,)
    assert first["snapshot_furniture_prior"].shape == (STEPS, 8, 2)
    assert first["snapshot_furniture_extra_evidence"].dtype == np.float16
    assert first["snapshot_furniture_extra_relevance"].dtype == np.float32


def test_they_are_read_back_as_they_were(together, collection):
    """In any order, with homes of other sizes between them."""
    dataset = SnapshotDataset(collection, BatchBuilder(FeatureConfig()))
    assert len(dataset) == len(SIZES) * STEPS
    for number, live in enumerate(together[0]):
        read = dataset.snapshots.take(np.arange(len(SIZES)) * STEPS + number)
        assert_equal_snapshots(read, live)


@pytest.mark.dgl
@pytest.mark.parametrize("num_hops", [None, 1])
def test_a_batch_falls_apart_into_its_homes(together, alone, num_hops):
    """`dgl.unbatch` gives the graphs that the homes give alone, with all their data."""
    import dgl

    builder = BatchBuilder(FeatureConfig(), num_hops)
    batch = builder.build(together[0][-1])
    parts = dgl.unbatch(batch.graph)
    assert len(parts) == len(SIZES)
    for number, (part, (snapshots, _)) in enumerate(zip(parts, alone, strict=True)):
        own = builder.build(snapshots[-1]).graph
        for ntype in NODE_TYPES:
            assert part.num_nodes(ntype) == own.num_nodes(ntype)
            for name, column in own.nodes[ntype].data.items():
                found = part.nodes[ntype].data[name]
                assert found.equal(column + number if name == "snapshot" else column), name
        for etype in EDGE_TYPES:
            for found, expected in zip(
                part.edges(etype=etype), own.edges(etype=etype), strict=True
            ):
                assert found.equal(expected)
            for name, column in own.edges[etype].data.items():
                found = part.edges[etype].data[name]
                if name == "query":
                    column = column.where(column < 0, column + number)
                assert found.nan_to_num(-1).equal(column.nan_to_num(-1)), name


@pytest.mark.dgl
def test_readouts_are_those_of_each_home(together):
    import dgl

    graph = BatchBuilder(FeatureConfig()).build(together[0][-1]).graph
    for ntype in NODE_TYPES:
        data = graph.nodes[ntype].data
        mean = dgl.mean_nodes(graph, "degree", ntype=ntype)
        expected = [data["degree"][data["snapshot"] == home].mean() for home in range(len(SIZES))]
        np.testing.assert_allclose(mean, expected, rtol=1e-6)


def test_degrees_before_pruning_by_edge_type(together):
    full = BatchBuilder(FeatureConfig()).build(together[0][-1]).to_pyg()
    pruned = BatchBuilder(FeatureConfig(), 1).build(together[0][-1]).to_pyg()
    for ntype, etypes in ENTERING.items():
        degrees = full[ntype].degrees
        for column, etype in enumerate(etypes):
            entered = full[etype].edge_index[1].bincount(minlength=len(degrees))
            assert degrees[:, column].equal(entered.float())
        assert not degrees[:, len(etypes) :].any()
        assert degrees.sum(dim=1).equal(full[ntype].degree)
        kept = pruned[ntype].degrees
        assert {tuple(row) for row in kept.tolist()} <= {tuple(row) for row in degrees.tolist()}


def test_without_convolutions_there_are_no_degrees(together):
    graph = BatchBuilder(FeatureConfig(), 0).build(together[0][-1]).to_pyg()
    for ntype in NODE_TYPES:
        assert not graph[ntype].degree.any()
        assert not graph[ntype].degrees.any()
