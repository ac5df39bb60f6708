"""What only a simulator knows of a home that it has recorded: `simulation.json`."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sgm.files import read_json
from sgm.messages import shorten, shorten_values
from simulator.world.config import HomeConfig

TRUTH_FILE = "simulation.json"
TRUTH_VERSION = 1
MAX_SLOTS = 100_000  # of a home
_BROKEN = (
    OSError, ValueError, TypeError, KeyError, AttributeError, OverflowError, RecursionError,
)  # fmt: skip

# Weights of places by the text of what lies there: {"mug": {"3": 0.25, ...}, ...}
Weights = Mapping[str, Mapping[int, float]]


@dataclass(frozen=True)
class Truth:
    """The rules and dynamics of a simulated home; a recorded one has none.

    Attributes:
        config: the rules.
        step_seconds: length of a time step.
        num_slots: most objects that the home can hold; detection draws one number for each.
        transitions: true dynamics T by description: weight by place (2 x furniture + relation).
        place_weights: class weights by object label: weight by place.
    """

    config: HomeConfig
    step_seconds: float
    num_slots: int
    transitions: Weights
    place_weights: Weights


def list_weights(row: np.ndarray) -> dict[int, float]:
    """List the places of a row of weights (P,) that are not zero."""
    return {int(place): float(row[place]) for place in np.flatnonzero(row)}


def fill_row(weights: Mapping[int, float], num_places: int) -> np.ndarray:
    """Return a row of weights, float32 (P,)."""
    row = np.zeros(num_places, dtype=np.float32)
    row[list(weights)] = list(weights.values())
    return row


def make_truth_json(truth: Truth) -> str:
    """Write the text of a `simulation.json`; numbers come back as the same float32."""
    data = {
        "version": TRUTH_VERSION,
        "step_seconds": truth.step_seconds,
        "num_slots": truth.num_slots,
        "rules": truth.config.describe(),
        "transitions": truth.transitions,
        "place_weights": truth.place_weights,
    }
    return json.dumps(data, ensure_ascii=False) + "\n"


def load_truth(path: Path, num_places: int) -> Truth | None:
    """Read a `simulation.json` beside a layout of P places; None if there is none.

    Raises:
        ValueError: if the file is broken; it is named.
    """
    if not path.exists():
        return None
    try:
        data = read_json(path)
        if data["version"] != TRUTH_VERSION:
            raise ValueError(f"version {shorten(data['version'])} instead of {TRUTH_VERSION}")
        truth = Truth(
            HomeConfig.from_json(data["rules"]),
            float(data["step_seconds"]),
            int(data["num_slots"]),
            _read_weights(data["transitions"], num_places),
            _read_weights(data["place_weights"], num_places),
        )
        if not 0 < truth.step_seconds < math.inf:
            raise ValueError(f"step_seconds {truth.step_seconds}")
        if not 1 <= truth.num_slots <= MAX_SLOTS:
            raise ValueError(
                f"num_slots {shorten(truth.num_slots)}, which must lie in 1 to {MAX_SLOTS}"
            )
    except _BROKEN as error:
        raise ValueError(
            f"{path}: simulation must be whole, got {type(error).__name__}: "
            f"{shorten_values(str(error))}. Record the home again, or delete the file to replay it "
            "like any recorded home."
        ) from None
    return truth


def _read_weights(data: Any, num_places: int) -> Weights:
    weights = {
        str(text): {int(place): float(weight) for place, weight in row.items()}
        for text, row in data.items()
    }
    for text, row in weights.items():
        if not all(0 <= place < num_places and weight >= 0 for place, weight in row.items()):
            raise ValueError(
                f"a place outside the layout, or a negative weight, for {shorten(text)}"
            )
    return weights
