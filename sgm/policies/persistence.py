"""Persistence: one filter per object and place, whether the object is still or again there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from sgm.arrays.grouped import sum_relations
from sgm.arrays.table import Table
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Change, Queries
from sgm.policies.policy import Policy, mask_furniture

_LEAST_PRIOR = 1e-3  # what the prior excludes happens, too
_MOST_PRIOR = 0.9
_MOST_PRESENT = 1 - 1e-6  # odds stay finite


class Persistence(Policy):
    """Asks of each place where an object may be whether it persists there, or has come (back).

    Each pair of object and furniture node has its own filter, as if it had nothing to do with the
    others: present or absent, leaving at one rate and coming at another. How long objects stay
    differs, so that a pair is one of K kinds, which leave at different rates; how likely each kind
    is follows from what was seen of the pair, and the rates and shares of the kinds from all pairs
    of the home, by expectation maximisation, one step per look:

    - E: the look's likelihood under each kind weighs the kinds of a pair, and gives the expected
      departures and steps present between two looks (`follow_interval`);
    - M: a kind leaves at (a + departures) / (a stay + steps present) in its home, with a =
      `prior_departures` at the mean stay that `stays` expects of it.

    A pair comes at (c m / (1 - m) + arrivals) / (c / leave + steps absent), with c = `prior_stays`,
    so that before anything was seen it is there with the prior weight m of the place. A look that
    misses an object that is there (`miss_rate`) or sees one that is not (`false_rate`) is part of
    the likelihood. Places are compared by their odds: given that the object is at one of them, it
    is at each in proportion to p / (1 - p).

    Every look costs the pairs of the furniture node looked at, whatever came before.

    Source: Rosen, Mason, Leonard: Towards lifelong feature-based mapping in semi-static
    environments (ICRA 2016), the persistence filter; Saavedra-Ruiz et al.: Perpetua, multi-
    hypothesis persistence modeling for semi-static environments (IROS 2025), emergence after
    persistence, mixtures of both and their rates by EM. Differs: times are exponential within a
    kind, so that a filter is two states with closed forms, and EM is incremental.

    Attributes:
        stays: mean steps that an object of each kind stays, before anything was seen, (K,).
        prior_departures: how many departures of each kind that counts as.
        prior_stays: how many stays of absence the prior of a place counts as.
    """

    stays = (4.0, 20.0, 100.0)
    prior_departures = 2.0
    prior_stays = 1.0

    counts_looks = True

    def __init__(self, miss_rate: np.ndarray | float, false_rate: float = 1e-6) -> None:
        """Say what the detector is like.

        Args:
            miss_rate: probability that a look misses an object, of all homes or of each, (H,).
            false_rate: probability that a look sees an object that is not there.
        """
        self._miss_rate = miss_rate
        self._false_rate = false_rate

    @classmethod
    def make(cls, homes: Any) -> Persistence:
        """Make one that knows how often the detector of the homes misses an object."""
        return cls(homes.detection_error)

    def reset(self, memory: MemoryBatch) -> None:
        """Forget all looks."""
        num_homes, num_kinds = memory.num_homes, len(self.stays)
        self._miss = np.broadcast_to(np.asarray(self._miss_rate, dtype=float), (num_homes,))
        self._departures = np.full((num_homes, num_kinds), self.prior_departures)
        self._time_present = self._departures * np.array(self.stays)
        self._num_of_kind = np.ones((num_homes, num_kinds))
        # Pairs that no look at the place was about: what is left of their prior weight, when.
        self._left = np.ones((num_homes, memory.num_furniture, num_kinds))
        self._left_time = np.zeros((num_homes, memory.num_furniture))
        kinds = (num_kinds,)
        pair = np.dtype(
            [
                ("home", np.int64),
                ("time", np.float64),
                ("prior", np.float64),
                ("was_seen", np.bool_),
                ("arrivals", np.float64),
                ("time_absent", np.float64),
                ("presence", np.float64, kinds),
                ("log_likelihood", np.float64, kinds),
                ("share", np.float64, kinds),
            ]
        )
        self._pairs = Table({"pair": pair})
        self._pair_of_place: dict[tuple[int, int], int] = {}  # by object row and furniture
        self._pair_of_edge = np.empty(0, dtype=np.int64)

    def observe(self, memory: MemoryBatch, change: Change) -> None:
        """Update the pairs of the furniture looked at, and the rates of the homes."""
        self._add_pairs(memory)
        rows, number = np.unique(self._pair_of_edge[change.edges], return_inverse=True)
        times_seen = np.bincount(number, weights=change.is_seen, minlength=len(rows))
        is_seen = times_seen > 0  # in any relation
        miss = self._miss.copy()
        miss[change.home] += (1 - change.coverage) * (1 - miss[change.home])  # what is out of view
        self._update_pairs(rows, memory.time, is_seen, miss)
        left = self._compute_left(change.home, change.furniture, memory.time)
        self._left[change.home, change.furniture] = left * miss[change.home][:, None]
        self._left_time[change.home, change.furniture] = memory.time

    def scores(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        """Return the odds that an object asked for is there, (Q, F)."""
        self._add_pairs(memory)
        home = queries.home
        left = self._compute_left(home[:, None], np.arange(memory.num_furniture), memory.time)
        by_kind = (self.compute_kind_shares()[home][:, None] * left).sum(axis=2)
        presence = _get_prior(memory, home, queries.prior) * by_kind  # (Q, F), without a look
        query, edge = memory.edges_of(queries)
        pairs = self._pairs["pair"][self._pair_of_edge[edge]]
        leave, come = self._compute_rates(pairs)
        steps = memory.time - pairs["time"][:, None]
        by_kind = compute_presence(pairs["presence"], leave, come, steps)  # (n, K)
        share = self._compute_shares(pairs)
        presence[query, memory.edges["furniture"][edge]] = (share * by_kind).sum(axis=1)
        presence = np.minimum(presence, _MOST_PRESENT)
        return mask_furniture(memory, queries, presence / (1 - presence))

    def compute_leave_rates(self) -> np.ndarray:
        """Return the rate at which each kind leaves, per step, (H, K)."""
        return self._departures / self._time_present

    def compute_kind_shares(self) -> np.ndarray:
        """Return the share of the pairs of a home that is of each kind, (H, K)."""
        return self._num_of_kind / self._num_of_kind.sum(axis=1, keepdims=True)

    def _compute_left(self, home: np.ndarray, furniture: np.ndarray, time: int) -> np.ndarray:
        """Return what is left of the prior weight of places, (..., K).

        A look that does not see an object leaves `miss_rate` of it, if it is unlikely to be there;
        then the weight comes back as fast as objects come and go.
        """
        steps = time - self._left_time[home, furniture][..., None]
        leave = self.compute_leave_rates()[home]
        return 1 - (1 - self._left[home, furniture]) * np.exp(-leave * steps)

    def _add_pairs(self, memory: MemoryBatch) -> None:
        """Start a filter for what new edges of the memory are about, from the latest look there."""
        first = len(self._pair_of_edge)
        edges = memory.edges
        if edges.num_rows == first:
            return
        columns = (edges[name][first:].tolist() for name in ("object", "furniture"))
        number, added, new = [], [], self._pairs.num_rows
        for edge, place in enumerate(zip(*columns, strict=True), first):
            pair = self._pair_of_place.setdefault(place, new)
            if pair == new:
                added.append(edge)
                new += 1
            number.append(pair)
        self._pair_of_edge = np.concatenate([self._pair_of_edge, np.array(number, dtype=np.int64)])
        if not added:
            return
        home, furniture = edges["home"][added], edges["furniture"][added]
        types = memory.objects["type"][edges["object"][added]]
        weights = _get_prior(memory, home, memory.place_prior.rows(home, types))
        pairs = np.zeros(len(added), dtype=self._pairs["pair"].dtype)
        pairs["home"] = home
        pairs["prior"] = weights[np.arange(len(added)), furniture]
        pairs["time"] = self._left_time[home, furniture]
        pairs["presence"] = pairs["prior"][:, None] * self._left[home, furniture]
        self._pairs.append(len(added), pair=pairs)

    def _update_pairs(
        self, rows: np.ndarray, time: int, is_seen: np.ndarray, miss_rate: np.ndarray
    ) -> None:
        """Fold in looks at pairs (n,) that saw the object or not, (n,), with miss rates (H,)."""
        pairs = self._pairs["pair"][rows]
        home = pairs["home"]
        leave, come = self._compute_rates(pairs)
        miss = miss_rate[home]
        steps = time - pairs["time"]
        found = follow_interval(
            pairs["presence"],
            leave,
            come,
            steps[:, None],
            np.where(is_seen, 1 - miss, miss)[:, None],
            np.where(is_seen, self._false_rate, 1 - self._false_rate)[:, None],
        )
        pairs["presence"] = found.presence
        pairs["time"] = time
        pairs["log_likelihood"] += np.log(found.evidence)
        pairs["log_likelihood"] -= pairs["log_likelihood"].max(axis=1, keepdims=True)
        pairs["was_seen"] |= is_seen
        share = self._compute_shares(pairs)
        pairs["arrivals"] += (share * found.arrivals).sum(axis=1)
        pairs["time_absent"] += steps - (share * found.time_present).sum(axis=1)
        _add(self._departures, home, share * found.departures)
        _add(self._time_present, home, share * found.time_present)
        counted = np.where(pairs["was_seen"][:, None], share, 0.0)  # others say nothing of kinds
        _add(self._num_of_kind, home, counted - pairs["share"])
        pairs["share"] = counted
        self._pairs["pair"][rows] = pairs

    def _compute_rates(self, pairs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the rates at which pairs (n,) leave and come if of each kind, (n, K) each."""
        leave = self.compute_leave_rates()[pairs["home"]]
        prior = pairs["prior"][:, None]
        arrivals = self.prior_stays * prior / (1 - prior) + pairs["arrivals"][:, None]
        return leave, arrivals / (self.prior_stays / leave + pairs["time_absent"][:, None])

    def _compute_shares(self, pairs: np.ndarray) -> np.ndarray:
        """Return how likely pairs (n,) are of each kind, (n, K)."""
        weight = self.compute_kind_shares()[pairs["home"]] * np.exp(pairs["log_likelihood"])
        return weight / weight.sum(axis=1, keepdims=True)


