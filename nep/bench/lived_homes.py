"""Homes that a robot lives in, simulated and recorded."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from nep.bench.robot_life import LivedHome
from sgm.prior.prior_graph import PriorGraph
from simulator.trace.source import RecordedSource
from simulator.trace.trace import find_traces
from simulator.world.config import HomeConfig
from simulator.world.routine.dynamics import RoutineDynamics
from simulator.world.source import SampledSource


def list_lived_homes(
    sizes: Sequence[int], num_homes: int, folders: Sequence[str], rules: HomeConfig, seed: int
) -> list[LivedHome]:
    """List the homes: people with routines, or recordings.

    Args:
        sizes: furniture nodes of each room, of one simulated home after the other, in turn.
        num_homes: simulated homes, or plays of each recording.
        folders: traces, or folders of traces, where a robot's memory uses the household prior,
            as it does by default; none for simulated homes.
        rules: of looking.
        seed: of the first play, or of all simulated homes.
    """
    if folders:
        prior = PriorGraph.household()
        return [
            LivedHome(
                f"{path.name}-{own}", RecordedSource(prior, rules, [str(path)]), 0, own, path.name
            )
            for path in find_traces(folders)
            for own in range(seed, seed + num_homes)
        ]
    homes = []
    for number in range(num_homes):
        size = sizes[number % len(sizes)]
        own = replace(
            rules, furniture_per_room=size, objects_per_furniture=3, dynamics=RoutineDynamics()
        )
        name = f"{size * len(rules.rooms)} places-{number}"
        homes.append(LivedHome(name, SampledSource(None, own), number, seed, name))
    return homes
