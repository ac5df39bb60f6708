"""Features of questions as a whole; `out` is float32 (Q, columns of the group), in their order."""

from __future__ import annotations

import math

import numpy as np

from sgm.kernel import kernel

_HOUR_ANGLE = 2 * math.pi / 24


@kernel
def fill_size(
    out: np.ndarray,
    num_places: np.ndarray,
    num_rooms: np.ndarray,
    num_known: np.ndarray,
    sightings: np.ndarray,
    now: int,
    hours: np.ndarray,
) -> None:
    """How large the home is, and how much of it is known."""
    for query in range(len(out)):
        row = out[query]
        row[0] = math.log(num_places[query, 0])
        row[1] = math.log(num_rooms[query])
        row[2] = math.log1p(num_known[query, 0])
        row[3] = math.log1p(sightings[query] / max(num_known[query, 0], 1))
        row[4] = math.log1p(now * hours[query, 0])
        row[5] = math.log(hours[query, 0])


@kernel
def fill_movement(
    out: np.ndarray,
    num_seen: np.ndarray,
    last_observed: np.ndarray,
    num_moved: np.ndarray,
    now: int,
    hours: np.ndarray,
    of_home: np.ndarray,
    own: np.ndarray,
    any_moved: np.ndarray,
    crossing: np.ndarray,
    moves: np.ndarray,
    miss: np.ndarray,
) -> None:
    """How fast things move here, and how much this one may have moved since it was seen."""
    for query in range(len(out)):
        row, since, was_seen = out[query], 0.0, num_seen[query, 0] > 0
        if was_seen:
            since = (now - last_observed[query]) * hours[query, 0]
        row[0] = math.log(of_home[query])
        row[1] = math.log(own[query])
        row[2] = math.log1p(num_moved[query])
        row[3] = math.log1p(since)
        row[4] = -math.expm1(-of_home[query] * since) if was_seen else 1
        row[5] = -math.expm1(-own[query] * since) if was_seen else 1
        row[6] = any_moved[query]
        row[7] = crossing[query]
        row[8] = math.log1p(moves[query])
        row[9] = miss[query]


@kernel
def fill_stays(
    out: np.ndarray,
    num_seen: np.ndarray,
    num_true: np.ndarray,
    num_known: np.ndarray,
    num_left: np.ndarray,
    last_observed: np.ndarray,
    num_sought: np.ndarray,
    num_still: np.ndarray,
    now: int,
    hours: np.ndarray,
    home_left: np.ndarray,
    left: np.ndarray,
) -> None:
    """How long things stay here, and this one; how often it was gone when it was asked for."""
    for query in range(len(out)):
        row, since, placed = out[query], 0.0, 0.0
        was_seen = num_seen[query, 0] > 0
        if was_seen:
            since = (now - last_observed[query]) * hours[query, 0]
        for place in range(num_true.shape[1]):
            placed += num_true[query, place] / max(num_known[query, place], 1)
        row[0] = math.log(home_left[query])
        row[1] = math.log(left[query])
        row[2] = math.log1p(num_left[query].sum())
        row[3] = -math.expm1(-left[query] * since)
        row[4] = max(1 - placed, 0) if was_seen else 1
        row[5] = math.log1p(num_sought[query])
        row[6] = (num_still[query] + 0.5) / (num_sought[query] + 1)


@kernel
def fill_trust(
    out: np.ndarray,
    trust: np.ndarray,
    num_typed: np.ndarray,
    num_known: np.ndarray,
    num_placed: np.ndarray,
    lift: np.ndarray,
    num_asked: np.ndarray,
    num_found: np.ndarray,
    rights: tuple[np.ndarray, ...],
) -> None:
    """How well simple rules and the prior have done in this home."""
    for query in range(len(out)):
        row = out[query]
        row[0] = trust[query] > 0
        row[1] = num_typed[query] / max(num_known[query, 0], 1)
        row[2] = math.log1p(num_placed[query])
        row[3] = lift[query] / (num_placed[query] + 3)
        row[4] = (num_found[query] + 0.5) / (num_asked[query] + 1)
        for number in range(len(rights)):
            row[5 + number] = (rights[number][query] + 0.5) / (num_found[query] + 1)


