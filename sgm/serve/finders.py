"""The finder that the options name, ready for the first question."""

from __future__ import annotations

from datetime import datetime

from sgm.finder.finder import Finder
from sgm.finder.object_finder import ObjectFinder
from sgm.memory.clock import Clock
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.policies import Adaptive, Bayesian


def make_finder(name: str) -> Finder:
    """Make the finder of a name: any_home, bayesian, adaptive, or an exported folder."""
    heuristics = {"adaptive": Adaptive, "bayesian": Bayesian}
    if name in heuristics:
        return Finder(heuristics[name]())
    return ObjectFinder.load(name)


def warm_up(finder: Finder, memory: SceneGraphMemory | None = None) -> None:
    """Load what the first question would wait for.

    A home that is given is asked; one that has no places yet says little, so that another one,
    with things that were seen, is asked, too.
    """
    other = SceneGraphMemory(clock=Clock(datetime(2026, 1, 1), 600))
    kitchen = other.add_room("kitchen")
    table, _ = (other.add_furniture(name, room=kitchen) for name in ("table", "fridge"))
    other.observe(table, [Sighting("cup")])
    other.step()
    for name in ("cup", "thing"):  # one that was seen, and one that was not
        finder.rank(other, name)
    if memory is not None and memory.num_furniture:
        finder.rank(memory, "cup")
