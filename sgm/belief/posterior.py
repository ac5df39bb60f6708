r"""Where what is asked for is: the belief of a policy, then what was said and seen since, in order.

With p one of F places or elsewhere, for each thing that is meant:

    P(p) ∝ P(p | memory before this step)   the policy's belief (`Policy.believe`)
           P(last word | p)                 what was seen or said last may be wrong
           P(looks | p)                     of this step, and of looks for this thing alone

and of several, at least one is at a place with 1 - Π (1 - P(p)), all of them elsewhere with Π P.
One that may be another of them, seen since where it was (`compute_same`), counts by so much less.
Nothing else changes what a policy believes. The numbers are those of the `Detector`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from sgm.arrays.grouped import join_groups
from sgm.belief.detector_rates import Detector
from sgm.belief.stay import compute_same, compute_stay
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.memory_questions import Asked
from sgm.memory.seen_places import Looks

_ROUNDING = 1e-6  # of a sum of probabilities


@dataclass(frozen=True)  # no slots: probabilities are kept
class Belief:
    """Where each of K things may be: at one of F places, or elsewhere.

    Attributes:
        log_weights: float64 (K, F + 1), the last column for elsewhere; -inf for what is ruled out.
            Only differences within a row mean something.
    """

    log_weights: np.ndarray

    @classmethod
    def of(cls, places: np.ndarray, elsewhere: np.ndarray | float) -> Belief:
        """Make a belief of places and of elsewhere.

        Args:
            places: weights of the places, 0 or more, (K, F). Where none has any, the thing is
                elsewhere.
            elsewhere: probability of elsewhere, (K,) or one for all; the places share the rest in
                proportion.
        """
        total = places.sum(axis=1)
        is_some = total > 0
        in_places = np.where(is_some, 1 - np.asarray(elsewhere), 0.0)
        weights = np.empty((len(places), places.shape[1] + 1))
        weights[:, :-1] = places * (in_places / np.where(is_some, total, 1.0))[:, None]
        weights[:, -1] = 1 - in_places
        with np.errstate(divide="ignore"):
            return cls(np.log(weights))

    @classmethod
    def of_logits(cls, scores: np.ndarray, elsewhere: np.ndarray | float) -> Belief:
        """Make a belief of logits of the places, (K, F), -inf rules one out; see `of`."""
        best = scores.max(axis=1, keepdims=True)
        return cls.of(np.exp(scores - np.where(np.isfinite(best), best, 0.0)), elsewhere)

    @cached_property
    def probabilities(self) -> np.ndarray:
        """Probability of each place and of elsewhere, (K, F + 1); zeros where all is ruled out.

        Computed once; to be read.

        Raises:
            ValueError: if a weight is nan or infinite.
        """
        best = self.log_weights.max(axis=1, keepdims=True)
        weights = np.exp(self.log_weights - np.where(np.isfinite(best), best, 0.0))
        total = weights.sum(axis=1, keepdims=True)
        if not np.isfinite(total).all():
            raise ValueError(
                "belief of a policy must have weights that are numbers, got nan or infinity for "
                f"question {int(np.isfinite(total)[:, 0].argmin())}. Mend what the policy computes."
            )
        return np.divide(weights, total, out=np.zeros_like(weights), where=total > 0)

    @property
    def places(self) -> np.ndarray:
        """Probability of each place, (K, F)."""
        return self.probabilities[:, :-1]

    @property
    def elsewhere(self) -> np.ndarray:
        """Probability of elsewhere, (K,)."""
        return self.probabilities[:, -1]

    def look(self, log_likelihood: np.ndarray) -> Belief:
        """Fold looks in by Bayes' rule.

        `log_likelihood` is that of what the looks showed, if the thing is at each place, (K, F); if
        it is elsewhere, the likelihood is one. What looks rule out wherever it was believed to be
        is elsewhere.
        """
        if not log_likelihood.any():  # nothing was looked for
            return self
        changed = self.log_weights.copy()
        changed[:, :-1] += log_likelihood
        is_out = np.all(changed == -np.inf, axis=1) & np.any(self.log_weights > -np.inf, axis=1)
        changed[is_out, -1] = 0.0
        return Belief(changed)

    def take(self, rows: list[int]) -> Belief:
        """Return the belief about some of the things, about one perhaps several times."""
        return Belief(self.log_weights[rows])


class Posterior(NamedTuple):
    """Where any of the things asked for is.

    Attributes:
        places: probability that at least one of them is at each place, (F,).
        elsewhere: that none is at any, or in the robot's hand. All sum to one with what the robot
            carries for one thing, unless it was seen at several places at once.
        detection: how likely one look at each place now shows one that is there, (F,).
    """

    places: np.ndarray
    elsewhere: float
    detection: np.ndarray


def compute_posterior(prior: Belief, asked: Asked, detector: Detector) -> Posterior:
    """Return where any of the K things asked for is, (F,), of what a policy believes, (K, F + 1).

    The policy has read the memory as it was before the looks of this step (`asked.batch`).
    """
    places, elsewhere, shown = compute_each(prior, asked, detector)
    same = compute_same(asked) if len(asked.rows) > 1 else np.zeros(1)
    if same.any() and len(same) == len(places):  # what is another one of them is at no place more
        places, elsewhere = places * (1 - same)[:, None], same + elsewhere * (1 - same)
    if len(places) == 1:
        return Posterior(places=places[0], elsewhere=float(elsewhere[0]), detection=shown[0])
    any_there, any_shown = 1 - np.prod(1 - np.stack([places, places * shown]), axis=1)
    detection = np.divide(any_shown, any_there, out=shown.max(axis=0), where=any_there > 0)
    return Posterior(places=any_there, elsewhere=float(np.prod(elsewhere)), detection=detection)


def compute_each(
    prior: Belief, asked: Asked, detector: Detector
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return where each of the V things is that are meant by the K asked for (`list_copies`).

    Arguments as of `compute_posterior`.

    Returns:
        Probability of each place, (V, F), and of elsewhere, (V,); how likely a look at each place
        now shows one that is there, (V, F).
    """
    belief = weigh_last_word(prior, asked)
    belief, looks, carried = list_copies(belief, asked)
    seen, shown = detector.weigh_seen(looks), detector.compute_detection(looks.negative)
    belief = belief.look(compute_log_likelihood(looks, asked.batch, detector))
    seen = np.where(seen > 0, np.maximum(seen, belief.places), 0.0)  # it never lowers its place
    places, elsewhere = see(belief, seen)
    _check_sums(places, elsewhere, seen)
    return places * (1 - carried)[:, None], elsewhere * (1 - carried), shown


