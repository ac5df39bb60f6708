"""Probabilities from iGibson 2.0: `misc/placement_probs.json` of its object models."""

from __future__ import annotations

import math
import re
from collections import defaultdict
from pathlib import Path
from typing import Any

from sgm.files import read_json
from sgm.messages import shorten
from simulator.priors.types import load_names, load_types
from tools.priors.counts import PlaceKey, PlacementCounts

RELATIONS = {"ontop": "onTop", "inside": "in", "in": "in"}


def count_igibson(folder: Path, *, skip_bad: bool = False) -> PlacementCounts:
    """Read the placement probabilities of all object models.

    A key such as `counter-kitchen-onTop` is split from the right. What lies in our tables is
    normalised per model (the files do not sum to one), then averaged over the models of a type.

    Args:
        folder: `ig_dataset`, or its `objects` folder.
        skip_bad: note bad files and entries and go on.

    Raises:
        ValueError: on a bad file or entry unless `skip_bad`; if there is no such file at all.

    Source: iGibson 2.0 (Li et al., 2021); paper appendix A.
    """
    folder = Path(folder)
    root = folder / "objects" if (folder / "objects").is_dir() else folder
    files = sorted(root.glob("*/*/misc/placement_probs.json"))
    if not files:
        raise ValueError(
            f"iGibson data must hold */*/misc/placement_probs.json, got none in {folder}. "
            "Pass the ig_dataset folder."
        )
    counts = PlacementCounts("igibson", is_counted=False, skips_bad=skip_bad)
    models: dict[str, list[dict[PlaceKey, float]]] = defaultdict(list)
    for path in files:
        category = path.parents[2].name
        label = load_names("igibson").find_object(category)
        if label is None:
            counts.outside["objects"][category] += 1
            continue
        counts.num_units += 1
        weights = _read_model(path, label, counts)
        total = math.fsum(weights.values())
        if total > 0:
            models[label].append({key: weight / total for key, weight in weights.items()})
    for rows in models.values():
        for weights_of_model in rows:
            for key, weight in weights_of_model.items():
                counts.placements[key] += weight / len(rows)
    return counts


def _read_model(path: Path, label: str, counts: PlacementCounts) -> dict[PlaceKey, float]:
    """Weights of one model, in our names; what is outside the tables is noted."""
    where = "/".join(path.parts[-4:])
    try:
        entries: Any = read_json(path, allow_nan=True)
        if not isinstance(entries, dict):
            raise ValueError(f"a {type(entries).__name__}")
    except ValueError as error:
        counts.report(f"model must hold a JSON object, got {error} in {where}", "Mend the file")
        return {}
    weights: dict[PlaceKey, float] = defaultdict(float)
    names = load_names("igibson")
    for key, weight in entries.items():
        parts = key.rsplit("-", 2)
        relation = RELATIONS.get(parts[-1].lower()) if len(parts) == 3 else None
        if relation is None:
            rule = "key must be furniture-room-onTop or furniture-room-inside"
            counts.report(f"{rule}, got {shorten(key)} in {where}", "Mend the file")
            continue
        if not _is_weight(weight):
            rule = f"weight of {shorten(key)} must be a finite number >= 0"
            counts.report(f"{rule}, got {shorten(weight)} in {where}", "Mend the file")
            continue
        furniture = names.find_furniture(parts[0])
        room = names.find_room(re.sub(r"_\d+$", "", parts[1]))
        if furniture is None:
            counts.outside["furniture"][parts[0]] += 1
        elif room is None:
            counts.outside["rooms"][parts[1]] += 1
        else:
            forced = load_types().furniture[furniture].relation
            place = (room, furniture, label, "in" if forced == "in" else relation)
            weights[place] += float(weight)
    return weights


def _is_weight(value: Any) -> bool:
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    return is_number and math.isfinite(value) and value >= 0
