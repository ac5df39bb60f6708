"""Command line: `python -m tools.bench --help`."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib import import_module

from sgm.messages import shorten
from simulator.command_line import one_line_errors
from simulator.process import run_main

# What plays each, and what its table is of; imported when it is asked for, in a checkout.
SUITES = {
    "any_home": ("tools.bench.any_home", "networks and policies in every kind of home"),
    "recorded": ("tools.bench.recorded", "networks and policies in recorded homes"),
    "igridson": ("tools.bench.igridson", "searches in the home on a grid"),
    "searches": ("tools.searches.suite", "how soon searches find things"),
    "elsewhere": ("tools.elsewhere.suite", "what finders know is out"),
    "kitchens": ("tools.kitchens.suite", "finders in homes recorded by the minute"),
}


def main(arguments: Sequence[str] | None = None) -> object:
    """Run the suite that the first argument names, with the others.

    Returns:
        what the suite returns; 2 if there is none of this name.
    """
    arguments = sys.argv[1:] if arguments is None else arguments
    if arguments and arguments[0] in ("-h", "--help"):
        lines = [f"  {name:11} {about}" for name, (_, about) in SUITES.items()]
        print("\n".join(["usage: python -m tools.bench SUITE ...", "", *lines]))
        print("\nSUITE is one of these, in a checkout, or module:main of your own.")
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
