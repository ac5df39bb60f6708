"""Where to look for something, asked of a memory and any policy."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from datetime import datetime
from pathlib import Path
from threading import Lock
from typing import Any

import numpy as np

from sgm.belief import CORRECTIONS, Belief, Detector
from sgm.checks import check_elsewhere_share, check_kind, check_shares
from sgm.evidence.doubted import doubt_sightings
from sgm.evidence.leaving import Leaving
from sgm.evidence.outings import Outings, join_left
from sgm.finder.adaptation import Adaptation
from sgm.finder.judged import JudgedBeliefs, list_said_moves, show_said_move, take_thing
from sgm.finder.ranking import Place, Ranking, gather_evidence
from sgm.finder.search import ObjectSearch, SearchRules
from sgm.finder.search_plan import Distance, SearchPlan, find_distance, plan_search
from sgm.memory.asking import Asked
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import RELATIONS
from sgm.messages import shorten
from sgm.names.name_matching import Resolution, Similarity
from sgm.policies.policy import Policy, compute_probabilities

_USUAL_DETECTOR = Detector()
_DETECTOR_HINT = "Give for example Detector(miss_rate=0.1)."


class Finder:
    """Answers where things are, from a `SceneGraphMemory` and a policy; needs no torch.

    Asking is reading: nothing that was asked stays in the memory. Several threads may ask one
    finder, and one memory, while others observe.

    Example:
        >>> finder = Finder(Bayesian())
        >>> print(finder.rank(memory, "the red mug", k=3))

    Attributes:
        detector: how often a look misses what is there, and how fast the home changes. If one is
            given, its miss rate is that of the policy's counts, of `Leaving` and of Bayes' rule
            alike; else the memory counts it for the former, and the last has the usual one.
        elsewhere_share: how often what is asked for is at no known place. Things never seen are so
            with this share before the first look for them; for what was seen, the memory says how
            likely it has left (`Leaving`), with odds that are greater or less than that as those of
            the share are than those of one in ten.
    """

    def __init__(
        self,
        policy: Policy,
        detector: Detector | None = None,
        elsewhere_share: float = CORRECTIONS.elsewhere_share,
        asks_moved: float = 0.0,
    ) -> None:
        """Ask a policy.

        Args:
            policy: who judges, such as `Bayesian()`; only oracles cannot.
            detector: None for the detector of the paper's homes.
            elsewhere_share: above 0 and below 1.
            asks_moved: share of the questions that are about what has moved in this very time step,
                0 to 1: half of them in the tasks, and none of those of a person, who asks for what
                is needed.

        Raises:
            TypeError: if the policy or the detector is something else.
            ValueError: if a share is out of range.
        """
        check_elsewhere_share(elsewhere_share)
        check_shares(asks_moved=asks_moved)
        check_kind("policy", policy, Policy, "Give for example Bayesian().")
        if detector is not None:
            check_kind("detector", detector, Detector, _DETECTOR_HINT)
        self._detector = detector
        self.elsewhere_share = elsewhere_share
        self._asks_moved = asks_moved
        self._policy = policy.for_questions(asks_moved)
        self._lock = Lock()
        # What was learnt of which state of a memory, at which time: the same for all questions.
        self._learnt: tuple[object, int, Leaving, Outings | None] | None = None
        self._judged = JudgedBeliefs()

    @property
    def detector(self) -> Detector:
        """How often a look misses what is there, and how fast the home changes."""
        return self._detector or _USUAL_DETECTOR

    @detector.setter
    def detector(self, detector: Detector) -> None:
        check_kind("detector", detector, Detector, _DETECTOR_HINT)
        with self._lock:
            self._detector = detector
            self._learnt = None  # with the former miss rate

    def resolve(self, memory: SceneGraphMemory, description: str) -> Resolution:
        """Say which remembered things a question means; see `NameIndex` for the rules.

        Raises:
            TypeError: if the memory is none.
            ValueError: if the description is no name (`read_words`).
        """
        check_kind("memory", memory, SceneGraphMemory, "Give for example SceneGraphMemory().")
        return memory.resolve(description, self._get_similarity())

    def resolve_among(
        self, memory: SceneGraphMemory, description: str, names: Sequence[str]
    ) -> Resolution:
        """Say which of some names a question means, such as those that a look showed.

        Raises:
            ValueError: if the description is no name (`read_words`).
        """
        return memory.resolve(description, self._get_similarity(), among=names)

    def rank(
        self,
        memory: SceneGraphMemory,
        description: str,
        k: int | None = None,
        exclude: Collection[int] = (),
        at: datetime | int | None = None,
    ) -> Ranking:
        """Rank the places where something may be, now or at a time to come.

        Args:
            memory: what was seen so far; it needs furniture.
            description: what to look for, in words: "the red mug", seen before or not.
            k: most places to return; None for all.
            exclude: furniture ids to leave out; their probability is not given to others.
            at: when it will be looked for: a time step, or a date and time by the memory's clock;
                None for the present step.

        Raises:
            ValueError: if the description is no name (`read_words`), there is no furniture yet,
                `k` is below 1, or the time has passed.
        """
        if k is not None and (not isinstance(k, (int, np.integer)) or k < 1):
            raise ValueError(
                f"k must be at least 1, got {shorten(k)}. Give a whole number, or leave it out for "
                "all places."
            )
        check_ids(exclude)
        resolution = self.resolve(memory, description)
        asked = memory.ask(resolution.matches or (description,), at=at)
        probabilities, elsewhere, detection = self._compute_belief(asked)
        relations = asked.choose_relation().tolist()
        order = np.argsort(-probabilities, kind="stable")
        if exclude:
            order = order[[asked.furniture_ids[place] not in exclude for place in order]]
        chosen = order[:k].tolist()
        likely, shown = probabilities.tolist(), detection.tolist()
        evidence = gather_evidence(asked, self._get_cosines(asked), chosen)
        return Ranking(
            description=description,
            places=tuple(
                Place(
                    furniture=asked.furniture_ids[place],
                    name=asked.furniture_names[place],
                    relation=RELATIONS[relations[place]],
                    probability=likely[place],
                    evidence=own,
                    detection=shown[place],
                    open_cost=asked.open_costs[place] if relations[place] == 0 else None,
                )
                for place, own in zip(chosen, evidence, strict=True)
            ),
            elsewhere=elsewhere,
            with_robot=float(1 - np.prod(1 - asked.carried)),
            last_seen=asked.last_seen,
            resolution=resolution,
        )

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
        return plan_search(description, places, start, distance, look_cost)

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
        rules = SearchRules(look_cost, frozenset(exclude), give_up_at, budget)
        return ObjectSearch(self, memory, description, start, distance, rules)

    def adapt(self, log: str | Path) -> Adaptation:
        """Learn the home of a log; finders with a network can (`ObjectFinder.adapt`).

        Raises:
            TypeError: if the policy is no network.
        """
        raise TypeError(
            f"policy must be a network to be adapted to a home, got {type(self._policy).__name__}. "
            "Take ObjectFinder.load(), or Adaptive(), which learns from the memory alone."
        )

    def _compute_belief(self, asked: Asked) -> tuple[np.ndarray, float, np.ndarray]:
        """Return where any of the things asked for is: at each place, (F,), and at none of them.

        Also how likely a look at each place now shows one that is there, (F,).
        """
        was_seen, carried, looks = asked.was_seen, asked.carried, asked.looks
        self._tell_miss_rate(asked)
        with self._lock:  # policies keep caches
            belief = self._judged.recall(
                asked, self._list_settings(), self._judge_said, self._policy.answers_apart
            )
        belief = _doubt(belief, asked)
        rows, is_another = _list_variants(asked, carried)
        if any(is_another):
            looks, belief = looks.take(rows, is_another), Belief(belief.log_weights[rows])
            was_seen, carried = was_seen[rows], np.where(is_another, 0.0, carried[rows])
        earlier, since = self.detector.compute_log_likelihood(looks, self._policy.looks_counted)
        belief = belief.look(earlier, was_seen).look(since)
        joined = belief.join(self.detector.weigh_seen(looks), carried)
        shown = self.detector.compute_detection(looks.negative)
        return *joined, _join_detection(belief.places, shown)

    def _tell_miss_rate(self, asked: Asked) -> None:
        """Give policies and `Leaving` the miss rate of the finder's detector, if one was given."""
        if self._detector is not None:
            asked.batch.history.given_miss_rate = self._detector.miss_rate

    def _judge_said(self, asked: Asked, is_looked: np.ndarray) -> Belief:
        """Return the belief before this step's looks, in which things may be at any place.

        What was said to be elsewhere counts as missed by a look at where it was. No look was made,
        so that this holds for that thing alone: the things of such a question are judged one by
        one.
        """
        moved = list_said_moves(asked)
        if not moved:
            return self._judge_elsewhere(asked, is_looked).spread(CORRECTIONS.anywhere)
        beliefs = []
        for row in range(len(asked.rows)):
            own = show_said_move(asked, row) if row in moved else take_thing(asked, row)
            belief = self._judge_elsewhere(own, is_looked[[row]])
            if row in moved:
                counted = self._policy.looks_counted
                missed, _ = self.detector.compute_log_likelihood(own.looks, counted)
                belief = belief.look(missed, keeps_elsewhere=True)
            beliefs.append(belief)
        belief = Belief(np.concatenate([belief.log_weights for belief in beliefs]))
        return belief.spread(CORRECTIONS.anywhere)

    def _judge_elsewhere(self, asked: Asked, is_looked: np.ndarray) -> Belief:
        """Return the belief before this step's looks, with what may have left the home."""
        was_seen = asked.was_seen
        belief = self._judge(asked)
        if was_seen.any():
            left = np.where(was_seen, self._compute_left(asked), belief.elsewhere)
            belief = belief.with_elsewhere(left)
        share = self.elsewhere_share
        return doubt_sightings(belief, asked.batch, asked.queries, is_looked, share)

    def _list_settings(self) -> tuple[object, ...]:
        """Return what `_judge_elsewhere` reads besides what is asked."""
        return (self.elsewhere_share, self._policy, self._detector, CORRECTIONS)

    def _compute_left(self, asked: Asked) -> np.ndarray:
        """Return how likely each thing is out, before this step's looks, for good or not, (K,)."""
        batch, known = asked.batch, self._learnt
        if known is None or known[0] is not asked.origin or known[1] != batch.time:
            outings = None if batch.clock is None else Outings(batch)
            known = self._learnt = asked.origin, batch.time, Leaving(batch, asked.queries), outings
        _, _, leaving, outings = known
        left = leaving.compute(batch, asked.queries)
        left = np.minimum(join_left(left, *self._compute_out(asked, outings)), 1 - 1e-9)
        odds = left / (1 - left) * _odds(self.elsewhere_share) / _odds(CORRECTIONS.elsewhere_share)
        return odds / (1 + odds)

    def _compute_out(self, asked: Asked, outings: Outings | None) -> tuple[np.ndarray, np.ndarray]:
        """Return how likely things are out for a while, and what that explains; see `Outings`."""
        if outings is None:  # without a clock
            return np.zeros(len(asked.rows)), np.ones(len(asked.rows))
        return outings.compute(asked.batch, asked.queries)

    def _judge(self, asked: Asked) -> Belief:
        """Return the belief before this step's looks about each of the K things."""
        self._policy.reset(asked.batch)
        scores = self._policy.scores(asked.batch, asked.queries)
        places = compute_probabilities(scores, self._policy.score_kind)
        return Belief.of(places).with_elsewhere(self.elsewhere_share)

    def _get_similarity(self) -> Similarity | None:
        """Return how alike labels are; None without text vectors."""
        return None

    def _get_cosines(self, asked: Asked) -> np.ndarray | None:
        """Return the cosines of all pairs of labels (L, L); None without text vectors."""
        return None


