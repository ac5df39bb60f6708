"""Where other things were seen: of the same name, companions, of alike names, out of place.

Each function of columns computes a group of `sgm.evidence.columns`, by name.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sgm.arrays.grouped import compute_rank_in_group, compute_starts, concatenate_ranges
from sgm.evidence.expected_places import Expected
from sgm.evidence.question import Question
from sgm.evidence.rows import add_in_order, log_share, rank_rows, sum_equal
from sgm.memory.memory_batch import MemoryBatch
from sgm.text.vectors import compare

_WIDTH = 0.1  # of cosines by which the names of two things are alike
_LATELY = 10  # times as fast as a sighting of a companion, one out of place loses its weight
_FEWEST_NOW = 1.0  # companions known to be somewhere: less than one says little
_ALIKE = 0.3  # cosine of the sightings by place from which an object counts as a companion


class Companions(NamedTuple):
    """Where other things than Q that are asked for were seen, at F places.

    Attributes:
        likeness: how much each label of the memory is like the name of each thing, 1 for itself,
            (Q, L).
        same: sightings of things of the same name, (Q, F).
        fresh: companions that were seen last at a place, weighted by how much their sightings by
            place are like those of the thing, and by how fresh the last one is, (Q, F).
        often: share of the sightings of companions by place, weighted by likeness, (Q, F).
        similar: share of the sightings of all other things by place, weighted by how much their
            names are alike, (Q, F).
        most_similar: the greatest of these weights, (Q,).
        strays: other things that were seen last where they are not usually, weighted by how lately
            that was, (Q, F).
    """

    likeness: np.ndarray
    same: np.ndarray
    fresh: np.ndarray
    often: np.ndarray
    similar: np.ndarray
    most_similar: np.ndarray
    strays: np.ndarray

    @classmethod
    def gather(cls, asked: Question, age_rate: np.ndarray) -> Companions:
        """Gather what the memory holds; a sighting loses its weight at `age_rate` a step, (Q,)."""
        memory, counts, shape = asked.memory, asked.counts, asked.counts.num_true.shape
        objects, edges = memory.objects, memory.edges
        names = [memory.labels[label] for label in objects["label"][asked.thing].tolist()]
        query, edge = _join_edges(asked)
        likeness = np.exp((compare(names, memory.labels) - 1) / _WIDTH)
        object_total, object_square, object_most = _sum_sightings(memory)
        other, place = edges["object"][edge].astype(np.intp), edges["furniture"][edge]
        count, place = edges["num_true"][edge], place.astype(np.intp)
        label = objects["label"][other]
        name = likeness[query, label]
        most_similar = np.zeros(shape[0])
        np.maximum.at(most_similar, query, name)
        is_same = label == objects["label"][asked.thing[query]]
        # How much the sightings of each other thing by place are like those of the thing.
        seen = counts.num_true.astype(float)
        pair, num_pairs = _number_pairs(memory, query, other, shape[0])
        product = np.bincount(pair, count * seen[query, place], minlength=num_pairs)[pair]
        square = object_square[other] * (seen**2).sum(axis=1)[query]
        cosine = product / np.sqrt(np.maximum(square, 1))
        cosine *= cosine > _ALIKE
        share = count / object_total[other]
        age = age_rate[query] * (memory.time - objects["last_observed"][other])
        is_last = place == objects["last_furniture"][other]

        def sum_by_place(weight: np.ndarray) -> np.ndarray:
            summed = np.bincount(query * shape[1] + place, weight, minlength=shape[0] * shape[1])
            return summed.reshape(shape)

        return cls(
            likeness=likeness,
            same=sum_by_place(count * is_same),
            fresh=sum_by_place(cosine * np.exp(-age) * is_last),
            often=sum_by_place(cosine * share),
            similar=sum_by_place(name * share),
            most_similar=most_similar,
            strays=sum_by_place(np.exp(-_LATELY * age) * (is_last & (count < object_most[other]))),
        )


def _join_edges(asked: Question) -> tuple[np.ndarray, np.ndarray]:
    """Pair questions and edges of other objects in their home that were ever true, (k,) each."""
    edges, home, num_edges = asked.memory.edges, asked.home, asked.sums.num_edges
    of_home = np.arange(edges.num_rows)
    if asked.memory.num_homes > 1:
        of_home = np.argsort(edges["home"], kind="stable")
    query = np.repeat(np.arange(len(home)), num_edges[home])
    edge = of_home[concatenate_ranges(compute_starts(num_edges)[home], num_edges[home])]
    is_other = (edges["object"][edge] != asked.thing[query]) & (edges["num_true"][edge] > 0)
    return query[is_other], edge[is_other]


def _sum_sightings(memory: MemoryBatch) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return sum, sum of squares and maximum of the sightings by edge of each object, (O,)."""
    edges, num_objects = memory.edges, memory.objects.num_rows
    count = edges["num_true"].astype(float)
    most = np.zeros(num_objects)
    np.maximum.at(most, edges["object"], count)
    total = np.bincount(edges["object"], count, minlength=num_objects)
    return total, np.bincount(edges["object"], count**2, minlength=num_objects), most


