"""Files of tensors: what torch wrote comes back; what claims more than it holds is refused."""

import io
import struct
import subprocess
import sys
import zipfile
from collections import Counter, OrderedDict
from pathlib import Path

import pytest
import torch

from datamodules.batch_builder import BatchBuilder
from datamodules.feature_config import FeatureConfig
from nep.callbacks.resume import WholeCheckpoints
from nep.importers.homer import read_homer
from nep.paper.encoders import MLP
from nep.paper.nep_module import NEPModule
from nep.players.checkpoints import load_trained
from nep.tensor_file import read_tensors

ROOT = Path(__file__).parents[2]
GOOD = {
    "state": torch.nn.Linear(3, 2).state_dict(),
    "parameter": torch.nn.Parameter(torch.arange(3.0)),
    "bfloat16": torch.arange(3, dtype=torch.bfloat16),
    "bool": torch.tensor([[True, False]]),
    "complex": torch.ones(2, dtype=torch.complex64),
    "expanded": [torch.eye(3).expand(2, 3, 3), torch.zeros(2, 3, 3)],
    "turned": torch.arange(12).view(3, 4).t(),
    "part": torch.arange(10.0, dtype=torch.float64)[2:5],
    "empty": torch.empty(0, 3),
    "scalar": torch.tensor(3.0),
    "size": torch.Size([1, 2]),
    "plain": [1, -5, 2**70, 1.5, None, True, "ü" * 300, (), (1,), (1, 2), (1, 2, 3), (1, 2, 3, 4)],
    "many": list(range(2000)),
    "ordered": OrderedDict(b=1, a={"x": {}}),
    "counter": Counter("abba"),
    "set": {1, 2},
    "bytes": b"\x00\xff",
    "type": torch.float32,
}


@pytest.mark.parametrize("name", GOOD)
def test_what_torch_wrote_comes_back(name, tmp_path):
    path = tmp_path / "file.pt"
    torch.save({"value": GOOD[name]}, path)
    found = read_tensors(path)["value"]
    expected = torch.load(path, weights_only=True)["value"]
    assert type(found) is type(expected) or isinstance(found, torch.Tensor)
    if isinstance(expected, torch.Tensor):
        assert torch.equal(found, expected)
        assert found.dtype == expected.dtype
        assert not found.requires_grad
    elif name == "expanded":
        assert torch.equal(torch.stack(found), torch.stack(expected))
    elif name == "state":
        assert list(found) == list(expected)
        assert all(torch.equal(found[key], expected[key]) for key in expected)
    else:
        assert found == expected


class Call:
    """Pickled as a call."""

    def __init__(self, function, *arguments):
        self.reduced = (function, arguments)

    def __reduce__(self):
        return self.reduced


def rewrite(path: Path, change, compression=zipfile.ZIP_STORED) -> None:
    """Write an archive with other parts: `change` takes and returns them by name."""
    with zipfile.ZipFile(path) as archive:
        parts = {name.partition("/")[2]: archive.read(name) for name in archive.namelist()}
    with zipfile.ZipFile(path, "w", compression) as archive:
        for name, content in change(parts).items():
            archive.writestr(f"archive/{name}", content)


def save_storage_of(path: Path, numbers: int) -> None:
    """Save ten numbers, of which the pickle says that they are more."""
    torch.save({"x": torch.arange(10.0)}, path)

    def change(parts):
        old, new = b"K\x0at", b"J" + struct.pack("<i", numbers) + b"t"
        assert parts["data.pkl"].count(old) == 1
        return {**parts, "data.pkl": parts["data.pkl"].replace(old, new)}

    rewrite(path, change)


def save_repeated(path: Path) -> None:
    value = ["x"] * 10
    for _ in range(30):
        value = [value] * 10
    torch.save({"x": value}, path)


def save_around(path: Path) -> None:
    value: list[object] = []
    value.append(value)
    torch.save(value, path)


def save_deep(path: Path) -> None:
    torch.save([], path)
    deep = b"\x80\x02" + b"]" * 50_000 + b"a" * 49_999 + b"."
    rewrite(path, lambda parts: {**parts, "data.pkl": deep})


def save_shared(path: Path) -> None:
    weights = torch.zeros(100_000)
    torch.save({str(number): weights for number in range(1000)}, path)


def save_opcodes(content: bytes):
    def save(path: Path) -> None:
        torch.save([], path)
        rewrite(path, lambda parts: {**parts, "data.pkl": content})

    return save