def _add(sums: np.ndarray, home: np.ndarray, values: np.ndarray) -> None:
    """Add the values of pairs, (n, K), to the sums of their homes, (H, K), the smallest first.

    In the order of the pairs, sums would differ in the last digit between two memories of the same
    home in which the objects are numbered differently.
    """
    for kind in range(values.shape[1]):
        order = np.lexsort((values[:, kind], home))
        np.add.at(sums[:, kind], home[order], values[order, kind])


def _get_prior(memory: MemoryBatch, home: np.ndarray, prior: np.ndarray) -> np.ndarray:
    """Return the weight of each place before anything was seen, (n, F, relations) -> (n, F).

    The same everywhere where the prior knows nothing of the object; never 0 or 1.
    """
    weight = sum_relations(prior).astype(float)
    alike = 1 / memory.home_num_furniture[home][:, None]
    weight = np.where(weight.any(axis=1, keepdims=True), weight, alike)
    return np.clip(weight, _LEAST_PRIOR, _MOST_PRIOR)


def compute_presence(
    presence: np.ndarray, leave: np.ndarray, come: np.ndarray, steps: np.ndarray
) -> np.ndarray:
    """Return the probability that it is there after some steps without looks; all arrays broadcast.

    `presence` is that of now; the rates of leaving while it is there, positive, and of coming while
    it is not, are per step.
    """
    in_the_long_run = come / (leave + come)
    return in_the_long_run + (presence - in_the_long_run) * np.exp(-(leave + come) * steps)


