"""Hashes by which spaCy names strings and thinc finds the rows of a hash embedding."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_MASK = 2**64 - 1


def hash_string(text: str) -> int:
    """Hash a string as spaCy does: MurmurHash64A with seed 1 of its UTF-8 bytes, 0 if empty.

    Source: A. Appleby, MurmurHash2, 64-bit version; spaCy's StringStore.
    """
    if not text:
        return 0
    data, factor = text.encode("utf-8"), 0xC6A4A7935BD1E995
    hashed = (1 ^ (len(data) * factor)) & _MASK
    num_whole = len(data) // 8 * 8
    for start in range(0, num_whole, 8):
        block = int.from_bytes(data[start : start + 8], "little") * factor & _MASK
        block = (block ^ block >> 47) * factor & _MASK
        hashed = (hashed ^ block) * factor & _MASK
    if num_whole < len(data):
        hashed = (hashed ^ int.from_bytes(data[num_whole:], "little")) * factor & _MASK
    hashed = (hashed ^ hashed >> 47) * factor & _MASK
    return hashed ^ hashed >> 47


def hash_rows(
    ids: NDArray[np.uint64], seeds: NDArray[np.uint64], num_rows: NDArray[np.uint64]
) -> NDArray[np.intp]:
    """Choose four rows of each hash table for each id, (T, A) -> (T, A, 4).

    MurmurHash3_x64_128 of the eight bytes of an id, as thinc's `HashEmbed` computes it: of T
    tokens' A attributes, with seeds and numbers of rows of the tables, (A,).

    Source: A. Appleby, MurmurHash3; J. Svenstrup et al., "Hash embeddings", 2017.
    """
    first = ids * np.uint64(0x87C37B91114253D5)  # products modulo 2^64, as the hash wants them
    first = (first << np.uint64(31) | first >> np.uint64(33)) * np.uint64(0x4CF5AD432745937F)
    second = seeds ^ np.uint64(8)  # 8 bytes long
    first = (first ^ second) + second
    second = second + first
    first, second = _mix(first), _mix(second)
    first = first + second
    second = second + first
    low = np.uint64(0xFFFFFFFF)
    parts = [first & low, first >> np.uint64(32), second & low, second >> np.uint64(32)]
    return (np.stack(parts, axis=-1) % num_rows[:, None]).astype(np.intp)


def _mix(hashed: NDArray[np.uint64]) -> NDArray[np.uint64]:
    for factor in (0xFF51AFD7ED558CCD, 0xC4CEB9FE1A85EC53):
        hashed = (hashed ^ hashed >> np.uint64(33)) * np.uint64(factor)
    return hashed ^ hashed >> np.uint64(33)
