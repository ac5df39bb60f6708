"""Where to look for something, asked of a memory and any policy."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from datetime import datetime
from functools import partial
from threading import Lock
from typing import Any

import numpy as np

from sgm.belief import Belief, Detector, Posterior, compute_posterior
from sgm.belief.in_use import weigh_in_use
from sgm.belief.posterior import compute_each
from sgm.checks import check_kind, check_shares
from sgm.finder.expected_things import ExpectedThing, list_expected
from sgm.finder.judged import JudgedBeliefs, believe_bounded
from sgm.finder.learnt import Learnt, tell_learnt
from sgm.finder.patrol import PatrolLook, choose_looks
from sgm.finder.ranking import (
    Ranking,
    count_known,
    describe_places,
    order_places,
    rank_place,
)
from sgm.finder.said_places import narrow
from sgm.finder.search import ObjectSearch, SearchRules
from sgm.finder.search_plan import SearchPlan, plan_search
from sgm.finder.search_several import SeveralSearch
from sgm.finder.travel_costs import Distance, check_start, find_distance
from sgm.memory.home_history import HomeHistory
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.memory_questions import Asked
from sgm.memory.queries import Queries
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.messages import shorten
from sgm.names.name_matching import Similarity
from sgm.names.resolution import Resolution
from sgm.policies.policy import Policy
from sgm.text.vectors import TextVectors

_MOST_PAIRS = 16_000  # of a thing and a place that a policy is asked for at once: 50 MB
_USUAL_DETECTOR = Detector()
_DETECTOR_HINT = "Give for example Detector(miss_rate=0.1)."


class Finder:
    """Answers where things are, from a `SceneGraphMemory` and a policy; needs no torch.

    Asking is reading: nothing that was asked stays in the memory. Several threads may ask one
    finder, and one memory, while others observe.

    Example:
        >>> finder = Finder(Adaptive())
        >>> print(finder.rank(memory, "the red mug", k=3))

    Attributes:
        detector: how often a look misses what is there. If one is given, its miss rate is that of
            the policy and of Bayes' rule alike; else both have what the memory has counted
            (`Detector.estimate`), and this is what they start from.
    """

    def __init__(
        self,
        policy: Policy,
        detector: Detector | None = None,
        asks_moved: float = 0.0,
    ) -> None:
        """Ask a policy.

        Args:
            policy: who judges, such as `Adaptive()`; only oracles cannot.
            detector: None for one that is learnt from each memory (`Detector.estimate`).
            asks_moved: share of the questions that are about what has moved in this very time step,
                0 to 1: half of them in the tasks, and none of those of a person, who asks for what
                is needed.

        Raises:
            TypeError: if the policy or the detector is something else.
            ValueError: if a share is out of range.
        """
        check_shares(asks_moved=asks_moved)
        check_kind("policy", policy, Policy, "Give for example Adaptive().")
        if detector is not None:
            check_kind("detector", detector, Detector, _DETECTOR_HINT)
        self._detector = detector
        self._policy = policy.for_questions(asks_moved)
        self._lock = Lock()
        self._judged = JudgedBeliefs()
        self._text: TextVectors | None = None  # of labels
        self._cosines: tuple[list[str], np.ndarray] = ([], np.zeros((0, 0)))

    @property
    def detector(self) -> Detector:
        """How often a look misses what is there."""
        return self._detector or _USUAL_DETECTOR

    @detector.setter
    def detector(self, detector: Detector) -> None:
        check_kind("detector", detector, Detector, _DETECTOR_HINT)
        with self._lock:
            self._detector = detector

    def learn_detector(self, history: HomeHistory) -> Detector:
        """Return the detector that is given, or else what a memory has counted of its own."""
        return self._detector or Detector.learn(history, _USUAL_DETECTOR)

    def resolve(self, memory: SceneGraphMemory, description: str) -> Resolution:
        """Say which remembered things a question means; see `NameIndex` for the rules.

        Raises:
            TypeError: if the memory is none.
            ValueError: if the description is no name (`read_words`).
        """
        if not isinstance(memory, SceneGraphMemory):
            check_kind("memory", memory, SceneGraphMemory, "Give for example SceneGraphMemory().")
        resolution = memory.resolve(description, self._similarity)
        return narrow(memory, resolution) if resolution.where else resolution

    def resolve_among(
        self, memory: SceneGraphMemory, description: str, names: Sequence[str]
    ) -> Resolution:
        """Say which of some names a question means, such as those that a look showed.

        Raises:
            ValueError: if the description is no name (`read_words`).
        """
        return memory.resolve(description, self._similarity, among=names)

    def rank(
        self,
        memory: SceneGraphMemory,
        description: str,
        k: int | None = None,
        exclude: Collection[int] = (),
        at: datetime | int | None = None,
        *,
        exactly: bool = False,
        in_use: bool = False,
    ) -> Ranking:
        """Rank the places where something may be, now or at a time to come.

        A question for furniture or a room is answered with it (`Ranking.asked_for`).

        Args:
            memory: what was seen so far; it needs furniture.
            description: what to look for, in words: "the red mug", seen before or not.
            k: most places to return; None for all.
            exclude: furniture ids to leave out; their probability is not given to others.
            at: when it will be looked for: a time step, or a date and time by the memory's clock;
                None for the present step.
            exactly: whether only what is seen under this description is meant, and no other thing
                that it may name.
            in_use: whether it was in someone's hand within the last ten minutes, as who works with
                it asks. Then it is less likely where it was last seen.

        Raises:
            ValueError: if the description is no name (`read_words`), there is no furniture yet,
                `k` is below 1, or the time has passed or is more than a year ahead.
        """
        _check_most(k, "places")
        check_ids(exclude)
        resolution = self.resolve(memory, description)
        if exactly and description in resolution.matches:
            resolution = resolution.take_only(description)
        asked_for, ids = memory.find_places(description, resolution)
        if ids:
            ids = tuple(number for number in ids if number in resolution.places) or ids
            layout = memory.layout
            names = {number: layout.describe(number) for number in ids if number not in exclude}
            return rank_place(description, resolution, names, asked_for, k)
        given = self._detector  # holds for the policy, too
        asked = memory.ask(
            resolution.matches or (description,),
            at=at,
            question=description,
            miss_rate=None if given is None else given.miss_rate,
        )
        cosines, posterior = self._get_cosines(asked), self._compute_posterior(asked, in_use)
        order = order_places(asked, posterior.places)
        if resolution.places:  # what is asked for there comes first
            is_said = [asked.furniture_ids[place] in resolution.places for place in order]
            order = order[np.argsort(~np.array(is_said), kind="stable")]
        if exclude:
            order = order[[asked.furniture_ids[place] not in exclude for place in order]]
        shown = order[:k].tolist()
        return Ranking(
            description=description,
            places=describe_places(
                asked, posterior, cosines, shown, resolution.language, is_ahead=at is not None
            ),
            elsewhere=posterior.elsewhere,
            with_robot=float(1 - np.prod(1 - asked.carried)),
            last_seen=asked.sightings[0] if asked.sightings else None,
            resolution=resolution,
            num_known=count_known(asked),
            left_out=len(order) - len(shown),
        )

    def expect(
        self, memory: SceneGraphMemory, furniture: int, at: datetime | int | None = None
    ) -> list[ExpectedThing]:
        """List what may be at a place, of all that was ever seen or said to be there.

        Args:
            memory: what was seen so far.
            furniture: id of the place.
            at: as in `rank`.

        Returns:
            Things with the probability that `rank` gives this place, the likeliest first, each with
            what it rests on: on how many such days looks at that hour showed it there.

        Raises:
            KeyError: if there is no such furniture.
            ValueError: if the time has passed or is more than a year ahead.
        """

        def ask(things: Sequence[str]) -> tuple[Asked, Sequence[Posterior]]:
            asked, prior = self._ask_each(memory, things, at)
            detector = self.learn_detector(asked.batch.history)
            return asked, [
                compute_posterior(prior.take([*meant]), asked.take(number), detector)
                for number, meant in enumerate(asked.meant)
            ]

        return list_expected(memory, furniture, ask)

    def learnt(self, memory: SceneGraphMemory, k: int | None = None) -> Learnt:
        """Say what a memory with a clock has learnt of how its home goes.

        Of each thing where it is at which hours, or where it goes next. And of the latest looks at
        the place where similar moments before each held a thing for the likeliest, how likely
        that was, and how many showed it. Neither the policy nor what people said has a part in it.

        Example:
            >>> print(finder.learnt(memory, k=1))
            car keys: out on workdays from 11 to 15; shelf in living room in 72% of the looks
            sure to 0.97, right 1.00 in the last 200 looks

        Args:
            memory: what was seen so far; it needs furniture.
            k: most things to tell of, those with the clearest rhythm; None for all.

        Raises:
            ValueError: if there is no furniture yet, or `k` is below 1.
        """
        _check_most(k, "things")
        return tell_learnt(memory, k)

    def next_looks(
        self, memory: SceneGraphMemory, k: int = 1, exclude: Collection[int] = ()
    ) -> list[PatrolLook]:
        """Say where a robot that has nothing to do learns most of where things are.

        Places that were never looked at come first. Of several places each is chosen for what it
        tells beside those before it; the way there costs nothing.

        Example:
            >>> for look in finder.next_looks(memory, k=2):
            ...     print(look.name, look.gain)

        Args:
            memory: what was seen so far; it needs furniture.
            k: most places.
            exclude: furniture ids not to visit.

        Raises:
            ValueError: if there is no furniture yet, `k` is below 1 or None, or an id is none.
        """
        _check_most(k, "places", needs_one=True)
        check_ids(exclude)
        return choose_looks(memory, k, exclude, partial(self._believe_each, memory))

    def search_plan(
        self,
        memory: SceneGraphMemory,
        description: str,
        start: Any = None,
        distance: Distance | None = None,
        look_cost: float = 1.0,
        k: int | None = None,
        exclude: Collection[int] = (),
    ) -> SearchPlan:
        """Plan in which order to look, so that the expected cost until it is found is small.

        The plan keeps the present probabilities and has one look at each place; to search, use
        `search`, which learns from every look.

        Args:
            memory: what was seen so far.
            description: what to look for.
            start: where the search starts, as `distance` understands it.
            distance: cost of the way, `distance(start, furniture)` and
                `distance(furniture, furniture)` with furniture ids, in any unit; infinite where
                there is no way; None for the straight line, where all furniture has a position
                and the start is one, else only looks cost.
            look_cost: of one look, in the unit of the distances.
            k: most places to plan over, the likeliest ones; None for all.
            exclude: furniture ids not to visit.

        Raises:
            ValueError: as in `rank`; or if a cost is negative or nan, or a start is given without
                distances.
        """
        places = self.rank(memory, description, k, exclude).places
        distance = find_distance(memory, start, distance)
        layout = memory.layout
        return plan_search(description, places, start, distance, look_cost, layout=layout)

    def search(
        self,
        memory: SceneGraphMemory,
        description: str,
        start: Any = None,
        distance: Distance | None = None,
        look_cost: float = 1.0,
        exclude: Collection[int] = (),
        give_up_at: float = 0.9,
        budget: float | None = None,
    ) -> ObjectSearch:
        """Start a search: it says where to go next, and learns from what was seen there.

        Args:
            memory: what was seen so far; the search writes its looks into it.
            description: what to look for.
            start: where the search starts, as in `search_plan`.
            distance: cost of the way, as in `search_plan`.
            look_cost: of one look.
            exclude: furniture ids not to visit.
            give_up_at: probability that no further look finds it, from which on `next` gives up:
                it is elsewhere, where there is no way, or, once all other places were looked at,
                hidden there. Places that the budget does not allow count as out of reach. At 1
                the search ends with the budget alone.
            budget: most that all looks may cost together, in the unit of the distances; without
                distances it is the number of looks. None for as many looks as three at each place.

        Raises:
            ValueError: as in `search_plan`; or if `give_up_at` or the budget is out of range.
        """
        check_ids(exclude)
        distance = find_distance(memory, start, distance)
        check_start(start, distance)
        rules = SearchRules(look_cost, frozenset(exclude), give_up_at, budget)
        return ObjectSearch(self, memory, description, start, distance, rules)

    def search_several(
        self, memory: SceneGraphMemory, descriptions: Sequence[str], start: Any = None, **rules: Any
    ) -> SeveralSearch:
        """Start one search for several things; it ends when all are found.

        Args:
            memory: what was seen so far; the search writes its looks into it.
            descriptions: what to look for, one thing or more.
            start: where the search starts, as in `search`.
            rules: other arguments of `search`; a budget is that of all looks together.

        Raises:
            ValueError: as in `search`; or if there is nothing to look for.
        """
        if isinstance(descriptions, str) or not descriptions:
            raise ValueError(
                f"descriptions must be a list of things, got {shorten(descriptions)}. Write "
                "['keys', 'wallet'], or call search for one."
            )
        names = dict.fromkeys(descriptions)
        return SeveralSearch(memory, [self.search(memory, name, start, **rules) for name in names])

    def _compute_posterior(self, asked: Asked, in_use: bool = False) -> Posterior:
        """Return where any of the things asked for is."""
        settings = (self._policy, self._detector)
        detector = self.learn_detector(asked.batch.history)
        with self._lock:  # policies keep caches
            prior = self._judged.recall(asked, settings, self._believe, self._policy.answers_apart)
        if in_use:
            prior = weigh_in_use(prior, asked)
        return compute_posterior(prior, asked, detector)

    def _believe_each(
        self, memory: SceneGraphMemory, things: Sequence[str]
    ) -> tuple[Asked, np.ndarray, np.ndarray]:
        """Ask for things, and return where each of V is, and how likely a look shows it, (V, F)."""
        asked, prior = self._ask_each(memory, things)
        places, _, shown = compute_each(prior, asked, self.learn_detector(asked.batch.history))
        return asked, places, shown

    def _ask_each(
        self, memory: SceneGraphMemory, things: Sequence[str], at: datetime | int | None = None
    ) -> tuple[Asked, Belief]:
        """Ask for things, and return what is believed of each as if it were asked for alone."""
        given = self._detector
        asked = memory.ask(things, at=at, miss_rate=None if given is None else given.miss_rate)
        number = np.ones(len(asked.rows), dtype=np.int64)
        for meant in asked.meant:
            number[[*meant]] = len(meant)
        alone = replace(asked.queries, more_asked=number)
        with self._lock:
            return asked, believe_bounded(self._believe, asked.batch, alone)

    def _believe(self, batch: MemoryBatch, queries: Queries) -> Belief:
        """Return what the policy believes about each of the K things."""
        self._policy.reset(batch)
        num_things = len(queries.object)
        most = max(_MOST_PAIRS // batch.num_furniture, 1)
        if num_things <= most or not self._policy.answers_apart:
            return self._policy.believe(batch, queries)
        parts = np.split(np.arange(num_things), range(most, num_things, most))
        beliefs = [self._policy.believe(batch, queries.take(part)) for part in parts]
        return Belief(np.concatenate([belief.log_weights for belief in beliefs]))

    @property
    def _similarity(self) -> Similarity | None:
        """How alike labels are; None without text vectors."""
        return None if self._text is None else self._compare

    def _compare(self, label: str, others: Sequence[str]) -> Sequence[float]:
        assert self._text is not None
        with self._lock:
            return self._text.cosines([label, *others])[0, 1:].tolist()

    def _get_cosines(self, asked: Asked) -> np.ndarray | None:
        """Return the cosines of all pairs of labels (L, L); None without text vectors."""
        if self._text is None:
            return None
        labels = asked.batch.labels
        with self._lock:
            if labels != self._cosines[0]:  # a memory in use learns new labels now and then
                self._cosines = list(labels), self._text.cosines(labels)
            return self._cosines[1]


def _check_most(k: int | None, what: str, *, needs_one: bool = False) -> None:
    if (k is not None or needs_one) and (not isinstance(k, (int, np.integer)) or k < 1):
        raise ValueError(
            f"k must be at least 1, got {shorten(k)}. Give a whole number, or leave it out for "
            f"all {what}."
        )


def check_ids(exclude: Collection[int]) -> None:
    """Check which furniture is left out.

    Raises:
        ValueError: if it is no collection of whole numbers.
    """
    if not isinstance(exclude, Collection) or not all(
        isinstance(number, (int, np.integer)) for number in exclude
    ):
        raise ValueError(
            f"exclude must be furniture ids, got {shorten(exclude)}. Give a list of what "
            "add_furniture returned."
        )