@dataclass(frozen=True, slots=True)
class Interval:
    """What the look at the end of an interval says; arrays of the shape of its arguments.

    Attributes:
        presence: probability that it is there after the look.
        evidence: probability of what the look saw.
        departures: expected number of times that it left, given the look.
        arrivals: expected number of times that it came.
        time_present: expected number of steps that it was there.
    """

    presence: np.ndarray
    evidence: np.ndarray
    departures: np.ndarray
    arrivals: np.ndarray
    time_present: np.ndarray


def follow_interval(
    presence: np.ndarray,
    leave: np.ndarray,
    come: np.ndarray,
    steps: np.ndarray,
    if_present: np.ndarray,
    if_absent: np.ndarray,
) -> Interval:
    """Follow it from one look to the next; all arrays broadcast.

    Args:
        presence: probability that it was there after the look before.
        leave: rate of leaving while it is there, per step, positive.
        come: rate of coming while it is not there, per step, positive.
        steps: time between the looks, D below.
        if_present: probability of what the look saw if it is there.
        if_absent: the same if it is not there.

    With s = leave + come, p = come / s, q = leave / s and e = exp(-s D), the probability to be
    there after u steps is p + q exp(-s u) from there and p - p exp(-s u) from elsewhere. The
    expected steps there that start in state i and end in j are the integral over u of
    P(i -> there, u) P(there -> j, D - u), and the expected departures are `leave` times that of
    P(i -> there, u) P(not there -> j, D - u); the integrals of 1, exp(-s u) and
    exp(-s u) exp(-s (D - u)) are D, (1 - e) / s and D e.

    Source: Hobolth, Jensen: Summary statistics for endpoint-conditioned continuous-time Markov
    chains (2011), for two states.
    """
    total = leave + come
    p, q = come / total, leave / total
    decay = np.exp(-total * steps)
    once, both = (1 - decay) / total, steps * decay
    present_before, absent_before = presence, 1 - presence  # at the look before
    # Weights of the four pairs of states, each times what the look says of the second.
    start = (present_before, absent_before)
    end = (if_present, if_absent)
    goes = ((p + q * decay, q - q * decay), (p - p * decay, q + p * decay))
    weight = [[start[i] * goes[i][j] * end[j] for j in (0, 1)] for i in (0, 1)]
    evidence = weight[0][0] + weight[0][1] + weight[1][0] + weight[1][1]
    # P(i -> there, u) = p + a_i exp(-s u); P(there -> j, v) = b_j + c_j exp(-s v);
    # P(not there -> j, v) = b_j + d_j exp(-s v); likewise P(i -> not there, u) = q - a_i exp(-s u).
    a, b, c, d = (q, -p), (p, q), (q, -q), (-p, p)
    present = departures = arrivals = np.zeros(np.shape(evidence))
    for i in (0, 1):
        for j in (0, 1):
            chance = start[i] * end[j]
            stayed = p * b[j] * steps + (p * c[j] + a[i] * b[j]) * once + a[i] * c[j] * both
            left = p * b[j] * steps + (p * d[j] + a[i] * b[j]) * once + a[i] * d[j] * both
            came = q * b[j] * steps + (q * c[j] - a[i] * b[j]) * once - a[i] * c[j] * both
            present = present + chance * stayed
            departures = departures + chance * leave * left
            arrivals = arrivals + chance * come * came
    return Interval(
        presence=(weight[0][0] + weight[1][0]) / evidence,
        evidence=evidence,
        departures=departures / evidence,
        arrivals=arrivals / evidence,
        time_present=present / evidence,
    )
