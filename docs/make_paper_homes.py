"""Prints the table of results/paper_homes.md from the `table_1.json` of `nep.reproduce`."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from nep.paper.paper_numbers import PAPER_TABLE_1
from simulator.policies.registry import ORACLES

TASKS = {
    "predict_location": "location ↑",
    "relative_likelihood": "likelihood ↑",
    "find_object": "find ↓",
}
NODES = ("on", "off")


def make_table(settings: Mapping[str, Mapping[str, Mapping[str, Any]]]) -> str:
    """Return scores by setting ("predict_location-on", ...) and method as Markdown."""
    columns = [(task, f"{task}-{nodes}") for task in TASKS for nodes in NODES]
    titles = [f"{TASKS[task]}, {setting.rpartition('-')[2]}" for task, setting in columns]
    lines = [f"| method | {' | '.join(titles)} |", f"| --- |{' ---: |' * len(columns)}"]
    for name in sorted(settings["predict_location-on"], key=ORACLES.count):  # others first
        cells = []
        for task, setting in columns:
            score = settings[setting][name]
            digits = 2 if task == "find_object" else 3
            text = f"{score['mean']:.{digits}f} ± {score['std']:.{digits}f}"
            published = PAPER_TABLE_1[setting].get(name)
            cells.append(text if published is None else f"{text} ({published[0]:.{digits}f})")
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join(lines)


if __name__ == "__main__":
    print(make_table(json.loads(Path(sys.argv[1]).read_text())["settings"]))
