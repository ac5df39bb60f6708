"""Every benchmark runs, tiny, and prints one JSON line."""

import json
import runpy
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

FOLDER = Path(__file__).resolve().parents[2] / "benchmarks"


@pytest.fixture(autouse=True)
def _fork(monkeypatch, python):
    """What a benchmark measures in processes of its own."""
    monkeypatch.setattr(sys, "executable", python)


def run(path: Path, monkeypatch, *options: str) -> None:
    """Run in this process, which has imported torch already."""
    monkeypatch.syspath_prepend(FOLDER)
    monkeypatch.setattr(sys, "argv", [str(path), "--tiny", *options])
    runpy.run_path(str(path), run_name="__main__")


NEED_DGL = ("heat_conv",)
PATHS = [
    pytest.param(path, id=path.stem, marks=[pytest.mark.dgl] if path.stem in NEED_DGL else [])
    for path in sorted(FOLDER.glob("[a-z]*.py"))
]


@pytest.mark.parametrize("path", PATHS)
def test_benchmark_prints_one_json_line(path, capsys, monkeypatch):
    run(path, monkeypatch, "--threads", "1")
    line = json.loads(capsys.readouterr().out)
    assert 0 < line["lowest"] <= line["median"] <= line["highest"]
    assert line["figure"] in (line["lowest"], line["highest"])
    assert {"benchmark", "unit", "goal", "limit", "is_met", "size", "threads"} <= line.keys()


def test_one_that_fails_is_named_and_stops_no_other(tmp_path, capsys, monkeypatch):
    line = {"benchmark": "one", "figure": 2.0, "unit": "s", "goal": 1, "limit": None}
    line |= {"is_met": False, "size": "small", "threads": 1}
    (tmp_path / "a.py").write_text("raise RuntimeError('too late')")
    (tmp_path / "b.py").write_text(f"print({json.dumps(json.dumps(line))})")
    main = runpy.run_path(str(FOLDER / "__main__.py"))["main"]
    monkeypatch.setitem(main.__globals__, "FOLDER", tmp_path)
    monkeypatch.setattr(sys, "argv", ["benchmarks"])
    with pytest.raises(SystemExit, match=r"got failures of a\.py"):
        main()
    printed = capsys.readouterr().out
    assert json.loads(printed.splitlines()[0]) == line
    assert "small" in printed.splitlines()[-2]


def test_growth_curves_are_measured_and_drawn(tmp_path, capsys, monkeypatch):
    run(FOLDER / "growth", monkeypatch, "--out", str(tmp_path))
    curves = {row.split('"')[1] for row in (tmp_path / "growth.csv").read_text().splitlines()[1:]}
    assert {"look, by objects remembered", "batches of an epoch, by snapshots"} <= curves
    assert json.loads(capsys.readouterr().out).keys() >= curves
    assert (tmp_path / "growth.png").stat().st_size > 10_000
