"""Command line: `python -m nep.bench --help`."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib import import_module
from importlib.util import find_spec

from simulator.process import run_main

# Each has a `main`, and is imported when it is asked for.
SUITES = {
    "any_home": "nep.bench.suites.any_home",
    "recorded": "nep.bench.suites.recorded",
    "own_home": "nep.bench.suites.own_home",
    "searches": "nep.bench.suites.searches",
    "elsewhere": "nep.bench.suites.elsewhere",
    "paper": "nep.reproduce",
    "temporal": "nep.temporal",
    "igridson": "nep.igridson",
    "claims": "tools.claims.__main__",
}


def main(arguments: Sequence[str] | None = None) -> object:
    """Run the suite that the first argument names, with the others.

    Returns:
        what the suite returns; 2 if there is none of this name.
    """
    arguments = sys.argv[1:] if arguments is None else arguments
    if arguments and arguments[0] in ("-h", "--help"):
        print("usage: python -m nep.bench SUITE ...\n\n  " + "\n  ".join(SUITES))
        return 0
    if not arguments or arguments[0] not in SUITES:
        found = repr(arguments[0]) if arguments else "none"
        print(f"error: suite must be one of {', '.join(SUITES)}, got {found}.", file=sys.stderr)
        return 2
    module = SUITES[arguments[0]]
    if find_spec(module.partition(".")[0]) is None:
        print(f"error: {arguments[0]} must be run in a checkout, got none.", file=sys.stderr)
        return 2
    return import_module(module).main(arguments[1:])


if __name__ == "__main__":
    run_main(main)
