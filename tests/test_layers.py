"""Import directions: the order of all folders, and a simulator free of heavy packages."""

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


# The parts of the three packages, bottom first: every folder, and files at the top of a package
# that others import. A part imports from those before it alone, so that there is no circle. Other
# files, the package's `__init__.py` among them, count as the package itself; a `__main__.py` is a
# command, on top of all.
ORDER = """
    sgm.arrays sgm.messages sgm.checks sgm.lazy_names simulator.caches
    sgm.files simulator.yaml_text simulator.fan_out simulator.process simulator.compiled
    simulator.priors simulator.text sgm.memory simulator.world sgm.evidence
    simulator.policies simulator.snapshots simulator.tasks sgm.finder simulator.trace
    simulator.drawing simulator.replay simulator.realism simulator.home_options
    simulator.command_line simulator.gym simulator.igridson simulator.collect simulator.testing
    simulator.test_sets simulator datamodules nep.tensor_file nep.importers nep.layers
    nep.encoders nep.model nep.checkpoint_files nep.config_files nep.players nep.report
    nep.kinds nep.robot nep.callbacks nep.fit nep.evaluate nep.paper nep.view nep
""".split()
COMMANDS = "commands"


def find_imports(source: str, *, with_type_checks: bool) -> set[str]:
    """Names of all absolute imports, those inside functions included: "a.b" and "a.b.name"."""
    tree = ast.parse(source)
    left_out = set()
    for node in ast.walk(tree):
        if (
            not with_type_checks
            and isinstance(node, ast.If)
            and ast.unparse(node.test).endswith("TYPE_CHECKING")
        ):
            left_out |= {inner for part in node.body for inner in ast.walk(part)}
    names = set()
    for node in ast.walk(tree):
        if node in left_out:
            continue
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            names |= {f"{node.module}.{alias.name}" for alias in node.names}
        elif isinstance(node, ast.Call) and get_name(node.func).endswith(
            ("import_module", "__import__")
        ):
            names |= {str(arg.value) for arg in node.args[:1] if isinstance(arg, ast.Constant)}
    return names


def get_name(function: ast.expr) -> str:
    """The last part of the name of what is called, "" if it has none."""
    return getattr(function, "attr", getattr(function, "id", ""))


def find_part(name: str) -> str:
    """The part that a module, or a name in it, belongs to."""
    if f".{name}.".endswith(".__main__."):
        return COMMANDS
    part = ".".join(name.split(".")[:2])
    is_folder = (ROOT / part.replace(".", "/")).is_dir()
    return part if is_folder or part in ORDER else part.partition(".")[0]


def list_modules() -> dict[str, Path]:
    """All modules of the three packages by dotted name."""
    files = [file for package in PACKAGES for file in sorted((ROOT / package).rglob("*.py"))]
    names = [".".join(file.relative_to(ROOT).with_suffix("").parts) for file in files]
    return {name.removesuffix(".__init__"): file for name, file in zip(names, files, strict=True)}


def test_find_imports_sees_every_form():
    source = """
import a.b as x, c
from d.e import f
from . import g
from .h import i
if typing.TYPE_CHECKING:
    from m import n
else:
    import o
def late():
    import j
    importlib.import_module("k.l")
    importlib.import_module(name)
"""
    found = {"a.b", "c", "d.e.f", "j", "k.l", "o"}
    assert find_imports(source, with_type_checks=False) == found
    assert find_imports(source, with_type_checks=True) == {*found, "m.n"}


def test_find_part():
    assert find_part("simulator.world.config.HomeConfig") == "simulator.world"
    assert find_part("sgm.files.write_whole") == "sgm.files"
    assert find_part("simulator.HomeConfig") == find_part("simulator") == "simulator"
    assert find_part("datamodules.batch.SGMBatch") == "datamodules"
    assert find_part("simulator.priors.__main__") == COMMANDS


def test_the_order_names_every_folder():
    parts = {find_part(name) for name in list_modules()} - {COMMANDS}
    assert sorted(parts) == sorted(ORDER), "ORDER must name every folder. Put it where it belongs."


def test_every_part_imports_from_those_before_it():
    place = {part: number for number, part in enumerate([*ORDER, COMMANDS])}
    found = [
        f"{name} imports {imported}"
        for name, file in list_modules().items()
        for imported in find_imports(file.read_text("utf-8"), with_type_checks=False)
        if imported.partition(".")[0] in PACKAGES
        and find_part(imported) != find_part(name)
        and place.get(find_part(imported), 0) > place.get(find_part(name), len(place))
    ]
    assert found == []


@pytest.mark.parametrize("package", PACKAGES)
def test_no_file_imports_a_package_that_is_too_heavy_or_above(package):
    files = sorted((ROOT / package).rglob("*.py"))
    assert files, f"{package} has no Python file"
    found = {}
    for file in files:
        imports = find_imports(file.read_text("utf-8"), with_type_checks=True)
        forbidden = {name.partition(".")[0] for name in imports} & FORBIDDEN[package]
        if forbidden:
            found[str(file.relative_to(ROOT))] = sorted(forbidden)
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


@pytest.mark.slow
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
