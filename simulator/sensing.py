"""What an agent sees when it looks at a furniture node."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simulator.homes import NUM_RELATIONS, Homes


@dataclass(frozen=True, slots=True)
class Observation:
    """One look in each of some homes: a furniture node and what was detected there.

    Attributes:
        house: which homes looked, ascending, (n,).
        furniture: the furniture index each of them looked at, (n,).
        seen_house: home of each detected object, (m,).
        seen_code: its description code, (m,).
        seen_relation: 0 "in", 1 "onTop", (m,).
    """

    house: np.ndarray
    furniture: np.ndarray
    seen_house: np.ndarray
    seen_code: np.ndarray
    seen_relation: np.ndarray


def observe(houses: Homes, furniture: np.ndarray) -> Observation:
    """Look at one furniture node per house; a negative index means no look in that house.

    Each object there is missed with probability `detection_error`, independently.

    Args:
        houses: the homes.
        furniture: furniture index per house, (H,).

    Source: appendix "Detection error"; ruling 11.
    """
    looking = np.flatnonzero(furniture >= 0)  # (n,)
    # Only homes that look draw numbers: a home's numbers do not depend on its neighbours.
    uniform = houses.streams.rows("detection", houses.num_slots).take(looking)  # (n, C)
    places = houses.object_place[looking]
    first = furniture[looking, None] * NUM_RELATIONS
    is_seen = (places >= first) & (places < first + NUM_RELATIONS)
    is_seen &= uniform >= houses.config.detection_error
    row, slot = np.divmod(np.flatnonzero(is_seen), houses.num_slots)
    house = looking[row]
    return Observation(
        house=looking,
        furniture=furniture[looking],
        seen_house=house,
        seen_code=houses.object_code[house, slot],
        seen_relation=houses.object_place[house, slot] % NUM_RELATIONS,
    )
