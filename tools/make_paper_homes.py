"""Prints the tables of results/paper_homes.md from the `table_1.json` of `nep.reproduce`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from nep.bench.comparisons import correct_rows
from nep.bench.paper.experiments import Setting
from nep.bench.paper.paper_numbers import PAPER_TABLE_1
from nep.bench.paper.paper_tables import (
    CLAIM,
    VERDICT,
    compute_table,
    find_known,
    list_claims,
    list_shown,
    load_table_1,
)
from nep.report.results import ScoreSummary
from nep.report.tables import BOUNDED, TOP, TableColumn, join_table, lay_out
from simulator.command_line import make_parser, one_line_errors, parse
from simulator.process import run_main

TASKS = {
    "predict_location": "location ↑",
    "relative_likelihood": "likelihood ↑",
    "find_object": "find ↓",
}
Results = Mapping[Setting, Mapping[str, ScoreSummary]]


def make_table(results: Results) -> str:
    """Return scores by setting and method as Markdown, in brackets the paper's means."""
    header = [
        "method",
        "knows",
        *(f"{TASKS[setting.task]}, {setting.nodes}" for setting in results),
    ]
    rows = []
    for name, shown in list_shown(next(iter(results.values()))).items():
        cells = []
        for setting, scores in results.items():
            form = ".2f" if setting.task == "find_object" else ".3f"
            values = scores[name].home_values
            text = f"{values.mean():{form}} ± {values.std():{form}}"
            if name == TOP and setting.metric.name not in BOUNDED:
                text = "no bound"
            published = PAPER_TABLE_1[setting.name].get(name)
            cells.append(text if published is None else f"{text} ({published[0]:{form}})")
        rows.append([shown, find_known(name), *cells])
    return join_table(header, rows, num_text=2)


def make_orderings(results: Results) -> str:
    """Return what the paper orders, and what these homes say, as Markdown."""
    claims = [
        claim
        for setting, scores in results.items()
        for claim in list_claims(setting, compute_table(setting, scores), scores)
    ]
    where = TableColumn(
        "setting",
        lambda row: f"{TASKS[row.setting.task].split()[0]}, {row.setting.nodes}",
    )
    return lay_out(correct_rows(claims), (where, CLAIM, *VERDICT), 2)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line."""
    parser = make_parser("python -m tools.make_paper_homes", __doc__)
    parser.add_argument("scores", type=Path, help="table_1.json of nep.reproduce --homes paper")
    with one_line_errors(status=2):
        results, _ = load_table_1(parse(parser, arguments).scores)
        print(f"{make_table(results)}\n{make_orderings(results)}", end="")


if __name__ == "__main__":
    run_main(main)
