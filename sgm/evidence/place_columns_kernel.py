"""Features of places: what was seen there, is expected, and is believed by filters.

Each function fills the columns of a group, in the order of `sgm.evidence.columns`: `out` is float32
(Q, F, columns of the group), and holds zeros where a home has no place.
"""

from __future__ import annotations

import math

import numpy as np

from sgm.evidence.adaptive_filter import Rates
from sgm.evidence.expected_places import Expected
from sgm.evidence.home_sums import HomeSums
from sgm.evidence.object_counts import ObjectCounts
from sgm.evidence.question import Companions, QuestionArrays
from sgm.kernel import kernel

_MOST = 1 - 1e-3  # of a presence: odds stay finite
_LEAST = 0.02  # of a share times the number of places, in logarithms


@kernel
def fill_place_columns(
    out: tuple[np.ndarray, ...],
    asked: QuestionArrays,
    counts: ObjectCounts,
    rates: Rates,
    expected: Expected,
    companions: Companions,
    sums: HomeSums,
) -> None:
    """Fill all groups: one call, since handing many arrays to a kernel takes time."""
    sightings, looks, times, stays, prior, words, filters, places, others, rooms, hours = out
    fill_sightings(sightings, asked, counts)
    fill_looks(looks, asked, counts)
    fill_times(times, asked, counts, rates)
    fill_stays(stays, asked, counts, rates)
    fill_prior(prior, asked, counts, expected)
    fill_words(words, asked, expected, companions)
    fill_filters(filters, asked)
    fill_places(places, asked, sums)
    fill_others(others, asked, counts, companions)
    fill_rooms(rooms, asked, counts)
    if counts.hours.shape[3] > 0:  # else no home has a clock
        fill_hours(hours, asked, counts)


@kernel
def fill_sightings(out: np.ndarray, asked: QuestionArrays, counts: ObjectCounts) -> None:
    """Where the object was seen, how often and in which order."""
    by_count, by_time = np.empty(asked.is_place.shape[1]), np.empty(asked.is_place.shape[1])
    for query in range(len(out)):
        total, usual = 0, 0
        for place in range(asked.is_place.shape[1]):
            total += counts.num_true[query, place]
            if counts.num_true[query, place] > counts.num_true[query, usual]:
                usual = place
        rank_row(counts.num_true[query].astype(np.float64), by_count)
        rank_row(counts.last_true[query].astype(np.float64), by_time)
        for place in range(asked.is_place.shape[1]):
            if not asked.is_place[query, place]:
                continue
            row, count = out[query, place], counts.num_true[query, place]
            is_usual = place == usual and total > 0
            row[0] = math.log1p(count)
            row[1] = count / max(total, 1)
            row[2] = count / (asked.looks[query, place] + 1)
            row[3] = (count + 0.2) / (asked.looks[query, place] + 1)
            row[4] = place == asked.last[query]
            row[5] = count > 0
            row[6] = by_count[place] if count > 0 else 0
            row[7] = by_time[place] if count > 0 else 0
            row[8] = is_usual
            row[9] = is_usual and usual != asked.last[query]


@kernel
def fill_looks(out: np.ndarray, asked: QuestionArrays, counts: ObjectCounts) -> None:
    """Looks at the place, and those that missed the object since it was there."""
    for query in range(len(out)):
        total = max(asked.looks[query].sum(), 1)
        for place in range(asked.is_place.shape[1]):
            if not asked.is_place[query, place]:
                continue
            row, seen = out[query, place], counts.num_true[query, place] > 0
            absent = math.log1p(counts.num_absent[query, place])
            row[0] = absent if seen else 0
            row[1] = 0 if seen else absent
            row[2] = math.log1p(asked.looks[query, place])
            row[3] = asked.looks[query, place] > 0
            row[4] = asked.looks[query, place] / total * asked.num_places[query] / 4
            row[5] = seen and asked.last_look[query, place] > counts.last_true[query, place]


