"""Every benchmark runs, tiny, and prints one JSON line."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[2] / "benchmarks"


def run(*command: str) -> subprocess.CompletedProcess:
    return subprocess.run(
        [sys.executable, *command], cwd=FOLDER.parent, capture_output=True, text=True, check=False
    )


@pytest.mark.parametrize("path", sorted(FOLDER.glob("[a-z]*.py")), ids=lambda path: path.stem)
def test_benchmark_prints_one_json_line(path):
    done = run(str(path), "--tiny", "--threads", "1")
    assert done.returncode == 0, done.stderr
    line = json.loads(done.stdout)
    assert 0 < line["lowest"] <= line["median"] <= line["highest"]
    assert line["figure"] in (line["lowest"], line["highest"])
    assert {"benchmark", "unit", "goal", "limit", "is_met", "size", "threads"} <= line.keys()


def test_growth_curves_are_measured_and_drawn(tmp_path):
    done = run(str(FOLDER / "growth"), "--tiny", "--out", str(tmp_path))
    assert done.returncode == 0, done.stderr
    curves = {row.split('"')[1] for row in (tmp_path / "growth.csv").read_text().splitlines()[1:]}
    assert {"look, by objects remembered", "batches of an epoch, by snapshots"} <= curves
    assert json.loads(done.stdout).keys() >= curves
    assert (tmp_path / "growth.png").stat().st_size > 10_000