def _check_sums(places: np.ndarray, elsewhere: np.ndarray, seen: np.ndarray) -> None:
    """Check that V things are somewhere: what leaves is a distribution.

    Its sum is one, or what sightings at several places say more (`see`).

    Raises:
        ValueError: if a sum is another one, or nan.
    """
    total = places.sum(axis=1) + elsewhere
    expected = seen.sum(axis=1) + np.prod(1 - seen, axis=1) if seen.any() else 1.0
    if not (np.abs(total - expected) < _ROUNDING).all():
        raise ValueError(
            f"probabilities of places and of elsewhere must sum to one, got {total.min():g}: "
            "policy and looks rule all of them out. Give a detector a miss rate above 0, or mend "
            "what the policy computes."
        )


def weigh_last_word(belief: Belief, asked: Asked) -> Belief:
    """Weigh a belief by how sure what was seen or said last of each thing is.

    Policies take for true that a thing was where it was last seen or said to be, l. With confidence
    c that was right; else the thing is where its n other sightings were, or, as one more, where the
    policy has it if not at l:

        P(p) = c P(p | right) + (1 - c) (n_p + P(p | not l)) / (n + 1)

    A look that shows a thing at l says by itself that it had left where it was before. What was
    said does not: if it was right t ago, the thing is where it was before only if it has come back
    since, so that this place has the likelihood 1 - `compute_stay` (t) there.
    """
    memory, now = asked.batch, asked.current.time
    last, confidence = find_last_word(asked)
    factor = np.ones(belief.places.shape)
    for number, said in enumerate(asked.said):
        if said is not None and said.furniture is not None and said.time < now:
            was_there = np.isin(asked.furniture_ids, said.was_at)
            factor[number, was_there] = 1 - compute_stay(memory, np.array(now - said.time))
    is_doubted = (confidence < 1) & (last >= 0)
    if not is_doubted.any() and (factor == 1).all():
        return belief
    with np.errstate(divide="ignore"):
        right = belief.look(np.log(factor)).probabilities
        not_last = belief.log_weights.copy()
        not_last[is_doubted, last[is_doubted]] = -np.inf
        wrong = Belief(not_last).probabilities + _count_others(asked, last)
        wrong /= np.maximum(wrong.sum(axis=1, keepdims=True), 1e-12)
        share = np.where(is_doubted, confidence, 1.0)[:, None]
        log_weights = np.log(share * right + (1 - share) * wrong)
    is_same = ~is_doubted & np.all(factor == 1, axis=1)  # to the bit
    log_weights[is_same] = belief.log_weights[is_same]
    return Belief(log_weights)


