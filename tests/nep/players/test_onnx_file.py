"""A file `network.onnx`: what is not ours is refused before ONNX Runtime sees it."""

import hashlib
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper, numpy_helper

from sgm.network.network import CONFIG, INPUTS, ONNX, Network
from sgm.network.onnx_check import check_onnx
from sgm.network.shipped import PRETRAINED

ROOT = Path(__file__).parents[2]


@pytest.fixture
def folder(tmp_path):
    """A copy of the shipped network, to spoil."""
    for name in (CONFIG, ONNX):
        (tmp_path / name).write_bytes((PRETRAINED / "any_home" / name).read_bytes())
    return tmp_path


@pytest.fixture
def model():
    return onnx.load_from_string((PRETRAINED / "any_home" / ONNX).read_bytes())


def edit(folder, *path, value):
    """Change one entry of the config."""
    config = json.loads((folder / CONFIG).read_text("utf-8"))
    part = config
    for name in path[:-1]:
        part = part[name]
    part[path[-1]] = value
    (folder / CONFIG).write_text(json.dumps(config), encoding="utf-8")


def put(folder, content):
    """Write an ONNX file, with the checksum that it has."""
    (folder / ONNX).write_bytes(content)
    edit(folder, "onnx", "sha256", value=hashlib.sha256(content).hexdigest())


def test_the_file_that_ships_is_valid_onnx(model):
    onnx.checker.check_model(model, full_check=True)
    assert [given.name for given in model.graph.input] == list(INPUTS)
    check_onnx(model.SerializeToString())


def test_the_file_alone_is_needed_beside_the_config(folder):
    assert Network.load(folder).checksum == Network.load(PRETRAINED / "any_home").checksum


def add_operator(model, operator="Add", inputs=("place", "place"), **options):
    model.graph.node.append(helper.make_node(operator, inputs, ["new"], **options))


def add_constant(model, values):
    model.graph.initializer.append(numpy_helper.from_array(np.asarray(values), "large"))


def add_external(model):
    tensor = model.graph.initializer[0]
    tensor.data_location = TensorProto.EXTERNAL
    tensor.external_data.add(key="location", value="/etc/passwd")


def add_outer_product(model):
    add_constant(model, np.ones((4096, 1), np.float32))
    add_operator(model, inputs=("large", "place"))


def add_short_constant(model):
    add_constant(model, np.ones(4, np.float32))
    model.graph.initializer[-1].dims[0] = 2**40


def add_branch(model):
    branch = helper.make_graph([], "branch", [], [])
    add_operator(model, "If", ["is_place"], then_branch=branch, else_branch=branch)


def add_function(model):
    model.functions.append(helper.make_function("ai.own", "F", ["x"], ["y"], [], []))


SPOILED = {
    "an operator of another kind": (lambda m: add_operator(m, "Tile"), "operator 'Tile'"),
    "a loop": (lambda m: add_operator(m, "Loop"), "operator 'Loop'"),
    "branches": (add_branch, "operator 'If'"),
    "a custom domain": (
        lambda m: m.opset_import.append(helper.make_opsetid("ai.own", 1)),
        "operators from outside ONNX",
    ),
    "an operator of a custom domain": (lambda m: add_operator(m, domain="ai.own"), "field 7 of"),
    "functions": (add_function, "field 25 of the model"),
    "data in another file": (add_external, "field 1[34] of the tensor"),
    "a constant that is too short": (add_short_constant, "a constant of shape"),
    "a constant that is not finite": (
        lambda m: add_constant(m, np.full(3, np.nan, np.float32)),
        "not finite everywhere",
    ),
    "a constant twice": (
        lambda m: (add_constant(m, np.ones(3)), add_constant(m, np.ones(4))),
        "two constants of one name",
    ),
    "a constant of text": (
        lambda m: add_constant(m, np.array(["a"], dtype=object)),
        "field 6 of the tensor|a constant of another type",
    ),
    "an outer product": (add_outer_product, "Add of a constant"),
    "a product of what was computed": (
        lambda m: add_operator(m, "MatMul"),
        "MatMul without a constant of 2 axes",
    ),
    "axes that move": (
        lambda m: add_operator(m, "ReduceSum", ["place", "constant_1"], keepdims=0),
        "attribute 'keepdims'",
    ),
    "no graph": (lambda m: m.ClearField("graph"), "0 graphs"),
    "another input": (
        lambda m: m.graph.input.append(
            helper.make_tensor_value_info("more", TensorProto.FLOAT, [1])
        ),
        "inputs ",
    ),
}