def _doubt(belief: Belief, asked: Asked) -> Belief:
    """Return the belief with as much of it as if people were wrong in what they said last.

    Then a thing is where it was held to be before; where that is nowhere, it may be at any place.
    What was said in this time step is weighed as what was seen in it.
    """
    if all(said is None for said in asked.said):
        return belief
    share = np.zeros(len(asked.said))
    places = np.ones((len(share), len(asked.furniture_ids)))
    elsewhere = belief.elsewhere.copy()
    for row, said in enumerate(asked.said):
        if said is None or said.furniture is None or said.time == asked.current.time:
            continue
        share[row] = 1 - said.confidence
        if said.was_at:
            places[row] = np.isin(asked.furniture_ids, said.was_at)
            elsewhere[row] = 0.0
    return belief.mix(Belief.of(places).with_elsewhere(elsewhere), share) if share.any() else belief


def _list_variants(asked: Asked, in_hand: np.ndarray) -> tuple[list[int], list[bool]]:
    """List what may be meant: each thing, and as many of its like as were seen at once.

    `in_hand` is the probability that the robot carries each of the K things, (K,).

    Returns:
        Which of the K things each is, or is like, V of them; and whether it is another one.
    """
    if asked.num_instances.max() == 1:
        return list(range(len(in_hand))), [False] * len(in_hand)
    num_seen = np.count_nonzero(asked.looks.seen, axis=1)
    others = np.where(num_seen > 0, np.maximum(asked.num_instances - num_seen, 0), 0)
    others = np.where((num_seen == 0) & (in_hand > 0), asked.num_instances - 1, others)
    rows = np.repeat(np.arange(len(others)), 1 + others)
    is_another = np.append(False, rows[1:] == rows[:-1])  # the first of each is itself
    return rows.tolist(), is_another.tolist()


def _odds(share: float) -> float:
    return share / (1 - share)


def _join_detection(places: np.ndarray, detection: np.ndarray) -> np.ndarray:
    """Return how likely a look shows one of several things, if any of them is there, (F,).

    Of the probability of each thing at each place, and how likely a look shows it there, (K, F).
    """
    if len(places) == 1:
        return detection[0]
    there, shown = (1 - np.prod(1 - share, axis=0) for share in (places, places * detection))
    joined: np.ndarray = np.divide(shown, there, out=detection.max(axis=0), where=there > 0)
    return joined


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
