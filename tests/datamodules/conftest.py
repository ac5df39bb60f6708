"""Small collections and hand-written snapshots."""

from pathlib import Path

import numpy as np
import pytest

from simulator.collect.folder import collect
from simulator.collect.settings import CollectConfig
from simulator.snapshots.snapshots import Snapshots
from simulator.world.config import HomeConfig
from simulator.world.source import SampledSource

SMALL = CollectConfig(
    num_homes=3,
    steps=12,
    homes=SampledSource(home=HomeConfig(furniture_per_room=3, objects_per_furniture=4)),
)


@pytest.fixture(scope="session")
def collection(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three small homes, twelve steps each."""
    folder = tmp_path_factory.mktemp("collection")
    collect(SMALL, folder, progress=False)
    return folder


@pytest.fixture(scope="session")
def hand_written() -> Snapshots:
    """One snapshot at time 10 with numbers that are easy to check.

    A kitchen with a table (looked at 3 times, last at time 8) and a fridge (never looked at); a
    mug seen on the table at times 2 and 6 but not at 8, and an apple that is asked for and was
    never seen. The prior puts the apple on the table (0.25) and in the fridge (0.75).
    """
    return Snapshots(
        labels=("house", "floor", "kitchen", "table", "fridge", "mug", "apple"),
        time=np.array([10]),
        rooms={"snapshot": np.array([0]), "label": np.array([2])},
        furniture={
            "snapshot": np.array([0, 0]),
            "label": np.array([3, 4]),
            "room": np.array([0, 0]),
            "prob": np.array([0.5, 0.125], dtype=np.float32),
            "num_observed": np.array([3, 0]),
            "last_observed": np.array([8, -1]),
        },
        objects={
            "snapshot": np.array([0, 0]),
            "key": np.array([0, 1]),
            "label": np.array([5, 6]),
            "num_observed": np.array([2, 0]),
            "last_observed": np.array([6, -1]),
            "num_moved": np.array([0, 0]),
            "last_moved": np.array([-1, -1]),
        },
        edges={
            "snapshot": np.array([0]),
            "object": np.array([0]),
            "furniture": np.array([0]),
            "relation": np.array([1]),
            "prior": np.array([0.1], dtype=np.float32),
            "num_observed": np.array([3]),
            "num_true": np.array([2]),
            "num_changed": np.array([1]),
            "last_observed": np.array([8]),
            "last_changed": np.array([8]),
            "last_true": np.array([6]),
            "is_true": np.array([False]),
        },
        query_object=np.array([1]),
        query_prior=np.array([[0.0, 0.25], [0.75, 0.0]], dtype=np.float32),
        answers=np.array([False, True]),
    )
