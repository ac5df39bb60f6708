"""An adaptive filter that at times looks elsewhere, so that what is collected is varied."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from simulator.memory.memory_batch import MemoryBatch, Queries
from simulator.policies.adaptive import Adaptive
from simulator.policies.policy import ScoreKind, mask_furniture

_TEMPERATURES = np.array([0.0, 0.0, 0.0, 0.0, 0.5, 0.5, 1.0, 3.0])  # each equally often
_LEAST = 1e-6


class Exploring(Adaptive):
    """`Adaptive`, with noise on half of the questions: for collecting, not for answering.

    A network that is to play well must have seen the memories of good and of bad guessers. Gumbel
    noise of temperature one draws places in proportion to the belief. It comes from a hash of what
    is asked and when, so that the same question to the same memory has the same answer.
    """

    score_kind: ClassVar[ScoreKind] = "logits"

    def scores(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        """Return logarithms of the belief with noise, (Q, F)."""
        belief = self.follow(memory, queries)[:, :-1]
        key = memory.objects["key"][queries.object].astype(np.uint64)
        first = memory.furniture_label[queries.home, 0].astype(np.uint64)
        seed = mix_bits(mix_bits(np.uint64(memory.time) + (key << np.uint64(32))) ^ first)
        temperature = _TEMPERATURES[(seed % np.uint64(len(_TEMPERATURES))).astype(int)]
        places = np.arange(belief.shape[1], dtype=np.uint64)
        uniform = (mix_bits(seed[:, None] + places + np.uint64(1)) >> np.uint64(11)) * 2.0**-53
        gumbel = -np.log(-np.log(np.clip(uniform, _LEAST, 1 - _LEAST)))
        scores = np.log(np.maximum(belief, _LEAST)) + temperature[:, None] * gumbel
        return mask_furniture(memory, queries, scores)


def mix_bits(values: np.ndarray) -> np.ndarray:
    """Hash 64-bit numbers, uint64 of any shape.

    Source: SplitMix64 (Steele, Lea and Flood 2014).
    """
    values = values + np.uint64(0x9E3779B97F4A7C15)
    values = (values ^ (values >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    values = (values ^ (values >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return values ^ (values >> np.uint64(31))
