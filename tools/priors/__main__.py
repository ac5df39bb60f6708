"""Command line: `python -m tools.priors --help`."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from sgm.checks import check_at_least
from sgm.files import write_whole
from sgm.prior.prior_graph import PRIOR_HELP, load_prior
from simulator.command_line import choose, make_parser, parse, pick
from simulator.priors.__main__ import summarise_prior
from simulator.process import run_main
from tools.priors.activities import count_activities, make_table
from tools.priors.build import DEFAULT_SOURCES, SOURCES, build_from_sources
from tools.priors.compare import compare_priors
from tools.priors.merge import BuildOptions

PROG = "python -m tools.priors"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command.

    Returns:
        the exit status: 0 if all is well, 1 on bad input.
    """
    return choose(PROG, {"build": build, "activities": count_kinds, "compare": compare}, arguments)


def build(arguments: Sequence[str]) -> int:
    """Count data sets and write a prior file."""
    parser = make_parser(
        f"{PROG} build",
        "Count data sets and write a prior file. Sources: "
        + "; ".join(f"{name}: {text}" for name, text in SOURCES.items()),
    )
    parser.add_argument(
        "--source",
        type=tuple[str, ...],
        default=DEFAULT_SOURCES,
        help="NAME[=PATH] of sources; the first wins where two know the same relation",
    )
    parser.add_argument("--out", type=Path, default=Path("prior.json"))
    parser.add_class_arguments(BuildOptions)
    parser.add_argument("--skip_bad", type=bool, default=False, help="report bad rows and go on")
    options = parse(parser, arguments)
    prior, report, counts = build_from_sources(
        tuple(options.source),
        options=BuildOptions(**pick(options, BuildOptions)),
        skip_bad=options.skip_bad,
    )
    for source in counts:
        print(source.summarise())
    print(report.summarise())
    prior.save(options.out)
    print(f"{options.out}: {summarise_prior(prior)}")
    return 0


def count_kinds(arguments: Sequence[str]) -> int:
    """Count activities of BEHAVIOR and write the table of what people use where."""
    parser = make_parser(
        f"{PROG} activities",
        "Count activities of BEHAVIOR and write the table of what people use where.",
    )
    parser.add_argument("--out", type=Path, required=True, help="the JSON file to write")
    parser.add_argument("--bddl", type=Path | None, help="folder of the package bddl")
    options = parse(parser, arguments)
    kinds, left_out = count_activities(options.bddl)
    write_whole(options.out, (json.dumps(make_table(kinds), indent=1) + "\n").encode())
    for category, counts in kinds.items():
        print(f"{category}: {counts.num_activities} activities, {len(counts.objects)} object types")
    print(f"of no kind: {len(left_out)} ({', '.join(left_out)})")
    return 0


def compare(arguments: Sequence[str]) -> int:
    """Show how two priors differ."""
    parser = make_parser(f"{PROG} compare", "Show how two priors differ.")
    parser.add_argument("a", help=PRIOR_HELP)
    parser.add_argument("b", help=PRIOR_HELP)
    parser.add_argument("--top", type=int, default=10, help="differences listed")
    options = parse(parser, arguments)
    check_at_least(1, top=options.top)
    a, b = load_prior(options.a), load_prior(options.b)
    result = compare_priors(a, b)
    print(f"A {options.a}: {summarise_prior(a)}\nB {options.b}: {summarise_prior(b)}")
    print(
        f"Spearman of P(furniture | room): {result.furniture_correlation:.3f} "
        f"({result.num_furniture} furniture nodes)\n"
        f"Spearman of P(furniture | object, room): {result.placement_correlation:.3f} "
        f"({result.num_placements} places)"
    )
    for name, only in (("A", result.only_a), ("B", result.only_b)):
        for part, names in only.items():
            if names:
                more = f", and {len(names) - options.top} more" if len(names) > options.top else ""
                print(f"only in {name}, {part}: {', '.join(names[: options.top])}{more}")
    for title, differences in (
        ("P(furniture | room)", result.furniture_differences),
        ("P(furniture | object, room)", result.placement_differences),
    ):
        print(f"largest differences of {title}, B - A:")
        for value, name in differences[: options.top]:
            print(f"  {value:+.3f}  {name}")
    return 0


if __name__ == "__main__":
    run_main(main)
