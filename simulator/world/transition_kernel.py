"""Rows of T as lists of entries: making them and drawing from them.

Block b holds the entries bound[b]..bound[b + 1] - 1, and row r the blocks r B..(r + 1) B - 1.
"""

from __future__ import annotations

import numpy as np

from sgm.kernel import kernel


@kernel
def list_entries(
    rows: np.ndarray,
    places: np.ndarray,
    weights: np.ndarray,
    layouts: np.ndarray,
    place_block: np.ndarray,
    num_blocks: int,
    entry: np.ndarray,
    ends: np.ndarray,
) -> int:
    """Write the positive of weights (k,) into entries; see `Transitions.append`.

    Args:
        rows: (k,).
        places: (k,).
        weights: (k,).
        layouts: of each of the n rows, (n,).
        place_block: of every place in each layout, (L, P).
        num_blocks: B.
        entry: filled from its start on, (k,).
        ends: filled with the number of entries up to the end of each block, (n * B,).

    Returns:
        How many were positive.
    """
    count, block = 0, 0
    for i in range(len(rows)):
        own_block = rows[i] * num_blocks + place_block[layouts[rows[i]], places[i]]
        while block < own_block:
            ends[block] = count
            block += 1
        weight = np.float32(weights[i])
        if weight > 0:
            entry[count].place = places[i]
            entry[count].weight = weight
            count += 1
    ends[block:] = count
    return count


@kernel
def _draw(
    entry: np.ndarray, start: int, end: int, furniture: np.ndarray, avoid: int, uniform: float
) -> int:
    """Draw one of the entries start..end - 1 in proportion to its weight; return its place.

    None at the furniture to avoid is drawn. Furniture is given per place, (P,).
    """
    total = np.float32(0)
    for i in range(start, end):
        if furniture[entry[i].place] != avoid:
            total += entry[i].weight
    target = uniform * total
    passed = np.float32(0)
    drawn = -1
    for i in range(start, end):
        if furniture[entry[i].place] != avoid:
            drawn = entry[i].place  # rounding can push the target onto the total: then the last
            passed += entry[i].weight
            if passed > target:
                break
    return drawn


@kernel
def _touch(entry: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.bool:
    """Ask for the memory of n ranges of entries at once, instead of range after range.

    A draw takes 73 ns so instead of 220 (`benchmarks/evolve.py`). Returns whether a weight is
    negative, which none is: else the compiler would leave this out.
    """
    total = np.float32(0)
    for i in range(len(start)):
        total += entry[min(start[i], len(entry) - 1)].weight + entry[end[i] - 1].weight
    return total < 0


@kernel
def _draw_all(
    entry: np.ndarray,
    start: np.ndarray,
    end: np.ndarray,
    furniture: np.ndarray,
    avoid: np.ndarray,
    uniform: np.ndarray,
) -> np.ndarray:
    """Draw one entry of each of n ranges, see `_draw`, (n,) places."""
    found = np.empty(len(start), dtype=np.int32)
    if not _touch(entry, start, end):
        for i in range(len(start)):
            found[i] = _draw(entry, start[i], end[i], furniture, avoid[i], uniform[i])
    return found


@kernel
def sample_moves(
    entry: np.ndarray,
    bound: np.ndarray,
    place_block: np.ndarray,
    num_blocks: int,
    place_furniture: np.ndarray,
    rows: np.ndarray,
    layouts: np.ndarray,
    places: np.ndarray,
    uniform: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Draw where objects of rows (n,) at places (n,) move to; see `Transitions.sample_moves`."""
    block = np.empty(len(rows), dtype=np.int64)
    for i in range(len(rows)):
        block[i] = rows[i] * num_blocks + place_block[layouts[i], places[i]]
    here = place_furniture[places]
    found = _draw_all(entry, bound[block], bound[block + 1], place_furniture, here, uniform)
    return found, can_leave(
        entry, bound, place_block, num_blocks, place_furniture, rows, layouts, found
    )


@kernel
def sample_places(
    entry: np.ndarray,
    bound: np.ndarray,
    place_block: np.ndarray,
    num_blocks: int,
    place_furniture: np.ndarray,
    rows: np.ndarray,
    layouts: np.ndarray,
    uniform: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Draw where new objects of rows (n,) are put; see `Transitions.sample_places`."""
    start, end = bound[rows * num_blocks], bound[(rows + 1) * num_blocks]
    nowhere = np.full(len(rows), -1, dtype=place_furniture.dtype)
    found = _draw_all(entry, start, end, place_furniture, nowhere, uniform)
    return found, can_leave(
        entry, bound, place_block, num_blocks, place_furniture, rows, layouts, found
    )


@kernel
def can_leave(
    entry: np.ndarray,
    bound: np.ndarray,
    place_block: np.ndarray,
    num_blocks: int,
    place_furniture: np.ndarray,
    rows: np.ndarray,
    layouts: np.ndarray,
    places: np.ndarray,
) -> np.ndarray:
    """Tell whether objects can move on from places (n,); see `Transitions.can_leave`."""
    is_free = np.zeros(len(rows), dtype=np.bool_)
    for i in range(len(rows)):
        block = rows[i] * num_blocks + place_block[layouts[i], places[i]]
        here = place_furniture[places[i]]
        for j in range(bound[block], bound[block + 1]):
            if place_furniture[entry[j].place] != here:
                is_free[i] = True
                break
    return is_free
