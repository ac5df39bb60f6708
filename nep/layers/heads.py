"""A check that layers of attention share."""

from __future__ import annotations


def check_heads(owner: str, heads: int, units: int) -> None:
    """Raise ValueError unless the units of a layer can be shared out among its heads."""
    if heads < 1 or units % heads:
        raise ValueError(
            f"heads of {owner} must divide its units, got {heads} heads for {units} units. Choose "
            "for instance 1, 2 or 4 heads for 64 units."
        )
