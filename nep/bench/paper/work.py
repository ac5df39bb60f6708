"""What commands that train and play for hours share: their folders, a lock, and how they end."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from pathlib import Path
from typing import NoReturn

from filelock import FileLock, Timeout
from rich.console import Console

from nep.bench.table_options import Option
from sgm.files import write_whole

# Held in the folder of runs by the command that works there: a training deletes what it finds of
# itself, which another command may be writing. The system frees it when the command is killed.
LOCK = ".lock"
_LOG_WIDTH = 100


def list_work_options(runs: str, made: str) -> tuple[Option, ...]:
    """List the options of folders; `runs` is the default, `made` what is made of its scores."""
    return (
        Option("out", Path("results"), f"folder for {made}", type=Path),
        Option("runs", Path(runs), "folder for networks and scores", type=Path),
        Option("data", Path("data"), "folder for collected snapshots", type=Path),
    )


def make_console() -> Console:
    """Return a console, of one width where no terminal shows it."""
    return Console() if sys.stdout.isatty() else Console(width=_LOG_WIDTH)


@contextmanager
def work_in(runs: Path) -> Iterator[None]:
    """Work in a folder of runs alone; whatever ends the work ends the command with one line."""
    try:
        with FileLock(runs / LOCK, timeout=0):
            yield
    except Timeout:
        _stop(
            f"error: runs must be a folder that one command works in at a time, got {runs}, "
            "where another one does. Wait until it has ended, or give another --runs."
        )
    except KeyboardInterrupt:
        _stop("interrupted; the same command goes on from here", status=130)
    except BrokenProcessPool:
        _stop(
            "error: workers must live, got one that was killed. If memory ran out, give fewer "
            "--workers; the same command goes on from here."
        )


def stop_if_failed(failed: Mapping[str, str]) -> None:
    """End the command if jobs have failed; `failed` says how, by name."""
    if failed:
        lines = [f"{name}: {error}" for name, error in failed.items()]
        message = "\n".join(["error: every job must end well, got", *lines])
        _stop(f"{message}\nMend it; the same command goes on from here.")


def write_files(folder: Path, files: Mapping[str, bytes], console: Console) -> None:
    """Write files by name, each whole, and say so."""
    for name, content in files.items():
        write_whole(folder / name, content)
        console.print(f"wrote {folder / name}", highlight=False, markup=False)


def _stop(message: str, status: int = 1) -> NoReturn:
    print(message, file=sys.stderr)
    sys.exit(status)
