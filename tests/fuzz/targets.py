"""What is fuzzed: a good folder of each kind of file, how it is changed, how it is used."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

import forged_files
import mutate
import numpy as np
import torch

from datamodules.batch_builder import BatchBuilder
from datamodules.feature_config import FeatureConfig
from datamodules.snapshot_loader import SnapshotDataset
from nep import ObjectFinder
from nep.compare import compare
from nep.paper.encoders import MLP
from nep.paper.nep_module import NEPModule
from nep.players.checkpoints import TrainedModel, save_exported
from nep.report.results import Results, ScoreSummary
from sgm.files import compute_checksum
from sgm.layout.box import Box
from sgm.memory.memory_event import read_events
from sgm.prior.prior_graph import load_prior
from simulator import (
    Bayesian,
    Clock,
    HomeConfig,
    PriorGraph,
    SampledHomes,
    SceneGraphMemory,
    Sighting,
    Streams,
)
from simulator.collect.folder import collect
from simulator.collect.settings import CollectConfig
from simulator.igridson.layout_file import DEFAULT_LAYOUT, load_layout
from simulator.snapshots.shards import MANIFEST, load_shard, save_shard
from simulator.story.past_memory import PastMemory
from simulator.trace.from_log import make_trace as make_trace_of_log
from simulator.trace.importers.procthor import read_procthor
from simulator.trace.record import record_homes
from simulator.trace.source import RecordedSource
from simulator.trace.trace import remember_trace, save_trace
from simulator.world.source import SampledSource
from tools.priors.table import count_table

SMALL = HomeConfig(furniture_per_room=2, objects_per_furniture=2)
Rng = np.random.Generator


@dataclass(frozen=True)
class Target:
    """One kind of file.

    Attributes:
        make: writes good files into a folder.
        change: changes them.
        use: loads them, and does with them what a user does.
    """

    make: Callable[[Path], None]
    change: Callable[[Path, Rng], None]
    use: Callable[[Path], Any]


def make_memory() -> SceneGraphMemory:
    """Return a memory of two places that has looked at both."""
    memory = SceneGraphMemory()
    kitchen = memory.add_room("kitchen")
    shelf = memory.add_furniture("shelf", kitchen)
    memory.add_furniture("table", kitchen)
    for _ in range(3):
        memory.observe(shelf, [Sighting("red mug"), Sighting("plate", "in")])
        memory.step()
    return memory


def use_memory(folder: Path) -> None:
    memory = SceneGraphMemory.load(folder / "home.sgm")
    memory.rank(Bayesian(), "red mug")
    for furniture in list(memory.furniture_ids)[:2]:
        memory.observe(furniture, [Sighting("red mug")])
    memory.step()
    memory.save(folder / "again.sgm")
    SceneGraphMemory.load(folder / "again.sgm")


def change_memory(folder: Path, rng: Rng) -> None:
    forged_files.change_file(folder / "home.sgm", rng)


def make_trace(folder: Path) -> None:
    homes = SampledHomes(PriorGraph.default(), SMALL, Streams(0, "train", [0]))
    for trace in record_homes(homes, 4):
        save_trace(trace, folder / "home")


def use_trace(folder: Path) -> None:
    source = RecordedSource(folders=[str(folder / "home")])
    homes = source.make(Streams(0, "test", [0]))
    for _ in range(min(source.num_steps or 1, 3)):
        homes.evolve()


def use_prior(folder: Path) -> None:
    prior = load_prior(str(folder / "prior.json"))
    if set(SMALL.rooms) <= set(prior.rooms):
        SampledHomes(prior, SMALL, Streams(0, "test", [0])).evolve()


def make_collection(folder: Path) -> None:
    config = CollectConfig(homes=SampledSource(home=SMALL), num_homes=1, steps=4)
    collect(config, folder, progress=False)


def change_collection(folder: Path, rng: Rng) -> None:
    manifest = json.loads((folder / MANIFEST).read_text())
    path = folder / next(iter(manifest["shards"]))
    if rng.random() < 0.3:
        manifest = mutate.mutate_json(manifest, rng)
    elif rng.random() < 0.3:
        path.write_bytes(mutate.mutate_bytes(path.read_bytes(), rng))
        manifest["shards"][path.name] = compute_checksum(path)
    else:
        arrays = load_shard(path)
        name = str(rng.choice(sorted(arrays)))
        array = arrays[name].copy()
        kind = rng.integers(5)
        if kind == 0:
            del arrays[name]
        elif kind == 1:
            arrays[name] = array[: len(array) // 2]
        elif kind == 2:
            arrays[name] = array.astype(str(rng.choice(["int64", "float32", "uint8", "bool"])))
        elif kind == 3:
            arrays[name] = array[..., None]
        elif array.size:
            odd = rng.choice([0, -1, -2, 1, 7, 255, 2**31 - 1])
            array.reshape(-1)[int(rng.integers(array.size))] = np.array(odd).astype(array.dtype)
            arrays[name] = array
        manifest["shards"][path.name] = save_shard(path, arrays)
    (folder / MANIFEST).write_text(json.dumps(manifest))


def use_collection(folder: Path) -> None:
    dataset = SnapshotDataset(folder, BatchBuilder(FeatureConfig()))
    if len(dataset):
        dataset.__getitems__(list(range(min(len(dataset), 3))))


def make_network() -> TrainedModel:
    """Return a small network, as good as its first random numbers."""
    torch.manual_seed(0)
    return TrainedModel(NEPModule(MLP(units=8)), BatchBuilder(FeatureConfig()))


def make_exported(folder: Path) -> None:
    save_exported(folder / "net", make_network(), {})


def change_exported(folder: Path, rng: Rng) -> None:
    config_path, weights = folder / "net" / "config.json", folder / "net" / "weights.safetensors"
    config = json.loads(config_path.read_text())
    if rng.random() < 0.2:
        weights.write_bytes(mutate.mutate_bytes(weights.read_bytes(), rng))
        config["weights_sha256"] = hashlib.sha256(weights.read_bytes()).hexdigest()
    else:
        part = str(rng.choice(["model", "features", "schema"]))
        config[part] = mutate.mutate_json(config[part], rng)
    config_path.write_text(json.dumps(config))


def use_exported(folder: Path) -> None:
    ObjectFinder.load(folder / "net").rank(make_memory(), "red mug")


def make_checkpoint(folder: Path) -> None:
    torch.manual_seed(0)
    builder, module = BatchBuilder(FeatureConfig()), NEPModule(MLP(units=8))
    content = {
        "state_dict": module.state_dict(),
        "hyper_parameters": dict(module.hparams),
        "datamodule_hyper_parameters": {
            "features": {},
            "feature_schema": 1,
            "text": builder.text_name,
            "training": {},
        },
    }
    torch.save(content, folder / "last.ckpt")


def change_checkpoint(folder: Path, rng: Rng) -> None:
    path = folder / "last.ckpt"
    if rng.random() < 0.5:
        path.write_bytes(mutate.mutate_bytes(path.read_bytes(), rng))
        return
    content = torch.load(path, weights_only=True)
    part = str(rng.choice(["hyper_parameters", "datamodule_hyper_parameters"]))
    content[part] = mutate.mutate_json(content[part], rng)
    torch.save(content, path)


def use_checkpoint(folder: Path) -> None:
    ObjectFinder.load(folder / "last.ckpt").rank(make_memory(), "red mug")


def change_any(folder: Path, rng: Rng) -> None:
    """Change one file of a folder, as bytes, lines or JSON."""
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    path = files[int(rng.integers(len(files)))]
    content = path.read_bytes()
    if rng.random() < 0.3:
        path.write_bytes(mutate.mutate_bytes(content, rng))
    elif path.suffix == ".json":
        path.write_text(json.dumps(mutate.mutate_json(json.loads(content), rng)))
    else:
        path.write_bytes(mutate.mutate_text(content, rng))


_FRIDGE = Box((1.0, 0.3, 0.9), (0.6, 0.7, 1.8), 1.57, "door")


def make_log(folder: Path) -> None:
    """Write the log of a memory to which everything happened that a log can say."""
    memory = SceneGraphMemory(path=folder / "looks.sgm")
    memory.start_clock(Clock(datetime(2026, 5, 4, 7), 600))
    kitchen, study = memory.add_room("kitchen"), memory.add_room("study")
    shelf = memory.add_furniture("shelf", kitchen, "oak shelf", (1.0, 2.0))
    desk, table = memory.add_furniture("desk", study), memory.add_furniture("table", kitchen)
    fridge = memory.add_furniture("fridge", study, box=_FRIDGE, open_cost=2.0)
    for _ in range(3):
        memory.observe(fridge, [Sighting("tray")], {"in": 0, "onTop": 0.5}, ["plate"])
        memory.observe(shelf, [Sighting("red mug", "in", 0.5), Sighting("plate")], 0.75)
        memory.observe(desk, [Sighting("mug")])
        memory.note_absent(desk, "plate")
        memory.step(2)
    memory.note_moved("plate", table, "anna")
    memory.picked_up("plate")
    memory.put_down("plate", shelf)
    memory.rename("red mug", "tea mug")
    memory.observe(table, [Sighting("pen", id="a"), Sighting("pen", id="b")])
    memory.merge("a", "b")
    memory.split("b")
    memory.observe(table, [Sighting("tray")])
    memory.split("tray", table, "new tray")
    memory.query("lamp")
    memory.rename_room(study, "office")
    memory.name_furniture(desk, "desk", "white desk")
    memory.merge_furniture(desk, memory.add_furniture("desk", study))
    memory.transform(0.5, (1.0, -2.0))
    memory.move_furniture(table, study)
    memory.remove_object("mug")
    memory.remove_furniture(table)
    memory.remove_room(kitchen)
    memory.close()


def change_log(folder: Path, rng: Rng) -> None:
    forged_files.change_file(folder / "looks.sgm", rng)


def use_log(folder: Path) -> None:
    """Go through time, make a trace of it."""
    lines = read_events(folder / "looks.sgm")
    replay = PastMemory(lines, "home")
    for step in {0, replay.num_steps // 2, replay.num_steps}:
        memory = replay.memory_at(step)
        if memory.num_furniture:
            memory.rank(Bayesian(), "red mug")
    make_trace_of_log(lines)


def make_results(folder: Path) -> None:
    """Write the results of two runs of two policies in two homes."""
    rng = np.random.default_rng(0)
    for name in ("first", "second"):
        scores = {
            policy: ScoreSummary(rng.integers(2, size=(2, 3)).astype(float), {"hits_at_3": 0.5})
            for policy in ("bayesian", "priors")
        }
        Results("evaluate", {"seed": 0}, {"python": "3"}, {"predict_location": scores}).save(
            folder / f"{name}.json"
        )


def use_results(folder: Path) -> None:
    compare(*(Results.load(folder / f"{name}.json") for name in ("first", "second")))


HOUSE = {
    "rooms": [
        {"id": "room|2", "roomType": "Kitchen", "floorPolygon": [{"x": 0, "y": 0, "z": 0}] * 3},
        {"id": "room|3", "roomType": "Bedroom"},
    ],
    "objects": [
        {
            "id": "DiningTable|2|0",
            "position": {"x": 1, "y": 0, "z": 3},
            "children": [{"id": "Plate|surface|2|0", "children": [{"id": "Apple|surface|2|1"}]}],
        },
        {"id": "Bed|3|0", "children": [{"id": "Pillow|3|1"}]},
    ],
}
TABLE = "room,furniture,object,relation,weight\nkitchen,fridge,egg,in,6\nbedroom,bed,book,,9\n"


def make_sources(folder: Path) -> None:
    """Write what other programs write."""
    (folder / "house.json").write_text(json.dumps(HOUSE))
    (folder / "rows.csv").write_text(TABLE)
    (folder / "rows.json").write_text(
        json.dumps([{"room": "kitchen", "furniture": "fridge", "object": "egg", "weight": 6}])
    )


def use_sources(folder: Path) -> None:
    trace, home = read_procthor(folder / "house.json")
    save_trace(trace, folder / "copy")
    home.summarise()
    remember_trace(trace, PriorGraph.default())
    count_table(folder / "rows.csv")
    count_table(folder / "rows.json")


TARGETS = {
    "memory": Target(lambda f: make_memory().save(f / "home.sgm"), change_memory, use_memory),
    "trace": Target(make_trace, change_any, use_trace),
    "prior": Target(lambda f: PriorGraph.default().save(f / "prior.json"), change_any, use_prior),
    "collection": Target(make_collection, change_collection, use_collection),
    "exported": Target(make_exported, change_exported, use_exported),
    "checkpoint": Target(make_checkpoint, change_checkpoint, use_checkpoint),
    "log": Target(make_log, change_log, use_log),
    "results": Target(make_results, change_any, use_results),
    "source": Target(make_sources, change_any, use_sources),
    "layout": Target(
        lambda f: (f / "home.txt").write_bytes(DEFAULT_LAYOUT.read_bytes()) and None,
        change_any,
        lambda f: load_layout(f / "home.txt"),
    ),
}
