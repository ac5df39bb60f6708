"""Where other things were seen: of the same name, companions, of alike names, out of place."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sgm.arrays.grouped import compute_rank_in_group, compute_starts, concatenate_ranges
from sgm.evidence.home_sums import HomeSums
from sgm.evidence.object_counts import ObjectCounts
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Queries

_LATELY = 10  # times as fast as a sighting of a companion, one out of place loses its weight
_ALIKE = 0.3  # cosine of the sightings by place from which an object counts as a companion


class Companions(NamedTuple):
    """Where other things than Q that are asked for were seen, at F places.

    Attributes:
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

    same: np.ndarray
    fresh: np.ndarray
    often: np.ndarray
    similar: np.ndarray
    most_similar: np.ndarray
    strays: np.ndarray

    @classmethod
    def gather(
        cls,
        memory: MemoryBatch,
        queries: Queries,
        counts: ObjectCounts,
        age_rate: np.ndarray,
        sums: HomeSums,
        likeness: np.ndarray,
    ) -> Companions:
        """Gather what the memory holds; a sighting loses its weight at `age_rate` a step, (Q,).

        `likeness` is that of `compare_names`.
        """
        objects, edges, shape = memory.objects, memory.edges, counts.num_true.shape
        object_total, object_square, object_most = _sum_sightings(memory)
        query, edge = _join_edges(memory, queries, sums)
        row, place = (edges[name][edge].astype(np.intp) for name in ("object", "furniture"))
        count = edges["num_true"][edge]

        def sum_by_place(weight: np.ndarray) -> np.ndarray:
            summed = np.bincount(query * shape[1] + place, weight, minlength=shape[0] * shape[1])
            return summed.reshape(shape)

        label = objects["label"][row]
        name = likeness[query, label]
        most_similar = np.zeros(shape[0])
        np.maximum.at(most_similar, query, name)
        is_same = label == objects["label"][queries.object[query]]
        # How much the sightings of each other thing by place are like those of the thing.
        seen = counts.num_true.astype(float)
        pair, num_pairs = _number_pairs(memory, query, row, shape[0])
        product = np.bincount(pair, count * seen[query, place], minlength=num_pairs)[pair]
        square = object_square[row] * (seen**2).sum(axis=1)[query]
        cosine = product / np.sqrt(np.maximum(square, 1))
        cosine *= cosine > _ALIKE
        share = count / object_total[row]
        age = age_rate[query] * (memory.time - objects["last_observed"][row])
        is_last = place == objects["last_furniture"][row]
        return cls(
            same=sum_by_place(count * is_same),
            fresh=sum_by_place(cosine * np.exp(-age) * is_last),
            often=sum_by_place(cosine * share),
            similar=sum_by_place(name * share),
            most_similar=most_similar,
            strays=sum_by_place(np.exp(-_LATELY * age) * (is_last & (count < object_most[row]))),
        )


def _sum_sightings(memory: MemoryBatch) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return sum, sum of squares and maximum of the sightings by edge of each object, (O,)."""
    edges, num_objects = memory.edges, memory.objects.num_rows
    count = edges["num_true"].astype(float)
    most = np.zeros(num_objects)
    np.maximum.at(most, edges["object"], count)
    total, square = (
        np.bincount(edges["object"], weight, minlength=num_objects) for weight in (count, count**2)
    )
    return total, square, most


def _join_edges(
    memory: MemoryBatch, queries: Queries, sums: HomeSums
) -> tuple[np.ndarray, np.ndarray]:
    """Pair questions and edges of other objects in their home that were ever true, (k,) each."""
    edges, home = memory.edges, queries.home
    of_home = np.arange(edges.num_rows)
    if memory.num_homes > 1:
        of_home = np.argsort(edges["home"], kind="stable")
    num_edges = sums.num_edges[home]
    query = np.repeat(np.arange(len(home)), num_edges)
    edge = of_home[concatenate_ranges(compute_starts(sums.num_edges)[home], num_edges)]
    is_other = (edges["object"][edge] != queries.object[query]) & (edges["num_true"][edge] > 0)
    return query[is_other], edge[is_other]


def _number_pairs(
    memory: MemoryBatch, query: np.ndarray, row: np.ndarray, num_queries: int
) -> tuple[np.ndarray, int]:
    """Number pairs of a question and an object of its home, equal ones alike; below how many."""
    if memory.num_homes == 1:
        return query * memory.objects.num_rows + row, num_queries * memory.objects.num_rows
    home = memory.objects["home"]
    by_home = np.argsort(home, kind="stable")
    number = np.empty(len(home), dtype=np.int64)  # within the home
    number[by_home] = compute_rank_in_group(home[by_home])
    most = int(number.max(initial=0)) + 1
    return query * most + number[row], num_queries * most
