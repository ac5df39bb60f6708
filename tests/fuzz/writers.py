"""Whoever writes is killed, or has no disk: what was there stays, or what is new is whole."""

from __future__ import annotations

import os
import resource
import signal
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import targets
import torch

from datamodules.batch_builder import BatchBuilder
from datamodules.feature_config import FeatureConfig
from nep import ObjectFinder
from nep.callbacks.resume import WholeCheckpoints
from nep.paper.encoders import MLP
from nep.paper.nep_module import NEPModule
from nep.players.checkpoints import TrainedModel, load_trained, save_exported
from sgm.memory.memory_event import read_events
from simulator import SceneGraphMemory, Sighting
from simulator.collect.folder import collect
from simulator.collect.settings import CollectConfig
from simulator.trace.trace import load_trace, save_trace
from simulator.world.source import SampledSource

Rng = np.random.Generator
torch.set_num_threads(1)  # threads do not survive a fork
_FOLDERS = (None, "/dev/shm")  # temporary files on this file system, or on another one


def make_all(folder: Path) -> None:
    """Write what is there before."""
    targets.make_memory().save(folder / "home.sgm")
    targets.make_trace(folder)
    targets.make_exported(folder)
    targets.make_checkpoint(folder)
    _collect(folder, "expected")
    _look(folder, 3)
    (folder / "plan").write_text("kill memory 1 0")


def change_plan(folder: Path, rng: Rng) -> None:
    """Choose what is written, and what happens meanwhile."""
    how, what = rng.choice(["kill", "full"]), rng.choice(list(WRITERS))
    bound = 10 ** rng.uniform(-4, -0.5) if how == "kill" else int(10 ** rng.uniform(0, 5.5))
    (folder / "plan").write_text(f"{how} {what} {bound} {rng.integers(2)}")


def use_plan(folder: Path) -> None:
    """Write in a process of its own, end it or its disk, and read what is there then."""
    how, what, bound, where = (folder / "plan").read_text().split()
    write, read = WRITERS[what]
    read(folder)
    child = os.fork()
    if child == 0:
        os._exit(_write(write, folder, how, float(bound), _FOLDERS[int(where)]))
    if how == "kill":
        time.sleep(float(bound))
        os.kill(child, signal.SIGKILL)
    _, status = os.waitpid(child, 0)
    if how == "full":
        assert os.waitstatus_to_exitcode(status) == 0, f"{what}: an error that is no OSError"
    read(folder)  # what was there, or what is new


def _write(
    write: Callable[[Path], None], folder: Path, how: str, bound: float, temporary: str | None
) -> int:
    tempfile.tempdir = temporary
    if how == "full":
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (int(bound), int(bound)))
    try:
        while True:
            write(folder)
            if how == "full":
                return 0
    except (OSError, ValueError) as error:
        return 0 if str(error).count("\n") == 0 else 1
    except BaseException as error:
        os.write(2, f"{type(error).__name__}: {error}\n".encode())
        return 1


def _look(folder: Path, num_looks: int) -> None:
    memory = SceneGraphMemory.open(folder / "looks.sgm", is_new=True)
    shelf = memory.add_furniture("shelf", memory.add_room("kitchen"))
    for _ in range(num_looks):
        memory.observe(shelf, [Sighting("mug")])
        memory.step()


def _save_trace(folder: Path) -> None:
    found = load_trace(folder / "home")
    target = folder / "copies" / str(len(list((folder / "copies").glob("*"))))
    save_trace(found, target)


def _read_traces(folder: Path) -> object:
    for layout in folder.glob("copies/*/layout.json"):  # one with a layout is whole
        load_trace(layout.parent)
    return load_trace(folder / "home")


def _save_network(folder: Path) -> None:
    model = TrainedModel(NEPModule(MLP(units=8)), BatchBuilder(FeatureConfig()))
    save_exported(folder / "net", model, {})


def _read_network(folder: Path) -> object:
    try:
        return ObjectFinder.load(folder / "net")
    except ValueError as error:
        if "weights" not in str(error):  # new ones beside the old config are refused
            raise AssertionError(error) from error
        return error


def _save_checkpoint(folder: Path) -> None:
    content = torch.load(folder / "last.ckpt", weights_only=True)
    WholeCheckpoints().save_checkpoint(content, folder / "last.ckpt")


def _collect(folder: Path, name: str = "more") -> None:
    config = CollectConfig(homes=SampledSource(home=targets.SMALL), num_homes=3, steps=4)
    collect(config, folder / name, progress=False)


def _read_collection(folder: Path) -> object:
    """Go on where it was stopped: it ends with the same bytes."""
    if (folder / "more").exists():
        _collect(folder)
        found, expected = (
            {path.name: path.read_bytes() for path in (folder / name).iterdir()}
            for name in ("more", "expected")
        )
        assert found == expected
    return True


def _read_log(folder: Path) -> object:
    return read_events(folder / "looks.sgm")


# By name: what writes, and what reads it.
WRITERS: dict[str, tuple[Callable[[Path], None], Callable[[Path], object]]] = {
    "memory": (
        lambda folder: targets.make_memory().save(folder / "home.sgm"),
        lambda folder: SceneGraphMemory.load(folder / "home.sgm"),
    ),
    "trace": (_save_trace, _read_traces),
    "network": (_save_network, _read_network),
    "checkpoint": (_save_checkpoint, lambda folder: load_trained(folder / "last.ckpt")),
    "collection": (_collect, _read_collection),
    "log": (lambda folder: _look(folder, 3), _read_log),
}