@kernel
def fill_times(out: np.ndarray, asked: QuestionArrays, counts: ObjectCounts, rates: Rates) -> None:
    """Time since the object was there and since the place was looked at, in hours and in moves."""
    for query in range(len(out)):
        for place in range(asked.is_place.shape[1]):
            if not asked.is_place[query, place]:
                continue
            row, since_seen, since_look = out[query, place], 0.0, 0.0
            if counts.num_true[query, place] > 0:
                since_seen = (asked.now - counts.last_true[query, place]) * asked.hours[query]
            if asked.last_look[query, place] >= 0:
                since_look = (asked.now - asked.last_look[query, place]) * asked.hours[query]
            row[0] = math.log1p(since_seen)
            row[1] = -math.expm1(-rates.home[query] * since_seen)
            row[2] = -math.expm1(-rates.own[query] * since_seen)
            row[3] = math.log1p(since_look)
            row[4] = -math.expm1(-rates.home[query] * since_look)
            row[5] = -math.expm1(-rates.own[query] * since_look)


@kernel
def fill_stays(out: np.ndarray, asked: QuestionArrays, counts: ObjectCounts, rates: Rates) -> None:
    """How long the object stays at the place, and whether it is there by that alone.

    Presence is that of two states, there and not. They are left at a rate from the looks that
    found it gone, and balance at the share of the looks that found it. Places are independent.
    """
    odds = np.empty(asked.is_place.shape[1])
    for query in range(len(out)):
        length, total = asked.hours[query], 0.0
        for place in range(asked.is_place.shape[1]):
            if not asked.is_place[query, place]:
                continue
            row, count = out[query, place], counts.num_true[query, place]
            left = counts.num_left[query, place] + 1
            left /= counts.time_true[query, place] * length + 1 / rates.left[query]
            since_true, last, known = 0.0, asked.last_look[query, place], asked.looks[query, place]
            if count > 0:
                since_true = (asked.now - counts.last_true[query, place]) * length
                last, known = counts.last_known[query, place], counts.num_known[query, place]
            usually = (count + asked.goes[query, place]) / (known + 1)
            was_there = usually
            if last >= 0:
                was_there = 1.0 if counts.is_true[query, place] else 0.0
            remains = math.exp(-left / (1 - usually + _LEAST) * (asked.now - max(last, 0)) * length)
            presence = min(usually + (was_there - usually) * remains, _MOST)
            odds[place] = presence / (1 - presence)
            total += odds[place]
            row[0] = math.log1p(counts.num_left[query, place])
            row[1] = -math.expm1(-left * since_true)
            row[2] = count / max(counts.num_known[query, place], 1)
            row[3] = presence
        for place in range(asked.is_place.shape[1]):
            if asked.is_place[query, place]:
                share = odds[place] / total
                out[query, place, 4] = math.log(share * asked.num_places[query] + _LEAST)


@kernel
def fill_hours(out: np.ndarray, asked: QuestionArrays, counts: ObjectCounts) -> None:
    """Where the object was seen at this hour of the day, and where others that are out of place.

    Its presence is the share of the looks at about this hour that showed it.
    """
    sums = np.zeros(asked.is_place.shape[1])
    for query in range(len(out)):
        first, has_clock = 0, not math.isnan(asked.hour[query])
        for weight in (asked.wide[query], asked.narrow[query]):
            total = 0.0
            for place in range(asked.is_place.shape[1]):
                if not asked.is_place[query, place]:
                    continue
                row, seen, gone = out[query, place], 0.0, 0.0
                for hour in range(len(weight)):
                    seen += counts.hours[0, query, place, hour] * weight[hour]
                    gone += counts.hours[1, query, place, hour] * weight[hour]
                sums[place] = seen
                total += seen
                usually = counts.num_true[query, place] / max(counts.num_known[query, place], 1)
                row[first + 1] = math.log1p(seen)
                row[first + 2] = (seen + usually) / (seen + gone + 1) if has_clock else 0
            for place in range(asked.is_place.shape[1]):
                if asked.is_place[query, place]:
                    out[query, place, first] = sums[place] / max(total, 0.3)
            first += 3
        total = asked.stray_hours[query].sum() + 0.5
        for place in range(asked.is_place.shape[1]):
            if asked.is_place[query, place]:
                share = asked.stray_hours[query, place] / total
                out[query, place, 6] = share
                if has_clock:
                    out[query, place, 7] = math.log(share * asked.num_places[query] + _LEAST)


