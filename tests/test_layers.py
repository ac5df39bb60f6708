"""Import directions: the order of packages and folders, no circles, and no heavy packages."""

import ast
import itertools
import json
import re
import subprocess
import sys
from collections.abc import Collection

import pytest
from PIL import Image

from tests.imports import (
    PACKAGES,
    ROOT,
    count_floors,
    find_circle,
    find_imports,
    find_module,
    find_named,
    find_part,
    list_classes,
    list_module_imports,
    list_modules,
)

DESIGN = (ROOT / "docs" / "design.md").read_text(encoding="utf-8")
# The parts of the packages, bottom first: every folder and file at the top of a package. A part
# imports from those before it alone. A package's own name is its `__init__.py`; its `__main__` are
# the commands of all its folders.
ORDER = """
    sgm.schema sgm.messages sgm.checks sgm.lazy_names sgm.files sgm.arrays sgm.text
    sgm.prior sgm.names sgm.layout sgm.store sgm.memory sgm.replay sgm.belief sgm.evidence
    sgm.policies
    sgm.network sgm.finder sgm.camera sgm.mapping sgm.eyes sgm.ros sgm.serve sgm.export sgm.check
    sgm.backup sgm
    sgm.__main__
    simulator.caches simulator.kernel_store simulator.kernel simulator.yaml_text simulator.process
    simulator.fan_out
    simulator.priors simulator.world simulator.policies
    simulator.snapshots simulator.tasks simulator.events simulator.trace simulator.drawing
    simulator.story
    simulator.home_options simulator.command_line simulator.import_command simulator.gym
    simulator.igridson
    simulator.box_world simulator.collect simulator.compile simulator.testing simulator.test_sets
    simulator simulator.__main__
    datamodules
    nep.tensor_file nep.importers nep.config_files nep.training nep.paper nep.any_home
    nep.players nep.report nep.robot nep.callbacks nep.view nep.fit
    nep.evaluate nep.export nep.compare nep.games nep.igridson nep.reproduce
    nep
    nep.__main__
    tools.bench tools.priors tools.text_training tools.realism tools.names tools.eyes tools.searches
    tools.elsewhere tools.kitchens tools.rhythm tools.patrols tools.measure_design
    tools.headlines tools.closures tools.install
    tools tools.__main__
""".split()
# Plug-ins of packages above, which a registry names and imports only where they are asked for.
PLUGINS = {("simulator.trace.importers", "nep.importers.homer")}  # its files need torch
# What commands of a folder take from above it: the options that commands share, and one command.
COMMANDS = {
    ("simulator.priors", "simulator.command_line"),
    ("simulator.priors", "simulator.trace"),  # from-trace counts a prior
    ("simulator.trace", "simulator.command_line"),
    ("simulator.trace", "simulator.home_options"),
    ("simulator.trace", "simulator.import_command"),
}
# What needs a learnt network; the simulator needs none.
LEARNING = {"dgl", "lightning", "pytorch_lightning", "torch", "torchmetrics"}
# All that `sgm` imports beside the standard library, and what single files import when asked to.
SGM_NEEDS = {"numpy", "sgm"}
SGM_OPTIONAL = {
    "sgm/eyes/__main__.py": {"yaml"},
    "sgm/export/mcap_file.py": {"foxglove_schemas_protobuf", "google", "mcap"},
    "sgm/files.py": {"filelock"},
    "sgm/memory/memory_things.py": {"pandas"},
    "sgm/memory/scene_graph_memory.py": {"pandas"},
    "sgm/memory/spark_graph.py": {"spark_dsg"},
    "sgm/network/hub.py": {"huggingface_hub"},
    "sgm/network/onnx_runtime.py": {"onnxruntime"},
    "sgm/ros/compressed_depth.py": {"PIL"},
    "sgm/serve/application.py": {"starlette"},
    "sgm/serve/server.py": {"uvicorn"},
    "sgm/serve/tools.py": {"mcp", "starlette"},
    "sgm/text/vectors.py": {"spacy"},
    "sgm/text/tok2vec.py": {"safetensors"},
}
# Names of files and folders that say nothing from outside.
NO_NAMES = "base common expected helpers kinds misc others stage still utils ways".split()
SAYS_NOTHING = ("it", "one", "ones", "own")  # as a variable, a field or a parameter
HEAVY = LEARNING | {"matplotlib", "minigrid", "rich", "spacy", "tensorboard"}


def test_find_imports_sees_every_form():
    source = """
import a.b as x, c
from d.e import f
from . import g
from ..h import i
if typing.TYPE_CHECKING:
    from m import n
else:
    import o
def late():
    import j
    importlib.import_module("k.l")
    importlib.import_module(name)
"""
    found = {"a.b", "c", "d.e.f", "own.home.g", "own.h.i", "m.n", "o", "j", "k.l"}
    assert find_imports(source, "own.home") == found


