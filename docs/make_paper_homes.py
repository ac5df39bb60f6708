"""Prints the table of results/paper_homes.md from folders that `nep.evaluate` has written."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from nep.paper.paper_numbers import PAPER_TABLE_1
from nep.paper.paper_tables import ORACLES

TASKS = {
    "predict_location": "location ↑",
    "relative_likelihood": "likelihood ↑",
    "find_object": "find ↓",
}
NODES = ("on", "off")

# Scores by "on" or "off", task and method.
Scores = dict[str, dict[str, dict[str, Any]]]


def load_scores(folders: Sequence[str]) -> Scores:
    """Read what was played with and without objects that come and go."""
    scores: Scores = {nodes: {task: {} for task in TASKS} for nodes in NODES}
    for folder in folders:
        results = json.loads((Path(folder) / "results.json").read_text())
        is_on = results["config"]["homes"]["home"]["dynamic_nodes"]
        for task, entry in results["tasks"].items():
            scores["on" if is_on else "off"][task] |= entry["policies"]
    return scores


def make_table(scores: Scores) -> str:
    """Return the table as Markdown; a cell is empty where somebody has not played."""
    columns = [(task, nodes) for task in TASKS for nodes in NODES]
    titles = [f"{TASKS[task]}, {nodes}" for task, nodes in columns]
    lines = [f"| method | {' | '.join(titles)} |", f"| --- |{' ---: |' * len(columns)}"]
    for name in sorted(scores["on"]["predict_location"], key=ORACLES.count):  # others first
        cells = []
        for task, nodes in columns:
            score = scores[nodes][task].get(name)
            published = PAPER_TABLE_1[f"{task}-{nodes}"].get(name)
            digits = 2 if task == "find_object" else 3
            text = (
                "" if score is None else f"{score['mean']:.{digits}f} ± {score['std']:.{digits}f}"
            )
            cells.append(text if published is None else f"{text} ({published[0]:.{digits}f})")
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join(lines)


if __name__ == "__main__":
    print(make_table(load_scores(sys.argv[1:])))
