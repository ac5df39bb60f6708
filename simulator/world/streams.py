"""Named random streams: one independent generator per (seed, split, home, purpose)."""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from sgm.checks import check_choice, check_seed
from simulator.kernel import kernel

# Homes of different splits never share a stream, whatever their index.
SPLITS = ("train", "val", "test")

_MANY_ROWS = 128  # from here on, sums over a row advance in all rows together

# Uniform numbers of PCG64, numpy's generator, with access to any number of a row. A state s, 128
# bits, is followed by s * M + i: M is the same for all generators, the increment i their own.
# k states on it is s * M^k + (1 + M + ... + M^(k-1)) * i, so that a number far ahead costs two
# multiplications. States, increments and jumps are held as pairs of 64 bits, the upper first.
# Source: O'Neill, "PCG: A Family of Simple Fast Space-Efficient Statistically Good Algorithms for
# Random Number Generation" (2014), PCG-XSL-RR-128/64; uniform numbers as
# `numpy.random.Generator.random` makes them.
_HIGH, _LOW = np.uint64(0x2360ED051FC65DA4), np.uint64(0x4385DF649FCCF645)  # M
_ZERO, _ONE = np.uint64(0), np.uint64(1)
_HALF, _MASK = np.uint64(32), np.uint64(0xFFFFFFFF)


@kernel
def _multiply_add(
    a: np.uint64, b: np.uint64, c: np.uint64, d: np.uint64, e: np.uint64, f: np.uint64
) -> tuple[np.uint64, np.uint64]:
    """Return (a, b) * (c, d) + (e, f) modulo 2^128: numba has no integers of 128 bits."""
    b_high, b_low, d_high, d_low = b >> _HALF, b & _MASK, d >> _HALF, d & _MASK
    cross = b_high * d_low + (b_low * d_low >> _HALF)
    other = b_low * d_high + (cross & _MASK)
    high = b_high * d_high + (cross >> _HALF) + (other >> _HALF)
    low = b * d + f
    carry = np.uint64(low < f)
    return high + a * d + b * c + e + carry, low


@kernel
def _make_uniform(high: np.uint64, low: np.uint64) -> float:
    """Make a number in [0, 1) of a state: 53 of its bits, rotated by its upper six."""
    turn = high >> np.uint64(58)
    bits = high ^ low
    bits = (bits >> turn) | (bits << ((np.uint64(64) - turn) & np.uint64(63)))
    return np.int64(bits >> np.uint64(11)) * 2.0**-53


@kernel
def make_jumps(width: int) -> np.ndarray:
    """Return M^k and 1 + M + ... + M^(k-1) for k = 0..width, (width + 1, 4)."""
    jumps = np.empty((width + 1, 4), dtype=np.uint64)
    high, low, sum_high, sum_low = _ZERO, _ONE, _ZERO, _ZERO
    for k in range(width + 1):
        jumps[k, 0], jumps[k, 1], jumps[k, 2], jumps[k, 3] = high, low, sum_high, sum_low
        high, low = _multiply_add(high, low, _HIGH, _LOW, _ZERO, _ZERO)
        sum_high, sum_low = _multiply_add(sum_high, sum_low, _HIGH, _LOW, _ZERO, _ONE)
    return jumps


@kernel
def claim_rows(
    state: np.ndarray, jumps: np.ndarray, widths: np.ndarray, homes: np.ndarray
) -> np.ndarray:
    """Return the state that the row of each of n homes starts from, (n, 4), and go on by one row.

    Args:
        state: state and increment of every home, changed in place, (H, 4).
        jumps: over 0, 1, 2, ... numbers, at least to the widest row, (W + 1, 4).
        widths: numbers in a row of every home, (H,).
        homes: (n,).
    """
    starts = np.empty((len(homes), 4), dtype=np.uint64)
    for i in range(len(homes)):
        home_state, jump = state[homes[i]], jumps[widths[homes[i]]]
        starts[i] = home_state
        step_high, step_low = _multiply_add(
            jump[2], jump[3], home_state[2], home_state[3], _ZERO, _ZERO
        )
        home_state[0], home_state[1] = _multiply_add(
            home_state[0], home_state[1], jump[0], jump[1], step_high, step_low
        )
    return starts


@kernel
def fill_rows(starts: np.ndarray, jump: np.ndarray, counts: np.ndarray, width: int) -> np.ndarray:
    """Return the first number of each row and those that follow by one jump each, (n, width).

    Row i has counts[i] numbers, then nan.
    """
    numbers = np.empty((len(starts), width))
    for i in range(len(starts)):
        start, drawn = starts[i], numbers[i]
        high, low = _multiply_add(start[0], start[1], _HIGH, _LOW, start[2], start[3])
        step_high, step_low = _multiply_add(jump[2], jump[3], start[2], start[3], _ZERO, _ZERO)
        drawn[counts[i] :] = np.nan
        for column in range(counts[i]):
            drawn[column] = _make_uniform(high, low)
            high, low = _multiply_add(high, low, jump[0], jump[1], step_high, step_low)
    return numbers


@kernel
def read_rows(
    starts: np.ndarray, jumps: np.ndarray, rows: np.ndarray, columns: np.ndarray, count: int
) -> np.ndarray:
    """Return the numbers of rows (k,) from columns (k,) on, (k, count)."""
    numbers = np.empty((len(rows), count))
    for i in range(len(rows)):
        start, jump, drawn = starts[rows[i]], jumps[columns[i]], numbers[i]
        step_high, step_low = _multiply_add(jump[2], jump[3], start[2], start[3], _ZERO, _ZERO)
        high, low = _multiply_add(start[0], start[1], jump[0], jump[1], step_high, step_low)
        for turn in range(len(drawn)):
            high, low = _multiply_add(high, low, _HIGH, _LOW, start[2], start[3])
            drawn[turn] = _make_uniform(high, low)
    return numbers


