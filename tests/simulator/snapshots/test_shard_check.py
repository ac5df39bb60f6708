"""Shards and manifests with a checksum of their own that no collection has."""

import json
import subprocess
import sys

import numpy as np
import pytest

from sgm.files import compute_checksum
from simulator.collect.folder import collect
from simulator.collect.settings import CollectConfig
from simulator.snapshots.shards import (
    check_manifest,
    check_shard,
    load_manifest,
    load_shard,
    save_shard,
)
from simulator.world.config import HomeConfig
from simulator.world.source import SampledSource

NAME = "home_000000.safetensors"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A home with all extras."""
    folder = tmp_path_factory.mktemp("collection")
    rules = HomeConfig(furniture_per_room=3, objects_per_furniture=4)
    config = CollectConfig(
        homes=SampledSource(home=rules),
        num_homes=1,
        steps=20,
        task="relative_likelihood",
        belief=True,
        evidence=True,
        relevance=True,
    )
    collect(config, folder, progress=False)
    return folder


@pytest.fixture
def arrays(folder):
    return {name: array.copy() for name, array in load_shard(folder / NAME).items()}


def check(arrays, folder):
    check_shard(arrays, len(load_manifest(folder)["settings"]["labels"]), folder / NAME)


def test_what_was_collected_passes(arrays, folder):
    check_manifest(load_manifest(folder), folder)
    check(arrays, folder)


def set_at(name, value, row=0):
    def change(arrays):
        arrays[name][row] = value

    return change


def cast(name, dtype):
    def change(arrays):
        arrays[name] = arrays[name].astype(dtype)

    return change


def cut(name):
    def change(arrays):
        arrays[name] = arrays[name][:-1]

    return change


def replace(name, array):
    def change(arrays):
        arrays[name] = array

    return change


BIG = 2**31 - 1
BAD = {
    "claims 2^31 snapshots": (
        set_at("edge_version_valid_to", BIG, -1),
        "versions of edge that do not follow each other",
    ),
    "a version from the future": (
        set_at("object_version_valid_from", BIG),
        "versions of object that do not follow",
    ),
    "negative": (set_at("furniture_version_valid_from", -5), "valid_from outside of 0 to"),
    "another object": (set_at("snapshot_query", 10_000), "snapshot_query outside of 0 to"),
    "another place": (set_at("edge_furniture", -1), "edge_furniture outside of 0 to 11"),
    "another room": (set_at("furniture_room", 4), "furniture_room outside of 0 to 3"),
    "another label": (set_at("object_label", 9999), "object_label outside of 0 to"),
    "no number": (set_at("edge_prior", np.nan), "edge_prior outside of 0"),
    "negative share": (set_at("furniture_prob", -0.5), "furniture_prob outside of 0"),
    "half an answer": (set_at("snapshot_furniture_answers", 2), "answers outside of 0 to 1"),
    "texts": (cast("edge_prior", np.int32), "edge_prior of type int32"),
    "floats": (cast("snapshot_time", np.float32), "snapshot_time of type float32"),
    "a time stamp that cannot be before the start": (
        cast("edge_version_last_observed", np.uint8),
        "last_observed of type uint8",
    ),
    "too few": (cut("edge_relation"), r"edge_relation of shape \(\d+,\)"),
    "no axis": (replace("home_clock", np.float64(1)), r"home_clock of shape \(\)"),
    "nothing wide": (
        replace("snapshot_furniture_extra_x", np.zeros((100, 12, 0), np.float32)),
        r"extra_x of shape \(100, 12, 0\)",
    ),
    "missing": (lambda a: a.pop("edge_version_is_true"), "no array edge_version_is_true"),
    "unknown": (replace("edge_colour", np.zeros(3)), "an array 'edge_colour' that has no meaning"),
    "not in order": (
        set_at("edge_version_of", 1),
        "versions of edge that do not follow each other",
    ),
    "an edge of nothing": (
        lambda arrays: arrays["edge_object"].fill(len(arrays["object_label"]) - 1),
        "an edge before its object",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_a_signed_shard_that_nobody_collected_is_refused(arrays, folder, name):
    change, message = BAD[name]
    change(arrays)
    with pytest.raises(
        ValueError, match=rf"shard must be one that .*, got .*{message}.* in .*{NAME}"
    ):
        check(arrays, folder)


@pytest.mark.slow
def test_a_small_shard_that_claims_billions_of_snapshots_takes_no_memory(arrays, folder, tmp_path):
    """Reading the collection ends with one line, in a process that may have a gigabyte more."""
    arrays["edge_version_valid_to"][:] = BIG
    arrays["edge_version_valid_from"][:] = 0
    save_shard(tmp_path / NAME, arrays)
    manifest = json.loads((folder / "manifest.json").read_text())
    manifest["shards"] = {NAME: compute_checksum(tmp_path / NAME)}
    (tmp_path / "manifest.json").write_text(json.dumps(manifest))
    program = f"""
import resource
from pathlib import Path
from datamodules.feature_config import FeatureConfig
from datamodules.batch_builder import BatchBuilder
from datamodules.snapshot_loader import SnapshotDataset

builder = BatchBuilder(FeatureConfig())
used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (used + (1 << 30), used + (1 << 30)))
try:
    SnapshotDataset(Path({str(tmp_path)!r}), builder)
except ValueError as error:
    print(error)
"""
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stderr
    assert "got versions of edge that do not follow each other" in done.stdout


SETTINGS = {"num_homes": 2, "labels": ["house"]}
GOOD = {NAME: "a" * 64}


@pytest.mark.parametrize(
    ("settings", "shards", "message"),
    [
        (SETTINGS, {"../" + NAME: "a"}, r"the shard '\.\./home_000000\.safetensors', which is"),
        (SETTINGS, {"/tmp/" + NAME: "a"}, r"the shard '/tmp/home_000000\.safetensors', which"),
        (SETTINGS, {"home_000002.safetensors": "a"}, r"none from home_000000.* to home_000001"),
        (SETTINGS, {"x" * 10_000: "a"}, r"the shard 'x{190,200}\.\.\., which"),
        (SETTINGS, {NAME: 3}, r"no checksum of home_000000"),
        (SETTINGS, [NAME], "shards that are no JSON object"),
        ([], GOOD, "num_homes that is no number"),
        ({**SETTINGS, "num_homes": True}, GOOD, "num_homes that is no number"),
        ({**SETTINGS, "num_homes": 10**20}, GOOD, "num_homes that is no number in 1 to 1000000"),
        ({**SETTINGS, "labels": "house"}, GOOD, "labels that are no list of texts"),
        ({**SETTINGS, "labels": [1]}, GOOD, "labels that are no list of texts"),
    ],
)
def test_a_manifest_that_nobody_collected_is_refused(tmp_path, settings, shards, message):
    with pytest.raises(ValueError, match=rf"manifest must be one that .*got .*{message}"):
        check_manifest({"settings": settings, "shards": shards}, tmp_path)