@pytest.mark.parametrize("name", SPOILED)
def test_what_is_not_ours_is_refused(name, folder, model):
    spoil, message = SPOILED[name]
    spoil(model)
    put(folder, model.SerializeToString())
    with pytest.raises(ValueError, match=message) as caught:
        Network.load(folder)
    assert "Export again with `python -m nep.export`" in str(caught.value)


@pytest.mark.parametrize("seed", range(60))
def test_a_damaged_file_is_refused_or_answers(seed, folder):
    """Bytes changed or cut off: a ValueError, or a network like any other."""
    rng = np.random.default_rng(seed)
    content = bytearray((folder / ONNX).read_bytes())
    for at in rng.integers(0, 3000 if seed % 2 else len(content), 4):
        content[at] = rng.integers(256)
    put(folder, bytes(content[: len(content) - (seed % 3) * 1000]))
    said = ""
    try:
        Network.load(folder)
    except ValueError as error:
        said = str(error)
    assert said == "" or "network.onnx must be as nep.export wrote it" in said


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        (["onnx", "sha256"], "0" * 64, r"network\.onnx must be that of config\.json, got another"),
        (["onnx", "evidence"], 2, "must read version 3 of the evidence, got 2"),
        (["schema", "text"], "fr_maison-2", "text vectors must be 'fr_maison-2', got en_househ"),
        (["onnx"], [], "must be one that nep.export wrote, got TypeError"),
    ],
)
def test_a_config_of_another_network_is_refused(path, value, message, folder):
    edit(folder, *path, value=value)
    with pytest.raises(ValueError, match=message):
        Network.load(folder)


def test_missing_and_oversized_files_are_named(folder, monkeypatch):
    monkeypatch.setattr("sgm.network.network._MOST_BYTES", 1000)
    with pytest.raises(ValueError, match=r"network\.onnx must have at most 1000 bytes"):
        Network.load(folder)
    (folder / ONNX).unlink()
    with pytest.raises(ValueError, match=r"must have config\.json and network\.onnx"):
        Network.load(folder)


WITHOUT_TORCH = """
import json, sys
for name in ("torch", "dgl", "lightning", "pytorch_lightning", "scipy"):
    sys.modules[name] = None  # as if it were not installed
from sgm import ObjectFinder, SceneGraphMemory, Sighting
memory = SceneGraphMemory()
room = memory.add_room("kitchen")
table, sink = (memory.add_furniture(name, room) for name in ("table", "sink"))
memory.observe(table, [Sighting("red mug")])
memory.step()
found = ObjectFinder.load().rank(memory, "red mug")
try:
    ObjectFinder.load("heat")
except ValueError as error:
    said = str(error)
loaded = {name.partition(".")[0] for name, module in sys.modules.items() if module is not None}
print(json.dumps([[place.name for place in found], said, sorted(loaded)]))
"""


@pytest.mark.slow
def test_the_shipped_network_answers_where_torch_is_not_installed():
    command = [sys.executable, "-c", WITHOUT_TORCH]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    places, said, loaded = json.loads(done.stdout)
    assert places == ["table in kitchen", "sink in kitchen"]
    assert said.startswith("network must read evidence alone to be run without torch, got one")
    assert "\n" not in said
    assert "onnxruntime" in loaded
    assert {"torch", "dgl", "lightning", "datamodules", "onnx", "scipy"}.isdisjoint(loaded)


def test_the_folder_imports_no_heavy_package():
    """Nor do its functions: `sgm` runs where nothing of it is installed."""
    heavy = ("torch", "dgl", "lightning", "datamodules", "nep", "onnx ", "onnx.", "scipy")
    files = sorted((ROOT / "sgm").rglob("*.py"))
    assert files
    for file in files:
        for line in file.read_text("utf-8").splitlines():
            words = f"{line.strip()} ".split(" ", 2)
            if words[0] in ("import", "from"):
                assert not f"{words[1]} ".startswith(heavy), f"{file}: {line}"
