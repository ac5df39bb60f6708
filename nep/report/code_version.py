"""Which code made a table: the version of the package, and the commit where there is one."""

from __future__ import annotations

import platform
import subprocess
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

_PACKAGE = "scene-graph-memory"
_DEPENDENCIES = ("numpy", "scipy", "torch", "dgl")
_CHECKOUT = Path(__file__).parents[2]
_CODE = ("nep", "simulator", "datamodules")  # folders whose changes make it another code
_COMMIT_LENGTH = 12


def list_versions() -> dict[str, str]:
    """Return the versions of Python and of what scores depend on, with the commit if known."""
    versions = {"python": platform.python_version(), _PACKAGE: _find_version(_PACKAGE)}
    commit = find_commit()
    if commit is not None:
        versions["commit"] = commit
    return {**versions, **{name: _find_version(name) for name in _DEPENDENCIES}}


def describe_code() -> str:
    """Return version and commit in one line."""
    commit = find_commit()
    known = f"{_PACKAGE} {_find_version(_PACKAGE)}"
    return known if commit is None else f"{known}, commit {commit}"


@lru_cache(maxsize=1)
def find_commit() -> str | None:
    """Return the commit of the checkout that runs; None where the package was installed.

    A commit whose files were edited since ends with "+changes".
    """
    try:
        # The package may lie in an environment within another repository.
        _run_git("ls-files", "--error-unmatch", str(Path(__file__).relative_to(_CHECKOUT)))
        commit = _run_git("rev-parse", f"--short={_COMMIT_LENGTH}", "HEAD")
        changed = _run_git("status", "--porcelain", "--untracked-files=no", "--", *_CODE)
    except (OSError, subprocess.SubprocessError):  # no git, no repository, or not ours
        return None
    return f"{commit}+changes" if changed else commit


def _run_git(*arguments: str) -> str:
    command = ["git", "-C", str(_CHECKOUT), *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=10)
    return done.stdout.strip()


def _find_version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:  # run from a checkout that is not installed
        return "not installed"
