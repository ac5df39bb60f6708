"""Features of places from what is expected, from filters, and from the other objects of a home.

As in `sgm.evidence.sighting_columns_kernel`: each function fills the columns of a group.
"""

from __future__ import annotations

import math

import numpy as np

from sgm.evidence.rank_kernel import rank_row
from sgm.evidence.sighting_columns_kernel import LEAST
from sgm.kernel import kernel


@kernel
def fill_prior(
    out: np.ndarray,
    is_place: np.ndarray,
    num_true: np.ndarray,
    looks: np.ndarray,
    prior: np.ndarray,
    trust: np.ndarray,
    crowding: np.ndarray,
    home: np.ndarray,
    room: np.ndarray,
    num_rooms: int,
    last: np.ndarray,
    num_places: np.ndarray,
) -> None:
    """The prior, and posteriors that trust it as so many looks.

    A place's share is in proportion to how much of what is expected there is this thing: a place
    where all is kept has as much room as one where little is.
    """
    width = is_place.shape[1]
    by_prior, by_share, share = np.empty(width), np.empty(width), np.empty(width)
    in_room = np.empty(num_rooms + 1)  # the last one for what is no place
    for query in range(len(out)):
        total, was_seen, in_room[:] = 0.0, False, 0
        for place in range(width):
            own = prior[query, place]
            share[place] = own / max(crowding[home[query], place], 1e-6)
            in_room[room[query, place]] += own
            if is_place[query, place]:
                total += share[place]
            was_seen |= num_true[query, place] > 0
        for place in range(width):
            share[place] = share[place] / total if total > 1e-9 else 0.0
        rank_row(prior[query], by_prior)
        rank_row(share, by_share)
        last_room = room[query, max(last[query], 0)] if was_seen else -1
        for place in range(width):
            if not is_place[query, place]:
                continue
            row, own = out[query, place], prior[query, place]
            row[0] = own
            row[3] = own > 0
            row[4] = share[place]
            if trust[query] > 0:
                row[1] = math.log(own * num_places[query, 0] + LEAST)
                row[2] = by_prior[place]
                row[5] = math.log(share[place] * num_places[query, 0] + LEAST)
                row[6] = by_share[place]
            if room[query, place] == last_room:
                row[7] = own / max(in_room[last_room], 1e-6)
        column = 8
        for strength in (0.5, 2.0, 8.0):
            total = 0.0
            for place in range(width):
                if is_place[query, place]:
                    weight = num_true[query, place] + strength * prior[query, place]
                    share[place] = weight / (looks[query, place] + strength)
                    total += share[place]
            for place in range(width):
                if is_place[query, place]:
                    out[query, place, column] = share[place] / max(total, 1e-6)
            column += 1


@kernel
def fill_words(
    out: np.ndarray,
    is_place: np.ndarray,
    by_name: np.ndarray,
    name_cosine: np.ndarray,
    similar: np.ndarray,
    furniture_cosine: np.ndarray,
    num_places: np.ndarray,
) -> None:
    """Where things of such names are kept by the prior and in this home, and the place's own."""
    order = np.empty(is_place.shape[1])
    for query in range(len(out)):
        total = similar[query].sum() + 0.1
        rank_row(by_name[query], order)
        for place in range(is_place.shape[1]):
            if not is_place[query, place]:
                continue
            row, here = out[query, place], similar[query, place] / total
            row[0] = by_name[query, place]
            if name_cosine[query] > 0:
                row[1] = math.log(by_name[query, place] * num_places[query, 0] + LEAST)
                row[2] = order[place]
            row[3] = here
            row[4] = math.log(here * num_places[query, 0] + LEAST)
            row[5] = furniture_cosine[query, place]


@kernel
def fill_filters(
    out: np.ndarray,
    is_place: np.ndarray,
    belief: np.ndarray,
    asked: int,
    num_places: np.ndarray,
) -> None:
    """What the adaptive filters believe, float64 (Q, K, F + 1); `asked` is the one that ranks."""
    order = np.empty(is_place.shape[1])
    num_filters = belief.shape[1]
    for query in range(len(out)):
        rank_row(belief[query, asked, :-1], order)
        for place in range(is_place.shape[1]):
            if is_place[query, place]:
                row = out[query, place]
                for number in range(num_filters):
                    own = belief[query, number, place]
                    row[2 * number] = own
                    row[2 * number + 1] = math.log(own * num_places[query, 0] + LEAST)
                row[2 * num_filters] = order[place]


