"""Prints the table of results/paper_homes.md from two folders that `nep.evaluate` has written."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from nep.paper.paper_numbers import PAPER_TABLE_1

TASKS = {
    "predict_location": "location ↑",
    "relative_likelihood": "likelihood ↑",
    "find_object": "find ↓",
}
NODES = ("on", "off")


def make_table(results: dict[str, Any]) -> str:
    """Return the table as Markdown.

    Args:
        results: what `nep.evaluate` has written, by "on" and "off".
    """
    columns = [(task, nodes) for task in TASKS for nodes in NODES]
    titles = [f"{TASKS[task]}, {nodes}" for task, nodes in columns]
    lines = [f"| method | {' | '.join(titles)} |", f"| --- |{' ---: |' * len(columns)}"]
    for name in results["on"]["tasks"]["predict_location"]["policies"]:
        cells = []
        for task, nodes in columns:
            score = results[nodes]["tasks"][task]["policies"][name]
            published = PAPER_TABLE_1[f"{task}-{nodes}"].get(name)
            digits = 2 if task == "find_object" else 3
            text = f"{score['mean']:.{digits}f} ± {score['std']:.{digits}f}"
            cells.append(text if published is None else f"{text} ({published[0]:.{digits}f})")
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join(lines)


if __name__ == "__main__":
    found = {
        nodes: json.loads((Path(folder) / "results.json").read_text())
        for nodes, folder in zip(NODES, sys.argv[1:], strict=True)
    }
    print(make_table(found))