@kernel
def fill_words(
    out: np.ndarray,
    trust: np.ndarray,
    name_cosine: np.ndarray,
    by_name: np.ndarray,
    similar: np.ndarray,
    most_similar: np.ndarray,
) -> None:
    """Whether the prior knows the object, and how sure its name tells where it is kept."""
    for query in range(len(out)):
        row = out[query]
        row[0] = trust[query] == 1
        row[1] = name_cosine[query]
        row[2] = by_name[query].max()
        row[3] = math.log1p(similar[query].sum())
        row[4] = most_similar[query]


@kernel
def fill_object(
    out: np.ndarray,
    is_place: np.ndarray,
    num_true: np.ndarray,
    num_seen: np.ndarray,
    num_absent: np.ndarray,
    prior: np.ndarray,
    same: np.ndarray,
    room: np.ndarray,
    last: np.ndarray,
    num_places: np.ndarray,
    belief: np.ndarray,
    asked: int,
) -> None:
    """Where the object tends to be, how sure that is, and what filters say in sum."""
    for query in range(len(out)):
        row, before = out[query], max(last[query], 0)
        was_seen = num_seen[query, 0] > 0
        entropy, most, usual, size, num_seen_places = 0.0, 0.0, 0, 0, 0
        for place in range(is_place.shape[1]):
            share = num_true[query, place] / max(num_seen[query, 0], 1)
            entropy -= share * math.log(share + 1e-9)
            most = max(most, share)
            num_seen_places += share > 0
            if num_true[query, place] > num_true[query, usual]:
                usual = place
            if is_place[query, place] and room[query, place] == room[query, before]:
                size += 1
        row[0] = was_seen
        row[1] = math.log1p(num_seen[query, 0])
        row[2] = math.log1p(num_seen_places)
        row[3] = entropy
        row[4] = most
        row[5] = prior[query].max()
        row[6] = was_seen and usual == last[query]
        row[7] = math.log1p(num_absent[query, before]) if was_seen else 0
        row[8] = math.log1p(same[query].sum())
        row[9] = math.log(max(size, 1)) if was_seen else 0
        row[10] = size / num_places[query, 0] if was_seen else 1
        row[11] = belief[query, asked, :-1].max()
        row[12] = belief[query, asked, -1]


@kernel
def fill_hour(
    out: np.ndarray,
    num_true: np.ndarray,
    num_seen: np.ndarray,
    hours: np.ndarray,
    weight: np.ndarray,
    now: np.ndarray,
    last: np.ndarray,
) -> None:
    """What time it is, and how often the object is away from its usual place at that time.

    `now` is the hour of day, nan where it is unknown; `weight` how much each hour counts, (Q, bins
    of the day), of `hours` (2, Q, F, bins).
    """
    for query in range(len(out)):
        row = out[query]
        row[0] = not math.isnan(now[query])
        if not row[0]:
            row[1:] = 0
            continue
        row[1] = math.sin(now[query] * _HOUR_ANGLE)
        row[2] = math.cos(now[query] * _HOUR_ANGLE)
        usual, before = num_true[query].argmax(), max(last[query], 0)
        total, at_usual, at_last, gone = 0.0, 0.0, 0.0, 0.0
        for place in range(num_true.shape[1]):
            seen = 0.0
            for hour in range(weight.shape[1]):
                seen += hours[0, query, place, hour] * weight[query, hour]
            total += seen
            if place == usual:
                at_usual = seen
            if place == before:
                at_last = seen
        for hour in range(weight.shape[1]):
            gone += hours[1, query, before, hour] * weight[query, hour]
        row[3] = (total - at_usual + 0.3) / (total + 1)
        row[4] = (gone + 0.3) / (gone + at_last + 1) if num_seen[query, 0] > 0 else 0
