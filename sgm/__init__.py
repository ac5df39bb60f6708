"""Scene graph memory: what a robot remembers of a home, and where it should look.

`SceneGraphMemory`, `Sighting` and `Clock` remember; `ObjectFinder` asks the network that ships,
`Finder` any policy, such as `Adaptive`; `MemoryService` answers in words. Needs numpy and ONNX
Runtime, no deep learning and no compiler.
The names are loaded when they are first used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from sgm.lazy_names import load_lazily

if TYPE_CHECKING:
    from sgm.belief import Detector
    from sgm.finder.finder import Finder
    from sgm.finder.object_finder import ObjectFinder
    from sgm.finder.ranking import Place, Ranking
    from sgm.finder.search_plan import Look, SearchPlan
    from sgm.finder.service import MemoryService
    from sgm.memory.clock import Clock
    from sgm.memory.scene_graph_memory import SceneGraphMemory
    from sgm.memory.score_calibration import ScoreCalibration
    from sgm.memory.sighting import SeenAt, Sighting
    from sgm.policies import Adaptive, Bayesian, Policy
    from sgm.prior.prior_graph import PriorGraph

__version__ = "0.1.0"

_MODULES = {
    "Adaptive": "sgm.policies",
    "Bayesian": "sgm.policies",
    "Clock": "sgm.memory.clock",
    "Detector": "sgm.belief",
    "Finder": "sgm.finder.finder",
    "Look": "sgm.finder.search_plan",
    "MemoryService": "sgm.finder.service",
    "ObjectFinder": "sgm.finder.object_finder",
    "Place": "sgm.finder.ranking",
    "Policy": "sgm.policies",
    "PriorGraph": "sgm.prior.prior_graph",
    "Ranking": "sgm.finder.ranking",
    "SceneGraphMemory": "sgm.memory.scene_graph_memory",
    "ScoreCalibration": "sgm.memory.score_calibration",
    "SearchPlan": "sgm.finder.search_plan",
    "SeenAt": "sgm.memory.sighting",
    "Sighting": "sgm.memory.sighting",
}

__all__ = [
    "Adaptive",
    "Bayesian",
    "Clock",
    "Detector",
    "Finder",
    "Look",
    "MemoryService",
    "ObjectFinder",
    "Place",
    "Policy",
    "PriorGraph",
    "Ranking",
    "SceneGraphMemory",
    "ScoreCalibration",
    "SearchPlan",
    "SeenAt",
    "Sighting",
]

__getattr__ = load_lazily(__name__, _MODULES)
