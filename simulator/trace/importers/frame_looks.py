"""A memory that looks at the frames of a recording: how it begins, and what it has counted."""

from __future__ import annotations

from collections import Counter
from typing import Any

from sgm.finder.finder import Finder
from sgm.finder.home_map import HomeMap
from sgm.layout.areas import Areas
from sgm.mapping.furniture_labels import FurnitureLabels
from sgm.mapping.furniture_mapper import FurnitureMapper
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.policies.adaptive import Adaptive
from sgm.ros.live_memory import LiveMemory
from simulator.trace.importers.imported_looks import TimeOptions


def begin_looking(
    memory: SceneGraphMemory,
    home: HomeMap | None,
    options: TimeOptions,
    *,
    areas: Areas | None,
    labels: FurnitureLabels | None,
    discover: bool,
    **of_live: Any,
) -> LiveMemory:
    """Begin to look: with the furniture of a home, or to find it in the frames.

    Args:
        memory: an empty one.
        home: rooms and furniture; None to find furniture in the frames.
        options: how times are read.
        areas: rooms as polygons, for furniture that is found.
        labels: what furniture may be called.
        discover: whether furniture is found where there is a home, too.
        of_live: other arguments of `LiveMemory`.
    """
    mapper = FurnitureMapper(memory, areas=areas, labels=labels)
    if home is not None:
        home.add_to(memory)
    return LiveMemory(
        memory,
        Finder(Adaptive()),
        step_seconds=options.step_seconds,
        local_time=options.to_local,
        discover=mapper if home is None or discover else None,
        labels=labels,
        **of_live,
    )


def count_frames(live: LiveMemory) -> Counter[str]:
    """Return what was counted of frames, and of the map where one is drawn."""
    counts = Counter[str]()
    if live.mapper is not None:
        counts.update({f"map: {name}": number for name, number in live.mapper.counts.items()})
    counts.update({f"frames: {name}": number for name, number in live.builder.counts.items()})
    return counts
