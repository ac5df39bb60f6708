"""The wheels of dist/ in fresh environments, in a folder that is not the repository.

    python tests/wheels.py core [--python /path/to/python3.13] [arguments of pytest]
    python tests/wheels.py research [--python /path/to/python3.13] [arguments of pytest]
    python tests/wheels.py newest [arguments of pytest]

`core` has no torch: README's lines, the tests of `sgm`, and those of simulated homes, on the newest
supported Python that is found. `research` has both wheels: README's lines, a tiny training, the
page of a memory, its server, types as a user's mypy sees them, and that `sgm` stays when the rest
is uninstalled; tests only where they are named. `newest` is `research` on the newest Python with a
fast share of the tests, where torch comes without CUDA, which is several GB. `make dist` builds the
wheels before.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import urllib.request
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
NEWEST_FIRST = ("3.14", "3.13", "3.12", "3.11", "3.10")
# What the tests need beside the packages: the pages whose code they run, homes to ask about.
FILES = ("tests", "docs", "README.md", "setup.cfg", "CONTRIBUTING.md")
# Homes of the tests come from the simulator, which needs numba, scipy, joblib and tqdm.
# Maps need PyYAML, depth images Pillow.
TEST_PACKAGES = (
    "pytest pytest-xdist hypothesis filelock packaging numba scipy joblib pyyaml pillow tqdm"
).split()
HEAVY = ("torch", "dgl", "lightning", "spacy", "scipy", "numba")
LIGHT = ("-m", "not slow", "tests/sgm", "tests/simulator/world", "tests/simulator/snapshots")
FAST = ("-m", "not slow", "tests/datamodules", "tests/nep/paper", "tests/nep/training")
TINY_FIT = (
    "--config heat.yaml --data.num_homes 2 --data.steps 4 --data.num_val_homes 1 "
    "--data.batch_size 4 --data.workers 1 --trainer.max_epochs 1 --online.num_homes 1 "
    "--online.steps 1 --online.policies [] --threads 1 --trainer.enable_progress_bar false"
).split()
TYPES = """
reveal_type(finder.rank(memory, "mug"))
reveal_type(finder.rank(memory, "mug").places[0].probability)
"""
REVEALED = ('"sgm.finder.ranking.Ranking"', '"float"')


def find_python(versions: Sequence[str] = NEWEST_FIRST) -> str:
    """Return the first of some versions of Python that runs and has `venv`: on PATH, or of pyenv.

    What pyenv puts on PATH runs only the version that is chosen in the folder.
    """
    pyenv = Path(os.environ.get("PYENV_ROOT") or Path.home() / ".pyenv")
    folders = [*os.get_exec_path(), *sorted(pyenv.glob("versions/*/bin"), reverse=True)]
    for version in versions:
        for folder in folders:
            python = Path(folder) / f"python{version}"
            check = [str(python), "-c", "import ensurepip, venv"]
            if python.exists() and not subprocess.run(check, capture_output=True).returncode:
                return str(python)
    raise SystemExit(f"Python must be one of {', '.join(versions)}, got none on PATH.")


class Environment:
    """A virtual environment, and an empty folder that commands run in.

    Args:
        folder: where to make both.
        python: interpreter that it is made from.
    """

    def __init__(self, folder: Path, python: str) -> None:
        subprocess.run([python, "-m", "venv", folder / "env"], check=True)
        self.commands = folder / "env" / "bin"
        self.python = self.commands / "python"
        self.packages = next((folder / "env" / "lib").glob("python*/site-packages"))
        self.work = folder / "work"
        self.work.mkdir()
        # No folder of the repository is searched.
        self.variables = {k: value for k, value in os.environ.items() if k != "PYTHONPATH"}

    def install(self, *packages: str | Path) -> None:
        """Install packages of the versions of constraints.txt; among them may be options of pip."""
        pip = [self.python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
        command = [*pip, "--constraint", ROOT / "constraints.txt", *packages]
        subprocess.run(command, env=self.variables, check=True)

    def run(self, *command: str | Path) -> str:
        """Run a command of the environment in its folder; return what it prints."""
        command = (self.commands / command[0], *command[1:])
        print(
            "$", *command[:1], *(str(word).partition("\n")[0] for word in command[1:]), flush=True
        )
        done = subprocess.run(
            command, cwd=self.work, env=self.variables, capture_output=True, text=True
        )
        if done.returncode:
            raise SystemExit(f"{done.stdout}\n{done.stderr}\nstatus {done.returncode}")
        return done.stdout

    def test(self, arguments: list[str]) -> int:
        """Run tests of the repository with the installed packages; return pytest's status."""
        for name in FILES:
            source = ROOT / name
            if source.is_dir():
                ignore = shutil.ignore_patterns("__pycache__")
                shutil.copytree(source, self.work / name, ignore=ignore)
            else:
                shutil.copy(source, self.work / name)
        pytest = [self.python, "-m", "pytest", "-n", "2", "--dist", "loadfile", "-q"]
        return subprocess.run([*pytest, *arguments], cwd=self.work, env=self.variables).returncode


