"""ONNX Runtime starts without its telemetry; that one file imports it stands in test_layers.py."""

import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from sgm.network.onnx_runtime import TELEMETRY, import_onnx_runtime

ROOT = Path(__file__).resolve().parents[3]


def test_loading_a_finder_leaves_no_file_in_the_home_folder(tmp_path):
    kept = {name: os.environ[name] for name in ("PATH", "PYTHONPATH") if name in os.environ}
    code = "import sgm, time; sgm.ObjectFinder.load('any_home'); time.sleep(0.5)"
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=ROOT,
        env={**kept, "HOME": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == []


@pytest.fixture
def runtime(monkeypatch):
    """A module in the place of ONNX Runtime, which counts how often it is told to be silent."""
    told = []
    module = SimpleNamespace(told=told, disable_telemetry_events=lambda: told.append(1))
    monkeypatch.setitem(sys.modules, "onnxruntime", module)
    monkeypatch.delenv(TELEMETRY, raising=False)
    return module


def test_telemetry_is_off_before_the_import_and_after_one_of_another(runtime):
    assert import_onnx_runtime() is runtime
    assert os.environ[TELEMETRY] == "1"
    assert runtime.told == [1]


@pytest.mark.parametrize("value", ["0", "1", ""])
def test_a_setting_of_the_user_stays(runtime, monkeypatch, value):
    monkeypatch.setenv(TELEMETRY, value)
    import_onnx_runtime()
    assert os.environ[TELEMETRY] == value
    assert runtime.told == []


def test_what_a_program_switches_on_later_stays_on(runtime):
    import_onnx_runtime()
    import_onnx_runtime()
    assert runtime.told == [1]