@kernel
def fill_prior(
    out: np.ndarray, asked: QuestionArrays, counts: ObjectCounts, expected: Expected
) -> None:
    """The prior, and posteriors that trust it as so many looks.

    A place's share is in proportion to how much of what is expected there is this thing: a place
    where all is kept has as much room as one where little is.
    """
    width = asked.is_place.shape[1]
    by_prior, by_share, share = np.empty(width), np.empty(width), np.empty(width)
    in_room = np.empty(asked.room.max() + 2)  # the last one for what is no place
    for query in range(len(out)):
        total, was_seen, in_room[:] = 0.0, False, 0
        for place in range(width):
            own = expected.share[query, place]
            share[place] = own / max(asked.crowding[query, place], 1e-6)
            in_room[asked.room[query, place]] += own
            if asked.is_place[query, place]:
                total += share[place]
            was_seen |= counts.num_true[query, place] > 0
        for place in range(width):
            share[place] = share[place] / total if total > 1e-9 else 0.0
        rank_row(expected.share[query], by_prior)
        rank_row(share, by_share)
        last_room = asked.room[query, max(asked.last[query], 0)] if was_seen else -1
        for place in range(width):
            if not asked.is_place[query, place]:
                continue
            row, own = out[query, place], expected.share[query, place]
            row[0] = own
            row[3] = own > 0
            row[4] = share[place]
            if expected.trust[query] > 0:
                row[1] = math.log(own * asked.num_places[query] + _LEAST)
                row[2] = by_prior[place]
                row[5] = math.log(share[place] * asked.num_places[query] + _LEAST)
                row[6] = by_share[place]
            if asked.room[query, place] == last_room:
                row[7] = own / max(in_room[last_room], 1e-6)
        column = 8
        for strength in (0.5, 2.0, 8.0):
            total = 0.0
            for place in range(width):
                if asked.is_place[query, place]:
                    weight = counts.num_true[query, place] + strength * expected.share[query, place]
                    share[place] = weight / (asked.looks[query, place] + strength)
                    total += share[place]
            for place in range(width):
                if asked.is_place[query, place]:
                    out[query, place, column] = share[place] / max(total, 1e-6)
            column += 1


@kernel
def fill_words(
    out: np.ndarray, asked: QuestionArrays, expected: Expected, companions: Companions
) -> None:
    """Where things of such names are kept by the prior and in this home, and the place's own."""
    order = np.empty(asked.is_place.shape[1])
    for query in range(len(out)):
        total = companions.similar[query].sum() + 0.1
        rank_row(expected.by_name[query], order)
        for place in range(asked.is_place.shape[1]):
            if not asked.is_place[query, place]:
                continue
            row, here = out[query, place], companions.similar[query, place] / total
            row[0] = expected.by_name[query, place]
            if expected.name_cosine[query] > 0:
                row[1] = math.log(expected.by_name[query, place] * asked.num_places[query] + _LEAST)
                row[2] = order[place]
            row[3] = here
            row[4] = math.log(here * asked.num_places[query] + _LEAST)
            row[5] = expected.furniture_cosine[query, place]


@kernel
def fill_filters(out: np.ndarray, asked: QuestionArrays) -> None:
    """What the adaptive filters believe."""
    order = np.empty(asked.is_place.shape[1])
    num_filters = asked.belief.shape[1]
    for query in range(len(out)):
        rank_row(asked.belief[query, asked.ranking, :-1], order)
        for place in range(asked.is_place.shape[1]):
            if asked.is_place[query, place]:
                row = out[query, place]
                for number in range(num_filters):
                    own = asked.belief[query, number, place]
                    row[2 * number] = own
                    row[2 * number + 1] = math.log(own * asked.num_places[query] + _LEAST)
                row[2 * num_filters] = order[place]


@kernel
def fill_places(out: np.ndarray, asked: QuestionArrays, sums: HomeSums) -> None:
    """How much the place is used, and how often objects go there from where this one was."""
    for query in range(len(out)):
        home, many, was_seen = asked.home[query], asked.num_places[query], asked.num_seen[query] > 0
        total, total_onward = sums.arrivals[home].sum(), asked.onward[query].sum()
        for place in range(asked.is_place.shape[1]):
            if not asked.is_place[query, place]:
                continue
            row, came = out[query, place], sums.arrivals[home, place]
            used = sums.popularity[home, place] / max(sums.num_known[home], 1)
            row[0] = used
            row[1] = math.log(used * many + 0.1)
            row[2] = came / max(total, 1)
            row[3] = math.log((came + 0.5) / (total + 0.5 * many) * many)
            if was_seen:
                row[4] = asked.onward[query, place] / max(total_onward, 1)
                row[5] = math.log1p(asked.onward[query, place])
                row[6] = math.log1p(asked.back[query, place])


