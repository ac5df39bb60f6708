"""What says that a thing is at no place of the home: it was missed, it has left, it is out."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sgm.arrays.rows import add_in_order
from sgm.arrays.week import NUM_WEEK_HOURS, compute_week_hours
from sgm.evidence.adaptive_filter import list_look_times
from sgm.evidence.elsewhere import compute_elsewhere_of
from sgm.evidence.question import Question
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Queries

# What people carry when they go out, by the words of a label.
CARRIED = frozenset(
    """backpack bag bicycle briefcase car_keys cell_phone cellphone coat credit_card dog_leash
    glasses handbag hat helmet house_key house_keys id_card jacket key keychain keys laptop
    laptop_bag leash lunch_box mobile_phone phone purse school_bag scarf shoes smartphone
    sunglasses umbrella wallet""".split()
)
# Filters of `sgm.evidence.question` whose elsewhere is shown.
SHOWN_FILTERS = ("learnt", "asked", "left", "anywhere")
_LEAST = 0.02  # of a probability times the number of places, in logarithms
_NEAR = 0.3  # weight of looks in the hour before and after
_USUAL = 3.0  # looks that the share at all hours counts as, beside those of an hour


class Absence(NamedTuple):
    """Evidence about elsewhere for Q things.

    Attributes:
        looked: share of where the thing goes that was looked at since it was last seen, (Q,).
        places: share of the home's places that were, (Q,).
        rounds: looks since at the places where it goes, on average over these, (Q,).
        missing: share of the home's things that no place is known to hold now, (Q,).
        is_carried: whether it is called like what people take along, bool (Q,).
    """

    looked: np.ndarray
    places: np.ndarray
    rounds: np.ndarray
    missing: np.ndarray
    is_carried: np.ndarray

    @classmethod
    def gather(cls, asked: Question) -> Absence:
        """Gather it."""
        memory, queries = asked.memory, asked.queries
        objects, home, row = memory.objects, queries.home, queries.object
        times, number = list_look_times(memory, queries)
        last = objects["last_observed"][row][:, None, None]
        since = np.count_nonzero(times[number] > last, axis=2)  # (Q, F)
        since *= memory.is_furniture[home]
        goes = asked.arrays.goes[:, :-1]
        is_missing, num_seen = _count_missing(memory)
        labels = [memory.labels[label] for label in objects["label"][row]]
        return cls(
            looked=add_in_order(goes * (since > 0))[:, 0],
            places=(since > 0).sum(axis=1) / memory.home_num_furniture[home],
            rounds=add_in_order(goes * since)[:, 0],
            missing=((is_missing + 0.5) / (num_seen + 1))[home],
            is_carried=np.array([label.replace(" ", "_") in CARRIED for label in labels]),
        )


def compute_absence(asked: Question) -> dict[str, np.ndarray]:
    """What filters believe of elsewhere, what looks have missed, and what else tells of it."""
    absence, num_places = Absence.gather(asked), asked.arrays.num_places
    beliefs = {name: asked.get_elsewhere(name) for name in SHOWN_FILTERS}
    beliefs["rule"] = compute_elsewhere_of(asked.memory, asked.queries, asked.counts, asked.rates)
    columns = {
        f"log_belief_{name}": np.log(belief * num_places + _LEAST)
        for name, belief in beliefs.items()
    }
    return columns | {
        "looked": absence.looked,
        "places": absence.places,
        "rounds": np.log1p(absence.rounds),
        "missing": absence.missing,
        "is_carried": absence.is_carried,
    }


def compute_week(asked: Question) -> dict[str, np.ndarray]:
    """How likely the thing, and the things of the home, are seen at this hour of the week.

    Zero where no look was counted at a known hour.
    """
    if asked.memory.clock is None:
        return {}
    at_hour, home_at_hour = _compare_hours(asked.memory, asked.queries)
    return {"in_at_this_hour": at_hour, "home_in_at_this_hour": home_at_hour}


def _count_missing(memory: MemoryBatch) -> tuple[np.ndarray, np.ndarray]:
    """Count the things of each home that are true nowhere, and all that were seen, (H,) each."""
    objects, edges = memory.objects, memory.edges
    is_there = np.zeros(objects.num_rows, dtype=bool)
    is_there[edges["object"][edges["is_true"]]] = True
    was_seen = objects["num_observed"] > 0
    count = memory.num_homes
    missing = np.bincount(objects["home"][was_seen & ~is_there], minlength=count)
    return missing, np.bincount(objects["home"][was_seen], minlength=count)


def _compare_hours(memory: MemoryBatch, queries: Queries) -> tuple[np.ndarray, np.ndarray]:
    """Return how likely a look that should show a thing does at this hour of the week, (Q,).

    And likewise of all things of its home together, (Q,). The memory has a clock.
    """
    assert memory.clock is not None
    week = memory.history.week
    if not week.is_counted:
        return np.zeros(len(queries.home)), np.zeros(len(queries.home))
    objects, edges = memory.objects, memory.edges
    weight = _weigh_hours(compute_week_hours(memory.clock, memory.time))  # (H, 48)
    looks = np.matmul(week.looks, weight[..., None])[..., 0]  # (H, F), at about this hour
    all_looks = week.looks.sum(axis=2)
    # Of each thing: looks that showed it, and those that would have, had it been where it is seen.
    num_true = edges["num_true"].astype(float)
    total = np.bincount(edges["object"], num_true, minlength=objects.num_rows)
    share = num_true / np.maximum(total, 1)[edges["object"]]
    at = (edges["home"], edges["furniture"])
    expected, all_expected = (
        np.bincount(edges["object"], share * own[at], minlength=objects.num_rows)
        for own in (looks, all_looks)
    )
    rows = np.arange(objects.num_rows)
    seen_by_hour = week.get_seen(rows)
    seen = (seen_by_hour * weight[objects["home"]]).sum(axis=1)
    usual = np.minimum((seen_by_hour.sum(axis=1) + 1.0) / (all_expected + 1.0), 1.0)
    thing = (seen + _USUAL * usual) / (expected + _USUAL)
    home = objects["home"]
    of_home = np.bincount(home, seen, minlength=memory.num_homes) + _USUAL
    of_home /= np.bincount(home, expected, minlength=memory.num_homes) + _USUAL
    is_known = ~np.isnan(memory.clock[queries.home, 0])
    return (
        np.where(is_known, thing[queries.object], 0.0),
        np.where(is_known, of_home[queries.home], 0.0),
    )


def _weigh_hours(hour: np.ndarray) -> np.ndarray:
    """Return how much each hour of the week counts at those of homes, (H,) -> (H, 48)."""
    weight = np.zeros((len(hour), NUM_WEEK_HOURS))
    known = np.flatnonzero(hour >= 0)
    day, within = np.divmod(hour[known], 24)
    for step, value in ((0, 1.0), (1, _NEAR), (-1, _NEAR)):
        weight[known, day * 24 + (within + step) % 24] = value
    return weight
