"""Named random streams: one independent generator per (seed, split, house, purpose)."""

from __future__ import annotations

import zlib
from collections.abc import Sequence

import numpy as np

from simulator.grouped import compute_rank_in_group

# Houses of different splits never share a stream, whatever their index.
SPLITS = ("train", "val", "test")

_BLOCK_NUMBERS = 4096  # drawn at once per house: one call of the generator, 32 KB
_MOST_BLOCK_ROWS = 256
_MANY_ROWS = 128  # from here on, sums over a row advance in all rows together


class UniformStream:
    """Rows of uniform numbers for many houses, each house from its own generator.

    A house's n-th row is the same whatever other houses are drawn beside it.
    """

    def __init__(self, generators: Sequence[np.random.Generator], width: int) -> None:
        self._generators = generators
        self._num_rows = min(max(_BLOCK_NUMBERS // max(width, 1), 1), _MOST_BLOCK_ROWS)
        self._buffer = np.empty((len(generators), self._num_rows, width))
        self._cursor = np.full(len(generators), self._num_rows)

    def next(self) -> np.ndarray:
        """Return the next row of every house, (H, width); valid until the next call."""
        if self._cursor.max(initial=0) >= self._num_rows:
            self._refill()
        cursor = int(self._cursor[0])
        if (self._cursor == cursor).all():
            rows = self._buffer[:, cursor]
        else:
            rows = self._buffer[np.arange(len(self._cursor)), self._cursor]
        self._cursor += 1
        return rows

    def read_last(self, houses: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """Return numbers (n,) of the rows that `next` gave last."""
        row = houses * self._num_rows + (self._cursor[houses] - 1)
        return self._buffer.ravel().take(row * self._buffer.shape[2] + columns)

    def take(self, houses: np.ndarray) -> np.ndarray:
        """Return one fresh row per entry of `houses` (n,), ascending; -> (n, width)."""
        blocks = self._buffer.reshape(-1, self._buffer.shape[2])
        position = self._cursor[houses] + compute_rank_in_group(houses)
        self._cursor += np.bincount(houses, minlength=len(self._cursor))
        block = houses * self._num_rows
        rows = blocks.take(block + np.minimum(position, self._num_rows - 1), axis=0)
        todo = np.flatnonzero(position >= self._num_rows)
        while len(todo):
            self._refill()
            position[todo] -= self._num_rows
            ready = todo[position[todo] < self._num_rows]
            rows[ready] = blocks[block[ready] + position[ready]]
            todo = todo[position[todo] >= self._num_rows]
        return rows

    def _refill(self) -> None:
        """Draw a new block for every house that has used up its own."""
        for house in np.flatnonzero(self._cursor >= self._num_rows).tolist():
            self._generators[house].random(out=self._buffer[house])
            self._cursor[house] -= self._num_rows


class Streams:
    """The named random streams of H houses.

    Adding a draw to one stream changes no other; a house's numbers do not depend on which
    houses are simulated beside it, so any number of workers gives the same bytes.
    """

    def __init__(self, seed: int, split: str, houses: Sequence[int]) -> None:
        """Create streams lazily for the given houses.

        Args:
            seed: experiment seed, non-negative.
            split: "train", "val" or "test".
            houses: house numbers within the split, (H,).

        Raises:
            ValueError: if the seed, the split or a house number is out of range.
        """
        if seed < 0:
            raise ValueError(f"seed must be non-negative, got {seed}. Choose 0 or more.")
        if split not in SPLITS:
            raise ValueError(
                f"split must be one of {', '.join(SPLITS)}, got {split!r}. Choose one of these."
            )
        if len(houses) < 1 or min(houses) < 0:
            raise ValueError(
                f"houses must be one or more non-negative numbers, got {list(houses)[:5]}. "
                "Ask for at least one house."
            )
        self.seed = seed
        self.split = split
        self.houses = tuple(int(house) for house in houses)
        self._streams: dict[str, UniformStream] = {}

    def generator(self, purpose: str, position: int) -> np.random.Generator:
        """Return a fresh generator for one purpose of the house at `position`."""
        key = (SPLITS.index(self.split), self.houses[position], zlib.crc32(purpose.encode()))
        return np.random.Generator(
            np.random.PCG64(np.random.SeedSequence(self.seed, spawn_key=key))
        )

    def sample_once(self, purpose: str, *shape: int) -> np.ndarray:
        """Draw one array of uniforms per house from the start of a stream, (H, *shape)."""
        return np.stack([self.generator(purpose, i).random(shape) for i in range(len(self.houses))])

    def rows(self, purpose: str, width: int) -> UniformStream:
        """Return the row stream of a purpose; a purpose keeps one width for its lifetime."""
        if purpose not in self._streams:
            generators = [self.generator(purpose, i) for i in range(len(self.houses))]
            self._streams[purpose] = UniformStream(generators, width)
        return self._streams[purpose]


def sample_categorical(weights: np.ndarray, uniform: np.ndarray) -> np.ndarray:
    """Draw one index per row in proportion to non-negative weights.

    Args:
        weights: (n, m), each row with a positive sum.
        uniform: (n,) in [0, 1).

    Returns:
        (n,) indices; an index of weight zero is never returned.
    """
    cumulative = _accumulate(weights)
    is_past = cumulative > uniform * cumulative[-1]
    index = is_past.argmax(axis=0)
    # Rounding can push the target onto the total: fall back to the last positive weight.
    beyond = np.flatnonzero(~is_past[-1])
    if len(beyond):
        index[beyond] = weights.shape[1] - 1 - np.argmax(weights[beyond, ::-1] > 0, axis=1)
    return index


def _accumulate(weights: np.ndarray) -> np.ndarray:
    """Return the cumulative sums of every row, (n, m) -> (m, n).

    numpy's own take one addition after another, 5 ns each; here those of all rows go together,
    in the same order within a row, so that the sums are equal to the last bit.
    """
    if len(weights) < _MANY_ROWS or weights.dtype.kind != "f":
        return np.cumsum(weights, axis=1).T
    cumulative = np.empty(weights.shape[::-1], dtype=weights.dtype)
    cumulative[0] = weights[:, 0]
    for column in range(1, weights.shape[1]):
        np.add(cumulative[column - 1], weights[:, column], out=cumulative[column])
    return cumulative


def sample_best(scores: np.ndarray, uniform: np.ndarray) -> np.ndarray:
    """Return the index of the highest score of each row, ties at random, (n, m), (n,) -> (n,).

    A row of -inf alone is a tie of all.
    """
    is_best = scores == scores.max(axis=1, keepdims=True)
    return sample_categorical(is_best.astype(float), uniform)
