"""The page of promises names tests and kinds that there are."""

import importlib.util
import re
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
ROWS = [
    [cell.strip() for cell in line.strip("|").split("|")]
    for line in (ROOT / "docs" / "promises.md").read_text("utf-8").splitlines()
    if line.startswith("| ") and not line.startswith(("| promise", "| ---"))
]


@pytest.fixture(scope="module")
def kinds():
    spec = importlib.util.spec_from_file_location("fuzz", ROOT / "tests" / "fuzz" / "__main__.py")
    fuzz = importlib.util.module_from_spec(spec)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "path", list(sys.path))
        spec.loader.exec_module(fuzz)
    return set(fuzz.KINDS)


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row[0][:40])
def test_a_promise_has_its_test(row, kinds):
    _, tests, tried = row
    named = re.findall("`([^`]+)`", tests)
    assert named
    for path, _, function in (name.partition("::") for name in named):
        (file,) = [ROOT / path] if "/" in path else (ROOT / "tests").rglob(path)
        text = file.read_text("utf-8")
        assert not function or f"def {function}(" in text, path
    assert set(re.findall("`([^`]+)`", tried)) <= kinds


def test_every_kind_is_named(kinds):
    assert kinds == {kind for row in ROWS for kind in re.findall("`([^`]+)`", row[2])}
