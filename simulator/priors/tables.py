"""Reads the tables that the package brings along."""

from __future__ import annotations

import csv
from importlib import resources


def read_table(name: str) -> list[dict[str, str]]:
    """Read the rows of a file in `data/`, such as "objects.csv"."""
    path = resources.files("simulator.priors").joinpath("data", name)
    return list(csv.DictReader(path.read_text(encoding="utf-8").splitlines()))
