"""Every benchmark runs, tiny, and prints one JSON line."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[2] / "benchmarks"


@pytest.mark.parametrize("path", sorted(FOLDER.glob("[a-z]*.py")), ids=lambda path: path.stem)
def test_benchmark_prints_one_json_line(path):
    done = subprocess.run(
        [sys.executable, str(path), "--tiny", "--threads", "1"],
        cwd=FOLDER.parent, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    line = json.loads(done.stdout)
    assert line["figure"] > 0
    assert {"benchmark", "unit", "size", "threads", "lowest", "highest"} <= line.keys()
