"""Programs in which a file of ours says something more, before anything that reads it is loaded."""

import subprocess
import sys

from tests.imports import ROOT

# `change` puts other text in the place of what a module of ours has once.
CHANGE = """
import importlib, sys, types
from pathlib import Path


def change(name, old, new):
    file = Path(name.replace(".", "/") + ".py")
    source = file.read_text("utf-8")
    assert source.count(old) == 1, old
    package, _, last = name.rpartition(".")
    module = types.ModuleType(name)
    setattr(importlib.import_module(package), last, module)
    sys.modules[name] = module
    exec(compile(source.replace(old, new), str(file), "exec"), module.__dict__)


"""


def run_python(*arguments: str) -> list[str]:
    """Run a program with its arguments, where warnings are errors; return the lines it prints."""
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", *arguments],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()
