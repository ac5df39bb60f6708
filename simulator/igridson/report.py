"""The table of a run, ours beside the paper's."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sgm.files import write_whole
from simulator.igridson.find_object import RunConfig, Runs

# Table 3: success rate, number of actions and path length, each with its standard deviation.
PAPER: Mapping[str, tuple[float, tuple[float, float], tuple[float, float]]] = {
    "random": (0.57, (9.36, 4.09), (141.74, 63.86)),
    "myopic": (0.57, (9.31, 4.14), (140.92, 64.40)),
    "bayesian": (0.84, (5.06, 4.50), (70.90, 63.06)),
    "nep": (1.00, (1.56, 0.86), (30.05, 24.67)),
}


def format_table(results: Mapping[str, Runs]) -> str:
    """Return a Markdown table, means and standard deviations over runs."""
    lines = [
        "| policy | success | actions | path length | paper: success | actions | path length |",
        "|---|---|---|---|---|---|---|",
    ]
    for name, runs in results.items():
        ours = runs.summarise()
        cells = [
            name,
            f"{ours['success_rate']:.3f}",
            f"{ours['num_actions']:.2f} ± {ours['num_actions_std']:.2f}",
            f"{ours['path_length']:.1f} ± {ours['path_length_std']:.1f}",
        ]
        if name in PAPER:
            success, actions, path = PAPER[name]
            cells += [
                f"{success:.2f}",
                f"{actions[0]:.2f} ± {actions[1]:.2f}",
                f"{path[0]:.1f} ± {path[1]:.1f}",
            ]
        else:
            cells += ["", "", ""]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def save_results(
    path: Path, results: Mapping[str, Runs], config: RunConfig, settings: Mapping[str, Any]
) -> None:
    """Write the results as JSON, with what they depend on.

    Args:
        path: file to write.
        results: by the name of the policy.
        config: how many searches.
        settings: further settings, as JSON values.
    """
    content = {
        "runs": config.runs,
        "homes": config.num_homes,
        "queries_per_home": config.queries_per_home,
        "attempts": config.attempts,
        "seed": config.seed,
        **settings,
        "policies": {name: runs.summarise() for name, runs in results.items()},
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, (json.dumps(content, indent=1) + "\n").encode())
