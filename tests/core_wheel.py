"""The wheel of `sgm` in a fresh environment without torch: README's lines and the tests of `sgm`.

    python tests/core_wheel.py [--python /path/to/python3.13] [arguments of pytest]

`make core-test` builds the wheel into dist/ before. The Python is the newest supported one on PATH.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
NEWEST_FIRST = ("3.13", "3.12", "3.11", "3.10")
# What the tests of `sgm` need beside it: homes to ask about, the pages whose code they run.
BESIDE = ("tests", "simulator", "docs", "README.md", "setup.cfg")
TEST_PACKAGES = ("pytest", "pytest-xdist", "hypothesis", "filelock", "packaging")
HEAVY = ("torch", "dgl", "lightning", "spacy", "scipy")


def find_python() -> str:
    """Return the newest supported Python that runs and has `venv`: on PATH, or installed by pyenv.

    What pyenv puts on PATH runs only the version that is chosen in the folder.
    """
    pyenv = Path(os.environ.get("PYENV_ROOT") or Path.home() / ".pyenv")
    folders = [*os.get_exec_path(), *sorted(pyenv.glob("versions/*/bin"), reverse=True)]
    for version in NEWEST_FIRST:
        for folder in folders:
            python = Path(folder) / f"python{version}"
            check = [str(python), "-c", "import ensurepip, venv"]
            if python.exists() and not subprocess.run(check, capture_output=True).returncode:
                return str(python)
    raise SystemExit(f"Python must be one of {', '.join(NEWEST_FIRST)}, got none on PATH.")


def measure_size(folder: Path) -> float:
    """Return the size of the installed packages in MB, those that only install others left out."""
    files = (file for file in folder.rglob("*") if file.is_file() and not file.is_symlink())
    return sum(file.stat().st_size for file in files if "/pip" not in str(file)) / 1e6


def main() -> int:
    """Install, run the lines of README, run the tests."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--python", default=None)
    arguments, for_pytest = parser.parse_known_args()
    python = arguments.python or find_python()
    (wheel,) = (ROOT / "dist").glob("scene_graph_memory_core-*.whl")
    with tempfile.TemporaryDirectory(prefix="core-") as name:
        folder = Path(name)
        subprocess.run([python, "-m", "venv", folder / "env"], check=True)
        own = folder / "env" / "bin" / "python"
        install = [own, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
        install += ["--constraint", ROOT / "constraints.txt"]
        subprocess.run([*install, wheel], check=True)
        packages = next((folder / "env" / "lib").glob("python*/site-packages"))
        print(f"{python}: {measure_size(packages):.0f} MB installed")
        for package in HEAVY:
            assert not (packages / package).exists(), f"{package} came with the core"
        subprocess.run([*install, *TEST_PACKAGES], check=True)
        for part in BESIDE:
            source = ROOT / part
            if source.is_dir():
                ignore = shutil.ignore_patterns("__pycache__")
                shutil.copytree(source, folder / "home" / part, ignore=ignore)
            else:
                shutil.copy(source, folder / "home" / part)
        environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
        (lines,) = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text("utf-8"), re.S)
        done = subprocess.run(
            [own, "-c", lines], cwd=folder, env=environment, capture_output=True, text=True
        )
        print(done.stdout + done.stderr, flush=True)
        if done.returncode:
            return 1
        tests = [own, "-m", "pytest", "-n", "2", "--dist", "loadfile", "-q", "-m", "not slow"]
        return subprocess.run(
            [*tests, *(for_pytest or ["tests/sgm"])], cwd=folder / "home", env=environment
        ).returncode


if __name__ == "__main__":
    sys.exit(main())
