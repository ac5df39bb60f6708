"""Where an object is expected before it is seen: by the prior, or by what its name is like."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sgm.arrays.both_relations import sum_relations
from sgm.arrays.grouped import sum_rows
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Queries

_TRUST = 0.5  # of what a name is like, as a share of what the prior knows


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
    def by_prior(cls, memory: MemoryBatch, queries: Queries) -> Expected:
        """Expect what the prior says, and nothing where it is silent."""
        share, has_prior = share_out(memory, queries, sum_relations(queries.prior).astype(float))
        nothing = np.zeros(share.shape)
        return cls(
            share=share,
            trust=has_prior.astype(float),
            by_name=nothing,
            name_cosine=nothing[:, 0],
            furniture_cosine=nothing,
        )

    @classmethod
    def by_words(cls, memory: MemoryBatch, queries: Queries) -> Expected:
        """Let words speak where the prior is silent.

        Furniture that the prior does not know is taken for what it is called like; so is an object
        of which it says nothing.
        """
        prior, home, row = memory.place_prior, queries.home, queries.object
        types = memory.objects["type"][row]
        own = np.where((types >= 0)[:, None], prior.weights_by_words[home, types], 0)
        own, is_known = share_out(memory, queries, own.astype(float))
        labels = [memory.labels[label] for label in memory.objects["label"][row]]
        by_name, cosine = prior.find_by_words(home, labels)
        by_name, is_called = share_out(memory, queries, by_name)
        return cls(
            share=np.where(is_known[:, None], own, by_name),
            trust=np.where(is_known, 1.0, _TRUST * is_called),
            by_name=by_name,
            name_cosine=np.ascontiguousarray(cosine),
            furniture_cosine=prior.furniture_cosine[home],
        )


def share_out(
    memory: MemoryBatch, queries: Queries, share: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Scale weights of places to a sum of one, (Q, F), and say which have one, bool (Q,)."""
    total = sum_rows(share, memory.home_num_furniture[queries.home])
    is_some = total > 1e-9
    share = np.divide(share, total[:, None], out=np.zeros_like(share), where=is_some[:, None])
    return share, is_some
