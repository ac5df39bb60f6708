"""Where an object is expected before it is seen, by the prior or by words, and where it goes.

Each function of columns computes a group of `sgm.evidence.columns`, by name.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sgm.arrays.grouped import share_rows, sum_relations, sum_rows
from sgm.evidence.question import Question, compute_hour, weigh_hour
from sgm.evidence.rows import add_in_order, log_share, rank_rows

_TRUST = 0.5  # of what a name is like, as a share of what the prior knows

# Things of known types that are counted beside those of a home. One thing of an unknown type among
# few says little of a home.
_BESIDE = 5


class Expected(NamedTuple):
    """What is expected of Q objects at F furniture nodes; shares sum to one or are all zero.

    Attributes:
        share: of each place, (Q, F).
        trust: how many sightings it counts as: 1 for the prior, less for words, (Q,).
        by_name: share of each place for things that are called most alike, (Q, F).
        name_cosine: of the name to the most alike one, 0 if nothing is known, (Q,).
        furniture_cosine: of each furniture node's label to the known one it is most like, 1 for
            itself, (Q, F).
    """

    share: np.ndarray
    trust: np.ndarray
    by_name: np.ndarray
    name_cosine: np.ndarray
    furniture_cosine: np.ndarray

    @classmethod
    def by_prior(cls, asked: Question) -> Expected:
        """Expect what the prior says, and nothing where it is silent."""
        weight = sum_relations(asked.queries.prior).astype(float) * asked.is_place
        share, has_prior = share_rows(weight, asked.num_columns)
        nothing = np.zeros(share.shape)
        return cls(
            share=share,
            trust=has_prior.astype(float),
            by_name=nothing,
            name_cosine=nothing[:, 0],
            furniture_cosine=nothing,
        )

    @classmethod
    def by_words(cls, asked: Question) -> Expected:
        """Let words speak where the prior is silent.

        Furniture that the prior does not know is taken for what it is called like; so is an object
        of which it says nothing.
        """
        memory, home = asked.memory, asked.home
        prior, types = memory.place_prior, memory.objects["type"][asked.thing]
        known = np.where((types >= 0)[:, None], prior.weights_by_words[home, types], 0)
        labels = [memory.labels[label] for label in memory.objects["label"][asked.thing]]
        named, cosine = prior.find_by_words(home, labels)
        weights = np.stack([known.astype(float), named], 1) * asked.is_place[:, None]
        shares, is_some = share_rows(weights, asked.num_columns)
        is_known, is_called = is_some.T
        return cls(
            share=np.where(is_known[:, None], shares[:, 0], shares[:, 1]),
            trust=np.where(is_known, 1.0, _TRUST * is_called),
            by_name=shares[:, 1],
            name_cosine=np.ascontiguousarray(cosine),
            furniture_cosine=prior.furniture_cosine[home],
        )


def compute_destinations(asked: Question, expected: Expected, hours: float = 0.0) -> np.ndarray:
    """Return where each object goes when it moves, (Q, F + 1), the last column elsewhere.

    In proportion to how often it was seen at a place, plus what is expected as one more sighting,
    plus a little everywhere: more where nothing is expected. Elsewhere gets as much of that as one
    place; rows sum to one. `hours` says how much sightings at other hours of the day are
    discounted, 0 to 1.
    """
    trust, num_places = expected.trust[:, None], asked.num_places
    seen = asked.counts.num_true.astype(float)
    if hours > 0 and asked.memory.clock is not None:
        near = weigh_hour(compute_hour(asked.memory, asked.home))
        near = np.einsum("qfh,qh->qf", asked.counts.hours[0], near)
        seen = seen * (1 - hours) + hours * near
    anywhere = (0.3 + (1 - trust)) / num_places[:, None]
    weight = (seen + trust * expected.share + anywhere) * asked.is_place
    total = sum_rows(weight, asked.num_columns)[:, None] + anywhere
    return np.append(weight, anywhere, axis=1) / total


def compute_prior(asked: Question, expected: Expected) -> dict[str, np.ndarray]:
    """The prior, and posteriors that trust it as so many looks, (Q, F) each.

    A place's share is in proportion to how much of what is expected there is this thing: a place
    where all is kept has as much room as one where little is.
    """
    num_places, is_place, in_room = asked.num_places, asked.is_place, asked.is_in_last_room
    expect, is_trusted = expected.share, expected.trust[:, None] > 0
    share = expect / np.maximum(asked.memory.place_prior.crowding[asked.home], 1e-6)
    total = add_in_order(share * is_place)
    share = np.divide(share, total, out=np.zeros_like(share), where=total > 1e-9)
    columns = {
        "prior": expect,
        "log_prior": log_share(expect, num_places) * is_trusted,
        "prior_rank": rank_rows(expect, is_place) * is_trusted,
        "is_possible": expect > 0,
        "place_share": share,
        "log_place_share": log_share(share, num_places) * is_trusted,
        "place_share_rank": rank_rows(share, is_place) * is_trusted,
        "prior_in_room": expect / np.maximum(add_in_order(expect * in_room), 1e-6) * in_room,
    }
    for strength in (0.5, 2.0, 8.0):
        weight = (asked.counts.num_true + strength * expect) / (asked.looks + strength)
        total = add_in_order(weight * is_place)
        columns[f"posterior_{strength:g}"] = weight / np.maximum(total, 1e-6)
    return columns


def compute_trust(asked: Question, expected: Expected) -> dict[str, np.ndarray]:
    """How well simple rules and the prior have done in this home, (Q,) each."""
    home, sums, counters = asked.home, asked.sums, asked.history.counters
    num_placed, num_found = sums.num_placed[home], counters["num_found"][home]
    num_asked = counters["num_asked"][home].astype(np.int64)
    if asked.queries.more_asked is not None:
        num_asked += asked.queries.more_asked
    return {
        "has_prior": expected.trust > 0,
        "known_share": (sums.num_typed[home] + _BESIDE) / (sums.num_known[home] + _BESIDE),
        "num_placed": np.log1p(num_placed),
        "prior_lift": sums.lift[home] / (num_placed + 3),
        "found": (num_found + 0.5) / (num_asked + 1),
        "last_right": (counters["num_last_right"][home] + 0.5) / (num_found + 1),
        "common_right": (counters["num_common_right"][home] + 0.5) / (num_found + 1),
        "prior_right": (counters["num_prior_right"][home] + 0.5) / (num_found + 1),
    }
