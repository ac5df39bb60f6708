"""How a function becomes machine code."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar, cast

from numba import njit

Function = TypeVar("Function", bound=Callable[..., object])


def kernel(function: Function) -> Function:
    """Compile a function when it is first called; later processes read the machine code.

    It is kept in `__pycache__` beside the file, else in the user's cache folder of numba
    (`NUMBA_CACHE_DIR`). Where neither can be written, every process compiles for itself. Division
    by zero is numpy's: a check of every divisor would keep loops from being vectorised.
    """
    try:
        return cast("Function", njit(function, cache=True, error_model="numpy"))
    except RuntimeError:  # no folder to keep it in
        return cast("Function", njit(function, error_model="numpy"))
