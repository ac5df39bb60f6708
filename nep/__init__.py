"""Node Edge Predictor: which remembered or supposed edges of a home are true now.

What a robot needs is exported here: `SceneGraphMemory`, `Sighting` and `Clock` to remember,
`ObjectFinder` to ask. The names are loaded when they are first used.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from sgm.lazy_names import load_lazily
from simulator.caches import keep_home_clean

# Waiting threads sleep rather than spin. When another process has one of two cores, spinning made a
# training step four times slower. Read when torch is loaded, hence here.
os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
keep_home_clean()  # torchmetrics imports matplotlib

if TYPE_CHECKING:
    from nep.robot.finder import ObjectFinder
    from sgm.finder.ranking import Place, Ranking
    from sgm.finder.search_plan import Look, SearchPlan
    from sgm.memory.clock import Clock
    from sgm.memory.scene_graph_memory import SceneGraphMemory
    from sgm.memory.sighting import SeenAt, Sighting

_MODULES = {
    "Clock": "sgm.memory.clock",
    "Look": "sgm.finder.search_plan",
    "ObjectFinder": "nep.robot.finder",
    "Place": "sgm.finder.ranking",
    "Ranking": "sgm.finder.ranking",
    "SceneGraphMemory": "sgm.memory.scene_graph_memory",
    "SearchPlan": "sgm.finder.search_plan",
    "SeenAt": "sgm.memory.sighting",
    "Sighting": "sgm.memory.sighting",
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
