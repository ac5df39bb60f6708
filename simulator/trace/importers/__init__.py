"""Homes of other programs as traces: ProcTHOR houses, and scene graphs of spark_dsg."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from pathlib import Path

from simulator.trace.importers.home_builder import HomeBuilder
from simulator.trace.importers.procthor import read_procthor
from simulator.trace.importers.scene_graph import read_scene_graph
from simulator.trace.trace import Trace


@dataclass(frozen=True, slots=True)
class Importer:
    """A format of another program.

    Attributes:
        help: what is read.
        read: gets the file and labels that are furniture besides those of the type table; returns
            the home, with everything at time 0, and the builder that says what was left out.
    """

    help: str
    read: Callable[[Path, Collection[str]], tuple[Trace, HomeBuilder]]


# Every format by the name that the command line uses.
IMPORTERS: Mapping[str, Importer] = {
    "procthor": Importer("a house of ProcTHOR, one JSON object", read_procthor),
    "spark-dsg": Importer(
        "a scene graph of spark_dsg (Hydra), JSON or binary; needs the package spark_dsg",
        read_scene_graph,
    ),
}

__all__ = ["IMPORTERS", "Importer", "read_procthor", "read_scene_graph"]
