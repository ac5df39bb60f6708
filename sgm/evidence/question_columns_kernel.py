"""Features of questions as a whole."""

from __future__ import annotations

import math

import numpy as np

from sgm.evidence.adaptive_filter import Rates
from sgm.evidence.expected_places import Expected
from sgm.evidence.home_sums import HomeSums
from sgm.evidence.object_counts import ObjectCounts
from sgm.evidence.question import Companions, QuestionArrays, QuestionCounters
from sgm.kernel import kernel

_HOUR_ANGLE = 2 * math.pi / 24


@kernel
def fill_question_columns(
    out: tuple[np.ndarray, ...],
    asked: QuestionArrays,
    counters: QuestionCounters,
    counts: ObjectCounts,
    rates: Rates,
    expected: Expected,
    companions: Companions,
    sums: HomeSums,
) -> None:
    """Fill the groups of `sgm.evidence.columns`, each float32 (Q, columns of the group)."""
    sizes, movement, stays, trust, words, things, clock = out
    for query in range(len(asked.home)):
        home, last, num_seen = asked.home[query], asked.last[query], asked.num_seen[query]
        num_true, hours, now = counts.num_true[query], asked.hours[query], asked.hour[query]
        num_known, num_found = sums.num_known[home], counters.num_found[query]
        was_seen, before = num_seen > 0, max(last, 0)
        since = (asked.now - counters.last_observed[query]) * hours if was_seen else 0.0

        # How large the home is, and how much of it is known.
        row = sizes[query]
        row[0] = math.log(asked.num_places[query])
        row[1] = math.log(counters.num_rooms[query])
        row[2] = math.log1p(num_known)
        row[3] = math.log1p(sums.sightings[home] / max(num_known, 1))
        row[4] = math.log1p(asked.now * hours)
        row[5] = math.log(hours)

        # How fast things move here, and how much this one may have moved since it was seen.
        row = movement[query]
        row[0] = math.log(rates.home[query])
        row[1] = math.log(rates.own[query])
        row[2] = math.log1p(counters.num_moved[query])
        row[3] = math.log1p(since)
        row[4] = -math.expm1(-rates.home[query] * since) if was_seen else 1
        row[5] = -math.expm1(-rates.own[query] * since) if was_seen else 1
        row[6] = counters.any_moved[query]
        row[7] = rates.crossing[query]
        row[8] = math.log1p(sums.arrivals[home].sum())
        row[9] = rates.miss[query]

        # How long things stay here, and this one; how often it was gone when it was asked for.
        placed = 0.0
        for place in range(len(num_true)):
            placed += num_true[place] / max(counts.num_known[query, place], 1)
        row = stays[query]
        row[0] = math.log(rates.home_left[query])
        row[1] = math.log(rates.left[query])
        row[2] = math.log1p(counts.num_left[query].sum())
        row[3] = -math.expm1(-rates.left[query] * since)
        row[4] = max(1 - placed, 0) if was_seen else 1
        row[5] = math.log1p(counters.num_sought[query])
        row[6] = (counters.num_still[query] + 0.5) / (counters.num_sought[query] + 1)

        # How well simple rules and the prior have done in this home.
        row = trust[query]
        row[0] = expected.trust[query] > 0
        row[1] = sums.num_typed[home] / max(num_known, 1)
        row[2] = math.log1p(sums.num_placed[home])
        row[3] = sums.lift[home] / (sums.num_placed[home] + 3)
        row[4] = (num_found + 0.5) / (counters.num_asked[query] + 1)
        for number in range(len(counters.num_right)):
            row[5 + number] = (counters.num_right[number, query] + 0.5) / (num_found + 1)

        # Whether the prior knows the object, and how sure its name tells where it is kept.
        row = words[query]
        row[0] = expected.trust[query] == 1
        row[1] = expected.name_cosine[query]
        row[2] = expected.by_name[query].max()
        row[3] = math.log1p(companions.similar[query].sum())
        row[4] = companions.most_similar[query]

        # Where the object tends to be, how sure that is, and what filters say in sum.
        room, belief = asked.room[query], asked.belief[query, asked.ranking]
        entropy, most, usual, size, num_seen_places = 0.0, 0.0, 0, 0, 0
        for place in range(len(num_true)):
            share = num_true[place] / max(num_seen, 1)
            entropy -= share * math.log(share + 1e-9)
            most = max(most, share)
            num_seen_places += share > 0
            if num_true[place] > num_true[usual]:
                usual = place
            if asked.is_place[query, place] and room[place] == room[before]:
                size += 1
        row = things[query]
        row[0] = was_seen
        row[1] = math.log1p(num_seen)
        row[2] = math.log1p(num_seen_places)
        row[3] = entropy
        row[4] = most
        row[5] = expected.share[query].max()
        row[6] = was_seen and usual == last
        row[7] = math.log1p(counts.num_absent[query, before]) if was_seen else 0
        row[8] = math.log1p(companions.same[query].sum())
        row[9] = math.log(max(size, 1)) if was_seen else 0
        row[10] = size / asked.num_places[query] if was_seen else 1
        row[11] = belief[:-1].max()
        row[12] = belief[-1]

        # What time it is, and how often the object is away from its usual place at that time.
        row = clock[query]
        row[0] = not math.isnan(now)
        if not row[0]:
            row[1:] = 0
            continue
        row[1] = math.sin(now * _HOUR_ANGLE)
        row[2] = math.cos(now * _HOUR_ANGLE)
        total, at_usual, at_last, gone = 0.0, 0.0, 0.0, 0.0
        for place in range(len(num_true)):
            seen = 0.0
            for hour in range(asked.narrow.shape[1]):
                seen += counts.hours[0, query, place, hour] * asked.narrow[query, hour]
            total += seen
            if place == usual:
                at_usual = seen
            if place == before:
                at_last = seen
        for hour in range(asked.narrow.shape[1]):
            gone += counts.hours[1, query, before, hour] * asked.narrow[query, hour]
        row[3] = (total - at_usual + 0.3) / (total + 1)
        row[4] = (gone + 0.3) / (gone + at_last + 1) if was_seen else 0
