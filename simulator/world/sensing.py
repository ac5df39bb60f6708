"""What an agent sees when it looks at a furniture node."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simulator.world.homes import NUM_RELATIONS, Homes


@dataclass(frozen=True, slots=True)
class Observation:
    """One look in each of some homes: a furniture node and what was detected there.

    Attributes:
        home: which homes looked, ascending, (n,).
        furniture: the furniture index each of them looked at, (n,).
        seen_home: home of each detected object, (m,).
        seen_code: its description code, (m,).
        seen_relation: 0 "in", 1 "onTop", (m,).
    """

    home: np.ndarray
    furniture: np.ndarray
    seen_home: np.ndarray
    seen_code: np.ndarray
    seen_relation: np.ndarray


def observe(homes: Homes, furniture: np.ndarray) -> Observation:
    """Look at one furniture node per home; a negative index means no look in that home.

    Each object there is missed with probability `detection_error`, independently.

    Args:
        homes: the homes.
        furniture: furniture index per home, (H,).

    Source: appendix "Detection error"; docs/design.md, ruling 11.
    """
    looking = np.flatnonzero(furniture >= 0)  # (n,)
    # Only homes that look draw numbers: a home's numbers do not depend on its neighbours.
    uniform = homes.streams.rows("detection", homes.home_num_slots).take(looking)  # (n, C)
    places = homes.object_place[looking]
    first = furniture[looking, None] * NUM_RELATIONS
    is_seen = (places >= first) & (places < first + NUM_RELATIONS)
    is_seen &= uniform >= homes.detection_error[looking, None]
    row, slot = np.divmod(np.flatnonzero(is_seen), homes.num_slots)
    home = looking[row]
    return Observation(
        home=looking,
        furniture=furniture[looking],
        seen_home=home,
        seen_code=homes.object_code[home, slot],
        seen_relation=homes.object_place[home, slot] % NUM_RELATIONS,
    )
