"""A search: where to go next, what was seen there, when to give up."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from simulator.memory.scene_graph_memory import SceneGraphMemory
from simulator.memory.sighting import Sighting
from simulator.robot.ranking import Ranking
from simulator.robot.search_plan import Distance, Look, SearchPlan, is_reachable, plan_search

if TYPE_CHECKING:
    from simulator.robot.finder import Finder


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
        finder: Finder,
        memory: SceneGraphMemory,
        description: str,
        start: Any,
        distance: Distance | None,
        look_cost: float,
        exclude: frozenset[int],
        give_up_at: float,
    ) -> None:
        """Start; `Finder.search` says what the arguments are."""
        if not 0 < give_up_at <= 1:
            raise ValueError(
                f"give_up_at must lie above 0 and at most at 1, got {give_up_at}. Give the "
                "probability of elsewhere from which on looking is not worth it."
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
        self._make_plan()  # bad arguments are told now

    @property
    def ranking(self) -> Ranking:
        """Where it may be now, all places."""
        return self._finder.rank(self.memory, self.description, exclude=self._exclude)

    @property
    def outcome(self) -> str:
        """Say in one line how the search stands or ended."""
        looks = f"{self.num_looks} look{'' if self.num_looks == 1 else 's'}"
        if self.is_found:
            where = "" if self._going is None else f" at {self._going.place.name}"
            return f"{self.description}: found{where} after {looks}"
        return f"{self.description}: {self._reason or 'not found yet'} after {looks}"

    def next(self) -> Look | None:
        """Return where to go and look next; None when the search is over (`outcome` says why)."""
        if self.is_found:
            return None
        plan = self._make_plan()
        elsewhere = self.ranking.elsewhere
        if not plan.looks:
            self._reason = "no place can be reached"
        elif min(self._count(look) for look in plan) > 0 and elsewhere >= self._give_up_at:
            self._reason = f"every reachable place was looked at, elsewhere {elsewhere:.0%}"
        else:
            self._going, self._reason = plan.looks[0], ""
            return self._going
        self._going = None
        return None

    def found(self) -> None:
        """Say that it was found at the place that `next` gave."""
        look = self._get_going()
        self.memory.observe(
            look.place.furniture,
            [Sighting(self._name, look.place.relation)],
            is_complete=False,
        )
        self._note(look, is_found=True)

    def not_found(self, coverage: float = 1.0) -> None:
        """Say that it was not at the place that `next` gave; what else was there is not known.

        Args:
            coverage: share of the furniture that was in view, above 0 and at most 1.
        """
        look = self._get_going()
        self.memory.observe(
            look.place.furniture, [], coverage, sought=self._names, is_complete=False
        )
        self._note(look, is_found=False)

    def seen(self, sightings: Sequence[Sighting], coverage: float = 1.0) -> bool:
        """Say what was seen at the place that `next` gave; return whether it was among that.

        Args:
            sightings: everything that the detector named there.
            coverage: share of the furniture that was in view, above 0 and at most 1.
        """
        look = self._get_going()
        self.memory.observe(look.place.furniture, sightings, coverage, sought=self._names)
        named = {sighting.description for sighting in sightings}
        matches = set(self._names)
        is_found = any(
            not matches.isdisjoint(self._finder.resolve(self.memory, name).matches)
            for name in named
        ) or self._is_named(named)
        self._note(look, is_found=is_found)
        return is_found
