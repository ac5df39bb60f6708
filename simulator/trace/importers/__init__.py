"""Homes of other programs and data sets, as traces, maps and looks."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from pkgutil import resolve_name
from typing import Any, Protocol

from simulator.trace.importers.home_assistant import read_home_assistant
from simulator.trace.importers.procthor import read_procthor
from simulator.trace.importers.scene_graph import read_scene_graph
from simulator.trace.importers.virtualhome import read_virtualhome
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
        options: names of further arguments of the reader, None where they are left out: `labels`,
            a file that names the numbers of labels (see `load_label_names`), and `room`, a name of
            one room for all that is in none.
    """

    help: str
    reader: Reader | str
    options: tuple[str, ...] = ()

    def read(
        self, path: Path, furniture_labels: Collection[str] = (), **options: Any
    ) -> tuple[Trace, Summary]:
        """Read a file or folder; see `Reader`.

        Raises:
            ModuleNotFoundError: if the reader needs a package that is not installed.
            ValueError: if the file is none of this format, or nothing of it can be placed.
        """
        for name, value in options.items():
            if value is not None and name not in self.options:
                known = [form for form, importer in IMPORTERS.items() if name in importer.options]
                raise ValueError(
                    f"{name} must come with the format {' or '.join(known)}, got {value}. Leave it "
                    "out."
                )
        read = resolve_name(self.reader) if isinstance(self.reader, str) else self.reader
        return read(path, furniture_labels, **{name: options.get(name) for name in self.options})


# Every format by the name that the command line uses.
IMPORTERS: Mapping[str, Importer] = {
    "procthor": Importer("a house of ProcTHOR, one JSON object", read_procthor),
    "spark-dsg": Importer(
        "a scene graph of spark_dsg (Hydra), JSON or binary; needs the package spark_dsg",
        read_scene_graph,
        options=("labels", "room"),
    ),
    "virtualhome": Importer(
        "a scene graph of VirtualHome, one JSON object with nodes and edges", read_virtualhome
    ),
    "home-assistant": Importer(
        "areas, devices and entities of Home Assistant, its folder of configuration",
        read_home_assistant,
    ),
    "homer": Importer(
        "a household of HOMER or HOMER+, a folder with days as tensors; needs torch",
        "nep.importers.homer:read_homer",
    ),
}

__all__ = ["IMPORTERS", "Importer", "read_procthor", "read_scene_graph"]
