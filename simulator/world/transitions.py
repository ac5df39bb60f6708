"""T^i, the true dynamics of homes: where an object of each description goes, and how likely."""

from __future__ import annotations

import numpy as np

from sgm.arrays.grouped import concatenate_ranges
from sgm.arrays.table import Table
from simulator.kernel import kernel

# A weight and where it leads: eight bytes, so that a block is one or two lines of the cache.
_ENTRY = np.dtype([("place", np.int32), ("weight", np.float32)])


class Transitions:
    """Rows of weights over the places of a home, one per home and description, kept sparse.

    A row has some five positive weights among 64 places. They are its entries, in the order of
    the places, and fall into blocks: the entries of a block of neighbouring places, such as those
    of a room. An object moves within a block, a new one is put anywhere in the row. Block b has the
    entries bound[b]..bound[b + 1] - 1, and row r the blocks r B..(r + 1) B - 1.

    Attributes:
        num_place_codes: of the largest home, P.

    Source: algorithm 1, section 4.1; docs/design.md, rulings 2 and 6.
    """

    def __init__(self, place_block: np.ndarray, places_per_furniture: int) -> None:
        """Start without rows.

        Args:
            place_block: block of every place of each home, ascending from 0, (H, P); what it says
                beyond the places of a home is never read.
            places_per_furniture: place p belongs to furniture p // places_per_furniture.
        """
        self.num_place_codes = place_block.shape[1]
        # Homes share a few layouts: read from the cache, unlike a row of blocks for each home.
        self._place_block, layout = np.unique(place_block, axis=0, return_inverse=True)
        self._layout_of_home = layout.reshape(-1)
        self._num_blocks = int(place_block.max()) + 1  # B
        self._place_furniture = np.arange(self.num_place_codes) // places_per_furniture
        self._entries = Table({"entry": _ENTRY})
        self._bounds = Table({"bound": np.int64})  # where each block starts, and an end
        self._bounds.append(1)

    def append(
        self, homes: np.ndarray, rows: np.ndarray, places: np.ndarray, weights: np.ndarray
    ) -> np.ndarray:
        """Add a row for each of n homes; return their numbers, (n,).

        Weights (k,), non-negative, are of rows 0..n - 1, ascending, and of places, ascending within
        a row.
        """
        layouts = self._layout_of_home[homes]
        entry, ends = list_entries(
            rows, places, weights, layouts, self._place_block, self._num_blocks
        )
        first = (self._bounds.num_rows - 1) // self._num_blocks
        self._bounds.append(len(ends), bound=self._entries.num_rows + ends)
        self._entries.append(len(entry), entry=entry)
        return np.arange(first, first + len(homes))

    def read(self, rows: np.ndarray) -> np.ndarray:
        """Return rows (n,) as float32 (n, P); zeros for row -1."""
        dense = np.zeros((len(rows), self.num_place_codes), dtype=np.float32)
        known = np.flatnonzero(rows >= 0)
        start = self._bounds["bound"][rows[known] * self._num_blocks]
        count = self._bounds["bound"][(rows[known] + 1) * self._num_blocks] - start
        entry = self._entries["entry"][concatenate_ranges(start, count)]
        dense[np.repeat(known, count), entry["place"]] = entry["weight"]
        return dense

    def sample_moves(
        self, rows: np.ndarray, homes: np.ndarray, places: np.ndarray, uniform: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Draw where objects move to: other furniture of the same block.

        `can_leave` must hold where they are. All arguments are (n,), and so are the new places, and
        whether they can move on from there.
        """
        start, end = self._find_blocks(rows, homes, places)
        return self._draw(rows, homes, start, end, self._place_furniture[places], uniform)

    def sample_places(
        self, rows: np.ndarray, homes: np.ndarray, uniform: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Draw where n new objects are put, anywhere in their rows (n,); see `sample_moves`."""
        bound = self._bounds["bound"]
        first = rows.astype(np.int64) * self._num_blocks
        start, end = bound[first], bound[first + self._num_blocks]
        return self._draw(rows, homes, start, end, np.full(len(rows), -1), uniform)

    def _draw(
        self,
        rows: np.ndarray,
        homes: np.ndarray,
        start: np.ndarray,
        end: np.ndarray,
        avoid: np.ndarray,
        uniform: np.ndarray,
    ) -> tuple[np.ndarray, np.ndarray]:
        entry, furniture = self._entries["entry"], self._place_furniture
        found = draw_places(entry, start, end, furniture, avoid, uniform)
        return found, self.can_leave(rows, homes, found)

    def can_leave(self, rows: np.ndarray, homes: np.ndarray, places: np.ndarray) -> np.ndarray:
        """Return whether objects at places (n,) have other furniture to move to, bool (n,).

        The places may have weight zero themselves.
        """
        bounds = self._find_blocks(rows, homes, places)
        furniture = self._place_furniture[places]
        return find_others(self._entries["entry"], *bounds, self._place_furniture, furniture)

    def _find_blocks(
        self, rows: np.ndarray, homes: np.ndarray, places: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the first entry of the block of each place, and the end of it, (n,) each."""
        block = rows.astype(np.int64) * self._num_blocks
        block += self._place_block[self._layout_of_home[homes], places]
        return self._bounds["bound"][block], self._bounds["bound"][block + 1]


@kernel
def list_entries(
    rows: np.ndarray,
    places: np.ndarray,
    weights: np.ndarray,
    layouts: np.ndarray,
    place_block: np.ndarray,
    num_blocks: int,
) -> tuple[np.ndarray, np.ndarray]:
    """List the positive weights as entries, and how many come before each block ends, (n * B,).

    Rows, places and weights are those of `Transitions.append`; `layouts` (n,) are those of the
    rows, and `place_block` (L, P) has the block of every place in each layout.
    """
    entry = np.empty(len(rows), dtype=_ENTRY)
    ends = np.empty(len(layouts) * num_blocks, dtype=np.int64)
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
    return entry[:count], ends


@kernel
def draw_places(
    entry: np.ndarray,
    start: np.ndarray,
    end: np.ndarray,
    furniture: np.ndarray,
    avoid: np.ndarray,
    uniform: np.ndarray,
) -> np.ndarray:
    """Draw one of the entries start..end - 1 of each of n ranges in proportion to its weight.

    Places, int32 (n,); none at the furniture `avoid` (n,). `furniture` is that of every place (P,).
    """
    # Ask for the memory of all ranges at once, instead of range after range: a draw takes 73 ns so
    # instead of 220 (`benchmarks/evolve.py`). No weight is negative; the compiler cannot know.
    touched = np.float32(0)
    for i in range(len(start)):
        touched += entry[min(start[i], len(entry) - 1)].weight + entry[end[i] - 1].weight
    drawn = np.full(len(start), -1, dtype=np.int32)
    for i in range(len(start) if touched >= 0 else 0):
        total = np.float32(0)
        for j in range(start[i], end[i]):
            if furniture[entry[j].place] != avoid[i]:
                total += entry[j].weight
        target = uniform[i] * total
        passed = np.float32(0)
        for j in range(start[i], end[i]):
            if furniture[entry[j].place] != avoid[i]:
                drawn[i] = entry[j].place  # rounding can push the target onto the total: the last
                passed += entry[j].weight
                if passed > target:
                    break
    return drawn


@kernel
def find_others(
    entry: np.ndarray,
    start: np.ndarray,
    end: np.ndarray,
    furniture: np.ndarray,
    current: np.ndarray,
) -> np.ndarray:
    """Tell which ranges of entries have some at other furniture than `current`, bool (n,)."""
    has_others = np.zeros(len(start), dtype=np.bool_)
    for i in range(len(start)):
        for j in range(start[i], end[i]):
            if furniture[entry[j].place] != current[i]:
                has_others[i] = True
                break
    return has_others
