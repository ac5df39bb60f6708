"""Modules that have moved: the old names say where to look, and the new ones are there."""

import importlib
import subprocess
import sys

import pytest

from sgm.moved import MOVED
from tests.imports import ROOT, list_modules


def test_every_new_name_is_a_module_and_no_old_one_is():
    modules = list_modules()
    assert [new for new in MOVED.values() if new not in modules] == []
    assert [old for old in MOVED if old in modules] == []
    # Python asks for a folder before what is in it, so that an entry within one is never read.
    assert [old for old in MOVED if any(old.startswith(f"{name}.") for name in MOVED)] == []


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("simulator.priors.household", "sgm.prior.household"),
        ("simulator.memory", "sgm.memory"),
        ("simulator.priors.sources", "tools.priors in a checkout"),
    ],
)
def test_an_import_says_where_it_is(old, new):
    with pytest.raises(ModuleNotFoundError) as caught:
        importlib.import_module(old)
    text = f"module must be imported by its new name, got {old}. Import {new}."
    assert str(caught.value) == text


def test_a_name_that_was_never_there_is_pythons_own_error():
    with pytest.raises(ModuleNotFoundError, match=r"No module named .simulator\.nothing"):
        importlib.import_module("simulator.nothing")


def test_a_command_that_has_moved_says_where():
    done = subprocess.run(
        [sys.executable, "-m", "simulator.realism"],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 1
    assert "Import tools.realism in a checkout." in done.stderr
    assert len(done.stderr.splitlines()) == 1
