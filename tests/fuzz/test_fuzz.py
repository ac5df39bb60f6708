"""A share of `make fuzz`: some cases of every kind, each ending well or with one line."""

import subprocess
import sys
from pathlib import Path

import pytest

FUZZ = Path(__file__).parent
# Of each kind, how many cases: a share of what `make fuzz` tries.
KINDS = {
    "memory": 20, "trace": 20, "prior": 20, "collection": 20, "exported": 20, "checkpoint": 20,
    "layout": 20, "session": 10, "command": 10, "writing": 15,
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_nothing_is_found(kind):
    command = [sys.executable, str(FUZZ), "--cases", str(KINDS[kind]), "--kinds", kind]
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=600, cwd=FUZZ.parents[1], check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert f"{KINDS[kind]} cases tried, 0 findings" in done.stdout
