"""Homes with as many things of a type, and of one description, as homes have."""

from __future__ import annotations

import numpy as np

from sgm.prior.copies import get_copies
from simulator.world.initial_homes import sample_initial_objects
from simulator.world.mixture.views import MixedHomes
from simulator.world.sampled_state import SampledState

_ALIKE = 0.6  # share of a type's things with its first description; of the others, its second, ...
_TRIES = 6  # to find as many different descriptions as things


class HomesWithCopies(MixedHomes):
    """Homes with as many things of each type and description as homes have."""

    def choose_objects(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Draw homes, ascending, types, places and description codes of the objects, (n,) each."""
        homes, types, places, _ = sample_initial_objects(self)
        return homes, *deal_copies(self, homes, types, places)


def deal_copies(
    homes: SampledState, home: np.ndarray, types: np.ndarray, places: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Give homes as many things of each type, and of each description, as homes have.

    What is there too often becomes a thing of another type of the home that may be there more
    often, and of which there are few for that; or, where all have as many as may be, stays.

    Args:
        homes: the group; its places and weights are known.
        home: of each thing that was drawn, ascending, (n,).
        types: of each thing, (n,).
        places: where each was drawn, (n,).

    Returns:
        Types, places and description codes, (n,) each.
    """
    types, places, codes = types.copy(), places.copy(), np.empty(len(types), dtype=np.int32)
    copies = np.array([get_copies(label) for label in homes.object_labels])
    num_types = len(copies)
    for number in range(homes.num_homes):
        rng = homes.streams.generator("copies", number)
        in_home = slice(*np.searchsorted(home, (number, number + 1)))
        most = np.ceil(copies[:, 0] * rng.uniform(0.3, 1, num_types)).astype(int)
        most[~homes.place_weights[number].any(axis=1)] = 0
        chosen = _limit(types[in_home], most, rng)
        for thing in np.flatnonzero(chosen != types[in_home]):
            weights = np.cumsum(homes.place_weights[number, chosen[thing]].astype(float))
            mark = rng.random() * weights[-1]
            places[in_home.start + thing] = np.searchsorted(weights, mark, side="right")
        types[in_home] = chosen
        codes[in_home] = _describe(homes, chosen, copies, rng)
    return types, places, codes


def _limit(types: np.ndarray, most: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return the types of things (n,) of a home, none more than `most` (T,) times if it can be."""
    order = rng.permutation(len(types))
    rank = np.empty(len(types), dtype=int)
    by_type = order[np.argsort(types[order], kind="stable")]
    counts = np.bincount(types, minlength=len(most))
    starts = np.cumsum(counts) - counts
    rank[by_type] = np.arange(len(types)) - starts[types[by_type]]
    is_extra = rank >= most[types]
    room = np.maximum(most - np.bincount(types[~is_extra], minlength=len(most)), 0)
    free = np.repeat(np.arange(len(most)), room)
    extra = np.flatnonzero(is_extra)
    taken = rng.permutation(free)[: len(extra)]
    limited = types.copy()
    limited[extra[: len(taken)]] = taken
    return limited


def _describe(
    homes: SampledState, types: np.ndarray, copies: np.ndarray, rng: np.random.Generator
) -> np.ndarray:
    """Draw description codes of the things (n,) of a home, by the table's numbers (T, 2).

    Some are called the same, but for types of which each thing has a description of its own.
    """
    codes = np.empty(len(types), dtype=np.int32)
    for thing_type in np.unique(types):
        things = np.flatnonzero(types == thing_type)
        most, num_kinds = copies[thing_type]
        is_own = num_kinds >= most
        num_kinds = len(things) if is_own else min(int(rng.integers(1, num_kinds + 1)), len(things))
        uniform = rng.random(num_kinds * _TRIES)
        drawn = homes.object_descriptions.sample(np.full(len(uniform), thing_type), uniform)
        drawn = drawn[np.sort(np.unique(drawn, return_index=True)[1])][:num_kinds]
        turn = np.arange(len(things)) if is_own else rng.geometric(_ALIKE, len(things)) - 1
        codes[things] = drawn[np.minimum(turn, len(drawn) - 1)]
    return codes
