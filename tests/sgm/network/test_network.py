"""An exported folder whose files are damaged: one line that says what is wrong, and where."""

import os
import shutil

import pytest

from sgm import ObjectFinder
from sgm.network.shipped import PRETRAINED


@pytest.fixture
def folder(tmp_path):
    return shutil.copytree(PRETRAINED / "any_home", tmp_path / "exported")


def cut(content):
    return content[: len(content) // 2]


def turn(content):
    """Other bits in the middle, no text of UTF-8."""
    middle = len(content) // 2
    return content[:middle] + b"\xff\xfe" + content[middle + 2 :]


@pytest.mark.parametrize(
    "damage",
    [
        cut, turn, lambda _: b"", lambda _: b"[]", lambda _: b"null", lambda _: b"7",
        lambda content: content.replace(b'"onnx"', b'"other"'),
        lambda content: content.replace(b'"version"', b'"onnx"'),  # a key twice
        lambda _: b"[" * 100_000,
    ],
)  # fmt: skip
def test_a_damaged_config_is_named(folder, damage):
    path = folder / "config.json"
    path.write_bytes(damage(path.read_bytes()))
    with pytest.raises(ValueError, match=r" must .*, got ") as error:
        ObjectFinder.load(folder)
    said = str(error.value)
    assert str(folder) in said
    assert "\n" not in said
    assert len(said) < 400 + len(str(folder))


@pytest.mark.parametrize("damage", [cut, turn, lambda _: b""])
def test_a_damaged_network_is_named(folder, damage):
    path = folder / "network.onnx"
    path.write_bytes(damage(path.read_bytes()))
    with pytest.raises(
        ValueError, match=r"network\.onnx must be that of config\.json, got another"
    ):
        ObjectFinder.load(folder)


@pytest.mark.parametrize("name", ["config.json", "network.onnx"])
def test_a_file_that_is_too_large_is_not_read(folder, name):
    """A hole of a terabyte takes no space on the disk; read, it would take all memory."""
    os.truncate(folder / name, 1 << 40)
    with pytest.raises(ValueError, match=r"must .* (more than|at most|that of)"):
        ObjectFinder.load(folder)
