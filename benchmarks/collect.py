"""Collect snapshots with the Bayesian policy in one process, written to disk."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path

from _measure import run

from simulator.collect import CollectConfig, collect


def prepare(tiny: bool) -> tuple[Callable[[], int], str]:
    """Choose the size."""
    config = CollectConfig(houses=2, steps=3) if tiny else CollectConfig(houses=100, steps=100)

    def work() -> int:
        with tempfile.TemporaryDirectory() as folder:
            collect(config, Path(folder), progress=False)
        return config.houses * config.steps

    return work, f"{config.houses} houses x {config.steps} steps, bayesian"


if __name__ == "__main__":
    run("collect", "snapshots/s", prepare)
