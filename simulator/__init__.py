"""Homes that change while nobody looks, and a memory of what was seen of them.

The names are loaded when they are first used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from simulator.lazy_names import load_lazily

if TYPE_CHECKING:
    from simulator.memory.clock import Clock
    from simulator.memory.scene_graph_memory import SceneGraphMemory
    from simulator.memory.sighting import Sighting
    from simulator.policies import POLICIES, Bayesian, Policy, make_policy
    from simulator.priors.prior_graph import PriorGraph
    from simulator.tasks.evaluation import evaluate_policy
    from simulator.world.config import HomeConfig
    from simulator.world.sampled_homes import SampledHomes
    from simulator.world.source import HomeSource, SampledSource
    from simulator.world.streams import Streams

_MODULES = {
    "POLICIES": "simulator.policies",
    "Bayesian": "simulator.policies",
    "Clock": "simulator.memory.clock",
    "HomeConfig": "simulator.world.config",
    "HomeSource": "simulator.world.source",
    "Policy": "simulator.policies",
    "PriorGraph": "simulator.priors.prior_graph",
    "SampledHomes": "simulator.world.sampled_homes",
    "SampledSource": "simulator.world.source",
    "SceneGraphMemory": "simulator.memory.scene_graph_memory",
    "Sighting": "simulator.memory.sighting",
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
