"""A search: where to go next, what was seen there, when to give up."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from sgm.belief import Detector, compute_stay
from sgm.checks import is_finite, is_number
from sgm.finder.ranking import Place, Ranking
from sgm.finder.search_plan import MOST_ROUNDS, Look, check_look_cost, plan_search
from sgm.finder.travel_costs import Distance, TravelCosts, is_at
from sgm.layout.viewpoint import Viewpoint
from sgm.memory.look import read_coverage, split_coverage
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.memory.thing import ThingName
from sgm.messages import shorten
from sgm.names.asking import Asking, make_asking
from sgm.names.phrase import strip_question
from sgm.names.words import read_name
from sgm.schema import RELATIONS

# Of what a first look shows, the share that another one must show to count beside first looks.
_LEAST_SHOWN = 0.25
_GIVEN_UP = "given up"
_GLANCE = 0.01  # share of the furniture in view when only the thing itself was


class KnownNames(NamedTuple):
    """Names of the thing that is looked for, and of all others; each as `read_name` gives it."""

    meant: frozenset[tuple[str, ...]]
    others: frozenset[tuple[str, ...]]


@dataclass(frozen=True, slots=True)
class SearchRules:
    """What a search costs and when it ends; see `Finder.search`.

    Attributes:
        look_cost: of one look.
        exclude: furniture ids not to visit.
        give_up_at: probability that no look within the budget finds it, from which on it ends.
        budget: most that all looks may cost together; None for as many as make sense.
    """

    look_cost: float
    exclude: frozenset[int]
    give_up_at: float
    budget: float | None

    def __post_init__(self) -> None:
        """Check what it costs and when it ends.

        Raises:
            ValueError: if the cost of a look, `give_up_at` or the budget is out of range.
        """
        check_look_cost(self.look_cost)
        if not is_number(self.give_up_at) or not 0 < self.give_up_at <= 1:
            raise ValueError(
                f"give_up_at must lie above 0 and at most at 1, got {shorten(self.give_up_at)}. "
                "Give the probability that no look finds it, from which on the search ends."
            )
        most = self.budget
        if most is not None and not ((is_finite(most) and most > 0) or most == math.inf):
            raise ValueError(
                f"budget must be a number above 0, got {shorten(self.budget)}. Give the most that "
                "all looks may cost, or leave it out."
            )


class _Ended(NamedTuple):
    """Why there is no next look.

    Attributes:
        how: sentence of the table of answers.
        values: of that sentence.
        reason: how likely it is elsewhere, where the sentence says so.
    """

    how: str
    values: Mapping[str, str] = {}
    reason: str = ""

    def tell(self, asking: Asking) -> str:
        """Say it in words."""
        return asking.say(self.how, **self.values, reason=self.reason)


class ObjectSearch:
    """Looks for one thing until it is found, or further looks are unlikely to find it.

    Every look goes into the memory, and the next place is the one with the best gain per cost by
    Bayes' rule: the probability that a look there now finds it, by what it costs to go there and
    look. What a look did not show, another one a moment later mostly does not show either
    (`Detector.repeated_share`): so each place is looked at once, before any is looked at again.
    Where a second look shows nearly as much as the first, it comes when it is the best. Time may
    pass meanwhile (`memory.step`), and a search that is started anew, after a restart for example,
    goes on with what the memory holds.

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
        cost: of these looks together, in the unit of the distances; without distances, their
            number.
        is_found: whether it was found.
        going: the look that `next` gave, as long as nothing was said of it; else None.
        offered: descriptions of what the latest look showed that may be it, and may be another
            thing: "piano bench" for "bench". They do not end the search: ask the user.
    """

    def __init__(
        self,
        finder: Any,
        memory: SceneGraphMemory,
        description: str,
        start: Any,
        distance: Distance | None,
        rules: SearchRules,
    ) -> None:
        """Start; `Finder.search` says what the arguments are."""
        self.description = description
        self.memory = memory
        self.num_looks = 0
        self.cost = 0.0
        self.is_found = False
        self._finder = finder  # a `Finder`, whose module imports this one
        self._at = start
        self._ways = TravelCosts(distance)
        self._rules = rules
        self._missed: dict[int, tuple[float, int]] = {}  # looks, and when the last one was
        self._in_a_row = 0  # looks at the place where it is now
        self._opened: int | None = None  # what was opened at the place where it is now
        self.going: Look | None = None
        self.offered: tuple[str, ...] = ()
        self._ended: _Ended | None = None
        self._asking = make_asking(memory.language)
        self._found_at = ""
        self._split(self.ranking)  # a bad name, or way from the start, is reported now

    @property
    def ranking(self) -> Ranking:
        """Where it may be now, all places."""
        return self._finder.rank(self.memory, self.description, exclude=self._rules.exclude)

    @property
    def outcome(self) -> str:
        """Say in one line how the search stands or ended."""
        asking, told, ended = self._asking, {"thing": self.description}, self._ended
        if not self.num_looks and ended is not None and ended.how == _GIVEN_UP:
            return asking.say("unlikely", reason=ended.reason, seen=self._tell_seen(), **told)
        if self.is_found:
            place = asking.translate(self._found_at)
            return asking.count("found at", self.num_looks, place=place, **told)
        reason = asking.say("not found yet") if ended is None else ended.tell(asking)
        return asking.count("ended", self.num_looks, reason=reason, **told)

    def next(self) -> Look | None:
        """Return where to go and look next; None when the search is over (`outcome` says why).

        It is over when the thing was found; when it is elsewhere or at a place that cannot be
        reached with `give_up_at` or more, or, once all others were looked at, hidden there; or when
        the budget allows no further look, or only looks that find it with less than
        1 - `give_up_at` together.
        """
        self.going = None
        if self.is_found:
            return None
        asking, ranking = self._asking, self._finder.rank(self.memory, self.description)
        if ranking.asked_for != "thing":
            names = ", ".join(asking.translate(place.name) for place in ranking)
            self._ended = _Ended(how=f"but a {ranking.asked_for}", values={"names": names})
            return None
        places, cut_off = self._split(ranking)
        if ranking.with_robot > 0.5:
            percent = f"{ranking.with_robot:.0%}"
            self._ended = _Ended(how="carried", values={"percent": percent})
            return None
        if not places:
            self._ended = _Ended(how="no way")
            return None
        if self._compute_prospect(places) <= 1 - self._rules.give_up_at:
            reason = self._tell_elsewhere(ranking.elsewhere, cut_off)
            if self.num_looks and places[0].probability > ranking.elsewhere:
                reason = self._tell_beside("hidden", reason, places[0])
            self._ended = _Ended(how=_GIVEN_UP, reason=reason)
            return None
        within = self._list_affordable(places)
        if within and self._compute_prospect(within) <= 1 - self._rules.give_up_at:
            self._ended = self._tell_too_small(places, within)
            return None
        look = self.plan(places)
        if look is None:
            how, budget = _GIVEN_UP, self._rules.budget
            if budget is not None:
                how = "budget spent" if self.cost else "budget too small"
            values = {} if budget is None else {"budget": f"{budget:g}"}
            reason = self._tell_elsewhere(ranking.elsewhere, cut_off)
            self._ended = _Ended(how=how, values=values, reason=reason)
            return None
        self.going, self._ended = look, None
        return look

    def found(self) -> None:
        """Say that it was found at the place that `next` gave; nothing is said of other things.

        It is the thing that the question means, the one that was there of several. Where that is
        doubtful, it is a thing of the name that was asked for.
        """
        look = self._get_going()
        resolution = self._finder.resolve(self.memory, self.description)
        things = self.memory.list_named(*resolution.meant)
        if len(things) > 1:
            things = self.memory.list_named(*resolution.meant, place=look.place.furniture)
        name = strip_question(self.description, self.memory.language) or self.description
        found = things[0] if len(things) == 1 else ThingName(name)  # else another of its kind
        self.memory.note_found(look.place.furniture, found, look.place.relation, _GLANCE)
        self._note(look, _GLANCE, is_found=True)

    def not_found(self, coverage: float = 1.0) -> None:
        """Say that it was not at the place that `next` gave; nothing is said of other things.

        That holds for all things that the question means. Of what says less, or holds it, nothing
        is said: where no "red mug" is there may be a "mug". It is noted for the question then.

        Args:
            coverage: share of the furniture that was in view, above 0 and at most 1.
        """
        look = self._get_going()
        resolution = self._finder.resolve(self.memory, self.description)
        for name in resolution.meant or (self.description,):
            self.memory.note_absent(look.place.furniture, name, coverage)
        self._note(look, coverage, is_found=False)

    def seen(
        self,
        sightings: Sequence[Sighting],
        coverage: float | Mapping[str, float] = 1.0,
        hidden: Sequence[str] = (),
        viewpoint: Viewpoint | None = None,
    ) -> bool:
        """Say all that was seen at the place that `next` gave.

        Args:
            sightings: everything that the detector named there.
            coverage: share of the furniture that was in view, or shares by relation,
                as `SceneGraphMemory.observe` takes them.
            hidden: descriptions of things whose own spots were out of view.
            viewpoint: from where the camera looked, for the file.

        Returns:
            Whether what is looked for was among it.
        """
        look, known = self._get_going(), self.list_known()
        named = self.memory.name_seen(look.place.furniture, sightings)
        self.memory.observe(look.place.furniture, sightings, coverage, hidden, viewpoint)
        return self.judge(known, named, coverage)

    def list_known(self) -> KnownNames:
        """Return by what names the thing and others are known before a look."""
        before = self._finder.resolve(self.memory, self.description)
        others = {read_name(name) for name in self.memory.descriptions}
        others -= {read_name(name) for name in before.matches or (self.description,)}
        is_known = before.is_sure or before.how == "typo"
        meant = {read_name(name) for name in (before.matches if is_known else (self.description,))}
        return KnownNames(meant=frozenset(meant), others=frozenset(others))

    def judge(
        self,
        known: KnownNames,
        sightings: Sequence[Sighting],
        coverage: float | Mapping[str, float] = 1.0,
    ) -> bool:
        """Say whether a look that the memory has observed showed it.

        `known` is from before it, and the sightings are as the memory calls them (`name_seen`).
        """
        look = self._get_going()
        meant, others = set(known.meant), known.others
        names = [sighting.description for sighting in sightings]
        # The detector may call it otherwise than before: "mug" for the "large red mug". A name
        # that was known of another thing is of that thing.
        new = [name for name in names if read_name(name) not in others]
        for resolution in (
            self._finder.resolve(self.memory, self.description),
            self._finder.resolve_among(self.memory, self.description, new),
        ):
            if resolution.is_sure:
                meant |= {read_name(name) for name in resolution.matches}
        is_found = any(
            read_name(sighting.description) in meant or sighting.id == self.description
            for sighting in sightings
        )
        self.offered = ()
        if not is_found and names:  # what was known of another thing before, too
            shown = self._finder.resolve_among(self.memory, self.description, names)
            self.offered = () if shown.is_sure else shown.matches or shown.doubtful
        share = read_coverage(coverage, look.place.name)
        self._note(look, split_coverage(share)[RELATIONS.index(look.place.relation)], is_found)
        return is_found

    def list_places(self) -> list[Place]:
        """List the places that can be visited now, and that the budget allows."""
        return self._list_affordable(
            self._split(self._finder.rank(self.memory, self.description))[0]
        )

    def take(self, look: Look) -> None:
        """Go where another search goes, too: the look is one of this search, whatever it gives."""
        ranking = self._finder.rank(self.memory, self.description)
        place = next(
            (place for place in ranking if place.furniture == look.place.furniture), look.place
        )
        self.going = replace(look, place=place)

    def pass_by(self) -> None:
        """Say that a look was taken that says nothing of this thing."""
        self._note(self._get_going(), _GLANCE, is_found=False)

    def plan(self, places: Sequence[Place]) -> Look | None:
        """Plan the next look among places; None where the budget allows none."""
        budget = self._rules.budget
        if budget is None:
            left = MOST_ROUNDS * len(places) - self.num_looks
            new = [place for place in places if place.furniture not in self._missed]
            if left <= len(new):  # the last looks are for places that were not looked at
                places = new[: max(left, 0)]
        if self._in_a_row >= MOST_ROUNDS and not self._rules.look_cost:  # looks that cost nothing
            places = [place for place in places if not is_at(self._at, place.furniture)] or places
        look = self._choose_first(places)
        if budget is None or look is None or look.cost <= budget - self.cost:
            return look
        return self._choose_first(self._list_affordable(places))

    def _choose_first(self, places: Sequence[Place]) -> Look | None:
        miss_again = self._detector.miss_again
        plan = plan_search(
            self.description,
            self._list_fresh(places) or places,
            self._at,
            self._ways,
            self._rules.look_cost,
            miss_again,
            self._opened,
            most=1,
            layout=self.memory.layout,
        )
        return next(iter(plan), None)

    def _list_affordable(self, places: Sequence[Place]) -> list[Place]:
        """List the places for which the rest of the budget is enough."""
        if self._rules.budget is None:
            return list(places)
        left = self._rules.budget - self.cost
        return [place for place in places if self._compute_cost(place) <= left]

    def _compute_cost(self, place: Place) -> float:
        """Return what a look at a place costs now."""
        cost = self._ways.compute(self._at, place.furniture) + self._rules.look_cost
        return cost if place.furniture == self._opened else cost + (place.open_cost or 0.0)

    def _tell_too_small(self, places: Sequence[Place], within: Sequence[Place]) -> _Ended:
        """Say which place the budget does not allow, and how little it allows."""
        budget, in_reach = self._rules.budget or 0.0, {place.furniture for place in within}
        beyond = [place for place in places if place.furniture not in in_reach]
        best = max(beyond, key=lambda place: place.probability)
        values = {
            "budget": f"{budget:g}",
            "place": self._asking.translate(best.name),
            "percent": f"{best.probability:.0%}",
            "cost": f"{self._compute_cost(best):.1f}",
            "left": f"{budget - self.cost:.1f}",
            "chance": f"{self._compute_prospect(within):.1%}",
        }
        return _Ended(how="too small for", values=values)

    def _compute_prospect(self, places: Sequence[Place]) -> float:
        """Return how likely looks at places find it, if there are as many as one likes.

        Once each of them was looked at, without what is hidden there: p d / (1 - a) are all gains
        of a place together, where `plan_search` says what these are. Where a second look shows
        little, it counts only if it is asked for, by a budget or by `give_up_at` 1.
        """
        if any(place.furniture not in self._missed for place in places):
            return sum(place.probability for place in places)
        if self._rules.budget is None and self._rules.give_up_at < 1:
            places = self._list_fresh(places)
        found_by_one = sum(place.probability * place.detection for place in places)
        return found_by_one / (1 - self._detector.miss_again)

    @property
    def _detector(self) -> Detector:
        """The robot's, as far as it is known by now."""
        found: Detector = self._finder.learn_detector(self.memory.batch.history)
        return found

    def _list_fresh(self, places: Sequence[Place]) -> list[Place]:
        """List the places that come first: all, where another look shows a lot to this detector.

        Else those that this search has not looked at, or so long ago that much may have come.
        """
        first, again = self._detector.compute_detection(np.array([0.0, 1.0])).tolist()
        least = _LEAST_SHOWN * first
        return [
            place
            for place in places
            if again >= least or place.furniture not in self._missed or place.detection >= least
        ]

    def _tell_seen(self) -> str:
        """Say what the memory knows of a thing for which no look pays."""
        last = self.ranking.last_seen
        if last is None:
            return self._asking.say("never seen here")
        return self._asking.count("seen before", last.steps_ago)

    def _tell_elsewhere(self, elsewhere: float, cut_off: Sequence[Place]) -> str:
        """Say how likely it is elsewhere, or at a place without a way."""
        reason = self._asking.say("elsewhere share", percent=f"{elsewhere:.0%}")
        if cut_off and cut_off[0].probability > elsewhere:
            return self._tell_beside("cut off", reason, cut_off[0])
        return reason

    def _tell_beside(self, sentence: str, reason: str, place: Place) -> str:
        name, chance = self._asking.translate(place.name), f"{place.probability:.0%}"
        return self._asking.say(sentence, reason=reason, place=name, percent=chance)

    def _split(self, ranking: Ranking) -> tuple[list[Place], list[Place]]:
        """Part the places that can be visited from those that cannot or shall not be.

        How likely a look shows it takes looks of this search into account from earlier time steps,
        too: what is there has been there then (`compute_stay`) and was missed, or has come since.
        """
        parts: tuple[list[Place], list[Place]] = [], []
        num_looks = np.array([0.0, *(number for number, _ in self._missed.values())])
        first, *shown = self._detector.compute_detection(num_looks).tolist()
        stayed = [self._compute_stayed(place) for place in self._missed]
        most = {
            place: stay * again + (1 - stay) * first
            for place, stay, again in zip(self._missed, stayed, shown, strict=True)
        }
        for place in ranking:
            to = place.furniture
            is_cut_off = to in self._rules.exclude or math.isinf(self._ways.compute(self._at, to))
            detection = most.get(to, first)
            if detection < place.detection:
                place = replace(place, detection=detection)
            parts[is_cut_off].append(place)
        return parts

    def _compute_stayed(self, furniture: int) -> float:
        """Return how likely what is there now was there at the last look of this search."""
        _, time = self._missed[furniture]
        return float(compute_stay(self.memory.batch, np.array(self.memory.time - time)))

    def _get_going(self) -> Look:
        if self.going is None:
            raise RuntimeError(
                "a look must follow next(), got one before it, or after the search was over. "
                "Call next() and go there first."
            )
        return self.going

    def _note(self, look: Look, coverage: float, is_found: bool) -> None:
        furniture = look.place.furniture
        self.num_looks += 1
        self.cost += look.cost
        self.is_found = is_found
        before = self._missed.get(furniture)
        number = 0.0 if before is None else before[0] * self._compute_stayed(furniture)
        self._missed[furniture] = number + coverage, self.memory.time
        self._found_at = look.place.name if is_found else ""
        self.going = None
        if look.place.open_cost is not None:
            self._opened = furniture
        elif self._opened != furniture:
            self._opened = None
        self._in_a_row = self._in_a_row + 1 if is_at(self._at, furniture) else 1
        if self._ways.distance is not None:
            self._at = furniture
