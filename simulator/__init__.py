"""Homes that change while nobody looks, and a memory of what was seen of them."""

from simulator.config import HouseConfig
from simulator.dynamics import evolve
from simulator.evaluation import evaluate_policy
from simulator.houses import Houses
from simulator.memory.clock import Clock
from simulator.memory.scene_graph_memory import SceneGraphMemory, Sighting
from simulator.policies import POLICIES, Bayesian, Policy, make_policy
from simulator.prior_graph import PriorGraph
from simulator.streams import Streams

__all__ = [
    "POLICIES",
    "Bayesian",
    "Clock",
    "HouseConfig",
    "Houses",
    "Policy",
    "PriorGraph",
    "SceneGraphMemory",
    "Sighting",
    "Streams",
    "evaluate_policy",
    "evolve",
    "make_policy",
]
