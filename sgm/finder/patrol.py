r"""Where a robot that has nothing to do learns most of where things are.

For a thing that is at place f with probability p_f, where one look shows it with probability d_f if
it is there, the looks at places S are independent of it but for that it is at one place. With
q = 1 - Σ_S p d, how likely these looks do not show it, a look at one place f more tells

    q h(p_f d_f / q) - p_f h(d_f)        h(x) = - x ln x - (1 - x) ln (1 - x)

nats of where the thing is (its mutual information with what the look shows). The gain of a place is
the sum over all things. Places are chosen one after the other, which reaches at least 1 - 1/e of
what the best k places tell. Places that were never looked at come before all others: what is there
is not known at all.

Source: Nemhauser, Wolsey and Fisher 1978 (the bound); Krause and Guestrin 2005 (of information).
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass

import numpy as np

from sgm.memory.memory_questions import Asked
from sgm.memory.scene_graph_memory import SceneGraphMemory

_NO_THING = "thing"  # asked for where nothing is known: it tells nothing
_MOST_THINGS = 500  # those that were seen last: half a second with a network


@dataclass(frozen=True, slots=True)
class PatrolLook:
    """A place to look at on a patrol.

    Attributes:
        furniture: its id.
        name: for people, "desk in study".
        gain: nats that a look there tells of where things are, beside the looks before it.
        is_new: whether it was never looked at.
    """

    furniture: int
    name: str
    gain: float
    is_new: bool

    def __str__(self) -> str:
        """Say it in one line, in English."""
        told = ", never looked at" if self.is_new else ""
        return f"{self.name}: {self.gain:.2f} nats{told}"


def choose_looks(
    memory: SceneGraphMemory,
    k: int,
    exclude: Collection[int],
    believe: Callable[[list[str]], tuple[Asked, np.ndarray, np.ndarray]],
) -> list[PatrolLook]:
    """Choose k places at most, in the order in which they are to be looked at.

    Args:
        memory: what was seen so far.
        k: most places.
        exclude: furniture ids not to visit.
        believe: asks for things by ids or descriptions, and returns besides where each of the V
            things is that they mean, and how likely a look shows it there, (V, F) each.

    Raises:
        ValueError: if there is no furniture yet.
    """
    things = _list_things(memory)
    asked, places, shown = believe(things or [_NO_THING])
    if not things:
        places = np.zeros_like(places)
    is_new = asked.current.furniture["num_observed"][0, : len(asked.furniture_ids)] == 0
    is_open = np.array([id_ not in exclude for id_ in asked.furniture_ids])
    return [
        PatrolLook(asked.furniture_ids[place], asked.furniture_names[place], gain, is_first)
        for place, gain, is_first in _choose(places, shown, is_new, is_open, k)
    ]


def _list_things(memory: SceneGraphMemory) -> list[str]:
    """List ids or descriptions of the things that were seen last, each once."""
    seen, _ = memory.list_seen(most=_MOST_THINGS)
    names = dict.fromkeys(name for name, _ in seen)
    return [thing.id or thing.description for thing in memory.list_named(*names)][:_MOST_THINGS]


def _choose(
    places: np.ndarray, shown: np.ndarray, is_new: np.ndarray, is_open: np.ndarray, k: int
) -> list[tuple[int, float, bool]]:
    """Choose positions of places, each with its gain and whether it is new; see the module."""
    found, would_show = np.clip(places, 0.0, 1.0) * shown, _compute_entropy(shown)
    left, is_left = np.ones(len(places)), is_open.copy()
    chosen: list[tuple[int, float, bool]] = []
    for _ in range(min(k, int(is_open.sum()))):
        share = np.minimum(found / np.maximum(left, 1e-12)[:, None], 1.0)
        gain = (left[:, None] * _compute_entropy(share) - places * would_show).sum(axis=0)
        best = int(np.lexsort((gain, is_new, is_left))[-1])
        chosen.append((best, float(max(gain[best], 0.0)), bool(is_new[best])))
        left, is_left[best] = np.maximum(left - found[:, best], 0.0), False
    return chosen


def _compute_entropy(probability: np.ndarray) -> np.ndarray:
    """Return h of probabilities, in nats, of the same shape."""
    is_open = (probability > 0) & (probability < 1)
    kept = np.where(is_open, probability, 0.5)
    entropy: np.ndarray = -kept * np.log(kept) - (1 - kept) * np.log1p(-kept)
    return np.where(is_open, entropy, 0.0)
