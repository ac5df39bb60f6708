"""A search: where to go next, what was seen there, when to give up."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from typing import Any, Protocol

from sgm.checks import is_number
from sgm.finder.ranking import Place, Ranking
from sgm.finder.search_plan import Distance, Look, SearchPlan, plan_search
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.messages import shorten
from sgm.names.names import Resolution, read_name

MOST_ROUNDS = (
    3  # looks at one place in a search: a detector that misses a quarter misses 2 % thrice
)
_GLANCE = 0.01  # share of the furniture in view when only the thing itself was


class Ranker(Protocol):
    """Whoever says where things are: `sgm.finder.finder.Finder`."""

    def resolve(self, memory: SceneGraphMemory, description: str) -> Resolution:
        """Say which remembered things a question means."""

    def resolve_among(
        self, memory: SceneGraphMemory, description: str, names: Sequence[str]
    ) -> tuple[str, ...]:
        """Return which of some names a question means."""

    def rank(
        self,
        memory: SceneGraphMemory,
        description: str,
        k: int | None = None,
        exclude: Collection[int] = (),
    ) -> Ranking:
        """Rank the places where something may be."""


class ObjectSearch:
    """Looks for one thing until it is found or not worth going on.

    Every look goes into the memory, so that the next place is chosen by Bayes' rule from all that
    was seen since. No place is offered again before every place that can be reached was offered as
    often; a detector that misses things makes a second round worth while. Time may pass meanwhile
    (`memory.step`), and a search that is started anew, after a restart for example, goes on with
    what the memory holds.

    Example:
        >>> search = finder.search(memory, "large red mug")
        >>> while (look := search.next()) is not None:
        ...     seen = robot.go_and_look(look.place.furniture)
        ...     if search.seen(seen):
        ...         break
        >>> print(search.outcome)

    Attributes:
        description: what is looked for.
        memory: what is remembered.
        num_looks: looks so far.
        is_found: whether it was found.
    """

    def __init__(
        self,
        finder: Ranker,
        memory: SceneGraphMemory,
        description: str,
        start: Any,
        distance: Distance | None,
        look_cost: float,
        exclude: frozenset[int],
        give_up_at: float,
    ) -> None:
        """Start; `Finder.search` says what the arguments are."""
        if not is_number(give_up_at) or not 0 < give_up_at <= 1:
            raise ValueError(
                f"give_up_at must lie above 0 and at most at 1, got {shorten(give_up_at)}. Give "
                "the probability of elsewhere from which on looking is not worth it."
            )
        self.description = description
        self.memory = memory
        self.num_looks = 0
        self.is_found = False
        self._finder = finder
        self._at = start
        self._distance = distance
        self._look_cost = look_cost
        self._exclude = exclude
        self._give_up_at = give_up_at
        self._rounds: dict[int, int] = {}  # looks of this search by furniture id
        self._going: Look | None = None
        self._reason = ""
        self._found_at = ""
        self._make_plan(self._split(self.ranking)[0])  # bad arguments are told now

    @property
    def ranking(self) -> Ranking:
        """Where it may be now, all places."""
        return self._finder.rank(self.memory, self.description, exclude=self._exclude)

    @property
    def outcome(self) -> str:
        """Say in one line how the search stands or ended."""
        looks = f"{self.num_looks} look{'' if self.num_looks == 1 else 's'}"
        if self.is_found:
            return f"{self.description}: found at {self._found_at} after {looks}"
        return f"{self.description}: {self._reason or 'not found yet'} after {looks}"

    def next(self) -> Look | None:
        """Return where to go and look next; None when the search is over (`outcome` says why).

        Until all places that can be reached were looked at, there is a next one. Then it is worth
        another round as long as "elsewhere" and what cannot be reached are together less likely
        than `give_up_at`, `MOST_ROUNDS` at most.
        """
        self._going = None
        if self.is_found:
            return None
        ranking = self._finder.rank(self.memory, self.description)
        places, cut_off = self._split(ranking)
        plan, elsewhere = self._make_plan(places), ranking.elsewhere
        if not plan.looks:
            self._reason = "no place can be reached"
            return None
        num_rounds = self._rounds.get(plan.looks[0].place.furniture, 0)
        hopeless = elsewhere + sum(place.probability for place in cut_off)
        if num_rounds == MOST_ROUNDS or (num_rounds and hopeless >= self._give_up_at):
            self._reason = f"all that can be reached was looked at, elsewhere {elsewhere:.0%}"
            if cut_off and cut_off[0].probability > elsewhere:
                self._reason += (
                    f", {cut_off[0].name}, which cannot be reached, {cut_off[0].probability:.0%}"
                )
            return None
        self._going, self._reason = plan.looks[0], ""
        return self._going

    def found(self) -> None:
        """Say that it was found at the place that `next` gave; nothing is said of other things."""
        look = self._get_going()
        (name, *_) = self._list_meant()
        self.memory.observe(
            look.place.furniture, [Sighting(name, look.place.relation)], coverage=_GLANCE
        )
        self._note(look, is_found=True)

    def not_found(self, coverage: float = 1.0) -> None:
        """Say that it was not at the place that `next` gave; nothing is said of other things.

        Args:
            coverage: share of the furniture that was in view, above 0 and at most 1.
        """
        look = self._get_going()
        for name in self._list_meant():
            self.memory.note_absent(look.place.furniture, name, coverage)
        self._note(look, is_found=False)

    def seen(self, sightings: Sequence[Sighting], coverage: float = 1.0) -> bool:
        """Say all that was seen at the place that `next` gave.

        Args:
            sightings: everything that the detector named there.
            coverage: share of the furniture that was in view, above 0 and at most 1.

        Returns:
            Whether what is looked for was among it.
        """
        look = self._get_going()
        others = {read_name(name) for name in self.memory.descriptions}
        others -= {read_name(name) for name in self._list_meant()}
        self.memory.observe(look.place.furniture, sightings, coverage)
        names = [sighting.description for sighting in sightings]
        meant = {read_name(name) for name in self._list_meant()}
        # The detector may call it otherwise than before: "mug" for the "large red mug". A name
        # that was known of another thing is of that thing.
        new = [name for name in names if read_name(name) not in others]
        meant |= {
            read_name(name)
            for name in self._finder.resolve_among(self.memory, self.description, new)
        }
        is_found = any(read_name(name) in meant for name in names)
        self._note(look, is_found)
        return is_found

    def _list_meant(self) -> tuple[str, ...]:
        """Return the descriptions that the question means; itself, where nothing is called so."""
        resolution = self._finder.resolve(self.memory, self.description)
        return resolution.matches or (self.description,)

    def _make_plan(self, places: Sequence[Place]) -> SearchPlan:
        """Plan over the places that were looked at least often in this search."""
        fewest = min((self._rounds.get(place.furniture, 0) for place in places), default=0)
        places = [p for p in places if self._rounds.get(p.furniture, 0) == fewest]
        return plan_search(self.description, places, self._at, self._distance, self._look_cost)

    def _split(self, ranking: Ranking) -> tuple[list[Place], list[Place]]:
        """Part the places that can be visited from those that cannot or shall not be."""
        parts: tuple[list[Place], list[Place]] = [], []
        for place in ranking:
            to = place.furniture
            is_cut_off = to in self._exclude or (
                self._distance is not None and math.isinf(self._distance(self._at, to))
            )
            parts[is_cut_off].append(place)
        return parts

    def _get_going(self) -> Look:
        if self._going is None:
            raise RuntimeError(
                "a look must follow next(), got one before it, or after the search was over. "
                "Call next() and go there first."
            )
        return self._going

    def _note(self, look: Look, is_found: bool) -> None:
        furniture = look.place.furniture
        self.num_looks += 1
        self.is_found = is_found
        self._rounds[furniture] = self._rounds.get(furniture, 0) + 1
        self._found_at = look.place.name if is_found else ""
        self._going = None
        if self._distance is not None:
            self._at = furniture
