"""`make docs` builds a page for every module, without a warning."""

import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.slow
def test_pages_are_built_without_warnings(tmp_path, python):
    pytest.importorskip("pdoc", reason="pdoc is not installed: extra docs")
    done = subprocess.run(
        [python, "docs/make_api.py", "--out", str(tmp_path)],
        cwd=ROOT, env={"PYTHONPATH": str(ROOT), "PATH": "", "HOME": str(tmp_path)},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "Warning" not in done.stderr
    modules = [
        path.relative_to(ROOT).with_suffix(".html")
        for package in ("sgm", "nep", "simulator", "datamodules")
        for path in (ROOT / package).rglob("*.py")
        if path.stem not in ("__init__", "__main__")
    ]
    missing = [str(page) for page in modules if not (tmp_path / page).is_file()]
    assert missing == []
    page = (tmp_path / "nep.html").read_text(encoding="utf-8")
    for name in ("ObjectFinder", "SceneGraphMemory", "search_plan", "last_seen"):
        assert f">{name}<" in page