@kernel
def fill_others(
    out: np.ndarray, asked: QuestionArrays, counts: ObjectCounts, companions: Companions
) -> None:
    """Where things of the same name, its companions, and what is out of its place were seen.

    Things of a name, this one among them, at furniture of the same label, in the room and in the
    home: what belongs on one shelf may belong on the next.
    """
    width = asked.is_place.shape[1]
    # Places of one label are a chain, and those of them that are in one room.
    first = np.empty(width, dtype=np.int64)
    first_in_room = np.empty(width, dtype=np.int64)
    by_label, by_room, looks_in_room = np.empty(width), np.empty(width), np.empty(width)
    for query in range(len(out)):
        own_label, most = asked.label[query], 0
        total_same, total_fresh, total_often, total_named = 0.0, 0.0, 0.0, 0.0
        by_label[:], by_room[:], looks_in_room[:] = 0, 0, 0
        for place in range(width):
            most = max(most, counts.num_true[query, place])
        for place in range(width):
            if not asked.is_place[query, place]:
                continue
            named = companions.same[query, place] + counts.num_true[query, place]
            total_named += named
            total_same += companions.same[query, place]
            total_fresh += companions.fresh[query, place]
            if counts.num_true[query, place] < most:
                total_often += companions.often[query, place]
            first[place] = first_in_room[place] = place
            for other in range(place):
                if asked.is_place[query, other] and own_label[other] == own_label[place]:
                    first[place] = first[other]
                    if asked.room[query, other] == asked.room[query, place]:
                        first_in_room[place] = first_in_room[other]
                        break
            by_label[first[place]] += named
            by_room[first_in_room[place]] += named
            looks_in_room[first_in_room[place]] += asked.looks[query, place]
        total_strays = companions.strays[query].sum() + 0.5
        for place in range(width):
            if not asked.is_place[query, place]:
                continue
            row = out[query, place]
            kept = companions.often[query, place] if counts.num_true[query, place] < most else 0.0
            row[0] = math.log1p(by_label[first[place]])
            row[1] = by_label[first[place]] / max(total_named, 1)
            row[2] = math.log1p(by_room[first_in_room[place]])
            row[3] = math.log1p(looks_in_room[first_in_room[place]])
            row[4] = math.log1p(companions.same[query, place])
            row[5] = companions.same[query, place] / max(total_same, 1)
            row[6] = companions.fresh[query, place] / max(total_fresh, 0.5)
            row[7] = kept / max(total_often, 0.5)
            row[8] = math.log1p(companions.strays[query, place])
            row[9] = companions.strays[query, place] / total_strays


@kernel
def fill_rooms(out: np.ndarray, asked: QuestionArrays, counts: ObjectCounts) -> None:
    """The room of the place."""
    num_rooms = asked.room.max() + 1
    size, seen = np.empty(num_rooms), np.empty(num_rooms)
    for query in range(len(out)):
        size[:], seen[:] = 0, 0
        for place in range(asked.is_place.shape[1]):
            if asked.is_place[query, place]:
                size[asked.room[query, place]] += 1
                seen[asked.room[query, place]] += counts.num_true[query, place]
        was_seen = asked.num_seen[query] > 0
        last_room = asked.room[query, max(asked.last[query], 0)] if was_seen else -1
        for place in range(asked.is_place.shape[1]):
            if asked.is_place[query, place]:
                row, own = out[query, place], asked.room[query, place]
                row[0] = own == last_room
                row[1] = seen[own] / max(asked.num_seen[query], 1)
                row[2] = math.log(max(size[own], 1))


@kernel
def rank_row(values: np.ndarray, ranks: np.ndarray) -> None:
    """Write 1 / rank of each place, the highest value 1, ties in order, (F,) -> (F,)."""
    order = np.argsort(-values, kind="mergesort")
    for number in range(len(order)):
        ranks[order[number]] = 1 / (number + 1)
