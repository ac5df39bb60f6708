"""Random numbers of homes that take as many as they need: SplitMix64, a generator for each.

Source: Steele, Lea and Flood, "Fast Splittable Pseudorandom Number Generators" (OOPSLA 2014),
figure 14.
"""

import math

import numpy as np

from simulator.compiled.kernel import kernel


@kernel
def draw_uniform(random: np.ndarray, home: int) -> float:
    """Draw a number in [0, 1)."""
    random[home] += np.uint64(0x9E3779B97F4A7C15)
    bits = random[home]
    bits = (bits ^ (bits >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    bits = (bits ^ (bits >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    bits = bits ^ (bits >> np.uint64(31))
    return np.int64(bits >> np.uint64(11)) * 2.0**-53


@kernel
def draw_normal(random: np.ndarray, home: int) -> float:
    """Draw a number from the standard normal distribution."""
    radius = math.sqrt(-2 * math.log(1 - draw_uniform(random, home)))
    return radius * math.cos(2 * math.pi * draw_uniform(random, home))


@kernel
def draw_index(random: np.ndarray, home: int, summed: np.ndarray) -> int:
    """Draw an index in proportion to weights that are summed up; -1 if all are zero."""
    total = summed[-1]
    if total <= 0:
        return -1
    mark = np.float32(draw_uniform(random, home) * total)
    found: int = np.searchsorted(summed, mark, side="right")  # type: ignore[assignment]
    while found == len(summed) or summed[found] == (summed[found - 1] if found > 0 else 0):
        found -= 1  # rounding has led beyond the last, or onto an index of weight zero
    return found
