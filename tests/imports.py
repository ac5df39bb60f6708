"""What the modules of the packages import, read from their source: every import counts."""

from __future__ import annotations

import ast
import re
from collections.abc import Mapping
from functools import cache
from graphlib import CycleError, TopologicalSorter
from importlib.util import resolve_name
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("sgm", "simulator", "datamodules", "nep", "tools")  # a package imports those before it
NAMED = re.compile(r"([\w.]+)(?:\.[A-Z]\w*|:\w+)")


def list_modules() -> dict[str, Path]:
    """All modules of the packages by dotted name; a package has the name of its folder."""
    files = [file for package in PACKAGES for file in sorted((ROOT / package).rglob("*.py"))]
    names = [".".join(file.relative_to(ROOT).with_suffix("").parts) for file in files]
    return {name.removesuffix(".__init__"): file for name, file in zip(names, files, strict=True)}


def find_imports(source: str, package: str = "") -> set[str]:
    """Names of all imports, "a.b" or "a.b.name": in functions and under TYPE_CHECKING, too.

    Args:
        source: text of a module.
        package: that the module is in, for its relative imports.
    """
    names: set[str] = set()
    for node in _read(source).imports:
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            module = resolve_name("." * node.level + (node.module or ""), package)
            names |= {f"{module}.{alias.name}" for alias in node.names}
        else:
            names |= {arg.value for arg in node.args[:1] if _is_text(arg)}
    return names


def list_classes(source: str) -> list[str]:
    """Names of all classes of a module."""
    return _read(source).classes


def find_named(source: str, modules: Mapping[str, Path]) -> set[str]:
    """The modules of all strings "module.Class" and "module:function": registries import them."""
    parts = [NAMED.fullmatch(text) for text in _read(source).texts]
    return {part[1] for part in parts if part is not None and part[1] in modules}


def find_module(name: str, modules: Mapping[str, Path]) -> str:
    """The module of ours that an import names, "" if it is none.

    "a.b.c" names module a.b.c, or else something in a.b. It does not name the packages a and a.b,
    although Python runs their `__init__.py`: what these hand on is the business of who asks them
    for it.
    """
    while name and name not in modules:
        name = name.rpartition(".")[0]
    return name


def find_part(module: str) -> str:
    """The part that a module belongs to: a folder, or a file, at the top of a package.

    A package's own `__init__.py` is a part. `datamodules` has no folders and is one part. Files
    `__main__.py` are the commands of a package, and one part.
    """
    package, *rest = module.split(".")
    if rest and rest[-1] == "__main__":
        return f"{package}.__main__"
    return package if package == "datamodules" or not rest else f"{package}.{rest[0]}"


def list_module_imports() -> dict[str, set[str]]:
    """The modules of ours that each module imports, itself left out."""
    modules = list_modules()
    graph = {}
    for name, file in modules.items():
        package = name if file.name == "__init__.py" else name.rpartition(".")[0]
        imports = find_imports(file.read_text("utf-8"), package)
        graph[name] = {find_module(imported, modules) for imported in imports} - {"", name}
    return graph


def find_circle(graph: Mapping[str, set[str]]) -> list[str]:
    """One circle of imports, each module before the one that imports it; [] if there is none."""
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


def count_floors(graph: Mapping[str, set[str]], folder: str) -> int:
    """How many files of a folder the longest chain of imports among them has; no circle in it."""
    own = {name for name in graph if name.startswith(f"{folder}.")}
    floors: dict[str, int] = {}
    for name in TopologicalSorter({name: graph[name] & own for name in own}).static_order():
        floors[name] = 1 + max((floors[below] for below in graph[name] & own), default=0)
    return max(floors.values())


class _Read(NamedTuple):
    """What is asked of the source of a module: its imports, classes and strings."""

    imports: list[ast.Import | ast.ImportFrom | ast.Call]
    classes: list[str]
    texts: set[str]


@cache  # parsing and walking 350 files takes seconds
def _read(source: str) -> _Read:
    read = _Read([], [], set())
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import | ast.ImportFrom):
            read.imports.append(node)
        elif isinstance(node, ast.Call):
            if _get_name(node.func) in ("import_module", "__import__"):
                read.imports.append(node)
        elif isinstance(node, ast.ClassDef):
            read.classes.append(node.name)
        elif _is_text(node):
            read.texts.add(node.value)
    return read


def _get_name(function: ast.expr) -> str:
    """The last part of the name of what is called, "" if it has none."""
    return getattr(function, "attr", getattr(function, "id", ""))


def _is_text(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and isinstance(node.value, str)
