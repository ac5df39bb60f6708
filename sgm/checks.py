"""Checks of values that many settings share."""

from __future__ import annotations

import sys
from collections.abc import Collection, Iterable
from numbers import Integral, Real
from typing import Any, TypeGuard, TypeVar

from sgm.messages import shorten

Value = TypeVar("Value")
MOST_COST = 1e100  # of a way or a look: sums of many are finite


def is_number(value: object) -> TypeGuard[float]:
    """Tell whether a value that any caller may have given is a number; nan is one."""
    return isinstance(value, Real) and not isinstance(value, bool)


def is_finite(value: object) -> TypeGuard[float]:
    """Tell whether a value is a number of which there is a finite float; 10**400 is none."""
    return is_number(value) and -sys.float_info.max <= value <= sys.float_info.max


def check_kind(name: str, value: object, expected: type, hint: str) -> None:
    """Raise TypeError, which ends with a hint, unless a value is of the type expected."""
    if not isinstance(value, expected):
        raise TypeError(f"{name} must be a {expected.__name__}, got {shorten(value)}. {hint}")


def read_optional(name: str, value: Any, expected: type[Value], hint: str) -> Value | None:
    """Return a value of the type expected, or None; else raises TypeError, as `check_kind`."""
    if value is not None:
        check_kind(name, value, expected, hint)
    return value


def read_all(name: str, values: Any, expected: type[Value], hint: str) -> list[Value]:
    """Return values of the type expected; else raises TypeError, which ends with a hint."""
    read = list(values) if isinstance(values, Iterable) else None
    wrong = (
        [values] if read is None else [value for value in read if not isinstance(value, expected)]
    )
    if read is None or wrong:
        raise TypeError(
            f"{name} must hold {expected.__name__} objects, got {shorten(wrong[0])}. {hint}"
        )
    return read


def check_at_least(least: int, **values: float | None) -> None:
    """Check lower bounds of numbers by the name of their setting; None for one that was left out.

    Raises:
        ValueError: if one is below the bound; names it.
    """
    for name, value in values.items():
        if value is not None and not value >= least:  # nan is below every bound
            raise ValueError(f"{name} must be at least {least}, got {shorten(value)}. Raise it.")
        if isinstance(value, int) and not is_finite(value):
            raise ValueError(f"{name} must be below 1e308, got {shorten(value)}. Lower it.")


def check_at_most(most: int, **values: float) -> None:
    """Check upper bounds of numbers by the name of their setting.

    Raises:
        ValueError: if one is above the bound; names it.
    """
    for name, value in values.items():
        if not value <= most:
            raise ValueError(f"{name} must be at most {most}, got {shorten(value)}. Lower it.")


def check_shares(**values: object) -> None:
    """Check shares and probabilities by the name of their setting.

    Raises:
        ValueError: if one is no number in [0, 1]; names it.
    """
    for name, value in values.items():
        if not is_number(value) or not 0 <= value <= 1:
            raise ValueError(
                f"{name} must lie in [0, 1], got {shorten(value)}. Give a share or probability."
            )


def check_choice(name: str, value: object, choices: Collection[str]) -> None:
    """Raise ValueError unless a value is one of some choices; names them."""
    if value not in choices:
        known = ", ".join(choices)
        raise ValueError(
            f"{name} must be one of {known}, got {shorten(value)}. Choose one of these."
        )


def check_seed(seed: int) -> None:
    """Raise ValueError unless a seed is one that numpy takes."""
    if not isinstance(seed, Integral) or isinstance(seed, bool) or seed < 0:
        raise ValueError(f"seed must be non-negative, got {shorten(seed)}. Choose 0 or more.")
