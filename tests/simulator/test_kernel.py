"""Functions that numba compiles when they are first called."""

import ast
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from simulator.kernel import kernel

ROOT = Path(__file__).resolve().parents[2]
FILES = sorted(
    path for path in (ROOT / "simulator").rglob("*.py") if "\n@kernel\n" in path.read_text("utf-8")
)


def test_importing_what_has_kernels_does_not_load_numba():
    modules = [".".join(path.relative_to(ROOT).with_suffix("").parts) for path in FILES]
    assert len(modules) > 8
    code = f"import sys, {', '.join(modules)}; assert 'numba' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True, cwd=ROOT)


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_kernels_call_functions_of_their_own_file_alone(file):
    """Machine code is kept by its file and what that imports, not by what those import in turn."""
    tree, imported = ast.parse(file.read_text("utf-8")), {}
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and str(node.module).startswith(("sgm", "simulator")):
            names = {alias.asname or alias.name for alias in node.names}
            imported |= {name: node.module for name in names if not name.isupper()}
    kernels = [
        node
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef)
        and any(isinstance(mark, ast.Name) and mark.id == "kernel" for mark in node.decorator_list)
    ]
    assert kernels
    used = {
        node.id
        for kernel in kernels
        for statement in kernel.body
        for node in ast.walk(statement)
        if isinstance(node, ast.Name)
    }
    assert not used & imported.keys()


def test_kernels_that_two_files_have_are_equal():
    """Of those that draw numbers, `_draw` alone differs, which says in what."""
    drawn = []
    for life in ("routine", "sessions"):
        file = ROOT / "simulator" / "world" / life / "life_kernel.py"
        functions = [
            node
            for node in ast.parse(file.read_text("utf-8")).body
            if isinstance(node, ast.FunctionDef) and node.name in ("_uniform", "_normal")
        ]
        drawn.append([ast.dump(node) for node in functions])
    assert len(drawn[0]) == 2
    assert drawn[0] == drawn[1]


def make(code: str) -> dict[str, object]:
    """Functions without a file, so that there is nowhere to keep them."""
    namespace = {"kernel": kernel}
    exec(code, namespace)
    return namespace


def test_a_function_that_cannot_be_kept_is_compiled_all_the_same():
    double = make("@kernel\ndef double(number):\n    return 2 * number")["double"]
    assert double(21) == 42
    assert double.compile().nopython_signatures


def test_kernels_call_each_other():
    """Whichever is called first, and themselves."""
    code = """
@kernel
def add(a, b):
    return a + b

@kernel
def total(numbers):
    if len(numbers) == 0:
        return 0.0
    return add(numbers[0], total(numbers[1:]))
"""
    for first in ("total", "add"):
        made = make(code)
        arguments = {"total": (np.arange(4.0),), "add": (1.0, 5.0)}
        total, add = made["total"], made["add"]  # as another module has imported them
        assert {"total": total, "add": add}[first](*arguments[first]) == 6
        assert total(np.arange(5.0)) == 10
        assert add(1, 2) == 3


def test_it_keeps_the_name_and_the_docstring():
    @kernel
    def halve(number: float) -> float:
        """Divide by two."""
        return number / 2

    assert (halve.__name__, halve.__doc__) == ("halve", "Divide by two.")
