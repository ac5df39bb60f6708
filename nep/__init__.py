"""Node Edge Predictor: which remembered or supposed edges of a home are true now.

What a robot needs is exported here: `SceneGraphMemory`, `Sighting` and `Clock` to remember,
`ObjectFinder` to ask. The names are loaded when they are first used.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from simulator.caches import keep_home_clean
from simulator.lazy_names import load_lazily

# Waiting threads sleep rather than spin. When another process has one of two cores, spinning made a
# training step four times slower. Read when torch is loaded, hence here.
os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
keep_home_clean()  # torchmetrics imports matplotlib

if TYPE_CHECKING:
    from nep.robot.finder import ObjectFinder
    from simulator.memory.clock import Clock
    from simulator.memory.scene_graph_memory import SceneGraphMemory
    from simulator.memory.sighting import SeenAt, Sighting
    from simulator.robot.ranking import Place, Ranking
    from simulator.robot.search_plan import Look, SearchPlan

_MODULES = {
    "Clock": "simulator.memory.clock",
    "Look": "simulator.robot.search_plan",
    "ObjectFinder": "nep.robot.finder",
    "Place": "simulator.robot.ranking",
    "Ranking": "simulator.robot.ranking",
    "SceneGraphMemory": "simulator.memory.scene_graph_memory",
    "SearchPlan": "simulator.robot.search_plan",
    "SeenAt": "simulator.memory.sighting",
    "Sighting": "simulator.memory.sighting",
}

__all__ = [
    "Clock",
    "Look",
    "ObjectFinder",
    "Place",
    "Ranking",
    "SceneGraphMemory",
    "SearchPlan",
    "SeenAt",
    "Sighting",
]


__getattr__ = load_lazily(__name__, _MODULES)