HOSTILE = {
    "stride 0": (
        lambda path: torch.save(torch.zeros(1).expand(10**5, 10**5), path),
        "a tensor of 10000000000 numbers, more than the file has",
    ),
    "overlapping": (
        lambda path: torch.save(torch.zeros(9999).as_strided((5000, 5000), (1, 1)), path),
        "a tensor of 25000000 numbers",
    ),
    "shared": (save_shared, "repeated too often"),
    "bytearray": (
        lambda path: torch.save(Call(bytearray, 4 * 10**9), path),
        "__builtin__ bytearray', which",
    ),
    "range": (lambda path: torch.save(Call(list, range(9)), path), "which is no plain value"),
    "code": (lambda path: torch.save(Call(print, "executed"), path), "__builtin__ print', which"),
    "storage": (lambda path: save_storage_of(path, 10**9), "1000000000 numbers in 40 bytes"),
    "negative": (lambda path: save_storage_of(path, -1), "an unknown reference"),
    "deflated": (
        lambda path: (
            torch.save(torch.zeros(10**6), path),
            rewrite(path, lambda parts: parts, zipfile.ZIP_DEFLATED),
        ),
        "a compressed file",
    ),
    "legacy": (
        lambda path: torch.save([1], path, _use_new_zipfile_serialization=False),
        "no whole zip file",
    ),
    "repeated": (save_repeated, "values that are repeated too often"),
    "around": (save_around, "nested too deeply"),
    "deep": (save_deep, "nested too deeply"),
    "sparse": (lambda path: torch.save(torch.eye(3).to_sparse(), path), "no plain value"),
    "module": (lambda path: torch.save(torch.nn.Linear(1, 1), path), "no plain value"),
    "function": (save_opcodes(b"\x80\x02ctorch\nSize\n."), "no plain value"),
    "memo": (
        save_opcodes(b"\x80\x02]r\xff\xff\xff\x7f\x8e\xff\xff\xff\xff\xff\xff\xff\x7f."),
        "damaged|does not|expected",
    ),
    "empty": (save_opcodes(b""), "pickle exhausted"),
    "underflow": (save_opcodes(b"\x80\x02a."), "IndexError in a damaged file"),
    "other zip": (
        lambda path: zipfile.ZipFile(path, "w").writestr("a/b", "c"),
        "another zip file|no whole",
    ),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_what_claims_more_than_it_holds_is_refused(name, tmp_path):
    save, message = HOSTILE[name]
    path = tmp_path / "file.pt"
    save(path)
    with pytest.raises(ValueError, match=message):
        read_tensors(path)


def test_a_file_that_copies_a_value_again_and_again_is_refused(tmp_path):
    """A set of 1,000 numbers, 1,000 times made of the same list: a million from 20 kB."""
    numbers = b"".join(b"M" + struct.pack("<H", number) for number in range(1000))
    listed = b"](" + numbers + b"eq\x00"
    again = b"c__builtin__\nset\nh\x00\x85R" * 1000
    path = tmp_path / "file.pt"
    save_opcodes(b"\x80\x02(" + listed + again + b"t.")(path)
    with pytest.raises(ValueError, match="repeated too often"):
        read_tensors(path)


@pytest.mark.slow
def test_any_changed_byte_is_an_answer(tmp_path):
    """Of a small file every byte in turn is set to others: a value, or one kind of error."""
    torch.save({"x": torch.arange(3.0), "y": [1, "a", (2, 3)]}, tmp_path / "file.pt")
    content = (tmp_path / "file.pt").read_bytes()
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        pickled = archive.read("file/data.pkl")
    refused = 0
    for position in range(len(pickled)):
        for value in (0, 0x72, 0xFF):
            changed = pickled[:position] + bytes([value]) + pickled[position + 1 :]
            save_opcodes(changed)(tmp_path / "changed.pt")
            try:
                read_tensors(tmp_path / "changed.pt")
            except ValueError:
                refused += 1
    assert refused > len(pickled)


def make_content(units: int) -> dict:
    builder = BatchBuilder(FeatureConfig())
    module = NEPModule(MLP(units=units))
    return {
        "state_dict": module.state_dict(),
        "hyper_parameters": dict(module.hparams),
        "datamodule_hyper_parameters": {
            "features": {},
            "feature_schema": 1,
            "text": builder.text_name,
            "training": None,
        },
    }


def test_a_network_of_strides_of_0_is_refused_before_it_is_built(tmp_path):
    """20,000 units in 13 kB: within a tenth of the memory that such a network takes."""
    content = make_content(8)
    with torch.device("meta"):
        wanted = NEPModule(MLP(units=20_000))
    content["hyper_parameters"] = dict(wanted.hparams)
    content["state_dict"] = OrderedDict(
        (name, torch.zeros(1).expand(tensor.shape)) for name, tensor in wanted.state_dict().items()
    )
    path = tmp_path / "last.ckpt"
    torch.save(content, path)
    assert path.stat().st_size < 50_000
    with pytest.raises(ValueError, match=r"one that nep\.fit wrote, got a tensor of .*last\.ckpt"):
        load_trained(path)


def test_checkpoints_are_read_by_the_same_reader_when_training_goes_on(tmp_path):
    path = tmp_path / "last.ckpt"
    torch.save(make_content(8), path)
    found = WholeCheckpoints().load_checkpoint(path)
    for name, tensor in torch.load(path, weights_only=True)["state_dict"].items():
        assert torch.equal(found["state_dict"][name], tensor)
    torch.save(Call(bytearray, 10), path)
    with pytest.raises(ValueError, match="bytearray"):
        WholeCheckpoints().load_checkpoint(path)


@pytest.mark.parametrize("name", ["stride 0", "deflated", "bytearray", "legacy"])
def test_days_of_homer_are_read_by_it_too(name, tmp_path):
    save, message = HOSTILE[name]
    (tmp_path / "train").mkdir()
    save(tmp_path / "train" / "000.pt")
    with pytest.raises(ValueError, match=rf"day must be a file of tensors, got .*{message}.*000"):
        read_homer(tmp_path)


@pytest.mark.slow
def test_hostile_files_take_no_memory(tmp_path):
    """In a process that may not have 300 MB more than it has after its imports."""
    for name, (save, _) in HOSTILE.items():
        save(tmp_path / f"{name}.pt")
    code = f"""
import resource, sys
from pathlib import Path
import torch
from nep.tensor_file import read_tensors
size = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (size + 300_000_000,) * 2)
for path in sorted(Path({str(tmp_path)!r}).glob("*.pt")):
    try:
        read_tensors(path)
    except ValueError as error:
        assert "MemoryError" not in str(error), (path, error)
"""
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
