"""Homes that change between looks, and a memory of what was seen of them.

The names are loaded when they are first used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from sgm.lazy_names import load_lazily

if TYPE_CHECKING:
    from sgm.memory.clock import Clock
    from sgm.memory.scene_graph_memory import SceneGraphMemory
    from sgm.memory.sighting import Sighting
    from sgm.policies.heuristics import Bayesian
    from sgm.policies.policy import Policy
    from sgm.prior.prior_graph import PriorGraph
    from simulator.policies import POLICIES, make_policy
    from simulator.tasks.evaluation import evaluate_policy
    from simulator.world.config import HomeConfig
    from simulator.world.sampled_homes import SampledHomes
    from simulator.world.source import HomeSource, SampledSource
    from simulator.world.streams import Streams

_MODULES = {
    "POLICIES": "simulator.policies",
    "Bayesian": "sgm.policies.heuristics",
    "Clock": "sgm.memory.clock",
    "HomeConfig": "simulator.world.config",
    "HomeSource": "simulator.world.source",
    "Policy": "sgm.policies.policy",
    "PriorGraph": "sgm.prior.prior_graph",
    "SampledHomes": "simulator.world.sampled_homes",
    "SampledSource": "simulator.world.source",
    "SceneGraphMemory": "sgm.memory.scene_graph_memory",
    "Sighting": "sgm.memory.sighting",
    "Streams": "simulator.world.streams",
    "evaluate_policy": "simulator.tasks.evaluation",
    "make_policy": "simulator.policies",
}

__all__ = [
    "POLICIES",
    "Bayesian",
    "Clock",
    "HomeConfig",
    "HomeSource",
    "Policy",
    "PriorGraph",
    "SampledHomes",
    "SampledSource",
    "SceneGraphMemory",
    "Sighting",
    "Streams",
    "evaluate_policy",
    "make_policy",
]

__getattr__ = load_lazily(__name__, _MODULES)
