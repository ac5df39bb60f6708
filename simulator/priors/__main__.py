"""Command line: `python -m simulator.priors build | from-trace | show | check | compare`."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from simulator.priors.compare import compare_priors
from simulator.priors.prior_check import find_problems
from simulator.priors.prior_graph import PriorGraph, parse_json
from simulator.priors.sources.build import DEFAULT_SOURCES, SOURCES, build_from_sources
from simulator.priors.sources.merge import BuildOptions
from simulator.priors.sources.procthor_databases import NUM_HOUSES


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command.

    Returns:
        the exit status: 0 if all is well, 1 on bad input.
    """
    options = _make_parser().parse_args(arguments)
    commands = {
        "build": _build, "from-trace": _count_traces, "show": _show, "check": _check,
        "compare": _compare,
    }  # fmt: skip
    try:
        return commands[options.command](options)
    except (ValueError, OSError, ModuleNotFoundError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 1


def _make_parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m simulator.priors", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)

    build = commands.add_parser(
        "build",
        help="count data sets and write a prior file",
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog="sources:\n" + "\n".join(f"  {name:13} {text}" for name, text in SOURCES.items()),
    )
    build.add_argument(
        "--source",
        action="append",
        metavar="NAME[=PATH]",
        help="a source; repeat it for more, the first wins where two know the same relation "
        f"(default: {' '.join(DEFAULT_SOURCES)})",
    )
    build.add_argument("--out", type=Path, default=Path("prior.json"), help="default: %(default)s")
    build.add_argument(
        "--num_homes", type=int, default=NUM_HOUSES, help="symbolic houses to sample"
    )
    build.add_argument("--seed", type=int, default=0, help="of the symbolic houses")
    build.add_argument("--normalise", choices=("sum", "max"), default="sum")
    build.add_argument(
        "--scope",
        choices=("house", "room"),
        default="house",
        help="normalise an object's weights over the house, or within each room",
    )
    build.add_argument("--coarse", action="store_true", help="leave rooms out of the placements")
    build.add_argument("--min-edges", type=int, default=3, help="drop emptier furniture")
    build.add_argument(
        "--min-places", type=int, default=2, help="drop objects from rooms with fewer"
    )
    build.add_argument("--skip-bad", action="store_true", help="report bad rows and go on")

    traces = commands.add_parser("from-trace", help="count recorded homes and write a prior file")
    traces.add_argument("traces", nargs="+", metavar="DIR", help="traces, or folders of traces")
    traces.add_argument("--out", type=Path, default=Path("prior.json"), help="default: %(default)s")
    traces.add_argument(
        "--step-seconds",
        type=float,
        help="length of a time step; an hour, or what the homes were simulated with",
    )

    show = commands.add_parser("show", help="print a prior and draw it")
    show.add_argument("file", nargs="?", help="prior file (default: the shipped one)")
    show.add_argument("--room", help="only this room")
    show.add_argument("--object", help="only this object type")
    show.add_argument("--top", type=int, default=6, help="objects listed per furniture")
    show.add_argument(
        "--out",
        type=Path,
        default=Path("prior.png"),
        help="picture of the graph; the heat map is written beside it (default: %(default)s)",
    )
    show.add_argument("--no-picture", action="store_true", help="print the table alone")

    check = commands.add_parser("check", help="report every problem of a prior file")
    check.add_argument("file")

    compare = commands.add_parser("compare", help="show how two priors differ")
    compare.add_argument("a", help="prior file, or `default`")
    compare.add_argument("b", help="prior file, or `default`")
    compare.add_argument("--top", type=int, default=10, help="differences listed")
    return parser


def _build(options: argparse.Namespace) -> int:
    def report_progress(done: int) -> None:
        if sys.stderr.isatty():
            print(f"\r{done}/{options.num_homes} houses", end="", file=sys.stderr, flush=True)

    prior, report, counts = build_from_sources(
        tuple(options.source or DEFAULT_SOURCES),
        options=BuildOptions(
            normalise=options.normalise,
            scope=options.scope,
            coarse=options.coarse,
            min_edges=options.min_edges,
            min_places=options.min_places,
        ),
        num_houses=options.num_homes,
        seed=options.seed,
        skip_bad=options.skip_bad,
        progress=report_progress,
    )
    for source in counts:
        print(source.summarise())
    print(report.summarise())
    prior.save(options.out)
    print(f"{options.out}: {summarise_prior(prior)}")
    return 0


def _count_traces(options: argparse.Namespace) -> int:
    # Loaded when needed: the other commands do without the simulator.
    from simulator.trace.count_prior import count_prior
    from simulator.trace.source import check_step_seconds
    from simulator.trace.trace import find_traces, load_trace

    check_step_seconds(options.step_seconds)
    traces = [load_trace(folder) for folder in find_traces(options.traces)]
    prior, left_out = count_prior(traces, options.step_seconds)
    for line in left_out:
        print(f"left out: {line}")
    prior.save(options.out)
    print(f"{options.out}: {summarise_prior(prior)}")
    return 0


def summarise_prior(prior: PriorGraph) -> str:
    """Sizes of a prior, in one line."""
    pairs = {(row.room, row.object) for row in prior.placements}
    places = {(row.room, row.object, row.furniture) for row in prior.placements}
    return (
        f"{len(prior.rooms)} rooms, {len(prior.furniture)} furniture nodes, "
        f"{len(prior.objects)} objects, {len(prior.placements)} placements, "
        f"{len(places) / len(pairs):.1f} furniture types per (room, object), "
        f"checksum {prior.checksum[:12]}"
    )


def _show(options: argparse.Namespace) -> int:
    from simulator.priors.show import print_prior, select_rows

    prior = _load(options.file or "default")
    placements = select_rows(prior, room=options.room, label=options.object)
    print_prior(prior, placements, room=options.room, label=options.object, top=options.top)
    if not options.no_picture:
        from simulator.priors.draw import draw_graph, draw_heat_map

        heat_map = options.out.with_name(f"{options.out.stem}-heat{options.out.suffix or '.png'}")
        draw_graph(prior, placements, options.out, room=options.room)
        draw_heat_map(prior, placements, heat_map, room=options.room)
        print(f"pictures: {options.out}, {heat_map}")
    return 0


def _check(options: argparse.Namespace) -> int:
    text = Path(options.file).read_text(encoding="utf-8")
    data = parse_json(text, where=options.file)
    problems = list(find_problems(data))
    for problem in problems:
        print(f"{options.file}: {problem}")
    if problems:
        print(f"{len(problems)} problems", file=sys.stderr)
        return 1
    prior = PriorGraph.from_dict(data, where=options.file)
    print(f"{options.file}: {summarise_prior(prior)}")
    noted = prior.metadata.get("checksum")
    if noted is not None and noted != prior.checksum:
        print("note: edited since it was built (metadata.checksum differs)")
    return 0


def _compare(options: argparse.Namespace) -> int:
    a, b = _load(options.a), _load(options.b)
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


def _load(file: str) -> PriorGraph:
    return PriorGraph.default() if file == "default" else PriorGraph.load(file)


if __name__ == "__main__":
    sys.exit(main())