def _number_pairs(
    memory: MemoryBatch, query: np.ndarray, other: np.ndarray, num_queries: int
) -> tuple[np.ndarray, int]:
    """Number pairs of a question and an object of its home, equal ones alike; below how many."""
    if memory.num_homes == 1:
        return query * memory.objects.num_rows + other, num_queries * memory.objects.num_rows
    home = memory.objects["home"]
    by_home = np.argsort(home, kind="stable")
    number = np.empty(len(home), dtype=np.int64)  # within the home
    number[by_home] = compute_rank_in_group(home[by_home])
    most = int(number.max(initial=0)) + 1
    return query * most + number[other], num_queries * most


def compute_others(asked: Question, companions: Companions) -> dict[str, np.ndarray]:
    """Where things of the same name, its companions, and what is out of its place were seen.

    Things of a name, this one among them, at furniture of the same label, in the room and in the
    home: what belongs on one shelf may belong on the next. (Q, F) each.
    """
    count, is_place, same = asked.counts.num_true, asked.is_place, companions.same
    named = (same + count) * is_place
    is_usual = count == count.max(axis=1, keepdims=True)
    often = companions.often * ~is_usual * is_place
    # A number for each label, and for each label in a room: rooms have small ones.
    label = asked.memory.furniture_label[asked.home]
    label = np.where(is_place, label, -1).astype(np.int64)
    num_rooms = int(asked.room.max(initial=0)) + 1
    label_in_room = np.where(is_place, label * num_rooms + asked.room, -1)
    num_now = np.maximum(add_in_order(companions.fresh * is_place), _FEWEST_NOW)
    at_label = sum_equal(label, named)
    return {
        "name_at_label": np.log1p(at_label),
        "name_at_label_share": at_label / np.maximum(add_in_order(named), 1),
        "name_at_label_in_room": np.log1p(sum_equal(label_in_room, named)),
        "looks_at_label_in_room": np.log1p(sum_equal(label_in_room, asked.looks * is_place)),
        "same_name": np.log1p(same),
        "same_name_share": same / np.maximum(add_in_order(same * is_place), 1),
        "companions_now": companions.fresh / num_now,
        "companions_often": often / np.maximum(add_in_order(often), 0.5),
        "strays": np.log1p(companions.strays),
        "strays_share": companions.strays / (add_in_order(companions.strays) + 0.5),
    }


def compute_words(
    asked: Question, expected: Expected, companions: Companions
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Where things of such names are kept by the prior and in this home, and the place's own.

    And whether the prior knows the thing, and how sure its name tells where it is kept: columns of
    places, (Q, F) each, and of the question, (Q,) each.
    """
    by_name, similar, num_places = expected.by_name, companions.similar, asked.num_places
    is_called = expected.name_cosine[:, None] > 0
    num_similar = add_in_order(similar)
    share = similar / (num_similar + 0.1)
    of_places = {
        "by_name": by_name,
        "log_by_name": log_share(by_name, num_places) * is_called,
        "by_name_rank": rank_rows(by_name, asked.is_place) * is_called,
        "similar_here": share,
        "log_similar_here": log_share(share, num_places),
        "furniture_cosine": expected.furniture_cosine,
    }
    return of_places, {
        "is_known": expected.trust == 1,
        "name_cosine": expected.name_cosine,
        "most_by_name": by_name.max(axis=1),
        "similar_known": np.log1p(num_similar[:, 0]),
        "most_similar": companions.most_similar,
    }
