"""Lists of public labels: what detectors, data sets and simulators call things.

Those of ScanNet (200 classes) stand in `data/scannet_labels.txt`. Others are read where they are
installed: COCO, LVIS, Objects365, Open Images, ADE20K and ImageNet in the package `ultralytics`,
BEHAVIOR in `bddl`. Any other is a file: one label a line, or YAML with `names`; "/" parts synonyms.
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import yaml

_WRITTEN = {"ScanNet": Path(__file__).parent / "data" / "scannet_labels.txt"}
_ULTRALYTICS = {
    "COCO": "coco.yaml",
    "LVIS": "lvis.yaml",
    "Objects365": "Objects365.yaml",
    "Open Images": "open-images-v7.yaml",
    "ADE20K": "ade20k.yaml",
    "ImageNet": "ImageNet.yaml",
}
ASKED_LAST = "ImageNet"  # after all rules, and in no memory: results/names.md


@dataclass(frozen=True)
class LabelList:
    """Labels of one source.

    Attributes:
        name: of the source.
        labels: what each thing is called, its own label first.
    """

    name: str
    labels: tuple[tuple[str, ...], ...]

    @property
    def seen(self) -> list[str]:
        """What a detector of these labels says, each once."""
        return list(dict.fromkeys(names[0] for names in self.labels))

    def list_asked(self, half: int | None) -> list[str]:
        """List what is asked for, synonyms too; of one half, 0 or 1, None for both."""
        asked = dict.fromkeys(name for names in self.labels for name in names)
        return [name for name in asked if half is None or find_half(name) == half]


def find_half(name: str) -> int:
    """Return in which half a label is: rules were tuned on 0, and 1 is reported."""
    return zlib.crc32(name.casefold().encode()) % 2


def load_lists(files: Mapping[str, Path] | None = None) -> list[LabelList]:
    """Load all lists that are here, by name; `files` come before those that are installed.

    Raises:
        ValueError: if a file holds no labels.
    """
    paths = {**_WRITTEN, **_find_installed(), **(files or {})}
    lists = [LabelList(name, _read(path)) for name, path in paths.items()]
    behavior = _read_behavior()
    if behavior:
        lists.append(LabelList("BEHAVIOR", behavior))
    return sorted(lists, key=lambda label_list: label_list.name)


def _find_installed() -> dict[str, Path]:
    found = find_spec("ultralytics")
    if found is None or found.submodule_search_locations is None:
        return {}
    folder = Path(next(iter(found.submodule_search_locations))) / "cfg" / "datasets"
    paths = {name: folder / file for name, file in _ULTRALYTICS.items()}
    return {name: path for name, path in paths.items() if path.is_file()}


def _read(path: Path) -> tuple[tuple[str, ...], ...]:
    text = path.read_text(encoding="utf-8")
    if path.suffix in (".yaml", ".yml"):
        names = yaml.safe_load(text).get("names", {})
        rows = list(names.values()) if isinstance(names, dict) else list(names)
    else:
        rows = text.splitlines()
    labels = tuple(
        tuple(name.strip() for name in str(line).split("/") if name.strip())
        for line in rows
        if str(line).strip()
    )
    if not labels:
        raise ValueError(f"labels must be one a line, got none in {path}. Name another file.")
    return labels


def _read_behavior() -> tuple[tuple[str, ...], ...]:
    if find_spec("bddl") is None:
        return ()
    from bddl.object_taxonomy import ObjectTaxonomy  # heavy, and seldom there

    leaves = ObjectTaxonomy().get_leaf_descendants("entity.n.01")
    names = {leaf.split(".")[0].replace("__", " ").replace("_", " ") for leaf in leaves}
    return tuple((name,) for name in sorted(names))
