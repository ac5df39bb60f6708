"""An adaptive filter that looks about in another way in every home, so that memories are varied."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Queries
from sgm.policies.adaptive import Adaptive
from sgm.policies.policy import ScoreKind, mask_furniture

_TEMPERATURES = np.array([0.0, 0.0, 0.0, 0.0, 0.5, 0.5, 1.0, 3.0])  # each equally often
_SHARES_OF_NEW = np.array([1.0, 0.3, 0.1, 0.03])  # each in as many homes
_LEAST = 1e-6


class Exploring(Adaptive):
    """`Adaptive` with noise, or one that keeps to what it knows: for collecting, not for answering.

    A network that is to play well must have seen the memories of good and of bad guessers, and of
    those who leave places alone as it will itself: where it looks follows from what it says.

    - In half of the homes there is noise on half of the questions. Gumbel noise of temperature one
      draws places in proportion to the belief.
    - Places that were never looked at are believed in to some share only, which is another in each
      home. The smaller it is, the longer they remain unseen.

    Both come from a hash of the home, of what is asked and of when, so that the same question to
    the same memory has the same answer.
    """

    score_kind: ClassVar[ScoreKind] = "logits"

    def scores(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        """Return logarithms of the belief, changed in this way, (Q, F)."""
        home = hash_homes(memory)[queries.home]
        is_noisy, share = home % np.uint64(2) == 0, home >> np.uint64(1)
        share_of_new = _SHARES_OF_NEW[(share % np.uint64(len(_SHARES_OF_NEW))).astype(int)]
        is_new = memory.furniture_num_observed[queries.home] == 0
        belief = self.follow(memory, queries)[:, :-1]
        belief = np.where(is_new, share_of_new[:, None] * belief, belief)
        key = memory.objects["key"][queries.object].astype(np.uint64)
        seed = mix_bits(mix_bits(np.uint64(memory.time) + (key << np.uint64(32))) ^ home)
        temperature = _TEMPERATURES[(seed % np.uint64(len(_TEMPERATURES))).astype(int)]
        places = np.arange(belief.shape[1], dtype=np.uint64)
        uniform = (mix_bits(seed[:, None] + places + np.uint64(1)) >> np.uint64(11)) * 2.0**-53
        gumbel = -np.log(-np.log(np.clip(uniform, _LEAST, 1 - _LEAST)))
        noise = np.where(is_noisy, temperature, 0.0)[:, None] * gumbel
        return mask_furniture(memory, queries, np.log(np.maximum(belief, _LEAST)) + noise)


def hash_homes(memory: MemoryBatch) -> np.ndarray:
    """Hash what furniture stands where in each home, uint64 (H,)."""
    label = memory.furniture_label.astype(np.uint64) << np.uint64(16)
    place = np.arange(label.shape[1], dtype=np.uint64)
    bits = np.where(memory.is_furniture, mix_bits(label + place), np.uint64(0))
    return mix_bits(bits.sum(axis=1, dtype=np.uint64))


def mix_bits(values: np.ndarray) -> np.ndarray:
    """Hash 64-bit numbers, uint64 of any shape.

    Source: SplitMix64 (Steele, Lea and Flood 2014).
    """
    values = values + np.uint64(0x9E3779B97F4A7C15)
    values = (values ^ (values >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    values = (values ^ (values >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return values ^ (values >> np.uint64(31))
