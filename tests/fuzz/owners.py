"""One home under many names, moved and linked while it is kept; and starts on a full disk."""

from __future__ import annotations

import json
import os
import resource
import signal
import warnings
from collections.abc import Callable
from datetime import datetime
from pathlib import Path

import numpy as np

from simulator import Clock, SceneGraphMemory, Sighting

Rng = np.random.Generator
_REFUSED, _OPENED, _WRONG = 0, 3, 1
CLOCK = Clock(datetime(2026, 11, 16, 7), 600)


def make_home(folder: Path) -> None:
    """Write a home with a snapshot and events since."""
    (folder / "a").mkdir()
    home = SceneGraphMemory(clock=CLOCK, path=folder / "a" / "home.sgm")
    home.add_furniture("shelf", home.add_room("kitchen"))
    home.save(folder / "a" / "home.sgm")
    for number in range(20):
        home.observe(0, [Sighting(f"thing {number}")])
        home.step()
    (folder / "plan").write_text("0")


def change_plan(folder: Path, rng: Rng) -> None:
    """Choose a seed."""
    (folder / "plan").write_text(str(rng.integers(2**62)))


def use_links(folder: Path) -> None:
    """Link and move what a process keeps, and let others try to have it under every name."""
    rng = np.random.default_rng(int((folder / "plan").read_text()))
    warnings.simplefilter("ignore")  # a file begun anew
    path = folder / "a" / "home.sgm"
    home = SceneGraphMemory.open(path)
    names = [path]
    for _ in range(12):
        _act(home, folder, names, rng)
        name = names[int(rng.integers(len(names)))]
        _let_another_try(home, name, rng)
    before = _write(home)
    is_in_place = _is_kept(home, path)
    del home  # as when its process ends
    if is_in_place:
        assert _write(SceneGraphMemory.open(path)) == before


def _act(home: SceneGraphMemory, folder: Path, names: list[Path], rng: Rng) -> None:
    """Link, move or remove a file, or change the memory."""
    number = len(names)
    name = names[int(rng.integers(number))]
    kind = int(rng.integers(8))
    try:
        if kind == 0:
            names.append(folder / f"link{number}")
            names[-1].symlink_to(os.path.relpath(name, folder))
        elif kind == 1:
            names.append(folder / f"hard{number}.sgm")
            os.link(name, names[-1])
        elif kind == 2:
            (folder / f"folder{number}").symlink_to("a", target_is_directory=True)
            names.append(folder / f"folder{number}" / name.name)
        elif kind == 3:
            names.append(folder / "a" / ".." / "a" / "." / name.name)
        elif kind == 4:
            names.append(name.rename(folder / f"moved{number}"))
        elif kind == 5:
            home.save(folder / "a" / "home.sgm")
        else:
            home.observe(0, [Sighting(f"new {number}")])
            home.step()
    except OSError as error:
        message = str(error.args[-1])
        is_taken_away = isinstance(error, FileNotFoundError | FileExistsError)
        assert is_taken_away or " must " in message, message
        names.append(folder / "a" / "home.sgm")


def _is_kept(home: SceneGraphMemory, path: Path) -> bool:
    """Tell whether a path leads to the file that a memory writes."""
    file = home.parts.files.file
    assert file is not None
    return path.exists() and file._owner.is_at(path)


def _let_another_try(home: SceneGraphMemory, name: Path, rng: Rng) -> None:
    """Another process has a file only if it is none that is kept here."""
    is_kept = _is_kept(home, name)
    tries: tuple[Callable[[Path], object], ...] = (
        SceneGraphMemory.open,
        SceneGraphMemory().save,
        lambda path: SceneGraphMemory(path=path),
    )
    how = tries[int(rng.integers(3))]
    before = _write(home)
    child = os.fork()
    if child == 0:
        os._exit(_try(how, name))
    ended = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    assert ended in (_REFUSED, _OPENED), f"{name} ended with {ended}"
    assert not (is_kept and ended == _OPENED), f"{name} has two owners"
    assert _write(home) == before


def _try(how: Callable[[Path], object], name: Path) -> int:
    try:
        how(name)
    except (ValueError, OSError) as error:
        return _REFUSED if "\n" not in str(error) else _WRONG
    except BaseException as error:
        os.write(2, f"{type(error).__name__}: {error}\n".encode())
        return _WRONG
    return _OPENED


def use_start(folder: Path) -> None:
    """Begin on a disk that takes no file beyond a size: it goes on, or says what to do."""
    rng = np.random.default_rng(int((folder / "plan").read_text()))
    path = folder / "a" / "home.sgm"
    for _ in range(3):
        size = int(10 ** rng.uniform(0, 5.5))
        child = os.fork()
        if child == 0:
            warnings.simplefilter("ignore")
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))
            os._exit(_start(path))
        ended = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        assert ended in (_REFUSED, _OPENED), f"a start ended with {ended}"
    SceneGraphMemory.open(path).observe(0, [Sighting("last")])


def _start(path: Path) -> int:
    try:
        home = SceneGraphMemory.open(path)
        assert home.num_furniture == 1
        home.step()
    except OSError as error:
        line = str(error.args[-1])
        is_clear = " must " in line and "home.sgm" in line and "\n" not in line
        if not is_clear:
            os.write(2, line.encode())
        return _REFUSED if is_clear else _WRONG
    except BaseException as error:
        os.write(2, f"{type(error).__name__}: {error}\n".encode())
        return _WRONG
    return _OPENED


def _write(memory: SceneGraphMemory) -> str:
    return json.dumps(memory._state.get_content_to_save().to_json(), sort_keys=True)
