"""How much of our code an import or a call walks through: `python -m tools.closures`.

A closure is the files of ours that an import loads; those with a docstring alone do not count. A
profile of a call counts its calls of our functions, the files that they are in, and the returns to
a file that was left. A stay is a run of calls in one file: there are as many as files and returns.
"""

from __future__ import annotations

import ast
import importlib
import json
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np

from sgm.messages import shorten
from simulator.command_line import make_parser, one_line_errors, parse
from simulator.process import run_main

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("sgm", "simulator", "datamodules", "nep")
# Most files that an import may load.
MOST_FILES = {"nep.paper.nep_module": 30, "nep.fit": 110}
MOST_STAYS = 12  # of a training step of NEP-HEAT, its forward pass and loss
# Most files that a call may walk through, and most returns.
MOST_WALKED = {"observe": (8, 15), "rank": (15, 37), "rank first": (31, 79)}


def list_closure(module: str) -> list[str]:
    """Return the modules of ours that an import of one loads, in a fresh interpreter.

    Raises:
        ValueError: if it cannot be imported.
    """
    code = (
        f"import importlib, json, sys; importlib.import_module({module!r}); "
        "print(json.dumps({n: m.__file__ for n, m in sys.modules.items()"
        " if getattr(m, '__file__', None)}))"
    )
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", code],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        last = done.stderr.strip().rpartition("\n")[2]
        raise ValueError(
            f"module must be one that can be imported, got {shorten(module)} ({last}). Check the "
            "name."
        )
    found = json.loads(done.stdout.splitlines()[-1])
    return sorted(
        name
        for name, file in found.items()
        if name.partition(".")[0] in PACKAGES and _has_code(file)
    )


def _has_code(file: str) -> bool:
    """Tell whether a file has more than a docstring."""
    return len(ast.parse(Path(file).read_text("utf-8")).body) > 1


@dataclass(frozen=True, slots=True)
class CallWalk:
    """What a call walks through.

    Attributes:
        calls: of functions of ours.
        files: that they are in.
        returns: how often a function calls into another file of ours that the call was in before.
    """

    calls: int
    files: tuple[str, ...]
    returns: int

    @property
    def stays(self) -> int:
        """How often a file was entered."""
        return len(self.files) + self.returns


def profile(call: Callable[[], Any]) -> CallWalk:
    """Follow a call; what it loads should be loaded before."""
    walked: list[str] = []

    def note(frame: FrameType, event: str, _: Any) -> None:
        file = frame.f_code.co_filename
        if event == "call" and file.startswith(str(ROOT)):
            name = file.removeprefix(f"{ROOT}/")
            if name.partition("/")[0] in PACKAGES:
                walked.append(name)

    sys.setprofile(note)
    try:
        call()
    finally:
        sys.setprofile(None)
    seen: set[str] = set()
    returns, last = 0, ""
    for name in walked:
        returns += name != last and name in seen
        seen.add(name)
        last = name
    return CallWalk(len(walked), tuple(sorted(seen)), returns)


def walk_calls() -> dict[str, CallWalk]:
    """Follow calls in a small home, each made before, by name.

    They are "observe", a look of two sightings; "rank", a question that was put before about the
    same state; and "rank first", the first question about a state: evidence is computed, and the
    network asked.
    """
    sgm = importlib.import_module("sgm")
    memory = sgm.SceneGraphMemory()
    kitchen = memory.add_room("kitchen")
    places = [memory.add_furniture(label, kitchen) for label in ("fridge", "table", "sink")]
    seen = [sgm.Sighting("milk", "in"), sgm.Sighting("red mug")]
    for place in places:
        memory.observe(place, seen)
        memory.step()
    finder, walks = sgm.ObjectFinder.load(), {}
    for _ in range(2):  # the second time, nothing is loaded
        memory.step()
        walks["rank first"] = profile(lambda: finder.rank(memory, "milk"))
        memory.observe(places[0], seen)
        walks["observe"] = profile(lambda: memory.observe(places[0], seen))
        finder.rank(memory, "milk")
        walks["rank"] = profile(lambda: finder.rank(memory, "milk"))
    return walks


def walk_step() -> CallWalk:
    """Follow a training step of NEP-HEAT on a batch of two memories, as the loader gives it."""
    module = importlib.import_module("nep.paper.nep_module").NEPModule(
        importlib.import_module("nep.paper.encoders").HEAT(units=8)
    )
    module.log = lambda *_, **__: None  # of Lightning, which there is none of
    simulator = importlib.import_module("simulator")
    homes = simulator.SampledHomes(
        simulator.PriorGraph.default(), simulator.HomeConfig(), simulator.Streams(0, "val", [0, 1])
    )
    rollout = importlib.import_module("simulator.tasks.rollout").Rollout(
        homes, importlib.import_module("sgm.policies").Bayesian()
    )
    _, queries = rollout.ask()
    truth = np.arange(homes.num_furniture) == np.zeros((2, 1))
    snapshots = importlib.import_module("simulator.snapshots.taken").take_snapshots(
        rollout.memory, queries, truth
    )
    features = importlib.import_module("datamodules.feature_config").FeatureConfig()
    builder = importlib.import_module("datamodules.batch_builder").BatchBuilder(
        features, module.num_hops
    )
    walk = CallWalk(0, (), 0)
    for _ in range(2):  # the second time, nothing is loaded
        batch = builder.build(snapshots)
        _ = batch.homogeneous
        walk = profile(partial(module.training_step, batch, 0))
    return walk


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line: print closures and profiles."""
    parser = make_parser("python -m tools.closures", __doc__)
    parser.add_argument(
        "modules", nargs="*", default=[], help="print what each of these loads, and no more"
    )
    with one_line_errors(status=2):
        names = parse(parser, arguments).modules
        for name in names:
            print("\n".join([f"{name}:", *(f"  {loaded}" for loaded in list_closure(name))]))
    if names:
        return
    print("| import | files of ours |\n| --- | --- |")
    for name in ("sgm.finder.object_finder", *MOST_FILES, "nep.evaluate", "nep.reproduce"):
        print(f"| `{name}` | {len(list_closure(name))} |")
    print("\n| call | calls | files | returns | stays |\n| --- | --- | --- | --- | --- |")
    for name, walk in {**walk_calls(), "training step": walk_step()}.items():
        counts = walk.calls, len(walk.files), walk.returns, walk.stays
        print(f"| `{name}` | {' | '.join(map(str, counts))} |")


if __name__ == "__main__":
    run_main(main)
