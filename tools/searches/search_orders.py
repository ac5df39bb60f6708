"""Searches in a robot's home: how soon orders of looks find what is asked for."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np

from sgm.finder.finder import Finder
from sgm.finder.ranking import Place
from sgm.memory.scene_graph_memory import SceneGraphMemory
from tools.bench.robot_life import FinderQuestion

COLUMNS = ("within", "found", "looks")
WITHIN = 8  # looks, of the first column
MOST_LOOKS = 20  # after which every search ends

# Yields where to look next, and goes on where that look did not show the thing.
Searcher = Callable[[Finder, SceneGraphMemory, str], Iterator[int]]


def follow_search(give_up_at: float) -> Searcher:
    """Return `Finder.search`, which gives up at a probability."""

    def search(finder: Finder, memory: SceneGraphMemory, thing: str) -> Iterator[int]:
        looking = finder.search(memory, thing, give_up_at=give_up_at)
        while (look := looking.next()) is not None:
            yield look.place.furniture
            looking.not_found()

    return search


def follow_belief(finder: Finder, memory: SceneGraphMemory, thing: str) -> Iterator[int]:
    """Ask `rank` before each look and go to the likeliest place, as one would without `search`."""
    while True:
        furniture = finder.rank(memory, thing, k=1)[0].furniture
        yield furniture
        _note_missed(finder, memory, thing, furniture)


def look_everywhere_first(finder: Finder, memory: SceneGraphMemory, thing: str) -> Iterator[int]:
    """As `follow_belief`, and no place again before all others."""
    num_looks = dict.fromkeys(memory.furniture_ids, 0)

    def count(place: Place) -> int:
        return num_looks[place.furniture]

    while True:
        furniture = min(finder.rank(memory, thing), key=count).furniture  # the first of the fewest
        yield furniture
        _note_missed(finder, memory, thing, furniture)
        num_looks[furniture] += 1


TOLD = ("greedy, told", "search, told")  # their finders are given the detector that they have
SEARCHERS: Mapping[str, Searcher] = {
    "greedy": follow_belief,
    TOLD[0]: follow_belief,
    "search": follow_search(give_up_at=1.0),
    TOLD[1]: follow_search(give_up_at=1.0),
    "search, gives up": follow_search(give_up_at=0.9),
    "everywhere first": look_everywhere_first,
}


def search_all(
    finder: Finder,
    searcher: Searcher,
    questions: Sequence[FinderQuestion],
    miss_rate: float,
    repeated_share: float,
    seed: int,
) -> dict[str, float]:
    """Search for everything that is asked for, and return `COLUMNS`.

    Args:
        finder: whose belief is followed.
        searcher: where it looks.
        questions: each is searched for in a copy of its memory; time stands still.
        miss_rate: probability that a look misses the thing.
        repeated_share: of the misses, that all looks at the place repeat; the rest is independent.
        seed: of what is missed: the n-th look at a place shows the same to every policy.

    Returns:
        "within": share of the things that were found within `WITHIN` looks. "found": share that was
        found at all, with `MOST_LOOKS` at most. "looks": mean number of looks,
        found or not.
    """
    found, looks = [], []
    for number, asked in enumerate(questions):
        memory = asked.memory.copy()
        rng, hidden = np.random.default_rng((seed, number)), repeated_share * miss_rate
        uniform = rng.random((memory.num_furniture, MOST_LOOKS))
        missed_by_one = uniform * (1 - hidden) < miss_rate - hidden
        missed_by_all = rng.random((memory.num_furniture, 1)) < hidden
        is_missed = dict(zip(memory.furniture_ids, missed_by_one | missed_by_all, strict=True))
        num_looks = dict.fromkeys(memory.furniture_ids, 0)
        is_found, num_made = False, 0
        for furniture in searcher(finder, memory, asked.description):
            missed = is_missed[furniture][num_looks[furniture]]
            num_looks[furniture] += 1
            num_made += 1
            is_found = furniture in asked.places and not missed
            if is_found or num_made == MOST_LOOKS:
                break
        found.append(is_found)
        looks.append(num_made)
    is_soon = np.array(found) & (np.array(looks) <= WITHIN)
    return {
        "within": float(is_soon.mean()),
        "found": float(np.mean(found)),
        "looks": float(np.mean(looks)),
    }


def _note_missed(finder: Finder, memory: SceneGraphMemory, thing: str, furniture: int) -> None:
    for name in finder.resolve(memory, thing).matches or (thing,):
        memory.note_absent(furniture, name)
