"""Uniform numbers of PCG64, numpy's generator, with access to any number of a row.

A state s, 128 bits, is followed by s * M + i: M is the same for all generators, the increment i
their own. k states on it is s * M^k + (1 + M + ... + M^(k-1)) * i, so that a number far ahead costs
two multiplications. States, increments and jumps are held as pairs of 64 bits, the upper first.

Source: O'Neill, "PCG: A Family of Simple Fast Space-Efficient Statistically Good Algorithms for
Random Number Generation" (2014), PCG-XSL-RR-128/64; uniform numbers as
`numpy.random.Generator.random` makes them.
"""

from __future__ import annotations

import numpy as np

from sgm.kernel import kernel

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
        own, jump = state[homes[i]], jumps[widths[homes[i]]]
        starts[i] = own
        step_high, step_low = _multiply_add(jump[2], jump[3], own[2], own[3], _ZERO, _ZERO)
        own[0], own[1] = _multiply_add(own[0], own[1], jump[0], jump[1], step_high, step_low)
    return starts


@kernel
def fill_rows(starts: np.ndarray, jump: np.ndarray, counts: np.ndarray, width: int) -> np.ndarray:
    """Return the first number of each row and those that follow by one jump each, (n, width).

    Row i has counts[i] numbers, then nan.
    """
    numbers = np.empty((len(starts), width))
    for i in range(len(starts)):
        own, row = starts[i], numbers[i]
        high, low = _multiply_add(own[0], own[1], _HIGH, _LOW, own[2], own[3])
        step_high, step_low = _multiply_add(jump[2], jump[3], own[2], own[3], _ZERO, _ZERO)
        row[counts[i] :] = np.nan
        for column in range(counts[i]):
            row[column] = _make_uniform(high, low)
            high, low = _multiply_add(high, low, jump[0], jump[1], step_high, step_low)
    return numbers


@kernel
def read_rows(
    starts: np.ndarray, jumps: np.ndarray, rows: np.ndarray, columns: np.ndarray, count: int
) -> np.ndarray:
    """Return the numbers of rows (k,) from columns (k,) on, (k, count)."""
    numbers = np.empty((len(rows), count))
    for i in range(len(rows)):
        own, jump, row = starts[rows[i]], jumps[columns[i]], numbers[i]
        step_high, step_low = _multiply_add(jump[2], jump[3], own[2], own[3], _ZERO, _ZERO)
        high, low = _multiply_add(own[0], own[1], jump[0], jump[1], step_high, step_low)
        for turn in range(len(row)):
            high, low = _multiply_add(high, low, _HIGH, _LOW, own[2], own[3])
            row[turn] = _make_uniform(high, low)
    return numbers
