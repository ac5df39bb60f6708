"""Files of other programs: graphs, registries, events, detections with poses, recordings."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mutate
import numpy as np

from sgm.memory.memory_event import read_events
from sgm.prior.prior_graph import PriorGraph
from simulator.trace.from_log import make_trace
from simulator.trace.importers.bag import load_home_map, read_bag
from simulator.trace.importers.coco import read_coco
from simulator.trace.importers.frigate import load_places, read_frigate
from simulator.trace.importers.home_assistant import read_home_assistant
from simulator.trace.importers.imported_looks import ImportedLooks
from simulator.trace.importers.virtualhome import read_virtualhome
from simulator.trace.trace import Trace, remember_trace, save_trace
from tests.simulator.trace import test_bag, test_coco, test_frigate
from tests.simulator.trace.test_home_assistant import write_config
from tests.simulator.trace.test_virtualhome import GRAPH

Rng = np.random.Generator
LARGE = (0, 1, 255, 2**16 - 1, 2**31 - 1, 2**32 - 1, 2**63 - 1)  # numbers of bytes, or of pixels
_BINARY = (".png", ".mcap", ".db3")


def make_all(folder: Path) -> None:
    """Write a folder of each program."""
    for name in ("virtualhome", "frigate", "coco", "bag"):
        (folder / name).mkdir()
    (folder / "virtualhome" / "graph.json").write_text(json.dumps(GRAPH))
    write_config(folder / "home_assistant")
    (folder / "frigate" / "events.json").write_text(json.dumps(test_frigate.EVENTS))
    (folder / "frigate" / "places.yaml").write_text(test_frigate.PLACES)
    test_coco.write_files(folder / "coco")
    test_bag.write_recording(folder / "bag" / "run", "MCAP")
    (folder / "bag" / "map.yaml").write_text(test_coco.MAP)
    (folder / "plan").write_text("virtualhome")


def change(folder: Path, rng: Rng) -> None:
    """Choose a program, and change one of its files."""
    name = str(rng.choice(list(READERS)))
    (folder / "plan").write_text(name)
    # Of one ending as often as of another: there are many pictures.
    files = sorted(path for path in (folder / name).rglob("*") if path.is_file())
    endings = sorted({path.suffix for path in files})
    ending = endings[int(rng.integers(len(endings)))]
    chosen = [path for path in files if path.suffix == ending]
    path = chosen[int(rng.integers(len(chosen)))]
    content, kind = path.read_bytes(), rng.random()
    if kind < 0.2:
        content = mutate.mutate_bytes(content, rng)
    elif path.suffix in _BINARY:
        content = _write_large(content, rng)
    elif kind < 0.3:
        content = _nest(rng)
    else:
        try:
            values = json.loads(content)
        except ValueError:
            content = mutate.mutate_text(content, rng)
        else:
            for _ in range(int(rng.integers(1, 4))):
                values = mutate.mutate_json(values, rng)
            content = json.dumps(values).encode()
    path.write_bytes(content)


def _write_large(content: bytes, rng: Rng) -> bytes:
    """Put a large number where one may stand that says how much follows, near the beginning."""
    form = str(rng.choice(["<Q", "<I", ">I", "<H"]))
    most = 8 ** struct.calcsize(form) if rng.random() < 0.5 else len(content)
    at = int(rng.integers(max(min(most, len(content) - 8), 1)))
    number = LARGE[int(rng.integers(len(LARGE)))] % 256 ** struct.calcsize(form)
    packed = struct.pack(form, number)
    return content[:at] + packed + content[at + len(packed) :]


def _nest(rng: Rng) -> bytes:
    """Return JSON, or YAML, of many levels or many entries."""
    many = int(rng.choice([100, 3000, 100_000]))
    texts = (
        "[" * many,
        "[" * many + "]" * many,
        '{"nodes":' * many + "1" + "}" * many,
        "[" + "{}," * many + "{}]",
        json.dumps({"nodes": [{"id": i} for i in range(many)], "edges": []}),
        json.dumps({"images": [{"id": i} for i in range(many)], "categories": []}),
        "9" * many,
    )
    return texts[int(rng.integers(len(texts)))].encode()


def _keep_trace(trace: Trace, folder: Path) -> None:
    save_trace(trace, folder / "copy")
    remember_trace(trace, PriorGraph.default()).save(folder / "home.sgm")


def _keep_looks(read: Callable[..., ImportedLooks], folder: Path, *given: Any, **more: Any) -> None:
    file = folder / "looks.sgm"
    looks = read(*given, prior=PriorGraph.default(), file=file, **more)
    looks.summarise()
    looks.memory.save(folder / "home.sgm")
    save_trace(make_trace(read_events(file), "home"), folder / "copy")


def _use_virtualhome(folder: Path) -> None:
    trace, home = read_virtualhome(folder / "graph.json")
    home.summarise()
    _keep_trace(trace, folder)


def _use_home_assistant(folder: Path) -> None:
    trace, home = read_home_assistant(folder)
    home.summarise()
    _keep_trace(trace, folder)


def _use_frigate(folder: Path) -> None:
    _keep_looks(read_frigate, folder, folder / "events.json", load_places(folder / "places.yaml"))


def _use_coco(folder: Path) -> None:
    files = (folder / name for name in ("coco.json", "poses.txt", "camera.yaml"))
    home = load_home_map(folder / "map.yaml")
    _keep_looks(read_coco, folder, *files, depth=folder / "depth", home=home)


def _use_bag(folder: Path) -> None:
    home = load_home_map(folder / "map.yaml")
    _keep_looks(read_bag, folder, folder / "run", home=home)


# By the name of the folder: what reads it, and makes of it what the command makes.
READERS: dict[str, Callable[[Path], None]] = {
    "virtualhome": _use_virtualhome,
    "home_assistant": _use_home_assistant,
    "frigate": _use_frigate,
    "coco": _use_coco,
    "bag": _use_bag,
}


def use(folder: Path) -> None:
    """Read what the plan names."""
    name = (folder / "plan").read_text()
    try:
        READERS[name](folder / name)
    except ValueError as error:
        if "\n" in str(error):
            raise AssertionError(f"{name} must be refused in one line") from error
        raise
