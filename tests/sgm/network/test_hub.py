"""`hf://owner/name`: an exported folder from a cache of huggingface_hub, without a network."""

import hashlib
import os
import sys

import pytest

from sgm import ObjectFinder, SceneGraphMemory, Sighting
from sgm.network.hub import fetch
from sgm.network.shipped import PRETRAINED

constants = pytest.importorskip(
    "huggingface_hub.constants", reason="huggingface_hub is not installed: extra hub"
)
COMMIT = "0123456789abcdef0123456789abcdef01234567"


def fill(cache, folder=""):
    """A cache as huggingface_hub keeps it: files by checksum, links to them by commit."""
    repository = cache / "models--robots--any-home"
    snapshot = repository / "snapshots" / COMMIT / folder
    for path in (repository / "refs", repository / "blobs", snapshot):
        path.mkdir(parents=True)
    (repository / "refs" / "main").write_text(COMMIT)
    for file in (PRETRAINED / "any_home").iterdir():
        content = file.read_bytes()
        blob = repository / "blobs" / hashlib.sha256(content).hexdigest()
        blob.write_bytes(content)
        os.symlink(os.path.relpath(blob, snapshot), snapshot / file.name)
    return snapshot


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """Without a network: what is not in the cache cannot be fetched."""
    monkeypatch.setattr(constants, "HF_HUB_CACHE", str(tmp_path))
    monkeypatch.setattr(constants, "HF_HUB_OFFLINE", True)
    return tmp_path


def rank(finder):
    memory = SceneGraphMemory()
    kitchen = memory.add_room("kitchen")
    table = memory.add_furniture("table", kitchen)
    memory.add_furniture("shelf", kitchen)
    memory.observe(table, [Sighting("cup")])
    return [(place.name, place.probability) for place in finder.rank(memory, "cup")]


@pytest.mark.parametrize("revision", ["", "@main", f"@{COMMIT}"])
def test_a_network_is_found_in_the_cache(cache, revision):
    snapshot = fill(cache)
    assert fetch(f"hf://robots/any-home{revision}") == snapshot
    found = ObjectFinder.load(f"hf://robots/any-home{revision}")
    assert rank(found) == rank(ObjectFinder.load("any_home"))


def test_a_network_may_be_in_a_folder(cache):
    snapshot = fill(cache, "exported/one")
    assert fetch("hf://robots/any-home#exported/one") == snapshot


@pytest.mark.parametrize(
    "name", ["", "robots", "robots/../x", "a/b/c", "a/b#../c", "a/b@", " /b", "../b"]
)
def test_a_source_that_is_none_ends_in_one_line(cache, name):
    with pytest.raises(ValueError, match="network of a hub must be hf://owner/name, got") as error:
        ObjectFinder.load(f"hf://{name}")
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("source", ["hf://robots/none", "hf://robots/any-home@other"])
def test_what_cannot_be_fetched_ends_in_one_line(cache, source):
    fill(cache)
    with pytest.raises(ValueError, match="network must be one that can be fetched") as error:
        ObjectFinder.load(source)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("source", ["hf://robots/any-home", "hf://robots/any-home#a/b"])
def test_a_repository_without_an_exported_folder_is_named(cache, source):
    fill(cache, "exported/one")
    with pytest.raises(ValueError, match=rf"must be an exported folder, got none .* '{source}'"):
        ObjectFinder.load(source)


def test_without_the_package_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "huggingface_hub", None)
    with pytest.raises(
        ModuleNotFoundError, match=r"huggingface_hub .* pip install './core\[hub\]'"
    ):
        ObjectFinder.load("hf://robots/any-home")
