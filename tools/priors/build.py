"""Building a prior from named sources; without arguments, the default that ships."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from sgm.messages import shorten
from sgm.prior.prior_graph import PriorGraph
from tools.priors.behavior import count_behavior
from tools.priors.counts import PlacementCounts
from tools.priors.igibson import count_igibson
from tools.priors.merge import BuildOptions, BuildReport, build_prior
from tools.priors.procthor_databases import NUM_HOUSES, SEED, count_procthor_databases
from tools.priors.procthor_houses import count_procthor_houses
from tools.priors.table import count_table

DEFAULT_SOURCES = ("procthor", "behavior")
SOURCES = {
    "procthor": "symbolic houses from the databases of the package procthor [=FOLDER]",
    "behavior": "household activities and scenes of the package bddl [=FOLDER]",
    "procthor-10k": "generated houses =train.jsonl.gz, or from the package prior",
    "igibson": "object models of iGibson 2.0 =ig_dataset",
    "table": "a table of your own =FILE.csv or FILE.json",
}
"""Names of the sources, and what may follow `=`."""

NEEDS_PATH = ("igibson", "table")


def load_source(
    name: str, *, skip_bad: bool = False, num_houses: int = NUM_HOUSES
) -> PlacementCounts:
    """Count one source.

    Args:
        name: a key of `SOURCES`, or `key=path`.
        skip_bad: note bad rows and go on.
        num_houses: symbolic houses to sample.

    Raises:
        ValueError: on an unknown source, a missing path, or a bad row unless `skip_bad`.
        OSError: if a file cannot be read.
    """
    key, _, text = name.partition("=")
    path = Path(text) if text else None
    if key not in SOURCES:
        raise ValueError(
            f"source must be one of {', '.join(SOURCES)}, got {shorten(key)}. Choose one."
        )
    if path is None and key in NEEDS_PATH:
        raise ValueError(f"source {shorten(key)} must have a path, got none. Write {key}=PATH.")
    if path is not None and not path.exists():
        raise FileNotFoundError(f"source {shorten(key)} must exist, got {path}. Correct the path.")
    counters: dict[str, Callable[[], PlacementCounts]] = {
        "procthor": lambda: count_procthor_databases(path, num_houses=num_houses),
        "behavior": lambda: count_behavior(path, skip_bad=skip_bad),
        "procthor-10k": lambda: count_procthor_houses(path, skip_bad=skip_bad),
        "igibson": lambda: count_igibson(Path(text), skip_bad=skip_bad),
        "table": lambda: count_table(Path(text), skip_bad=skip_bad),
    }
    return counters[key]()


def build_from_sources(
    names: Sequence[str] = DEFAULT_SOURCES,
    *,
    options: BuildOptions | None = None,
    num_houses: int = NUM_HOUSES,
    skip_bad: bool = False,
) -> tuple[PriorGraph, BuildReport, list[PlacementCounts]]:
    """Count sources and merge them, the first named wins.

    The same sources, versions and options give the same file, byte for byte.

    Raises:
        ValueError, OSError: as `load_source` and `build_prior`.
    """
    counts = [load_source(name, skip_bad=skip_bad, num_houses=num_houses) for name in names]
    metadata: dict[str, Any] = {
        "name": "default" if tuple(names) == DEFAULT_SOURCES else "own",
        "sources": [_describe(name, source) for name, source in zip(names, counts, strict=True)],
    }
    if "procthor" in names:
        metadata |= {"num_houses": num_houses, "seed": SEED}
    prior, report = build_prior(counts, options=options, metadata=metadata)
    return prior, report, counts


def _describe(name: str, source: PlacementCounts) -> str:
    """Name of a source for the file's metadata: no paths, so that machines agree on the bytes."""
    key, _, path = name.partition("=")
    package = {"procthor": "procthor", "behavior": "bddl"}.get(key)
    if package and not path:
        try:
            return f"{key} ({package} {version(package)}, {source.num_units} read)"
        except PackageNotFoundError:
            pass
    return f"{key} ({source.num_units} read)"
