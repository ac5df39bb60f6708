"""Reads the tables that a package brings along."""

from __future__ import annotations

import csv
from importlib import resources


def read_table(package: str, name: str) -> list[dict[str, str]]:
    """Read the rows of a file in the folder `data` of a package, such as "household.csv"."""
    path = resources.files(package).joinpath("data", name)
    return list(csv.DictReader(path.read_text(encoding="utf-8").splitlines()))
