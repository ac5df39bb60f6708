"""A search for several things: one tour, which ends when all are found."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from sgm.finder.ranking import Place
from sgm.finder.search import ObjectSearch
from sgm.finder.search_plan import Look
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.messages import shorten
from sgm.names.asking import make_asking


class SeveralSearch:
    """Looks for several things, each look for all that are not found yet.

    The next place is the one with the best gain per cost, where the gain is the expected number of
    things that a look there finds: it makes the mean time until each of them is found small. What a
    look tells of one thing it tells of each, and the memory observes it once.

    Example:
        >>> search = finder.search_several(memory, ["keys", "wallet"])
        >>> while (look := search.next()) is not None:
        ...     search.seen(robot.go_and_look(look.place.furniture))

    Attributes:
        memory: what is remembered.
        searches: one for each thing, which say whether it was found, and where.
        num_looks: looks so far.
        going: the look that `next` gave, as long as nothing was said of it; else None.
    """

    def __init__(self, memory: SceneGraphMemory, searches: Sequence[ObjectSearch]) -> None:
        """Look for what one search or more look for, all from the same start."""
        self.memory = memory
        self.searches = tuple(searches)
        self.num_looks = 0
        self.going: Look | None = None

    @property
    def description(self) -> str:
        """What is looked for, in one line."""
        names = [search.description for search in self.searches]
        return make_asking(self.memory.language).join(names, "and")

    @property
    def left(self) -> tuple[str, ...]:
        """What is not found yet."""
        return tuple(search.description for search in self._unfound)

    @property
    def is_found(self) -> bool:
        """Whether all of them were found."""
        return not self._unfound

    @property
    def cost(self) -> float:
        """Of all looks together; as of `ObjectSearch`."""
        return max(search.cost for search in self.searches)

    @property
    def offered(self) -> tuple[str, ...]:
        """What the latest look showed that may be one of them; as of `ObjectSearch`."""
        names = (name for search in self._unfound for name in search.offered)
        return tuple(dict.fromkeys(names))

    @property
    def outcome(self) -> str:
        """Say in one line how the search of each stands or ended."""
        return "; ".join(search.outcome for search in self.searches)

    @property
    def _unfound(self) -> list[ObjectSearch]:
        return [search for search in self.searches if not search.is_found]

    def next(self) -> Look | None:
        """Return where to go and look next; None when the search of each is over."""
        self.going = None
        unfound = self._unfound
        active = [search for search in unfound if search.next() is not None]
        if not active:
            return None
        look = active[0].going
        if len(active) > 1:
            look = active[0].plan(_join_places([search.list_places() for search in active]))
        if look is None:
            return None
        self.going = look
        for search in unfound:
            if search.going is not look:
                search.take(look)
        return look

    def found(self, thing: str = "") -> None:
        """Say that one of them was found at the place that `next` gave, and nothing of the others.

        Args:
            thing: one of `left`; it may be left out where that is one.

        Raises:
            ValueError: if it is none of them.
            RuntimeError: as of `ObjectSearch`.
        """
        names = self.left
        if thing not in names and not (thing == "" and len(names) == 1):
            raise ValueError(
                f"thing must be one of {', '.join(names)}, got {shorten(thing)}. Say which of them "
                "was found."
            )
        for search in self._unfound:
            if search.description == (thing or names[0]):
                search.found()
            else:
                search.pass_by()
        self._note()

    def not_found(self, coverage: float = 1.0) -> None:
        """Say that none of them was at the place that `next` gave; nothing is said of others."""
        for search in self._unfound:
            search.not_found(coverage)
        self._note()

    def seen(
        self,
        sightings: Sequence[Sighting],
        coverage: float | Mapping[str, float] = 1.0,
        **about: Any,
    ) -> bool:
        """Say all that was seen at the place that `next` gave; arguments as of `ObjectSearch`.

        Returns:
            Whether all are found now.
        """
        unfound = self._unfound
        known = [search.list_known() for search in unfound]
        named: Sequence[Sighting] = sightings
        if self.going is not None:
            named = self.memory.name_seen(self.going.place.furniture, sightings)
            self.memory.observe(self.going.place.furniture, sightings, coverage, **about)
        for search, names in zip(unfound, known, strict=True):
            search.judge(names, named, coverage)
        self._note()
        return self.is_found

    def _note(self) -> None:
        self.num_looks += 1
        self.going = None


def _join_places(rankings: Sequence[Sequence[Place]]) -> list[Place]:
    """Return places with the mean probability of several things, and how likely looks show them."""
    by_id: dict[int, list[Place]] = {}
    for places in rankings:
        for place in places:
            by_id.setdefault(place.furniture, []).append(place)
    joined = []
    for places in by_id.values():
        total = sum(place.probability for place in places)
        shown = sum(place.probability * place.detection for place in places)
        likeliest = max(places, key=lambda place: place.probability)
        costs = [place.open_cost for place in places if place.open_cost is not None]
        joined.append(
            replace(
                likeliest,
                probability=total / len(rankings),
                detection=shown / total if total > 0 else likeliest.detection,
                open_cost=max(costs, default=None),
            )
        )
    return sorted(joined, key=lambda place: -place.probability)
