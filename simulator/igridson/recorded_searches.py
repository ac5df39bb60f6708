"""Searches in the home on a grid, step by step, to look back at."""

from __future__ import annotations

from sgm.prior.prior_graph import PriorGraph
from simulator.igridson.find_object import RunConfig, make_homes
from simulator.igridson.floor_plan import make_plan
from simulator.igridson.layout_file import load_layout
from simulator.policies import make_policy
from simulator.story.past_memory import PastMemory
from simulator.story.run_recorder import RunRecorder
from simulator.tasks.find_object import FindObject
from simulator.world.streams import Streams


def record_searches(num_searches: int, *, seed: int = 0, policy: str = "bayesian") -> PastMemory:
    """Search the shipped home again and again, a step of time between searches.

    Raises:
        ValueError: if there is no policy of that name.
    """
    grid = load_layout()
    homes = make_homes(PriorGraph.default(), grid, Streams(seed, "test", [0]))
    game = FindObject(homes, make_policy(policy, homes), max_looks=RunConfig().attempts)
    recorder = RunRecorder(game)
    for _ in game.run(num_searches):
        recorder.end_step()
    return recorder.finish("iGridson", make_plan(grid))
