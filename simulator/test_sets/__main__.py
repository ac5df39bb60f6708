"""Frozen test homes: `python -m simulator.test_sets list`, `show NAME`, `check [NAME ...]`."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import asdict

from simulator.command_line import choose, make_parser, parse
from simulator.process import run_main
from simulator.test_sets.test_sets import find_test_set, load_test_sets

PROG = "python -m simulator.test_sets"


def list_sets(arguments: Sequence[str]) -> int:
    """List the sets."""
    parse(make_parser(f"{PROG} list", "List the sets."), arguments)
    for name, test_set in load_test_sets().items():
        print(f"{name}: {test_set.title}, {test_set.num_homes} homes x {test_set.steps} steps")
    return 0


def show(arguments: Sequence[str]) -> int:
    """Print a set as JSON: all that a paper has to cite."""
    parser = make_parser(f"{PROG} show", "Print a set as JSON: all that a paper has to cite.")
    parser.add_argument("name", help="of the set")
    print(json.dumps(asdict(find_test_set(parse(parser, arguments).name)), indent=1))
    return 0


def check(arguments: Sequence[str]) -> int:
    """Make the homes and compare their checksums."""
    parser = make_parser(f"{PROG} check", "Make the homes and compare their checksums.")
    parser.add_argument("names", nargs="*", default=[], help="of sets; all if left out")
    names = parse(parser, arguments).names or [*load_test_sets()]
    num_wrong = 0
    for test_set in [find_test_set(name) for name in names]:
        found = test_set.compute_checksums()
        wrong = [part for part, value in test_set.checksums.items() if found[part] != value]
        num_wrong += bool(wrong)
        print(f"{test_set.name}: {'differs in ' + ', '.join(wrong) if wrong else 'the same homes'}")
    if num_wrong:
        print(
            "error: homes must be those of the set, got others. Scores in them do not compare "
            "with those of others.",
            file=sys.stderr,
        )
    return 1 if num_wrong else 0


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line."""
    commands = {"list": list_sets, "show": show, "check": check}
    return choose(PROG, commands, arguments)


if __name__ == "__main__":
    run_main(main)
