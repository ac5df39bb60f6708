"""How much of a furniture node a look had in view, of both relations or of each."""

from __future__ import annotations

from collections.abc import Mapping
from numbers import Real
from typing import Any, TypeAlias

from sgm.memory.sighting import RELATIONS, read_relation
from sgm.messages import shorten

# One share for both relations, or one of "in" and one of "onTop".
Coverage: TypeAlias = float | tuple[float, float]


def read_coverage(coverage: Any, place: str) -> Coverage:
    """Return which share of a furniture node was in view, of a number or of numbers by relation.

    A relation that is left out was not in view. What is no share above 0 raises ValueError.
    """
    if not isinstance(coverage, Mapping):
        return read_share("coverage", coverage, place)
    shares = dict.fromkeys(RELATIONS, 0.0)
    for relation, share in coverage.items():
        if not isinstance(share, Real) or not 0 <= float(share) <= 1:
            raise ValueError(
                f"coverage of {shorten(relation)} must lie in [0, 1], got {shorten(share)} at "
                f"{place}. Give the share in view."
            )
        shares[read_relation(relation)] = float(share)
    inside, on_top = shares["in"], shares["onTop"]
    if inside == on_top:
        return read_share("coverage", inside, place)
    return inside, on_top


def parse_coverage(data: Any) -> Coverage:
    """Return the coverage of a file, a number or a list of two; ValueError or TypeError if none."""
    if isinstance(data, list):
        return read_coverage(dict(zip(RELATIONS, data, strict=True)), "a look")
    return float(data)


def split_coverage(coverage: Coverage) -> tuple[float, float]:
    """Return the shares of "in" and "onTop"."""
    return coverage if isinstance(coverage, tuple) else (coverage, coverage)


def read_share(name: str, share: Any, place: str) -> float:
    """Return a share above 0; raises ValueError for anything else."""
    if not isinstance(share, Real) or not 0 < float(share) <= 1:
        raise ValueError(
            f"{name} must be above 0 and at most 1, got {shorten(share)} at {place}. Give the "
            "share in view, or leave out the look."
        )
    return float(share)
