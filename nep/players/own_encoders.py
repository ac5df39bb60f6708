"""Encoders from outside the package: imported because the caller names their module."""

from __future__ import annotations

import argparse
import importlib
from collections.abc import Sequence


def import_encoders(modules: Sequence[str]) -> None:
    """Import modules that define encoders, so that networks made of them can be loaded.

    A checkpoint or an exported folder never makes us import what it names.

    Raises:
        ValueError: if there is no such module.
    """
    for name in modules:
        try:
            importlib.import_module(name)
        except ImportError as error:
            raise ValueError(
                f"encoder_module must be one that can be imported, got {name!r} ({error}). "
                "Put its folder on PYTHONPATH."
            ) from error


def add_encoder_argument(parser: argparse.ArgumentParser) -> None:
    """Add `--encoder_module` to a command line that loads networks."""
    parser.add_argument(
        "--encoder_module",
        action="append",
        default=[],
        metavar="MODULE",
        help="module of an encoder of your own that the network is made of; may be repeated",
    )
