"""Import directions: simulator <- datamodules <- nep, and a simulator free of heavy packages."""

import ast
import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("simulator", "datamodules", "nep")
FORBIDDEN = {
    "simulator": {
        "datamodules",
        "dgl",
        "lightning",
        "nep",
        "pytorch_lightning",
        "torch",
        "torchmetrics",
    },
    "datamodules": {"nep"},
    "nep": set(),
}


def find_imports(source: str) -> set[str]:
    """Top-level names of all absolute imports, those inside functions and type checks included."""
    names = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            names.add(node.module)
        elif isinstance(node, ast.Call) and ast.unparse(node.func).endswith(
            ("import_module", "__import__")
        ):
            names |= {str(arg.value) for arg in node.args[:1] if isinstance(arg, ast.Constant)}
    return {name.partition(".")[0] for name in names}


def test_find_imports_sees_every_form():
    source = """
import a.b as x, c
from d.e import f
from . import g
from .h import i
def late():
    import j
    importlib.import_module("k.l")
    importlib.import_module(name)
"""
    assert find_imports(source) == {"a", "c", "d", "j", "k"}


@pytest.mark.parametrize("package", PACKAGES)
def test_no_file_imports_against_the_layers(package):
    files = sorted((ROOT / package).rglob("*.py"))
    assert files, f"{package} has no Python file"
    found = {
        str(file.relative_to(ROOT)): sorted(forbidden)
        for file in files
        if (forbidden := find_imports(file.read_text("utf-8")) & FORBIDDEN[package])
    }
    assert found == {}


def list_loaded(code: str, names: set[str]) -> list[str]:
    """Which of `names` a fresh interpreter holds in `sys.modules` after `code`."""
    report = f"print(json.dumps(sorted({names} & sys.modules.keys())))"
    done = subprocess.run(
        [sys.executable, "-c", f"import json, sys\n{code}\n{report}"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


def test_import_simulator_loads_no_heavy_package():
    heavy = {"matplotlib", "minigrid", "rich", "spacy", "tensorboard"} | FORBIDDEN["simulator"]
    assert list_loaded("from simulator import *", heavy) == []


def test_no_module_of_simulator_loads_an_upper_layer():
    code = """
import importlib, pkgutil, simulator
for module in pkgutil.walk_packages(simulator.__path__, "simulator."):
    if not module.name.endswith("__main__"):
        importlib.import_module(module.name)
"""
    assert list_loaded(code, FORBIDDEN["simulator"]) == []


@pytest.mark.parametrize("package", PACKAGES)
def test_every_folder_with_code_is_a_package(package):
    """A folder without `__init__.py` works in a checkout and is missing from an installed copy."""
    folders = {file.parent for file in (ROOT / package).rglob("*.py")}
    missing = [
        str(folder.relative_to(ROOT))
        for folder in sorted(folders)
        if not (folder / "__init__.py").exists()
    ]
    assert missing == []