def find_last_word(asked: Asked) -> tuple[np.ndarray, np.ndarray]:
    """Return where each thing was last seen or said to be, -1 for nowhere, and how sure, (K,)."""
    memory, queries = asked.batch, asked.queries
    edges, objects = memory.edges, memory.objects
    last = objects["last_furniture"][queries.object]
    query, edge = join_groups(queries.object, edges["object"], objects.num_rows)
    is_last = edges["furniture"][edge] == last[query]
    is_last &= edges["last_true"][edge] == objects["last_observed"][queries.object[query]]
    confidence = np.zeros(len(last))
    np.maximum.at(confidence, query[is_last], edges["confidence"][edge[is_last]])
    return last, np.where(confidence > 0, confidence, 1.0)


def _count_others(asked: Asked, last: np.ndarray, things: np.ndarray | None = None) -> np.ndarray:
    """Count the sightings by place of K things, or n of them, but for the last one, (n, F + 1)."""
    edges = asked.batch.edges
    query, edge = asked.batch.edges_of(asked.queries)
    counts = np.zeros((len(asked.queries.object), asked.batch.num_furniture + 1))
    np.add.at(counts, (query, edges["furniture"][edge]), edges["num_true"][edge])
    counts = counts if things is None else counts[things]
    counts[np.arange(len(last)), last] -= 1  # where it was never seen: elsewhere, below 0
    return np.maximum(counts, 0)


def list_copies(belief: Belief, asked: Asked) -> tuple[Belief, Looks, np.ndarray]:
    """Return belief, looks and how likely the robot carries it, of all V things that are meant.

    Each of the K things, and others of its description, as many as were seen at once:

    - Whatever was seen in this step is known, and says nothing about the others but that they were
      missed there.
    - One that was last seen at a place is there as the one that was seen last of all: the policy's
      belief Q, with the two places exchanged. It was seen d earlier at l, and may have left
      meanwhile; then it is where the n other sightings were, or where Q has it if not at l:

          P(p) = s Q(p) + (1 - s) (n_p + Q(p | not l)) / (n + 1)    s = `compute_stay` (d)

    - Of others nothing is known but what the policy believes. They are counted only where one was
      seen in this step, or is in the robot's hand.
    """
    looks, carried = asked.looks, asked.carried
    rows: list[int] = []
    moved_to: list[_Held] = []  # where a copy was last seen
    is_another: list[bool] = []
    for number, num_things in enumerate(asked.num_instances.tolist()):
        others: list[_Held] = []
        if num_things > 1:
            num_seen = int(looks.num_seen[number].sum())
            num_others = num_things - max(num_seen, 1)
            is_seen = looks.num_seen[number] > 0
            held = [copy for copy in _list_held(asked, number) if not is_seen[copy.place]]
            if num_seen == 0 and not carried[number]:
                others = held[1:][:num_others]
            else:
                others = (held + [_UNKNOWN] * num_others)[: max(num_others, 0)]
        rows += [number] * (1 + len(others))
        moved_to += [_UNKNOWN, *others]
        is_another += [False] + [True] * len(others)
    if len(rows) == len(carried):
        return belief, looks, carried
    log_weights = belief.log_weights[rows]
    last = asked.batch.objects["last_furniture"][asked.queries.object[rows]]
    for copy, (place, _) in enumerate(moved_to):
        if place >= 0:
            from_place = last[copy] if last[copy] >= 0 else int(log_weights[copy, :-1].argmax())
            log_weights[copy, [from_place, place]] = log_weights[copy, [place, from_place]]
    belief = _age_copies(Belief(log_weights), asked, rows, moved_to)
    return belief, looks.take(rows, is_another), np.where(is_another, 0.0, carried[rows])