def find_wheel(name: str) -> Path:
    """Return a wheel of dist/."""
    found = [*(ROOT / "dist").glob(f"{name}-*.whl")]
    if len(found) != 1:
        raise SystemExit(f"dist must have one wheel of {name}, got {len(found)}. Run `make dist`.")
    return found[0]


def read_lines() -> str:
    """Return the twenty lines of README."""
    (lines,) = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text("utf-8"), re.S)
    return lines


def measure_size(folder: Path) -> float:
    """Return the size of the installed packages in MB, those that only install others left out."""
    files = (file for file in folder.rglob("*") if file.is_file() and not file.is_symlink())
    return sum(file.stat().st_size for file in files if "/pip" not in str(file)) / 1e6


def check_core(environment: Environment, arguments: list[str]) -> int:
    """Install `sgm` alone; README's lines, the tests of `sgm` and of simulated homes."""
    environment.install(find_wheel("scene_graph_memory_core"))
    print(f"{measure_size(environment.packages):.0f} MB installed")
    for package in HEAVY:
        if (environment.packages / package).exists():
            raise SystemExit(f"the core must come without {package}, got it installed.")
    print(environment.run("python", "-c", read_lines()))
    environment.install(*TEST_PACKAGES)
    shutil.copytree(ROOT / "simulator", environment.work / "simulator")
    return environment.test(arguments or [*LIGHT])


def check_research(environment: Environment, arguments: list[str]) -> int:
    """Install both wheels; what README says, commands, types, tests that were named."""
    both = find_wheel("scene_graph_memory_core"), find_wheel("scene_graph_memory")
    extras = "[test,events,igridson,sweep]" if arguments else ""
    # Modules are compiled when they are imported, few of them; not where tests are run, to which a
    # warning of the compiler is an error.
    compiled = [] if arguments else ["--no-compile"]
    environment.install(*compiled, f"{both[0]}[serve]", f"{both[1]}{extras}")
    print(environment.run("python", "-c", read_lines()))
    print(environment.run("python", "-m", "nep.fit", *TINY_FIT)[-2000:])
    environment.run("sgm-view", "home.sgm", "--save", "home.html")
    if "large red mug" not in (environment.work / "home.html").read_text("utf-8"):
        raise SystemExit("page of home.sgm must show the large red mug, got none in home.html.")
    check_server(environment)
    check_types(environment)
    status = environment.test(arguments) if arguments else 0
    environment.run("python", "-m", "pip", "uninstall", "--quiet", "--yes", "scene-graph-memory")
    environment.run("python", "-c", read_lines())
    return status


def check_server(environment: Environment) -> None:
    """Serve the memory, ask for its page, and end it."""
    command = [environment.commands / "sgm-serve", "home.sgm", "--port", "0"]
    print("$", *command, flush=True)
    server = subprocess.Popen(
        command, cwd=environment.work, env=environment.variables, stdout=subprocess.PIPE, text=True
    )
    try:
        assert server.stdout is not None
        said = server.stdout.readline()
        address = re.search(r"http://\S+", said)
        if address is None:
            raise SystemExit(f"sgm-serve must say its address, got {said!r}.")
        with urllib.request.urlopen(address[0] + "health", timeout=10) as answer:
            print(said.strip(), answer.status)
    finally:
        server.terminate()
    if server.wait(timeout=30):
        raise SystemExit(f"sgm-serve must end with status 0, got {server.returncode}.")


def check_types(environment: Environment) -> None:
    """Run mypy as a user does, over the lines of README in a file of their own."""
    (environment.work / "lines.py").write_text(read_lines() + TYPES, encoding="utf-8")
    mypy = [sys.executable, "-m", "mypy", "--strict", "--config-file", os.devnull]
    done = subprocess.run(
        [*mypy, "--python-executable", environment.python, "lines.py"],
        cwd=environment.work,
        env=environment.variables,
        capture_output=True,
        text=True,
    )
    print(done.stdout, done.stderr)
    if done.returncode or not all(name in done.stdout for name in REVEALED):
        raise SystemExit("mypy must find no error and no Any in README's lines.")


def has_cuda_alone(python: str) -> bool:
    """Tell whether no build of torch without CUDA is offered for a Python."""
    pip = [python, "-m", "pip", "index", "versions", "torch"]
    done = subprocess.run(pip, capture_output=True, text=True)
    return sys.platform == "linux" and "+cpu" not in done.stdout


def main() -> int:
    """Make an environment, install, check."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=("core", "research", "newest"))
    parser.add_argument("--python", default=None)
    options, arguments = parser.parse_known_args()
    default = sys._base_executable if options.what == "research" else find_python()
    python = options.python or default
    if options.what == "newest":
        if has_cuda_alone(python):
            print(f"{python}: torch comes with CUDA alone, several GB; nothing is tested with it")
            return 0
        arguments = arguments or [*FAST]
    print(python, flush=True)
    with tempfile.TemporaryDirectory(prefix="wheels-") as name:
        environment = Environment(Path(name), python)
        check = check_core if options.what == "core" else check_research
        return check(environment, arguments)


if __name__ == "__main__":
    sys.exit(main())