@kernel
def fill_places(
    out: np.ndarray,
    is_place: np.ndarray,
    popularity: np.ndarray,
    arrivals: np.ndarray,
    onward: np.ndarray,
    back: np.ndarray,
    num_known: np.ndarray,
    num_seen: np.ndarray,
    num_places: np.ndarray,
) -> None:
    """How much the place is used, and how often objects go there from where this one was.

    `onward` and `back` are moves from where it was last seen to each place, and from there.
    """
    for query in range(len(out)):
        many, was_seen = num_places[query, 0], num_seen[query, 0] > 0
        total, total_onward = arrivals[query].sum(), onward[query].sum()
        for place in range(is_place.shape[1]):
            if not is_place[query, place]:
                continue
            row, came = out[query, place], arrivals[query, place]
            used = popularity[query, place] / max(num_known[query, 0], 1)
            row[0] = used
            row[1] = math.log(used * many + 0.1)
            row[2] = came / max(total, 1)
            row[3] = math.log((came + 0.5) / (total + 0.5 * many) * many)
            if was_seen:
                row[4] = onward[query, place] / max(total_onward, 1)
                row[5] = math.log1p(onward[query, place])
                row[6] = math.log1p(back[query, place])


@kernel
def fill_others(
    out: np.ndarray,
    is_place: np.ndarray,
    num_true: np.ndarray,
    looks: np.ndarray,
    same: np.ndarray,
    fresh: np.ndarray,
    often: np.ndarray,
    strays: np.ndarray,
    label: np.ndarray,
    room: np.ndarray,
    home: np.ndarray,
) -> None:
    """Where things of the same name, its companions, and what is out of its place were seen.

    Things of a name, this one among them, at furniture of the same label, in the room and in the
    home: what belongs on one shelf may belong on the next. `label` is that of all homes, (H, F).
    """
    width = is_place.shape[1]
    # Places of one label are a chain, and those of them that are in one room.
    first = np.empty(width, dtype=np.int64)
    first_in_room = np.empty(width, dtype=np.int64)
    by_label, by_room, looks_in_room = np.empty(width), np.empty(width), np.empty(width)
    for query in range(len(out)):
        own_label, most = label[home[query]], 0
        total_same, total_fresh, total_often, total_named = 0.0, 0.0, 0.0, 0.0
        by_label[:], by_room[:], looks_in_room[:] = 0, 0, 0
        for place in range(width):
            most = max(most, num_true[query, place])
        for place in range(width):
            if not is_place[query, place]:
                continue
            named = same[query, place] + num_true[query, place]
            total_named += named
            total_same += same[query, place]
            total_fresh += fresh[query, place]
            if num_true[query, place] < most:
                total_often += often[query, place]
            first[place] = first_in_room[place] = place
            for other in range(place):
                if is_place[query, other] and own_label[other] == own_label[place]:
                    first[place] = first[other]
                    if room[query, other] == room[query, place]:
                        first_in_room[place] = first_in_room[other]
                        break
            by_label[first[place]] += named
            by_room[first_in_room[place]] += named
            looks_in_room[first_in_room[place]] += looks[query, place]
        total_strays = strays[query].sum() + 0.5
        for place in range(width):
            if not is_place[query, place]:
                continue
            row = out[query, place]
            kept = often[query, place] if num_true[query, place] < most else 0.0
            row[0] = math.log1p(by_label[first[place]])
            row[1] = by_label[first[place]] / max(total_named, 1)
            row[2] = math.log1p(by_room[first_in_room[place]])
            row[3] = math.log1p(looks_in_room[first_in_room[place]])
            row[4] = math.log1p(same[query, place])
            row[5] = same[query, place] / max(total_same, 1)
            row[6] = fresh[query, place] / max(total_fresh, 0.5)
            row[7] = kept / max(total_often, 0.5)
            row[8] = math.log1p(strays[query, place])
            row[9] = strays[query, place] / total_strays


@kernel
def fill_rooms(
    out: np.ndarray,
    is_place: np.ndarray,
    num_true: np.ndarray,
    num_seen: np.ndarray,
    room: np.ndarray,
    num_rooms: int,
    last: np.ndarray,
) -> None:
    """The room of the place."""
    size, seen = np.empty(num_rooms), np.empty(num_rooms)
    for query in range(len(out)):
        size[:], seen[:] = 0, 0
        for place in range(is_place.shape[1]):
            if is_place[query, place]:
                size[room[query, place]] += 1
                seen[room[query, place]] += num_true[query, place]
        was_seen = num_seen[query, 0] > 0
        last_room = room[query, max(last[query], 0)] if was_seen else -1
        for place in range(is_place.shape[1]):
            if is_place[query, place]:
                row, own = out[query, place], room[query, place]
                row[0] = own == last_room
                row[1] = seen[own] / max(num_seen[query, 0], 1)
                row[2] = math.log(max(size[own], 1))
