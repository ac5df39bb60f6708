"""Results that may not change: checksums of homes, collected shards and scores.

Speed must never change a result. A change that is meant to alter results replaces the figures
below by those that the failing test prints, and says so in CHANGELOG.md.
"""

import hashlib
from pathlib import Path

import numpy as np
import pytest

from simulator.collect.folder import collect
from simulator.collect.settings import CollectConfig
from simulator.policies import make_policy
from simulator.snapshots.shards import get_shard_name, load_shard
from simulator.tasks.evaluation import evaluate_policy
from simulator.tasks.registry import TASKS
from simulator.world.source import SampledSource
from simulator.world.streams import Streams

STATE = ("object_type", "object_code", "object_place", "object_moved", "object_move_weight")

HOMES = {
    "dynamic nodes": "4332302dbf0f84af",
    "static nodes": "dbb5f2020db0602b",
    "moves between rooms": "fc41f8282b20ea11",
}
SHARDS = {
    "predict_location": "885f506d223c37d4",
    "relative_likelihood": "23ccff44b4c8fa07",
    "find_object": "e5c1ded5aec39501",
}
# As many steps as it takes for any two policies to differ.
NUM_STEPS = {"predict_location": 24, "relative_likelihood": 8, "find_object": 8}
SCORES = {
    "predict_location": {
        "random": "14f01a3541c89160",
        "priors": "d98061cf405ecc70",
        "frequentist": "b715928657de234b",
        "myopic": "be422893ef751d5b",
        "bayesian": "4f347c772055068c",
        "last_seen": "3a4122c17b0f8086",
        "last_seen_prior": "a20f9b4fef70080e",
        "oracle": "1a32f29a5d826fc6",
        "prior_filter": "7eb2644df369f1cb",
        "home_filter": "dc58601554711479",
        "persistence": "8cc7c3012a40cc01",
        "ceiling": "baf40cf8a4d22a13",
    },
    "relative_likelihood": {
        "random": "7778e1c893384296",
        "priors": "5e220fb8b4f4a398",
        "frequentist": "de7cbfe198c9a9b3",
        "myopic": "15d495814fde3e6f",
        "bayesian": "b457b715d5a4026f",
        "last_seen": "00ee15779e86146a",
        "last_seen_prior": "3a7fdf0956744b24",
        "oracle": "be78d304ee1318e6",
        "prior_filter": "a167ebc2520c8822",
        "home_filter": "dcaa872119357e06",
        "persistence": "5fa819ab24f9ba00",
        "ceiling": "c8020c70d6651c9f",
    },
    "find_object": {
        "random": "348d7128103495d8",
        "priors": "aaf5732c6bd2238e",
        "frequentist": "470e539f84b94d01",
        "myopic": "47a14ee52d8607af",
        "bayesian": "aabc0daa309274de",
        "last_seen": "d9d8b8fab0ba75c1",
        "last_seen_prior": "67eef7369b5516d2",
        "oracle": "d6242a9c6a461b5b",
        "prior_filter": "3c81cc52607a2297",
        "home_filter": "901f3b0170932fe8",
        "persistence": "05427719452d5905",
        "ceiling": "c2f6e6f2b9ccfd97",
    },
}


def compute_digest(*arrays: np.ndarray) -> str:
    """Hash values, not the types that happen to hold them."""
    digest = hashlib.sha256()
    for array in arrays:
        kind = "<f8" if array.dtype.kind == "f" else "<i8"
        digest.update(np.ascontiguousarray(array, dtype=kind).tobytes())
    return digest.hexdigest()[:16]


@pytest.mark.parametrize(
    ("name", "rules"),
    [
        ("dynamic nodes", {}),
        ("static nodes", {"dynamic_nodes": False}),
        ("moves between rooms", {"cross_room_moves": True, "move_share": 0.2}),
    ],
)
def test_homes_stay_what_they_were(make_default_homes, name, rules):
    homes = make_default_homes(3, seed=11, **rules)
    states = [homes.furniture_type, homes.furniture_code, homes.place_weights]
    for _ in range(40):  # past a block of random numbers
        homes.evolve()
        states += [getattr(homes, column).copy() for column in STATE]
    home, slot = np.nonzero(homes.is_present)
    states.append(homes.transition_rows(home, homes.object_code[home, slot]))
    assert compute_digest(*states) == HOMES[name]


@pytest.mark.parametrize("task", TASKS)
def test_shards_stay_what_they_were(tmp_path: Path, task):
    collect(CollectConfig(num_homes=3, steps=12, seed=5, task=task), tmp_path, progress=False)
    arrays = []
    for home in range(3):
        shard = load_shard(tmp_path / get_shard_name(home))
        arrays += [shard[name] for name in sorted(shard)]
    assert compute_digest(*arrays) == SHARDS[task]


@pytest.mark.parametrize("task", TASKS)
def test_scores_stay_what_they_were(default_prior, task):
    found = {}
    for name in SCORES[task]:
        scores = evaluate_policy(
            lambda homes, name=name: make_policy(name, homes),
            SampledSource(default_prior),
            Streams(2, "test", range(3)),
            NUM_STEPS[task],
            task=task,
        )
        # Rounded: a processor may add the terms of a sum in another order.
        found[name] = compute_digest(
            scores.values.round(9), scores.is_correct, scores.is_away, scores.likelihood.round(9)
        )
    assert found == SCORES[task]
    assert len(set(found.values())) == len(found), "a digest must tell two policies apart"
