"""Tables on disk: any snapshot is found, however long its home, and memory does not grow."""

import gc
import resource
from pathlib import Path

import numpy as np
import pytest

from datamodules.batch_builder import BatchBuilder
from datamodules.feature_config import FeatureConfig
from datamodules.snapshot_loader import SnapshotDataset
from simulator.snapshots import stored
from simulator.snapshots.mapped_table import MappedTable
from simulator.snapshots.shards import load_manifest, load_shard
from simulator.snapshots.stored import StoredSnapshots

STATM = Path("/proc/self/statm")


def make_home(rng, num_snapshots, num_versions):
    """Arrays of a home whose versions begin and end anywhere; each is known by `stamp`."""
    shard = {
        "room_label": np.arange(2, dtype=np.int32),
        "furniture_label": np.arange(3, dtype=np.int32),
        "snapshot_furniture_prior": np.zeros((num_snapshots, 3), dtype=np.float32),
        "snapshot_time": np.arange(num_snapshots, dtype=np.int32),
        "object_label": np.zeros(1, dtype=np.int32),
        "edge_object": np.zeros(1, dtype=np.int32),
    }
    for kind in ("furniture", "object", "edge"):
        ends = np.sort(rng.integers(0, num_snapshots + 1, (num_versions, 2)), axis=1)
        shard[f"{kind}_version_valid_from"] = ends[:, 0].astype(np.int32)
        shard[f"{kind}_version_valid_to"] = ends[:, 1].astype(np.int32)
        shard[f"{kind}_version_stamp"] = rng.integers(0, 1 << 30, num_versions, dtype=np.int32)
    return shard


def test_versions_are_those_of_a_scan_over_all_of_them(tmp_path):
    """Homes of 1 to 40 snapshots: frames of 8 that are full, cut short and empty."""
    rng = np.random.default_rng(0)
    sizes = [1, 7, 8, 9, 16, 40]
    shards = [make_home(rng, size, size % 7 * 9) for size in sizes]
    tables = StoredSnapshots(shards, (), tmp_path)
    assert len(tables) == sum(sizes)
    everything = rng.permutation(len(tables))
    home = tables.find_home(everything)
    assert np.bincount(home).tolist() == sizes
    number = everything - tables.starts["snapshot"][home]
    np.testing.assert_array_equal(tables.take_rows("snapshot", everything)["time"], number)
    for kind in ("furniture", "object", "edge"):
        sample, versions = tables.take_versions(kind, home, number)
        expected = []
        for place, (own, at) in enumerate(zip(home, number, strict=True)):
            shard = shards[own]
            is_valid = (shard[f"{kind}_version_valid_from"] <= at) & (
                at < shard[f"{kind}_version_valid_to"]
            )
            expected += [(place, stamp) for stamp in shard[f"{kind}_version_stamp"][is_valid]]
        assert list(zip(sample, versions["stamp"], strict=True)) == expected


def test_a_frame_by_hand():
    """Three versions of a home of 10 snapshots, whose second frame holds 8 and 9."""
    columns, first = stored._list_frames(np.array([0, 3, 6]), np.array([10, 6, 9]), 2)
    # frame 0: version 0 in all 8, version 1 in 3 4 5, version 2 in 6 7; frame 1: 0 in both, 2 in 8
    assert columns["row"].tolist() == [0, 1, 2, 0, 2]
    assert columns["valid_in"].tolist() == [0b11111111, 0b00111000, 0b11000000, 0b11, 0b01]
    assert first.tolist() == [0, 3]


def test_releasing_memory_changes_nothing(collection, monkeypatch):
    """Batches of mapped pages that were given back equal those of pages that were kept."""
    orders = np.random.default_rng(0).permutation(36).reshape(4, 9)
    found = []
    for most in (1 << 28, 0):
        monkeypatch.setattr(stored, "_MAX_MAPPED", most)
        dataset = SnapshotDataset(collection, BatchBuilder(FeatureConfig()))
        batches = [dataset.__getitems__(order.tolist()) for order in orders]
        found.append([batch.to_pyg()["object"]["temporal"] for batch in batches])
    for kept, released in zip(*found, strict=True):
        assert kept.equal(released)


@pytest.mark.skipif(not STATM.exists(), reason="needs /proc, to know its own memory")
def test_pages_that_were_read_leave_the_memory_of_the_process(tmp_path):
    """64 MB of rows: mapped when they are read, and given back."""
    with MappedTable(tmp_path) as table:
        for start in range(0, 1 << 23, 1 << 20):
            table.append({"number": np.arange(start, start + (1 << 20))})
        table.finish()
    assert table.num_bytes == 1 << 26

    def read_resident():
        pages = int(STATM.read_text().split()[1])
        return pages * resource.getpagesize()

    gc.collect()
    before = read_resident()
    rows = np.arange(0, 1 << 23, 512)  # one of each page
    np.testing.assert_array_equal(table.take(rows)["number"], rows)
    assert read_resident() - before > 1 << 25
    table.release()
    assert read_resident() - before < 1 << 24
    np.testing.assert_array_equal(table.take(rows)["number"], rows)


def test_a_folder_that_cannot_be_written_to(collection, tmp_path):
    manifest = load_manifest(collection)
    shards = [load_shard(collection / name) for name in manifest["shards"]]
    tables = StoredSnapshots(shards, (), tmp_path / "none")
    assert len(tables) == 36


def test_nothing_is_left_behind(collection):
    before = sorted(collection.iterdir())
    dataset = SnapshotDataset(collection, BatchBuilder(FeatureConfig()))
    assert sorted(collection.iterdir()) == before
    assert len(dataset) == 36


def test_a_full_disk_is_named(tmp_path, monkeypatch):
    class FullFile:
        def write(self, content):
            raise OSError(28, "No space left on device")

        def close(self):
            pass

    with MappedTable(tmp_path) as table:
        table._file.close()
        monkeypatch.setattr(table, "_file", FullFile())
        with pytest.raises(OSError, match=r"disk must take a copy .*No space left.*Free some"):
            table.append({"number": np.arange(3)})
