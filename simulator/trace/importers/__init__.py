"""Homes of other programs and data sets as traces: ProcTHOR, spark_dsg, HOMER."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from pkgutil import resolve_name
from typing import Protocol

from simulator.trace.importers.procthor import read_procthor
from simulator.trace.importers.scene_graph import read_scene_graph
from simulator.trace.trace import Trace


class Summary(Protocol):
    """What an importer can say of its work."""

    def summarise(self) -> str:
        """Say what was placed and what was not, a line each."""


# Gets the file or folder and labels that are furniture besides those of the type table; returns the
# home and what was left out.
Reader = Callable[..., tuple[Trace, Summary]]


@dataclass(frozen=True, slots=True)
class Importer:
    """A format of another program or data set.

    Attributes:
        help: what is read.
        reader: the function that reads it, or where it is: "package.module:function", for one that
            needs more than this package does.
        has_numbers: whether things may be labelled by numbers; the reader is then given the file
            that names them (see `load_label_names`), or None, as a third argument.
    """

    help: str
    reader: Reader | str
    has_numbers: bool = False

    def read(
        self, path: Path, furniture_labels: Collection[str] = (), labels: Path | None = None
    ) -> tuple[Trace, Summary]:
        """Read a file or folder; see `Reader`.

        Raises:
            ModuleNotFoundError: if the reader needs a package that is not installed.
            ValueError: if the file is none of this format, or nothing of it can be placed.
        """
        if labels is not None and not self.has_numbers:
            raise ValueError(
                f"labels must come with a format whose labels are numbers, got {labels}. Leave it "
                "out."
            )
        read = resolve_name(self.reader) if isinstance(self.reader, str) else self.reader
        return read(path, furniture_labels, *[labels] * self.has_numbers)


# Every format by the name that the command line uses.
IMPORTERS: Mapping[str, Importer] = {
    "procthor": Importer("a house of ProcTHOR, one JSON object", read_procthor),
    "spark-dsg": Importer(
        "a scene graph of spark_dsg (Hydra), JSON or binary; needs the package spark_dsg",
        read_scene_graph,
        has_numbers=True,
    ),
    "homer": Importer(
        "a household of HOMER or HOMER+, a folder with days as tensors; needs torch",
        "nep.importers.homer:read_homer",
    ),
}

__all__ = ["IMPORTERS", "Importer", "read_procthor", "read_scene_graph"]