def test_find_module():
    modules = list_modules()
    assert find_module("simulator.world.config.HomeConfig", modules) == "simulator.world.config"
    assert find_module("simulator.world.config", modules) == "simulator.world.config"
    assert find_module("simulator.HomeConfig", modules) == "simulator"
    assert find_module("sgm.policies.Bayesian", modules) == "sgm.policies"
    assert find_module("numpy.random", modules) == ""


def test_find_named():
    modules = list_modules()
    assert find_named('A = {"a": "simulator.world.streams.Streams"}', modules) == {
        "simulator.world.streams"
    }
    assert find_named('read("sgm.files:read_json")', modules) == {"sgm.files"}
    assert find_named('print("sgm.files", "sgm.files.", "own.module.Class")', modules) == set()


def test_find_part():
    assert find_part("simulator.world.routine.life") == find_part("simulator.world")
    assert find_part("simulator.world") == "simulator.world"
    assert find_part("sgm.files") == "sgm.files"
    assert find_part("simulator") == "simulator"
    assert find_part("datamodules.batch") == find_part("datamodules") == "datamodules"
    assert find_part("simulator.priors.__main__") == "simulator.__main__"


def test_find_circle():
    assert find_circle({"a": {"b"}, "b": {"c"}, "c": set()}) == []
    circle = find_circle({"a": {"b"}, "b": {"c"}, "c": {"b"}})
    assert circle in (["b", "c", "b"], ["c", "b", "c"])


def test_count_floors():
    graph = {"a.b": {"a.c", "x"}, "a.c": {"a.d"}, "a.d": set(), "a.e": {"a.d"}, "x": {"a.e"}}
    assert count_floors(graph, "a") == 3


def test_a_memory_has_few_floors():
    """Who changes a part has to walk no farther down."""
    assert count_floors(list_module_imports(), "sgm.memory") <= 6


@pytest.mark.parametrize("folder", ["sgm.camera", "sgm.mapping", "sgm.eyes"])
def test_what_makes_looks_and_maps_of_frames_has_few_floors(folder):
    assert count_floors(list_module_imports(), folder) <= 5


def test_the_order_names_every_folder_package_by_package():
    parts = {find_part(name) for name in list_modules()}
    assert sorted(parts) == sorted(ORDER), "ORDER must name every folder. Put it where it belongs."
    packages = [part.partition(".")[0] for part in ORDER]
    assert tuple(name for name, _ in itertools.groupby(packages)) == PACKAGES


def test_docs_name_every_part_in_the_rows_of_its_package():
    section = DESIGN.partition("\n## Layers\n")[2].partition("\n## ")[0]
    rows = [line.split("|")[1:3] for line in section.splitlines() if line.startswith("|")][2:]
    package, named = "", []
    for first, folders in rows:
        package = first.strip(" `") or package
        named += [f"{package}.{name}" for name in re.findall(r"\w+", folders)] or [package]
    own = {"sgm", "simulator", "nep", "tools"}  # `__init__.py`, beside folders
    parts = [part for part in ORDER if part not in own and not part.endswith(".__main__")]
    assert sorted(named) == sorted(parts)


def test_picture_shows_every_part():
    image = Image.open(ROOT / "docs" / "images" / "layers.png")
    shown = image.text["Description"].split()
    parts = {*ORDER} - {"sgm", "simulator", "nep", "tools"}
    assert sorted(shown) == sorted(parts), "Draw it again: python -m docs.draw_layers"


@pytest.mark.slow
def test_every_part_imports_from_those_before_it():
    """Strings that name a class count, too: a registry imports it when it is asked to."""
    place = {part: number for number, part in enumerate(ORDER)}
    modules, graph = list_modules(), list_module_imports()
    up = {
        (name, imported)
        for name, file in modules.items()
        for imported in graph[name] | find_named(file.read_text("utf-8"), modules)
        if place[find_part(imported)] > place[find_part(name)]
    }
    assert up == PLUGINS


def test_commands_of_a_folder_import_from_those_before_it():
    place = {part: number for number, part in enumerate(ORDER)}
    up = set()
    for name, imports in list_module_imports().items():
        folder = find_part(name.removesuffix(".__main__"))
        if name.endswith(".__main__") and folder in place:
            parts = map(find_part, imports)
            up |= {(folder, part) for part in parts if place[part] > place[folder]}
    assert up == COMMANDS


def test_no_modules_import_each_other_in_a_circle():
    """Registries do not count: they name classes that build on what stands beside the names."""
    graph = list_module_imports()
    assert len(graph) > 300, "modules must have been found"
    assert graph["sgm.memory.scene_graph_memory"], "imports must have been found"
    assert find_circle(graph) == []


@pytest.mark.parametrize("package", PACKAGES)
def test_names_that_load_late_are_imported_for_types(package):
    """So that `load_lazily` hides no import from the tests above."""
    module = pytest.importorskip(package, reason=f"{package} is not installed")
    late = getattr(module, "_MODULES", {})
    source = (ROOT / package / "__init__.py").read_text("utf-8")
    assert {f"{path}.{name}" for name, path in late.items()} <= find_imports(source, package)
    assert bool(late) == ("load_lazily(" in source)


