"""Command line: `python -m tools.eyes`, the tables of results/eyes.md and eyes_maps.md."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Literal

from tqdm import tqdm

from sgm.checks import check_at_least, check_seed
from sgm.files import write_whole
from simulator.box_world.__main__ import USUAL_HOMES
from simulator.command_line import add_home_arguments, make_parser, one_line_errors, parse, pick
from simulator.home_options import HomeOptions
from simulator.process import run_main
from tools.eyes.results import (
    PARTS,
    MeasureRules,
    format_results,
    format_short,
    measure_homes,
)

_TITLES = {
    "looks": "Eyes, held against the truth of homes of boxes",
    "maps": "Maps that robots draw, held against the truth of homes of boxes",
}
_HEADING = """# {title}

Made by
`python -m tools.eyes --parts '["{part}"]' --num_homes {num_homes} --rounds {rounds}
--steps {steps} --seed {seed} --out {out}{also}`
in simulated homes with people ([Homes of boxes](../docs/box_world.md)); depth is measured. There
are {errands_per_step} errands in each of the {steps} hours of a home. A find counts where such a
thing truly is.
"""
# Of the page of looks, whose other figures stay: how a robot fares that starts without a map.
_SECTION = "## A robot that starts without a map"
_SHORT = """{section}

Made by
`python -m tools.eyes --parts '["{part}"]' --num_homes {num_homes} --rounds {rounds}
--steps {steps} --seed {seed} --out {out}{also}`
with the same robot on the true map beside it. [{maps}]({page}) has the rest.
"""


def main(arguments: Sequence[str] | None = None) -> None:
    """Hold coverage, assignment, absences and finds against the truth, over many homes."""
    parser = make_parser(
        "python -m tools.eyes",
        "Hold what the eyes of robots say against the truth of many homes of boxes, and print the "
        "table of results/eyes.md, or of results/eyes_maps.md. Homes that were measured before are "
        "not measured again.",
    )
    add_home_arguments(parser)
    parser.set_defaults(USUAL_HOMES)
    parser.add_class_arguments(MeasureRules)
    parser.add_argument(
        "--parts",
        type=list[Literal["looks", "maps"]],
        default=list(PARTS),
        help="looks at furniture on a map, the maps of robots without one, or both",
    )
    parser.add_argument("--seed", type=int, default=0, help="of homes, cameras and errands")
    parser.add_argument(
        "--work", type=Path, default=Path("runs/eyes"), help="folder with a file for each home"
    )
    parser.add_argument("--out", type=Path | None, help="file for the table")
    parser.add_argument(
        "--also",
        type=Path | None,
        help=f"page whose section '{_SECTION}' is renewed with figures of the part maps",
    )
    parser.add_argument("--quiet", type=bool, default=False, help="no progress bar")
    with one_line_errors():
        options = parse(parser, arguments)
        check_seed(options.seed)
        rules = MeasureRules(**pick(options, MeasureRules))
        check_at_least(1, **asdict(rules))
        _check_also(options.also, options.out, options.parts)
        source = HomeOptions(**pick(options, HomeOptions)).make()
        source.check_homes(range(rules.num_homes))
        source.check_steps(rules.steps)
        found = list(
            tqdm(
                measure_homes(source, rules, options.seed, options.work, options.parts),
                total=rules.num_homes,
                unit="home",
                disable=options.quiet,
            )
        )
        table = format_results(found)
        print(table)
        also = "" if options.also is None else f"\n--also {options.also}"
        parts = options.parts
        about = asdict(rules) | {
            "seed": options.seed,
            "out": options.out,
            "also": also,
            "part": '","'.join(parts),
            "title": _TITLES[parts[0]],
            "maps": _TITLES["maps"],
        }
        if options.out is not None:
            text = _HEADING.format(**about)
            write_whole(options.out, f"{text}\n{table}\n".encode())
        if options.also is not None:
            page = os.path.relpath(options.out, options.also.parent)
            text = _SHORT.format(section=_SECTION, page=page, **about)
            _renew_section(options.also, f"{text}\n{format_short(found)}\n")


def _check_also(also: Path | None, out: Path | None, parts: Sequence[str]) -> None:
    """Check that a page can get the section; raises ValueError else."""
    if also is None:
        return
    if out is None or "maps" not in parts:
        raise ValueError(
            f"--also must come with --out and the part maps, got --out {out} and {list(parts)}. "
            "The section names the page that has the rest."
        )
    if not also.is_file():
        raise ValueError(f"--also must be a page that exists, got {also}. Make it first.")


def _renew_section(path: Path, section: str) -> None:
    """Write the section of a page anew, at its end if it has none yet."""
    page = path.read_text("utf-8")
    before, _, old = page.partition(f"{_SECTION}\n")
    _, heading, after = old.partition("\n## ")
    write_whole(path, f"{before.rstrip()}\n\n{section}{heading}{after}".encode())


if __name__ == "__main__":
    run_main(main)