def _age_copies(
    belief: Belief, asked: Asked, rows: Sequence[int], moved_to: Sequence[_Held]
) -> Belief:
    """Weigh a belief of V things, whose rows of the K these are, by when each was seen."""
    places, earlier = np.array(moved_to).T  # (V,) each
    copies = np.flatnonzero(earlier > 0)
    if not len(copies):
        return belief
    place = places[copies]
    not_there = belief.log_weights[copies]
    not_there[np.arange(len(copies)), place] = -np.inf
    gone = Belief(not_there).probabilities + _count_others(asked, place, np.array(rows)[copies])
    total = gone.sum(axis=1, keepdims=True)
    gone[:, -1] += total[:, 0] == 0  # it can be at no other place
    stay = compute_stay(asked.batch, earlier[copies])[:, None]
    log_weights = belief.log_weights.copy()
    with np.errstate(divide="ignore"):
        log_weights[copies] = np.log(
            stay * belief.probabilities[copies] + (1 - stay) * gone / np.where(total > 0, total, 1)
        )
    return Belief(log_weights)


class _Held(NamedTuple):
    """Where a thing was, -1 for unknown, and how many steps before it was seen last of all."""

    place: int
    earlier: int


_UNKNOWN = _Held(place=-1, earlier=0)


def _list_held(asked: Asked, number: int) -> list[_Held]:
    """List the places where a thing was before this step's looks, the one seen last first."""
    edges, row = asked.batch.edges, asked.queries.object[number]
    _, held = asked.batch.edges_of(asked.queries.take(np.array([number])))
    held = held[edges["is_true"][held]]
    held = held[np.argsort(-edges["last_true"][held], kind="stable")]
    last, time = (
        int(asked.batch.objects[name][row]) for name in ("last_furniture", "last_observed")
    )
    seen: dict[int, int] = {}
    for place, seen_at in zip(
        edges["furniture"][held].tolist(), edges["last_true"][held].tolist(), strict=True
    ):
        seen.setdefault(place, max(time - seen_at, 0))
    places = ([last] if last in seen else []) + list(seen)
    return [_Held(place=place, earlier=seen[place]) for place in dict.fromkeys(places)]


def compute_log_likelihood(looks: Looks, memory: MemoryBatch, detector: Detector) -> np.ndarray:
    """Return the log likelihood of looks that did not show V things, if at each place, (V, F).

    Looks of this step all miss a thing that is there with `Detector.compute_miss`. Of looks for
    what no thing was called, of which policies know nothing, each misses it unless it came since:

        Π (1 - (1 - miss) stay(t))
    """
    log_likelihood = np.zeros(looks.negative.shape)
    if looks.negative.any():
        with np.errstate(divide="ignore"):  # of a detector that misses nothing
            log_likelihood += np.log(detector.compute_miss(looks.negative))
    if looks.sought.any():
        shown = 1 - detector.compute_miss(looks.sought)
        with np.errstate(divide="ignore"):
            log_likelihood += np.log1p(-shown * compute_stay(memory, looks.sought_ago)).sum(axis=2)
    return log_likelihood


def see(belief: Belief, seen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the probability of the places, (V, F), and of elsewhere, (V,), with what is seen now.

    `seen` says how likely each thing is where it was seen in this step, 0 where it was not, (V, F);
    of a doubtful sighting, no less than the belief has it.
    What is left over keeps its proportions, and is elsewhere where there is no other place.
    """
    places, elsewhere = belief.places, belief.elsewhere
    if not seen.any():
        return places, elsewhere
    missing = np.prod(1 - seen, axis=1)  # no sighting was right
    others = np.where(seen > 0, 0.0, places)
    left = others.sum(axis=1) + elsewhere
    share = np.divide(missing, left, out=np.zeros(len(left)), where=left > 0)
    is_seen = np.any(seen > 0, axis=1)
    shown = np.where(seen > 0, seen, others * share[:, None])
    nowhere_else = np.where(left > 0, elsewhere * share, missing)
    return (
        np.where(is_seen[:, None], shown, places),
        np.where(is_seen, nowhere_else, elsewhere),
    )
