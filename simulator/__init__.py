"""Homes that change while nobody looks, and a memory of what was seen of them."""

from simulator.memory.clock import Clock
from simulator.memory.scene_graph_memory import SceneGraphMemory, Sighting
from simulator.policies import POLICIES, Bayesian, Policy, make_policy
from simulator.priors.prior_graph import PriorGraph
from simulator.tasks.evaluation import evaluate_policy
from simulator.world.config import HomeConfig
from simulator.world.sampled_homes import SampledHomes
from simulator.world.source import HomeSource, SampledSource
from simulator.world.streams import Streams

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
