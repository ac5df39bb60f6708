"""Command line: `python -m simulator.priors --help`; a prior graph as a table in the terminal."""

from __future__ import annotations

import sys
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path

from sgm.checks import check_at_least
from sgm.files import read_file
from sgm.messages import needed_to, shorten
from sgm.prior.prior_check import find_problems
from sgm.prior.prior_graph import PRIOR_HELP, Placement, PriorGraph, load_prior, parse_prior
from simulator.command_line import choose, make_parser, parse
from simulator.priors.language import TEMPERATURE, make_prompt, make_word_prior, read_filled
from simulator.process import run_main

PROG = "python -m simulator.priors"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command, and return the exit status: 0 if all is well, 1 on bad input."""
    commands = {
        "from-trace": count_traces,
        "show": show,
        "check": check,
        "words": write_words,
        "prompt": print_prompt,
        "filled": write_filled,
    }
    return choose(PROG, commands, arguments)


def count_traces(arguments: Sequence[str]) -> int:
    """Count recorded homes and write a prior file."""
    # Loaded when needed: the other commands do without the simulator.
    from simulator.trace.count_prior import count_prior
    from simulator.trace.source import check_step_seconds
    from simulator.trace.trace import find_traces, load_trace

    parser = make_parser(f"{PROG} from-trace", "Count recorded homes and write a prior file.")
    parser.add_argument("traces", nargs="+", help="traces, or folders of traces")
    parser.add_argument("--out", type=Path, default=Path("prior.json"))
    parser.add_argument(
        "--step_seconds",
        type=float | None,
        help="length of a time step; an hour, or what the homes were simulated with",
    )
    options = parse(parser, arguments)
    check_step_seconds(options.step_seconds)
    traces = [load_trace(folder) for folder in find_traces(options.traces)]
    prior, left_out = count_prior(traces, options.step_seconds)
    for line in left_out:
        print(f"left out: {line}")
    return _save(prior, options.out)


def show(arguments: Sequence[str]) -> int:
    """Print a prior and draw it."""
    parser = make_parser(f"{PROG} show", "Print a prior and draw it.")
    parser.add_argument("file", nargs="?", help=PRIOR_HELP)
    parser.add_argument("--room", type=str | None, help="only this room")
    parser.add_argument("--object", type=str | None, help="only this object type")
    parser.add_argument("--top", type=int, default=6, help="objects listed per furniture")
    parser.add_argument(
        "--out",
        type=Path,
        default=Path("prior.png"),
        help="picture of the graph; the heat map is written beside it",
    )
    parser.add_argument("--picture", type=bool, default=True, help="--no_picture: the table alone")
    options = parse(parser, arguments)
    check_at_least(1, top=options.top)
    prior = load_prior(options.file)
    placements = select_rows(prior, room=options.room, label=options.object)
    print_prior(prior, placements, room=options.room, label=options.object, top=options.top)
    if options.picture:
        from simulator.priors.draw import draw_graph, draw_heat_map

        heat_map = options.out.with_name(f"{options.out.stem}-heat{options.out.suffix or '.png'}")
        draw_graph(prior, placements, options.out, room=options.room)
        draw_heat_map(prior, placements, heat_map, room=options.room)
        print(f"pictures: {options.out}, {heat_map}")
    return 0


def write_words(arguments: Sequence[str]) -> int:
    """Write a prior whose placements come from word vectors alone."""
    parser = make_parser(
        f"{PROG} words",
        "Write a prior whose placements come from word vectors alone: cosines of things with "
        "furniture and rooms. Its rooms, furniture and things are those of --base.",
    )
    parser.add_argument("--out", type=Path, required=True, help="prior file (JSON)")
    parser.add_argument("--base", type=str, default="household", help=PRIOR_HELP)
    parser.add_argument("--temperature", type=float, default=TEMPERATURE, help="of the softmax")
    options = parse(parser, arguments)
    prior = make_word_prior(load_prior(options.base), temperature=options.temperature)
    return _save(prior, options.out)


def print_prompt(arguments: Sequence[str]) -> int:
    """Print what to ask a language model for a table of placements."""
    parser = make_parser(
        f"{PROG} prompt",
        "Print a prompt: a language model that is given it answers with a table that `filled` "
        "reads (docs/priors.md).",
    )
    parser.add_argument("--base", type=str, default="household", help=PRIOR_HELP)
    parser.add_argument(
        "--things", type=Path | None, help="file with a thing a line; those of --base if left out"
    )
    options = parse(parser, arguments)
    things: list[str] = []
    if options.things is not None:
        try:
            lines = read_file(options.things).decode().splitlines()
        except UnicodeDecodeError as error:
            raise ValueError(
                f"things must be UTF-8, a thing a line, got {error} in {options.things}. Save it "
                "again."
            ) from error
        things = [line.strip() for line in lines if line.strip()]
    print(make_prompt(load_prior(options.base), things), end="")
    return 0


def write_filled(arguments: Sequence[str]) -> int:
    """Write a prior from a table that a language model has filled in."""
    parser = make_parser(
        f"{PROG} filled",
        "Write a prior from a table of room, furniture, object, relation and weight, which a "
        "language model or anyone has filled in (`prompt` prints what to ask).",
    )
    parser.add_argument("table", type=Path, help="CSV")
    parser.add_argument("--out", type=Path, required=True, help="prior file (JSON)")
    parser.add_argument("--base", type=str, default="household", help=PRIOR_HELP)
    options = parse(parser, arguments)
    return _save(read_filled(options.table, load_prior(options.base)), options.out)


def _save(prior: PriorGraph, out: Path) -> int:
    prior.save(out)
    print(f"{out}: {summarise_prior(prior)}")
    return 0


def check(arguments: Sequence[str]) -> int:
    """Report every problem of a prior file."""
    parser = make_parser(f"{PROG} check", "Report every problem of a prior file.")
    parser.add_argument("file", help="prior file")
    options = parse(parser, arguments)
    data = parse_prior(read_file(options.file), where=options.file)
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


def select_rows(
    prior: PriorGraph, *, room: str | None = None, label: str | None = None
) -> tuple[Placement, ...]:
    """Placements of one room, one object type, or both.

    Raises:
        ValueError: if the prior has no such room or object; lists what it has.
    """
    if room is not None and room not in prior.rooms:
        raise ValueError(
            f"room must be one of {', '.join(prior.rooms)}, got {shorten(room)}. Choose one."
        )
    labels = [object_type.label for object_type in prior.objects]
    if label is not None and label not in labels:
        close = [other for other in labels if label[:3] in other] or labels
        raise ValueError(
            f"object must be in the prior, got {shorten(label)}. Choose one of {', '.join(close)}."
        )
    return tuple(
        placement
        for placement in prior.placements
        if (room is None or placement.room in (room, None))
        and (label is None or placement.object == label)
    )


def print_prior(
    prior: PriorGraph,
    placements: Sequence[Placement],
    *,
    room: str | None = None,
    label: str | None = None,
    top: int = 6,
) -> None:
    """Print a prior as a table.

    With an object: its places, the likeliest first, with count and source. Without: the furniture
    of the rooms, and on each piece the `top` objects that are most typical of it. The rows are
    those that `select_rows` chose for the room and the object.

    Raises:
        ModuleNotFoundError: if `rich` is not installed.
    """
    with needed_to("show a prior", install="rich"):
        from rich.console import Console
        from rich.table import Table
    table = Table(title="places" if label else "furniture", title_justify="left")
    if label:
        for column in ("room", "furniture", "relation", "prob", "count", "source"):
            table.add_column(column, justify="right" if column in ("prob", "count") else "left")
        for placement in sorted(placements, key=lambda placement: -placement.prob):
            count = "" if placement.count is None else f"{placement.count:g}"
            cells = (
                placement.room or "(any)",
                placement.furniture,
                placement.relation,
                f"{placement.prob:.4f}",
                count,
            )
            table.add_row(*cells, placement.source or "")
    else:
        for column in ("room", "furniture", "prob", "objects", "most typical objects"):
            table.add_column(column, justify="right" if column in ("prob", "objects") else "left")
        on_furniture: dict[tuple[str | None, str], list[Placement]] = defaultdict(list)
        for placement in placements:
            on_furniture[placement.room, placement.furniture].append(placement)
        for node in prior.furniture:
            if room is not None and node.room != room:
                continue
            rows = on_furniture[node.room, node.label] + on_furniture[None, node.label]
            typical = sorted(rows, key=lambda placement: -placement.prob)[:top]
            names = ", ".join(f"{placement.object} {placement.prob:.2f}" for placement in typical)
            number = str(len({placement.object for placement in rows}))
            table.add_row(node.room, node.label, f"{node.prob:.3f}", number, names)
    Console().print(table)


def summarise_prior(prior: PriorGraph) -> str:
    """Sizes of a prior, in one line."""
    pairs = {(placement.room, placement.object) for placement in prior.placements}
    places = {
        (placement.room, placement.object, placement.furniture) for placement in prior.placements
    }
    return (
        f"{len(prior.rooms)} rooms, {len(prior.furniture)} furniture nodes, "
        f"{len(prior.objects)} objects, {len(prior.placements)} placements, "
        f"{len(places) / len(pairs):.1f} furniture types per (room, object), "
        f"checksum {prior.checksum[:12]}"
    )


if __name__ == "__main__":
    run_main(main)
