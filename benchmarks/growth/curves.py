"""Growth curves: how the cost of a step, a look, a query and a batch grows with the size."""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from sgm.layout.layout import LayoutArrays
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.policies.heuristics import Bayesian
from sgm.prior.place_prior import PlacePrior
from sgm.prior.prior_graph import PriorGraph
from simulator.collect.folder import collect
from simulator.collect.settings import CollectConfig
from simulator.tasks.rollout import Rollout
from simulator.world.config import HomeConfig
from simulator.world.sampled_homes import SampledHomes
from simulator.world.streams import Streams

OBJECTS_PER_FURNITURE = 20  # of the growing memory: 100,000 objects on 5,000 furniture nodes


@dataclass(frozen=True, slots=True)
class Point:
    """One measurement.

    Attributes:
        curve: what grows and what it costs.
        size: how large it is.
        cost: seconds, or GB of memory.
    """

    curve: str
    size: int
    cost: float


def measure_objects(sizes: Sequence[int], repeats: int) -> Iterator[Point]:
    """One home with more and more objects on its 32 furniture nodes: a step and a look."""
    for size in sizes:
        rules = HomeConfig(objects_per_furniture=max(size // 32, 1))
        rollout = Rollout(_sample_homes(1, rules), Bayesian())
        seconds = _time_step(rollout, repeats)
        yield Point("step and look, by objects of a home", rollout.homes.num_slots, seconds)


def measure_homes(sizes: Sequence[int], repeats: int) -> Iterator[Point]:
    """More and more homes in lockstep: a step and a look of all of them."""
    for size in sizes:
        rollout = Rollout(_sample_homes(size, HomeConfig()), Bayesian())
        yield Point("step and look, by homes in lockstep", size, _time_step(rollout, repeats))


def measure_memory(sizes: Sequence[int], repeats: int) -> Iterator[Point]:
    """One memory of more and more objects, and furniture with them: a look and a query."""
    rng = np.random.default_rng(0)

    def look(memory: MemoryBatch) -> None:
        _look(memory, int(rng.integers(0, memory.num_furniture)))
        memory.step()

    def ask(memory: MemoryBatch) -> None:
        key = rng.integers(0, memory.objects.num_rows, 1)
        label, types = memory.objects["label"][key], memory.objects["type"][key]
        queries = memory.query(np.zeros(1, dtype=np.int64), key, label, types)
        np.argsort(-Bayesian().scores(memory, queries)[0])

    for size in sizes:
        memory = fill_memory(size)
        seconds = _time(partial(look, memory), repeats)
        yield Point("look, by objects remembered", size, seconds)
        seconds = _time(partial(ask, memory), repeats)
        yield Point("query and ranking, by objects remembered", size, seconds)


def fill_memory(num_objects: int) -> MemoryBatch:
    """Return the memory of one home in which every furniture node has been looked at once."""
    prior = PriorGraph.default()
    rng = np.random.default_rng(0)
    num_furniture = max(num_objects // OBJECTS_PER_FURNITURE, 1)
    rooms = prior.rooms
    nodes = rng.integers(0, len(prior.furniture), num_furniture)
    furniture = [prior.furniture[node].label for node in nodes]
    furniture_room = np.array([[rooms.index(prior.furniture[node].room) for node in nodes]])
    labels = list(
        dict.fromkeys([*rooms, *furniture, *(object_type.label for object_type in prior.objects)])
    )
    index = {label: number for number, label in enumerate(labels)}
    layout = LayoutArrays(
        np.array([[index[room] for room in rooms]]),
        np.array([[index[label] for label in furniture]]),
        furniture_room,
        PlacePrior(prior, [rooms], [furniture], furniture_room),
    )
    memory = MemoryBatch(labels, layout)
    key = np.arange(num_objects)
    types = key % len(prior.objects)
    label_of_type = np.array([index[object_type.label] for object_type in prior.objects])
    memory.ensure_objects(np.zeros(num_objects, dtype=np.int64), key, label_of_type[types], types)
    for number in range(num_furniture):
        _look(memory, number)
    return memory


def measure_home(sizes: Sequence[int], repeats: int) -> Iterator[Point]:
    """The memory of a robot with more and more objects: saved, loaded, asked with the network.

    Half of what is asked for was seen, half is another object of a type that the prior knows; and
    something of a type that it does not know, which may be at any place.
    """
    from nep import ObjectFinder

    finder = ObjectFinder.load("heat")
    types = [object_type.label for object_type in PriorGraph.default().objects]
    rng = np.random.default_rng(0)
    for size in sizes:
        memory = fill_home(size)

        def ask(memory: SceneGraphMemory = memory) -> None:
            finder.rank(memory, memory.descriptions[rng.integers(len(memory.descriptions))], k=5)
            finder.rank(memory, f"other {types[rng.integers(len(types))]}", k=5)

        ask()
        yield Point("network asked where, by objects remembered", size, _time(ask, repeats) / 2)
        seconds = _time(partial(finder.rank, memory, "purple gizmo", k=5), repeats)
        yield Point("network asked for the unknown, by objects remembered", size, seconds)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "home.sgm"
            seconds = _time(partial(memory.save, path), repeats)
            seconds += _time(partial(SceneGraphMemory.load, path), repeats)
        yield Point("save and load, by objects remembered", size, seconds)


def fill_home(num_objects: int) -> SceneGraphMemory:
    """Return a robot's memory in which every furniture node has been looked at once."""
    prior = PriorGraph.default()
    memory = SceneGraphMemory(prior)
    rooms = {label: memory.add_room(label) for label in prior.rooms}
    for number in range(max(num_objects // OBJECTS_PER_FURNITURE, 1)):
        node = prior.furniture[number % len(prior.furniture)]
        memory.add_furniture(node.label, rooms[node.room], f"{node.label} {number}")
    for number, furniture in enumerate(memory.furniture_ids):
        first = number * OBJECTS_PER_FURNITURE
        keys = range(first, min(first + OBJECTS_PER_FURNITURE, num_objects))
        texts = [f"number {key} {prior.objects[key % len(prior.objects)].label}" for key in keys]
        memory.observe(furniture, [Sighting(text) for text in texts])
    memory.step()
    return memory


def measure_reading(sizes: Sequence[int], repeats: int) -> Iterator[Point]:
    """More and more snapshots on disk: to open them, an epoch's batches, memory of the process.

    In a process of its own each, so that the memory is that of the data; homes have 100 steps.
    The time of an epoch is that of `repeats` random batches, times the number of batches.
    """
    for size in sizes:
        with tempfile.TemporaryDirectory() as folder:
            config = CollectConfig(num_homes=max(size // 100, 1))
            collect(config, Path(folder), progress=False)
            done = subprocess.run(
                [sys.executable, __file__, folder, str(repeats)],
                capture_output=True,
                text=True,
                check=True,
            )
        opening, reading, gigabytes = (float(part) for part in done.stdout.split())
        yield Point("opening the data, by snapshots", size, opening)
        yield Point("batches of an epoch, by snapshots", size, reading)
        yield Point("memory while reading in GB, by snapshots", size, gigabytes)


def read_batches(folder: Path, num_batches: int) -> tuple[float, float, float]:
    """Return the seconds to open data, those of an epoch's batches, and the most GB it took."""
    from datamodules.batch_builder import BatchBuilder
    from datamodules.feature_config import FeatureConfig
    from datamodules.snapshot_loader import SnapshotDataset

    builder = BatchBuilder(FeatureConfig(), num_hops=1)
    before = most = _read_resident()
    start = time.process_time()
    dataset = SnapshotDataset(folder, builder)
    opening = time.process_time() - start
    indices = np.random.default_rng(0).integers(0, len(dataset), (num_batches + 1, 100))
    dataset.__getitems__(indices[0].tolist())
    start = time.process_time()
    for batch in indices[1:]:
        dataset.__getitems__(batch.tolist())
        most = max(most, _read_resident())
    seconds = (time.process_time() - start) / num_batches * len(dataset) / 100
    return opening, seconds, most - before


def _read_resident() -> float:
    """Return the GB of memory that this process holds now (Linux)."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() / 1e9


def _sample_homes(count: int, rules: HomeConfig) -> SampledHomes:
    return SampledHomes(PriorGraph.default(), rules, Streams(0, "train", range(count)))


def _time_step(rollout: Rollout, repeats: int) -> float:
    """Time a step of the homes and a look in each of them."""
    rng = np.random.default_rng(0)
    homes = rollout.homes

    def step() -> None:
        rollout.evolve()
        rollout.look(rng.integers(0, homes.num_furniture, homes.num_homes))

    step()
    return _time(step, repeats)


def _look(memory: MemoryBatch, furniture: int) -> None:
    """See all objects that were put on a furniture node of a filled memory."""
    first = furniture * OBJECTS_PER_FURNITURE
    seen = np.arange(first, min(first + OBJECTS_PER_FURNITURE, memory.objects.num_rows))
    memory.observe(np.zeros(1, dtype=np.int64), np.array([furniture]), seen, np.ones_like(seen))


def _time(work: Callable[[], None], repeats: int) -> float:
    """Return the seconds that the processor works in the fastest of some repeats."""
    seconds = []
    for _ in range(repeats):
        start = time.process_time()
        work()
        seconds.append(time.process_time() - start)
    return min(seconds)


if __name__ == "__main__":
    print(*read_batches(Path(sys.argv[1]), int(sys.argv[2])))
