import json

import numpy as np
import pytest

from sgm.files import compute_checksum, write_whole
from simulator.snapshots.shards import (
    get_shard_name,
    load_manifest,
    load_shard,
    save_manifest,
    save_shard,
)

ARRAYS = {
    "b": np.arange(6, dtype=np.int32).reshape(2, 3),
    "a": np.array([0.5, -1], dtype=np.float32),
    "none": np.zeros((0, 4), dtype=np.uint8),
}


def test_arrays_come_back_as_they_were(tmp_path):
    path = tmp_path / get_shard_name(7)
    assert path.name == "home_000007.safetensors"
    save_shard(path, ARRAYS)
    found = load_shard(path, compute_checksum(path))
    assert found.keys() == ARRAYS.keys()
    for name, array in ARRAYS.items():
        np.testing.assert_array_equal(found[name], array)
        assert found[name].dtype == array.dtype
    assert [file.name for file in tmp_path.iterdir()] == [path.name]


def test_equal_arrays_give_equal_bytes_in_any_order(tmp_path):
    save_shard(tmp_path / "one", ARRAYS)
    save_shard(tmp_path / "two", dict(reversed(ARRAYS.items())))
    assert (tmp_path / "one").read_bytes() == (tmp_path / "two").read_bytes()


def test_an_altered_shard_is_named(tmp_path):
    path = tmp_path / "house"
    save_shard(path, ARRAYS)
    checksum = compute_checksum(path)
    content = bytearray(path.read_bytes())
    content[-1] ^= 1
    path.write_bytes(content)
    with pytest.raises(ValueError, match=rf"shard must have the checksum .* for {path}\. It was"):
        load_shard(path, checksum)


def test_a_truncated_shard_is_named(tmp_path):
    path = tmp_path / "house"
    save_shard(path, ARRAYS)
    path.write_bytes(path.read_bytes()[:-5])
    with pytest.raises(ValueError, match=rf"whole safetensors file, got .* for {path}\. Delete"):
        load_shard(path)
    path.write_bytes(b"")
    with pytest.raises(ValueError, match=rf"for {path}\. Delete it and collect again"):
        load_shard(path)


def test_a_missing_shard_is_named(tmp_path):
    with pytest.raises(ValueError, match=rf"must exist, got none at {tmp_path / 'no'}\. Collect"):
        load_shard(tmp_path / "no")


def test_a_manifest_comes_back(tmp_path):
    save_manifest(tmp_path, {"seed": 3, "rooms": ["kitchen"]}, {"house": "abc"})
    assert load_manifest(tmp_path) == {
        "version": 1,
        "settings": {"seed": 3, "rooms": ["kitchen"]},
        "shards": {"house": "abc"},
    }


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, r"collection must have a manifest\.json, got none in .*simulator\.collect --out"),
        ("{", r"manifest must be whole, .* in .*manifest\.json\. Delete the folder"),
        ("[]", r"manifest must be whole, .*manifest\.json"),
        ("{}", r"manifest must be whole, .*version.*manifest\.json"),
        (json.dumps({"version": 1}), r"manifest must be whole, .*settings, shards"),
        (
            json.dumps({"version": 2, "settings": {}, "shards": {}}),
            r"^manifest version must be 1, got 2 in .*manifest\.json\. Make it again",
        ),
        (
            json.dumps({"version": "x" * 5000, "settings": {}, "shards": {}}),
            r"manifest version must be 1, got 'x{190,200}\.\.\. in",
        ),
    ],
)
def test_a_bad_manifest_is_named(tmp_path, content, message):
    if content is not None:
        (tmp_path / "manifest.json").write_text(content)
    with pytest.raises(ValueError, match=message):
        load_manifest(tmp_path)


def test_a_failed_write_keeps_the_old_file_and_leaves_no_part(tmp_path):
    """A folder in the way of the rename: the operating system refuses, after the write."""
    target = tmp_path / "target"
    target.mkdir()
    (target / "old").write_text("kept")
    with pytest.raises(OSError, match=r"path must be one of a file, got .*folder .*target\. Cho"):
        write_whole(target, b"new")
    assert (target / "old").read_text() == "kept"
    assert [path.name for path in tmp_path.iterdir()] == ["target"]
