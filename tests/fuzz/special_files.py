"""A FIFO, a device, a folder or a link where a file is meant: refused at once, left as it is."""

from __future__ import annotations

import os
import socket
import stat
from collections.abc import Callable
from pathlib import Path

import commands
import numpy as np
import targets

from nep import ObjectFinder
from nep.importers.homer import read_homer
from nep.players.checkpoints import save_exported
from nep.report.results import Results
from sgm.memory.memory_event import read_events
from sgm.prior.prior_graph import load_prior
from simulator import PriorGraph, SceneGraphMemory
from simulator.igridson.layout_file import load_layout
from simulator.trace.importers.procthor import read_procthor
from simulator.trace.importers.scene_graph import load_label_names
from simulator.trace.trace import load_trace
from tools.priors.table import count_table

Rng = np.random.Generator


def make_all(folder: Path) -> None:
    """Write nothing but what is put in the way."""
    (folder / "plan").write_text("memory file")


def _bind(path: Path) -> None:
    here = Path.cwd()
    os.chdir(path.parent)  # the name of a socket has at most 107 characters
    try:
        with socket.socket(socket.AF_UNIX) as made:
            made.bind(path.name)
    finally:
        os.chdir(here)


def _link_to_device(number: int) -> Callable[[Path], None]:
    """Return what makes a device of memory and a link to it; never one of the machine's own."""

    def make(path: Path) -> None:
        device = path.with_name("device")
        try:
            os.mknod(device, stat.S_IFCHR | 0o666, os.makedev(1, number))
        except PermissionError:  # not for this user: the next best that is no file
            os.mkfifo(device)
        path.symlink_to(device)

    return make


def _link(path: Path) -> None:
    real = path.with_name("real")
    real.write_bytes(b"x")
    path.symlink_to(real)


# By name: what is put where a file is meant.
THINGS: dict[str, Callable[[Path], None]] = {
    "file": lambda path: path.touch(),
    "fifo": lambda path: os.mkfifo(path),
    "zero": _link_to_device(5),
    "null": _link_to_device(3),
    "full": _link_to_device(7),
    "random": _link_to_device(9),
    "folder": lambda path: path.mkdir(),
    "socket": _bind,
    "nothing": lambda path: None,
    "circle": lambda path: path.symlink_to(path.name),
    "dangling": lambda path: path.symlink_to("nowhere/at/all"),
    "link": _link,
}
# By name: what reads a file there.
READERS: dict[str, Callable[[Path], object]] = {
    "memory": SceneGraphMemory.load,
    "log": read_events,
    "going on in a log": lambda path: SceneGraphMemory(path=path),
    "prior": lambda path: load_prior(str(path)),
    "checkpoint": ObjectFinder.load,
    "results": Results.load,
    "labels": load_label_names,
    "layout": load_layout,
    "house": read_procthor,
    "table": lambda path: count_table(path),
    "trace": lambda path: load_trace(_make_folder(path, "layout.json")),
    "exported": lambda path: ObjectFinder.load(_make_folder(path, "config.json")),
    "household": lambda path: read_homer(_make_folder(path, "train/000.pt")),
    "page": lambda path: commands.run_line(path.parent, ["nep.view", path.name, "--save=p.html"]),
    "config": lambda path: commands.run_line(
        path.parent, ["simulator.collect", f"--config={path.name}", *commands.SMALL, "--out=out"]
    ),
}


def _save_network(path: Path) -> None:
    folder = _make_folder(path, "weights.safetensors")
    save_exported(folder, targets.make_network(), {})


# By name: what writes a file there.
WRITERS: dict[str, Callable[[Path], object]] = {
    "saving a memory": lambda path: targets.make_memory().save(path),
    "saving a prior": lambda path: PriorGraph.default().save(path),
    "saving a network": _save_network,
    "saving results": lambda path: Results("evaluate", {}, {}, {}).save(path),
}
ENDINGS = ("", ".sgm", ".jsonl", ".json", ".csv", ".ckpt", ".yaml", ".txt", ".pt")


def _make_folder(path: Path, name: str) -> Path:
    """Put what is there into a folder, under the name that a reader looks for."""
    inside = path.parent / "inside" / name
    inside.parent.mkdir(parents=True)
    if path.is_symlink() and os.readlink(path) == path.name:
        inside.symlink_to(name)  # a circle under that name
    elif path.is_symlink() or path.exists():
        path.rename(inside)
    return path.parent / "inside"


def change(folder: Path, rng: Rng) -> None:
    """Choose who meets what."""
    who = str(rng.choice([*READERS, *WRITERS]))
    ending = str(rng.choice(ENDINGS))
    (folder / "plan").write_text(f"{who}|{rng.choice(list(THINGS))}|{ending}")


def use(folder: Path) -> None:
    """Read or write; a device, FIFO or link is there afterwards as it was."""
    who, _, what = (folder / "plan").read_text().partition("|")
    what, _, ending = what.partition("|")
    if not what:
        return
    path, device = folder / f"thing{ending}", folder / "device"
    THINGS[what](path)
    before = path.lstat() if path.is_symlink() or path.exists() else None
    try:
        (READERS.get(who) or WRITERS[who])(path)
    finally:
        found = path if path.is_symlink() or path.exists() else None
        if before is not None and found is not None:
            kind = stat.S_IFMT(before.st_mode)
            assert stat.S_IFMT(found.lstat().st_mode) == kind, f"{who}: a {what} was replaced"
        assert not device.is_file(), f"{who}: the device behind a link was replaced"
    is_odd = what not in ("file", "nothing", "link", "dangling")
    assert not is_odd or who not in WRITERS, f"{who} into a {what} must be refused"