def find_external(package: str) -> dict[str, set[str]]:
    """Packages that each file of a package imports, the standard library's left out."""
    return {
        str(file.relative_to(ROOT)): {
            name.partition(".")[0] for name in find_imports(file.read_text("utf-8"), module)
        }
        - sys.stdlib_module_names
        for module, file in list_modules().items()
        if module.partition(".")[0] == package
    }


def test_names_of_classes_are_unique_over_all_packages():
    defined: dict[str, list[str]] = {}
    for module, file in list_modules().items():
        for name in list_classes(file.read_text("utf-8")):
            defined.setdefault(name, []).append(module)
    assert len(defined) > 300, "classes must have been found"
    assert {name: modules for name, modules in defined.items() if len(modules) > 1} == {}


def list_bound(source: str, words: Collection[str] = SAYS_NOTHING) -> list[tuple[str, int]]:
    """List the variables, fields and parameters of a module that say nothing, and their lines."""
    return [
        (name, node.lineno)
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.arg)
        or (isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store))
        if (name := node.arg if isinstance(node, ast.arg) else node.id) in words
    ]


def test_list_bound_sees_every_form():
    source = """
class A:
    own: int
def f(one, *ones, it=0):
    for own, (other, it) in one.own: pass
    with one as ones: own = [it for it in ones if (one := it)]
    return lambda own: own.it
"""
    found = [name for name, _ in list_bound(source)]
    assert sorted(found) == ["it"] * 3 + ["one"] * 2 + ["ones"] * 2 + ["own"] * 4


@pytest.mark.parametrize("folder", ["simulator", "datamodules", "nep", "tools", "benchmarks"])
def test_a_variable_says_what_its_value_is(folder):
    """Thing, sighting, place, logits, posterior, ...: no word that may be anything."""
    files = sorted((ROOT / folder).rglob("*.py"))
    assert files
    found = {
        file.relative_to(ROOT).as_posix(): list_bound(file.read_text("utf-8")) for file in files
    }
    assert {name: bound for name, bound in found.items() if bound} == {}


@pytest.mark.parametrize(
    "part",
    "arrays belief evidence export eyes finder layout memory names network policies prior replay "
    "ros serve store text".split(),
)
def test_a_variable_of_sgm_says_what_its_value_is(part):
    """Detection, sighting, box, volume, position, area, ...: no pronoun and no adverb either."""
    words = {*SAYS_NOTHING, "at", "here", "is_it", "rest", "there", "what", "which"}
    if part in ("memory", "finder"):
        words.remove("at")  # as in every call: the time that is asked about
    if part == "finder":
        words.remove("what")  # has happened: a field of answers
    files = sorted((ROOT / "sgm" / part).rglob("*.py"))
    assert files
    found = {file.name: list_bound(file.read_text("utf-8"), words) for file in files}
    assert {name: bound for name, bound in found.items() if bound} == {}


@pytest.mark.parametrize("word", NO_NAMES)
def test_files_and_folders_say_what_is_in_them(word):
    names = {part for name in list_modules() for part in name.split(".")}
    assert word not in names


def test_sgm_imports_numpy_alone():
    found = find_external("sgm")
    assert "numpy" in set().union(*found.values())
    for file, names in found.items():
        assert names - SGM_NEEDS == SGM_OPTIONAL.get(file, set()), file


def test_one_file_imports_onnxruntime():
    """The one that switches its telemetry off."""
    packages = ("sgm", "simulator", "datamodules", "nep", "tools")
    found = {file: names for package in packages for file, names in find_external(package).items()}
    importing = {file for file, names in found.items() if "onnxruntime" in names}
    assert importing == {"sgm/network/onnx_runtime.py"}


def test_simulator_imports_no_network():
    found = find_external("simulator")
    assert "numpy" in set().union(*found.values())
    assert {file: names & LEARNING for file, names in found.items() if names & LEARNING} == {}


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


@pytest.mark.parametrize(
    ("code", "others"),
    [
        ("import sgm", {"numpy", "numba", "scipy", "simulator"}),
        ("from sgm import *", {"scipy", "simulator"}),
        ("from simulator import *", set()),
    ],
)
def test_public_names_load_no_heavy_package(code, others):
    assert list_loaded(code, HEAVY | others) == []


@pytest.mark.slow
@pytest.mark.parametrize(
    ("package", "others"),
    [
        ("sgm", {"datamodules", "filelock", "nep", "pandas", "simulator"} | HEAVY),
        ("simulator", {"datamodules", "nep"} | LEARNING),
    ],
)
def test_no_module_loads_an_upper_package_or_a_heavy_one(package, others):
    code = f"""
import importlib, pkgutil, {package}
for module in pkgutil.walk_packages({package}.__path__, "{package}."):
    if not module.name.endswith("__main__"):
        importlib.import_module(module.name)
"""
    assert list_loaded(code, others) == []


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
