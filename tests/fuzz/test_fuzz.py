"""A share of `make fuzz`: some mutated files of every kind, each used or refused in one line."""

import subprocess
import sys
from pathlib import Path

import pytest

FUZZ = Path(__file__).parent
KINDS = ("memory", "trace", "prior", "collection", "exported", "checkpoint", "layout")


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_mutated_files_are_used_or_refused(kind):
    command = [sys.executable, str(FUZZ), "--cases", "20", "--kinds", kind]
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=600, cwd=FUZZ.parents[1], check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "20 files tried, 0 findings" in done.stdout
