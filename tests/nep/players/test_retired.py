"""Settings of earlier versions: accepted, ignored, and said in one line."""

import json
import shutil

import pytest
import torch

from nep.players.checkpoints import load_trained
from nep.players.stored_network import build_network
from sgm.network.network import Network
from sgm.network.shipped import CONFIG, PRETRAINED, RETIRED, drop_retired

FORMER = {"filter_share": 0.1, "hours_share": 0.8}
LINE = r"filter_share 0\.1 and hours_share 0\.8 in .* must be left out: .* is ignored"


@pytest.fixture
def folder(tmp_path):
    """The shipped network as earlier versions exported it."""
    shutil.copytree(PRETRAINED / "any_home", tmp_path / "net")
    path = tmp_path / "net" / CONFIG
    config = json.loads(path.read_text(encoding="utf-8"))
    config["model"] |= FORMER
    path.write_text(json.dumps(config), encoding="utf-8")
    return tmp_path / "net"


def test_an_export_of_earlier_versions_is_loaded_and_says_what_is_ignored(folder):
    with pytest.warns(UserWarning, match=LINE):
        trained = load_trained(folder)
    same = load_trained("any_home").module.state_dict()
    for name, tensor in trained.module.state_dict().items():
        assert torch.equal(tensor, same[name])
    assert not RETIRED & dict(trained.module.hparams).keys()
    with pytest.warns(UserWarning, match=rf"{LINE}, but for the part .* network\.onnx holds"):
        network = Network.load(folder)
    assert network.prior_share == 0.05


def test_settings_of_a_checkpoint_are_dropped_too():
    trained = load_trained("any_home").module
    settings = {**trained.hparams, **FORMER}
    with pytest.warns(UserWarning, match=LINE):
        module = build_network(settings, trained.state_dict(), "old.ckpt")
    assert module.playing.prior_share == 0.05


@pytest.mark.filterwarnings("error")
def test_a_setting_that_did_nothing_is_dropped_in_silence():
    assert drop_retired({"filter_share": 0.0, "units": 3}, "old.ckpt") == {"units": 3}
    assert drop_retired({"units": 3}, "new.ckpt") == {"units": 3}
