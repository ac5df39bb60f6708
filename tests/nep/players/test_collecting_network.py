"""A trained network as the policy that collects."""

import shutil
from dataclasses import replace

import pytest

from sgm.network.shipped import PRETRAINED
from simulator.collect.folder import collect
from simulator.collect.settings import CollectConfig
from simulator.snapshots.shards import load_manifest
from simulator.world.mixture.lived_in_homes import LivedInSource

CONFIG = CollectConfig(
    homes=LivedInSource(),
    num_homes=3,
    steps=2,
    policy="nep.players.policy:NEPPolicy=any_home",
    evidence=True,
)


@pytest.fixture(scope="module")
def collected(tmp_path_factory):
    """What one process collects."""
    folder = tmp_path_factory.mktemp("collected")
    collect(CONFIG, folder, progress=False)
    return folder


@pytest.mark.slow
def test_a_network_collects_the_same_bytes_with_any_number_of_workers(collected, tmp_path):
    collect(CONFIG, tmp_path, workers=2, progress=False)
    alone, shared = (load_manifest(folder)["shards"] for folder in (collected, tmp_path))
    assert alone == shared
    assert len(alone) == 3


@pytest.mark.slow
def test_a_collection_names_the_network_by_its_weights(collected, tmp_path):
    """Wherever the file lies: a network that was trained anew collects anew."""
    folder = tmp_path / "copy"
    shutil.copytree(PRETRAINED / "any_home", folder)
    copied = replace(CONFIG, policy=f"nep.players.policy:NEPPolicy={folder}")
    assert copied.describe() == CONFIG.describe()
    other = replace(CONFIG, policy="nep.players.policy:NEPPolicy=heat")
    assert other.describe()["policy"] != CONFIG.describe()["policy"]
    assert load_manifest(collected)["settings"] == CONFIG.describe()
    with pytest.raises(ValueError, match="policy"):
        collect(other, collected, progress=False)


def test_a_network_that_is_not_there_is_refused_before_anything_is_made(tmp_path):
    config = replace(CONFIG, policy="nep.players.policy:NEPPolicy=nowhere")
    with pytest.raises(ValueError, match="one of any_home, heat, got 'nowhere'"):
        collect(config, tmp_path / "out", progress=False)
    assert not list(tmp_path.iterdir())
