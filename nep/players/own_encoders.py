"""Encoders from outside the package: imported because the caller names their module."""

from __future__ import annotations

import importlib
from collections.abc import Sequence

from sgm.messages import shorten


def import_encoders(modules: Sequence[str]) -> None:
    """Import modules that define encoders, so that networks made of them can be loaded.

    A checkpoint or an exported folder never makes us import what it names.

    Raises:
        ValueError: if there is no such module.
    """
    for name in modules:
        try:
            importlib.import_module(name)
        except (ImportError, TypeError, ValueError) as error:  # the last two of ".." or ""
            raise ValueError(
                f"encoders must be modules that can be imported, got {shorten(name)} ({error}). "
                "Put their folder on PYTHONPATH."
            ) from error
