"""A check that layers of attention share."""

from __future__ import annotations


def check_heads(owner: str, heads: int, units: int) -> None:
    """Check that units can be shared out among the heads.

    Args:
        owner: the layer, for the error.
        heads: how many there are.
        units: width of a node, all heads together.

    Raises:
        ValueError: if not.
    """
    if heads < 1 or units % heads:
        raise ValueError(
            f"heads of {owner} must divide its units, got {heads} heads for {units} units. Choose "
            "for instance 1, 2 or 4 heads for 64 units."
        )
