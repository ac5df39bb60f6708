"""Command line: `python -m nep.bench --help`."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib import import_module

from sgm.messages import shorten
from simulator.command_line import one_line_errors
from simulator.process import run_main

# What plays each, and what its table is of; imported when it is asked for.
SUITES = {
    "any_home": ("nep.bench.suites.any_home", "networks and policies in every kind of home"),
    "recorded": ("nep.bench.suites.recorded", "networks and policies in recorded homes"),
    "own_home": ("nep.bench.suites.own_home", "what the looks of a home gain there"),
    "paper": ("nep.bench.suites.paper", "the tables and the figure of the paper"),
    "temporal": ("nep.bench.suites.temporal", "temporal graph networks"),
    "igridson": ("nep.bench.suites.igridson", "searches in the home on a grid"),
    "searches": ("tools.searches.__main__", "how soon searches find things; in a checkout"),
    "elsewhere": (
        "tools.elsewhere.__main__",
        "what finders know is out; in a checkout",
    ),
    "claims": ("tools.claims.__main__", "what the paper claims; in a checkout"),
}


def main(arguments: Sequence[str] | None = None) -> object:
    """Run the suite that the first argument names, with the others.

    Returns:
        what the suite returns; 2 if there is none of this name.
    """
    arguments = sys.argv[1:] if arguments is None else arguments
    if arguments and arguments[0] in ("-h", "--help"):
        lines = [f"  {name:11} {about}" for name, (_, about) in SUITES.items()]
        print("\n".join(["usage: python -m nep.bench SUITE ...", "", *lines]))
        print("\nSUITE is one of these, or module:main of your own.")
        return 0
    name = arguments[0] if arguments else "none"
    module, _, function = name.partition(":")
    if name in SUITES:
        module, function = SUITES[name][0], "main"
    if not function:
        names = ", ".join(SUITES)
        print(f"error: suite must be one of {names}, got {shorten(name)}.", file=sys.stderr)
        return 2
    with one_line_errors(status=2):
        try:
            run = getattr(import_module(module), function)
        except (ImportError, AttributeError) as error:
            raise ValueError(
                f"suite {name} must be found, got {error}. Run it where {module} is, a checkout."
            ) from error
    return run(arguments[1:])


if __name__ == "__main__":
    run_main(main)