class UniformRows(NamedTuple):
    """Rows of uniform numbers that are worked out when they are read.

    Attributes:
        starts: from `claim_rows`, (n, 4).
        jumps: from `make_jumps`.
        widths: numbers in each row, (n,).
    """

    starts: np.ndarray
    jumps: np.ndarray
    widths: np.ndarray

    def fill(self, every: int = 1) -> np.ndarray:
        """Return every number, or those of columns 0, `every`, 2 `every`, ..., (n, m).

        A row that is narrower than the widest one ends with nan.
        """
        width = len(self.jumps) - 1
        counts = -(-self.widths // every)
        return fill_rows(self.starts, self.jumps[min(every, width)], counts, -(-width // every))

    def read(self, rows: np.ndarray, columns: np.ndarray, count: int = 1) -> np.ndarray:
        """Return the numbers of rows (k,) from columns (k,) on, (k, count)."""
        return read_rows(self.starts, self.jumps, rows, columns, count)


class UniformStream:
    """Rows of uniform numbers for many homes, each home from its own generator.

    A home's n-th row is the same whatever other homes are drawn beside it, and its numbers are
    those that its generator would give one after the other: rows of a home are as wide as the home
    needs, however wide those of others are.
    """

    def __init__(self, generators: Sequence[np.random.Generator], widths: np.ndarray) -> None:
        self._state = np.array([_get_state(rng) for rng in generators], dtype=np.uint64)  # (H, 4)
        self._widths = widths
        self._jumps = make_jumps(int(widths.max()))
        self._homes = np.arange(len(generators))

    def claim(self, homes: np.ndarray | None = None) -> UniformRows:
        """Return one fresh row per entry of `homes`, (n,), or one of every home."""
        homes = self._homes if homes is None else homes
        starts = claim_rows(self._state, self._jumps, self._widths, homes)
        return UniformRows(starts=starts, jumps=self._jumps, widths=self._widths[homes])

    def take(self, homes: np.ndarray | None = None) -> np.ndarray:
        """Claim rows and return their numbers, (n, width); see `UniformRows.fill`."""
        return self.claim(homes).fill()


def _get_state(generator: np.random.Generator) -> tuple[int, ...]:
    """Return the state and the increment of a PCG64, the upper 64 bits of each first."""
    words = generator.bit_generator.state["state"]
    return tuple(word for key in ("state", "inc") for word in divmod(words[key], 1 << 64))


class Streams:
    """The named random streams of H homes.

    Adding a draw to one stream changes no other; a home's numbers do not depend on which
    homes are simulated beside it, so any number of workers gives the same bytes.
    """

    def __init__(self, seed: int, split: str, homes: Sequence[int]) -> None:
        """Create streams lazily for the given homes.

        Args:
            seed: experiment seed, non-negative.
            split: "train", "val" or "test".
            homes: home numbers within the split, (H,).

        Raises:
            ValueError: if the seed, the split or a home number is out of range.
        """
        check_seed(seed)
        check_choice("split", split, SPLITS)
        if len(homes) < 1 or min(homes) < 0:
            raise ValueError(
                f"homes must be one or more non-negative numbers, got {list(homes)[:5]}. "
                "Ask for at least one home."
            )
        self.seed = seed
        self.split = split
        self.homes = tuple(int(home) for home in homes)
        self._streams: dict[str, UniformStream] = {}

    def select(self, homes: Sequence[int]) -> Streams:
        """Return fresh streams of homes of the same seed and split."""
        return Streams(self.seed, self.split, homes)

    def generator(self, purpose: str, position: int) -> np.random.Generator:
        """Return a fresh generator for one purpose of the home at `position`."""
        key = (SPLITS.index(self.split), self.homes[position], zlib.crc32(purpose.encode()))
        return np.random.Generator(
            np.random.PCG64(np.random.SeedSequence(self.seed, spawn_key=key))
        )

    def sample_once(self, purpose: str, *shape: int | np.ndarray) -> np.ndarray:
        """Draw one array of uniforms per home from the start of a stream.

        A length of the array is the same for all homes, or one per home, (H,). Returns (H, *shape)
        of the largest; nan beyond the array of a smaller home.
        """
        count = len(self.homes)
        sizes = np.stack([np.broadcast_to(size, count) for size in shape], axis=1)
        drawn = np.full((count, *sizes.max(axis=0)), np.nan)
        for position, size in enumerate(sizes.tolist()):
            home_numbers = drawn[position][tuple(slice(length) for length in size)]
            home_numbers[...] = self.generator(purpose, position).random(size)
        return drawn

    def rows(self, purpose: str, width: int | np.ndarray) -> UniformStream:
        """Return the row stream of a purpose, `width` numbers in a row, of all homes or each, (H,).

        A purpose keeps its widths for its lifetime.
        """
        if purpose not in self._streams:
            generators = [self.generator(purpose, i) for i in range(len(self.homes))]
            widths = np.array(np.broadcast_to(width, len(self.homes)), dtype=np.int64)
            self._streams[purpose] = UniformStream(generators, widths)
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


def sample_best(scores: np.ndarray, is_open: np.ndarray, uniform: np.ndarray) -> np.ndarray:
    """Return the index of the highest open score of each row, ties at random, (n,).

    Args:
        scores: (n, m); a row without anything above -inf is a tie of all that is open.
        is_open: what may be chosen, bool (n, m); some in each row.
        uniform: (n,) in [0, 1).
    """
    best = np.where(is_open, scores, -np.inf).max(axis=1, keepdims=True)
    return sample_categorical((is_open & (scores == best)).astype(float), uniform)
