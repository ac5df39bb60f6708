"""How likely a thing is at no known place: one rule, of what the memory counts, and evidence.

What says so: it was missed, it has left, it is out.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from sgm.arrays.week import NUM_WEEK_HOURS, compute_week_hours
from sgm.belief import compute_miss_over_steps
from sgm.evidence.adaptive_filter import Rates
from sgm.evidence.expected_places import Expected, compute_destinations
from sgm.evidence.question import Question, count_missed_then
from sgm.evidence.rows import add_in_order
from sgm.memory.lone_looks import LoneLooks
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Queries

ELSEWHERE = 0.1  # share of what is asked for, before any look for it: one search in ten
_GOES_OUT = 0.06  # share of things that go out and come back, before anything was seen
_AT_HOME = 2.0  # looks, beside those of an hour, by what is known of the hours near by
_LEAST = 0.03  # share of its days on which a thing is at home at an hour
_BESIDE = {1: 0.3, 2: 0.15}  # part of a look so many hours before or after
_HOURS = np.arange(24)
# What people carry when they go out, by the words of a label.
CARRIED = frozenset(
    """backpack bag bicycle briefcase car_keys cell_phone cellphone coat credit_card dog_leash
    glasses handbag hat helmet house_key house_keys id_card jacket key keychain keys laptop
    laptop_bag leash lunch_box mobile_phone phone purse school_bag scarf shoes smartphone
    sunglasses umbrella wallet""".split()
)
# Filters of `sgm.evidence.adaptive_filter` whose elsewhere is shown.
SHOWN_FILTERS = ("learnt", "asked", "left", "anywhere")
_FEWEST_THINGS = 2  # a home of one thing is read as one of two: one more changes less
_LEAST_BELIEF = 0.02  # of a probability times the number of places, in logarithms
_NEAR = 0.3  # weight of looks in the hour before and after
_USUAL = 3.0  # looks that the share at all hours counts as, beside those of an hour


def compute_elsewhere(memory: MemoryBatch, queries: Queries) -> np.ndarray:
    """Return how likely things are elsewhere, as of the looks that the memory holds, (Q,).

    By Bayes' rule over three cases: it stayed where it was last seen, it is at any place of the
    home, or it is elsewhere,

        elsewhere = max(.1 moved, out)
        stayed : at any place = 1 - moved : .9 moved

    - moved: how likely it has moved since it was last seen, at the rate at which it is found gone;
      1 if it never was.
    - out: how likely it is out at this hour (`compute_out`).

    Looks since it was last seen, or all, miss it at each place with `compute_miss_over_steps`; any
    place counts by the share of its time that it spends there. The memory counts its history.
    """
    asked = Question.gather(memory, queries)
    return compute_elsewhere_of(asked, Rates.estimate(asked))


def compute_elsewhere_of(asked: Question, rates: Rates) -> np.ndarray:
    """`compute_elsewhere`, of what was gathered for the same questions, (Q,)."""
    memory, objects, thing, last = asked.memory, asked.memory.objects, asked.thing, asked.last
    was_seen, seen_at = objects["num_observed"][thing] > 0, objects["last_observed"][thing]
    moved = -np.expm1(-rates.left * (asked.hours * (memory.time - seen_at)))
    moved = np.where(was_seen, moved, 1.0)
    usual = compute_destinations(asked, Expected.by_prior(asked))[:, :-1]
    usual = usual / usual.sum(axis=1, keepdims=True)
    elsewhere = np.maximum(ELSEWHERE * moved, compute_out(asked, usual))
    since = np.where(was_seen, seen_at, -1)[:, None, None]
    num_looks = np.count_nonzero(asked.look_times[asked.look_row] > since, axis=2)
    num_looks[np.arange(len(thing)), np.maximum(last, 0)] += count_missed_then(asked)
    num_looks = np.where(was_seen[:, None], num_looks, asked.looks)
    missed = compute_miss_over_steps(num_looks, rates.miss[:, None])  # (Q, F)
    missed_last = np.where(last >= 0, missed[np.arange(len(thing)), last], 1.0)
    stayed, anywhere = 1 - moved, (1 - ELSEWHERE) * moved
    at_home = (stayed * missed_last + anywhere * (usual * missed).sum(axis=1)) / (stayed + anywhere)
    left = elsewhere / np.maximum(elsewhere + (1 - elsewhere) * at_home, 1e-12)
    return np.minimum(left, 1 - 1e-9)


def compute_out(asked: Question, usual: np.ndarray) -> np.ndarray:
    """Return how likely things are out for a while, by the hour of working day or weekend, (Q,).

    A thing that goes out is at home at each hour for a share s of its days (`_share_at_home`).
    After a day it is out with 1 - s. Sooner, it has gone if s has fallen since it was last seen:

        out = 1 - s(now) / s(then), or 0

    `usual` says what share of its time at home it spends at each place, (Q, F). Without a clock
    nothing is out.
    """
    out, memory = np.zeros(len(asked.home)), asked.memory
    if memory.clock is None or not asked.history.week.is_counted:
        return out
    clock, last = memory.clock[asked.home], memory.objects["last_observed"][asked.thing]
    now = compute_week_hours(clock, memory.time)
    known = np.flatnonzero((last >= 0) & (now >= 0))
    if not len(known):
        return out
    goes_out, share = _share_at_home(asked, known, usual[known])
    things = np.arange(len(known))
    share_now = share[things, now[known]]
    share_then = share[things, compute_week_hours(clock[known], last[known])]
    hours = (memory.time - last[known]) * asked.hours[known]
    share_then = np.where(hours < 24, np.maximum(share_then, share_now), 1.0)
    out[known] = goes_out * (1 - share_now / share_then)
    return out


def _share_at_home(
    asked: Question, known: np.ndarray, usual: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return how likely some of the things go out, (n,), and on which share of days they are in.

    Both of `known`, (n,) of Q; the latter is (n, NUM_WEEK_HOURS).

    The share is that of the looks at an hour of the day that showed it, of those that would if it
    were always in, relative to the hours at which it mostly is. That it goes out at all is likelier
    by how much better the hours beside each hour foretell its looks than "always in" does; counts
    are Poisson ones.
    """
    home, thing, history = asked.home[known], asked.thing[known], asked.history
    detection = 1 - history.compute_miss_rate(asked.queries.miss_rate)[home][:, None]
    looks = history.week.looks[home].astype(float)
    if asked.lone is not None:
        looks += _count_lone_looks(asked, asked.lone)[known]
    expected = detection * np.einsum("qf,qfh->qh", usual, looks)
    seen = history.week.get_seen(thing).astype(float)
    # Looks of one day at one hour say the same: they count for as many as there were days.
    age = asked.memory.time - asked.memory.objects["first_observed"][thing]
    days = age * asked.hours[known] / 24
    most = np.repeat([5 / 7, 2 / 7], NUM_WEEK_HOURS // 2) * days[:, None] + 1
    weight = np.minimum(1.0, most / np.maximum(expected, 1e-9))
    seen, expected = weight * seen, weight * expected
    mostly = (seen + _AT_HOME) / (expected + _AT_HOME)
    expected = expected * np.minimum(mostly.max(axis=1, keepdims=True), 1.0)
    near = (_sum_beside(seen) + _AT_HOME) / (_sum_beside(expected) + _AT_HOME)
    near = np.clip(near, _LEAST, 1.0)
    gain = (seen * np.log(near) + expected * (1 - near)).sum(axis=1)
    odds = _GOES_OUT / (1 - _GOES_OUT) * np.exp(gain.clip(-50, 50))
    share = (seen + _AT_HOME * near) / (expected + _AT_HOME)
    return odds / (1 + odds), np.clip(share, _LEAST, 1.0)


def _count_lone_looks(asked: Question, lone: LoneLooks) -> np.ndarray:
    """Count the latest looks for each thing alone by hour of the week, (Q, F, NUM_WEEK_HOURS).

    The memory has a clock.
    """
    assert asked.memory.clock is not None
    looks = np.zeros((*lone.num_looks.shape, NUM_WEEK_HOURS))
    hour = compute_week_hours(asked.memory.clock[asked.home[lone.query]], lone.time)
    is_known = hour >= 0
    np.add.at(looks, (lone.query[is_known], lone.place[is_known], hour[is_known]), 1.0)
    return looks


def _sum_beside(counts: np.ndarray) -> np.ndarray:
    """Return, for counts by hour, those of the hours before and after, (Q, NUM_WEEK_HOURS)."""
    days = counts.reshape(len(counts), 2, 24)
    beside = sum(
        part * (days[:, :, _HOURS - hours] + days[:, :, (_HOURS + hours) % 24])
        for hours, part in _BESIDE.items()
    )
    return np.reshape(beside, counts.shape)


def compute_absence(
    asked: Question, rates: Rates, destinations: np.ndarray, beliefs: Mapping[str, np.ndarray]
) -> dict[str, np.ndarray]:
    """What filters believe of elsewhere, what looks have missed, and what else tells of it, (Q,).

    Of where the thing goes, the share that was looked at since it was last seen, and the looks
    since, on average over it; of the home's places, the share that was; of its things, the share
    that no place is known to hold; and whether the thing is called like what people take along.
    """
    memory, objects, edges = asked.memory, asked.memory.objects, asked.memory.edges
    labels = [memory.labels[label] for label in objects["label"][asked.thing]]
    is_carried = np.array([label.replace(" ", "_") in CARRIED for label in labels])
    believed = {name: beliefs[name][:, -1] for name in SHOWN_FILTERS}
    believed["rule"] = compute_elsewhere_of(asked, rates)
    columns = {}
    for name, belief in believed.items():
        columns[f"log_belief_{name}"] = np.log(belief * asked.num_places + _LEAST_BELIEF)
    last = objects["last_observed"][asked.thing][:, None, None]
    since = np.count_nonzero(asked.look_times[asked.look_row] > last, axis=2)  # (Q, F)
    since *= asked.is_place
    was_looked_at, goes = since > 0, destinations[:, :-1]
    looked, rounds = add_in_order(np.stack([goes * was_looked_at, goes * since]))[..., 0]
    is_true = np.zeros(objects.num_rows, dtype=bool)
    is_true[edges["object"][edges["is_true"]]] = True
    missing_home = objects["home"][(objects["num_observed"] > 0) & ~is_true]
    num_missing = np.bincount(missing_home, minlength=memory.num_homes)
    missing = (num_missing + 0.5) / (np.maximum(asked.sums.num_seen, _FEWEST_THINGS) + 1)
    return columns | {
        "looked": looked,
        "places": was_looked_at.sum(axis=1) / asked.num_places,
        "rounds": np.log1p(rounds),
        "missing": missing[asked.home],
        "is_carried": is_carried,
    }


def compute_week(asked: Question) -> dict[str, np.ndarray]:
    """How likely the thing, and the things of the home, are seen at this hour of the week.

    Zero where no look was counted at a known hour.
    """
    if asked.memory.clock is None:
        return {}
    at_hour, home_at_hour = _compare_hours(asked)
    return {"in_at_this_hour": at_hour, "home_in_at_this_hour": home_at_hour}


def _compare_hours(asked: Question) -> tuple[np.ndarray, np.ndarray]:
    """Return how likely a look that should show a thing does at this hour of the week, (Q,).

    And likewise of all things of its home together, (Q,). The memory has a clock.
    """
    memory, week = asked.memory, asked.history.week
    assert memory.clock is not None
    if not week.is_counted:
        return np.zeros(len(asked.home)), np.zeros(len(asked.home))
    objects, edges = memory.objects, memory.edges
    weight = _weigh_hours(compute_week_hours(memory.clock, memory.time))  # (H, 48)
    looks = np.matmul(week.looks, weight[..., None])[..., 0]  # (H, F), at about this hour
    all_looks = week.looks.sum(axis=2)
    # Of each thing: looks that showed it, and those that would have, had it been where it is seen.
    num_true = edges["num_true"].astype(float)
    total = np.bincount(edges["object"], num_true, minlength=objects.num_rows)
    share = num_true / np.maximum(total, 1)[edges["object"]]
    cell = (edges["home"], edges["furniture"])
    expected, all_expected = (
        np.bincount(edges["object"], share * num_looks[cell], minlength=objects.num_rows)
        for num_looks in (looks, all_looks)
    )
    seen_by_hour = week.get_seen(np.arange(objects.num_rows))
    seen = (seen_by_hour * weight[objects["home"]]).sum(axis=1)
    usual = np.minimum((seen_by_hour.sum(axis=1) + 1.0) / (all_expected + 1.0), 1.0)
    thing = (seen + _USUAL * usual) / (expected + _USUAL)
    home = objects["home"]
    of_home = np.bincount(home, seen, minlength=memory.num_homes) + _USUAL
    of_home /= np.bincount(home, expected, minlength=memory.num_homes) + _USUAL
    is_known = ~np.isnan(memory.clock[asked.home, 0])
    return (
        np.where(is_known, thing[asked.thing], 0.0),
        np.where(is_known, of_home[asked.home], 0.0),
    )


def _weigh_hours(hour: np.ndarray) -> np.ndarray:
    """Return how much each hour of the week counts at those of homes, (H,) -> (H, 48)."""
    weight = np.zeros((len(hour), NUM_WEEK_HOURS))
    known = np.flatnonzero(hour >= 0)
    day, within = np.divmod(hour[known], 24)
    for step, value in ((0, 1.0), (1, _NEAR), (-1, _NEAR)):
        weight[known, day * 24 + (within + step) % 24] = value
    return weight
