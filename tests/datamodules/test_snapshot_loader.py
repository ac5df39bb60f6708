"""Snapshots read back from disk equal the live memories; damage is named."""

import dataclasses
import shutil

import numpy as np
import pytest

from datamodules.batch_builder import BatchBuilder
from datamodules.feature_config import FeatureConfig
from datamodules.snapshot_loader import SnapshotDataset
from simulator.collect.folder import collect
from simulator.collect.settings import CollectConfig
from simulator.policies import make_policy
from simulator.snapshots.taken import take_snapshots
from simulator.tasks.predict_location import predict_locations
from simulator.tasks.rollout import Rollout
from simulator.world.config import HomeConfig
from simulator.world.source import SampledSource
from simulator.world.streams import Streams
from tests.snapshot_columns import assert_equal_snapshots


@pytest.fixture(scope="module")
def builder() -> BatchBuilder:
    return BatchBuilder(FeatureConfig())


def test_snapshots_on_disk_equal_the_live_memories(collection, builder):
    """Every field of every snapshot, replayed beside the collection."""
    dataset = SnapshotDataset(collection, builder)
    config = CollectConfig(
        num_homes=3,
        steps=12,
        homes=SampledSource(home=HomeConfig(furniture_per_room=3, objects_per_furniture=4)),
    )
    homes = config.homes.make(Streams(0, "train", range(3)))
    rollout = Rollout(homes, make_policy(config.policy, homes))
    for number, step in enumerate(predict_locations(rollout, config.steps)):
        live = take_snapshots(rollout.memory, step.queries)
        read = dataset.snapshots.take(np.arange(3) * config.steps + number)
        assert_equal_snapshots(read, dataclasses.replace(live, answers=step.answers.ravel()))


def test_length_and_order(collection, builder):
    dataset = SnapshotDataset(collection, builder)
    assert len(dataset) == 36
    assert dataset.snapshots.take(np.array([0, 13, 35])).time.tolist() == [1, 2, 12]


def _copy(collection, tmp_path):
    folder = tmp_path / "copy"
    shutil.copytree(collection, folder)
    return folder


def test_altered_shard_is_named(collection, builder, tmp_path):
    folder = _copy(collection, tmp_path)
    path = folder / "home_000001.safetensors"
    content = bytearray(path.read_bytes())
    content[-3] ^= 1
    path.write_bytes(content)
    with pytest.raises(ValueError, match=r"home_000001.*delete it and collect again"):
        SnapshotDataset(folder, builder)


def test_truncated_shard_is_named(collection, builder, tmp_path):
    folder = _copy(collection, tmp_path)
    path = folder / "home_000002.safetensors"
    path.write_bytes(path.read_bytes()[:1000])
    with pytest.raises(ValueError, match=r"home_000002.*delete it and collect again"):
        SnapshotDataset(folder, builder)


def test_missing_shard_is_named(collection, builder, tmp_path):
    folder = _copy(collection, tmp_path)
    (folder / "home_000000.safetensors").unlink()
    with pytest.raises(ValueError, match=r"home_000000.*Collect again"):
        SnapshotDataset(folder, builder)


def test_unfinished_collection_is_refused(collection, builder, tmp_path):
    folder = _copy(collection, tmp_path)
    manifest = folder / "manifest.json"
    text = manifest.read_text()
    start = text.index('"shards"')
    manifest.write_text(text[:start] + '"shards": {}}')
    with pytest.raises(ValueError, match=r"must be finished, got 0 of 3 homes"):
        SnapshotDataset(folder, builder)


def test_empty_folder_is_refused(builder, tmp_path):
    with pytest.raises(ValueError, match=r"manifest\.json, got none"):
        SnapshotDataset(tmp_path, builder)


def test_two_collections_are_one_set(collection, builder, tmp_path):
    rules = HomeConfig(furniture_per_room=2, objects_per_furniture=4)
    source = SampledSource(None, rules)
    more = CollectConfig(homes=source, task="find_object", seed=1, num_homes=2, steps=4)
    collect(more, tmp_path, progress=False)
    first, second = (SnapshotDataset(folder, builder) for folder in (collection, tmp_path))
    both = SnapshotDataset(collection, builder, tmp_path)
    assert len(both) == len(first) + len(second)
    last = np.arange(5)
    found, own = both.snapshots.take(last + len(first)), second.snapshots.take(last)
    for name in ("time", "edges", "query_prior", "answers"):
        np.testing.assert_equal(getattr(found, name), getattr(own, name))


def test_collections_of_other_words_are_not_mixed(collection, builder, tmp_path):
    folder = _copy(collection, tmp_path)
    manifest = folder / "manifest.json"
    manifest.write_text(manifest.read_text().replace('"bedroom"', '"loft"'))
    with pytest.raises(ValueError, match=r"must have the same labels, got others in .*copy"):
        SnapshotDataset(collection, builder, folder)
