"""What `python -m nep.view` can open: files, recorded homes, and homes that are played."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from nep.view.page_state import Stage
from sgm.memory.look_log import read_log
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.messages import shorten
from sgm.prior.prior_graph import PriorGraph, load_prior
from simulator.home_options import SOURCES, HomeOptions
from simulator.replay.record import record_run
from simulator.replay.replay import Replay
from simulator.replay.still_memory import StillMemory
from simulator.trace.trace import find_traces

WEEK = "routine"  # a simulated week with people
GRID = "igridson"
PLAYED = (WEEK, *(name for name in SOURCES if name != "recorded"), GRID)
DEFAULT_STEPS = 336  # a week of half hours
GRID_SEARCHES = 60
LOG_ENDING = ".jsonl"

# What stands for the options that a source is short for; those of the command line come after.
_SHORT_FOR = {
    WEEK: (
        "--dynamics", "routine", "--dynamics.step_seconds", "1800",
        "--home.furniture_per_room", "6", "--home.objects_per_furniture", "3",
        "--looks", "patrol", "--looks_per_step", "2",
    )
}  # fmt: skip


def list_options(source: str) -> list[str]:
    """Return the options of homes that a source stands for.

    Raises:
        ValueError: if there is no such file, folder or name.
    """
    if source in _SHORT_FOR:
        return list(_SHORT_FOR[source])
    if source in SOURCES and source in PLAYED:
        return ["--homes", source]
    if source == GRID:
        return []
    path = Path(source)
    if path.is_dir():
        find_traces([path])
        return ["--trace", source]
    if not path.exists():
        raise ValueError(
            f"source must be a memory file, a log of looks ({LOG_ENDING}), a folder with a trace, "
            f"or one of {', '.join(PLAYED)}, got {shorten(source)}. Check the path."
        )
    return []


def open_source(
    source: str,
    homes: HomeOptions,
    steps: int | None = None,
    number: int = 0,
    seed: int = 0,
    robot: str = "bayesian",
    doors: Sequence[Sequence[Any]] = (),
) -> Stage:
    """Open what a page shows: a source as `list_options` takes it, for a week if no steps are said.

    Raises:
        ValueError: if a file is broken, or a number out of range.
    """
    path = Path(source)
    if source == GRID:
        from simulator.igridson.replay import record_searches  # an extra

        return _hold(record_searches(steps or GRID_SEARCHES, seed=seed, policy=robot), doors)
    if source in PLAYED or path.is_dir():
        made = homes.make()
        return _hold(
            record_run(
                made, steps or made.num_steps or DEFAULT_STEPS, home=number, seed=seed, policy=robot
            ),
            doors,
        )
    prior = None if homes.prior is None else load_prior(homes.prior)
    load: Callable[[], Any]
    if path.suffix == LOG_ENDING:
        load = lambda: _read_replay(path, prior)  # noqa: E731
    else:
        load = lambda: StillMemory(SceneGraphMemory.load(path, prior), path.name)  # noqa: E731
    return Stage(load, lambda: (path.stat().st_mtime_ns, path.stat().st_size), doors)


def _read_replay(path: Path, prior: PriorGraph | None) -> Replay:
    """Read a log, and make its last memory: a line that cannot be made again is refused now."""
    story = Replay(read_log(path), path.name, prior=prior)
    story.memory_at(story.num_steps)
    return story


def _hold(story: Replay, doors: Sequence[Sequence[Any]]) -> Stage:
    return Stage(lambda: story, doors=doors)
