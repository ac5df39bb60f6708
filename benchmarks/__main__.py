"""Runs every benchmark and prints one table: `python benchmarks`; options are passed on."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

from rich.console import Console
from rich.table import Table

FOLDER = Path(__file__).resolve().parent
_COLUMNS = ("figure", "unit", "goal", "limit", "met")


def make_table(lines: list[dict[str, object]]) -> Table:
    """Put the JSON lines of all benchmarks below each other."""
    table = Table(title="Benchmarks: best of the repeats")
    table.add_column("benchmark")
    for name in _COLUMNS:
        table.add_column(name, justify="left" if name == "unit" else "right")
    table.add_column("size")
    table.add_column("threads", justify="right")
    for line in lines:
        limit = line["limit"]
        table.add_row(
            str(line["benchmark"]),
            f"{line['figure']:,g}",
            str(line["unit"]),
            f"{line['goal']:,g}",
            "" if limit is None else f"{limit:,g}",
            "yes" if line["is_met"] else "no",
            str(line["size"]),
            str(line["threads"]),
        )
    return table


def main() -> None:
    """Run them one after the other, each in a process of its own; one that fails stops no other."""
    lines, failed = [], []
    for path in sorted(FOLDER.glob("[a-z]*.py")):
        done = subprocess.run(
            [sys.executable, str(path), *sys.argv[1:]],
            stdout=subprocess.PIPE,
            text=True,
            check=False,
        )
        if done.returncode:  # its own message is on stderr
            failed.append(path.name)
            continue
        print(done.stdout.strip(), flush=True)
        lines.append(json.loads(done.stdout))
    Console(width=None if sys.stdout.isatty() else 160).print(make_table(lines))
    if failed:
        sys.exit(f"error: every benchmark must end well, got failures of {', '.join(failed)}")


if __name__ == "__main__":
    main()
