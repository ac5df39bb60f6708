"""Measures what the rulings of docs/design.md do: `python -m tools.measure_design`, a minute."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from datamodules.paper_features import EDGE_SCALE, NODE_SCALE
from sgm.schema import NUM_RELATIONS
from simulator import HomeConfig, PriorGraph, SampledHomes, Streams
from simulator.command_line import make_parser, one_line_errors, parse
from simulator.policies import make_policy
from simulator.process import run_main
from simulator.tasks.rollout import Rollout
from simulator.world.noise import compute_noisy_weights

_HOMES, _STEPS = 20, 100


def measure_moves(prior: PriorGraph) -> str:
    """Count moves to other rooms, and how much of T lies there, over 100 steps."""
    homes = SampledHomes(prior, HomeConfig(), Streams(0, "test", range(_HOMES)))
    place_room = np.repeat(
        homes.furniture_room.reshape(-1, homes.num_furniture), NUM_RELATIONS, axis=1
    )
    mass, best, moves, crossed = [], [], 0, 0
    for _ in range(_STEPS):
        before = homes.object_furniture.copy()
        homes.evolve()
        home, slot = np.nonzero(homes.object_moved & homes.is_present & (before >= 0))
        came, went = before[home, slot], homes.object_furniture[home, slot]
        crossed += int((_get_rooms(homes, home, came) != _get_rooms(homes, home, went)).sum())
        moves += len(home)
        home, slot = np.nonzero(homes.is_present)
        rows = homes.transition_rows(home, homes.object_code[home, slot]).astype(float)
        room = _get_rooms(homes, home, homes.object_furniture[home, slot])
        is_other = place_room[home % len(place_room)] != room[:, None]  # (objects, P)
        mass.append((rows * is_other).sum() / rows.sum())
        best.append(is_other[np.arange(len(rows)), rows.argmax(axis=1)].mean())
    return (
        f"{crossed} of {moves:,} moves change the room; {np.mean(mass):.1%} of T's mass lies in "
        f"other rooms than the object's, and the best place of {np.mean(best):.1%} of the objects"
    )


def measure_noise(prior: PriorGraph) -> str:
    """Count the weights that class noise leaves at zero."""
    weights = prior.weights.reshape(len(prior.objects), -1)
    rows, places = np.nonzero(weights)
    node_room = [prior.rooms.index(str(furniture_type.room)) for furniture_type in prior.furniture]
    place_room = np.repeat(node_room, NUM_RELATIONS)
    rng = np.random.default_rng(0)
    zeroed = [
        compute_noisy_weights(
            weights[rows, places],
            rows,
            places,
            rng.random((len(rows), 2)),
            np.zeros(len(weights), dtype=np.int64),
            place_room[None],
            np.array([len(place_room)]),
            zero_prob=np.array([0.25]),
            scale=np.array([0.25]),
        )
        == 0
        for _ in range(200)
    ]
    return f"{np.mean(zeroed):.1%} of the weights are zeroed"


def measure_prior(prior: PriorGraph) -> str:
    """Compare the prior feature with the weights that it was normalised from."""
    homes = SampledHomes(prior, HomeConfig(), Streams(0, "test", range(_HOMES)))
    memory = Rollout(homes, make_policy("random", homes)).memory
    known = memory.place_prior.weights[:, : len(prior.objects)]
    total = np.zeros(known.shape[:2])  # of the prior's own weights at the home's furniture
    per_type = prior.weights.sum(axis=2)  # (objects, furniture types)
    for home, types in enumerate(homes.furniture_type):
        total[home] = per_type[:, types].sum(axis=1)
    total = total[known.sum(axis=(2, 3)) > 0]
    low, high = np.quantile(total, [0.05, 0.95])
    return (
        "per object, the weights at a home's furniture sum to 1 "
        f"instead of {low:.2f} to {high:.2f} (5 % to 95 % of objects and homes)"
    )


def measure_scale() -> str:
    """Work out the largest scaled times of the paper's 100 steps."""
    return (
        f"scaled times reach {100 * NODE_SCALE:.0f} for nodes and {100 * EDGE_SCALE:.0f} for edges"
    )


def _get_rooms(homes: SampledHomes, home: np.ndarray, furniture: np.ndarray) -> np.ndarray:
    rooms = np.broadcast_to(homes.furniture_room, (homes.num_homes, homes.num_furniture))
    return rooms[home, furniture]


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line: print a line per row."""
    with one_line_errors(status=2):
        parse(make_parser("python -m tools.measure_design", __doc__), arguments)
    prior = PriorGraph.default()
    for name, line in (
        ("moves", measure_moves(prior)),
        ("class noise", measure_noise(prior)),
        ("prior feature", measure_prior(prior)),
        ("scaled times", measure_scale()),
    ):
        print(f"{name}: {line}")


if __name__ == "__main__":
    run_main(main)
