"""Hyper-parameters that no weights can fill are refused before anything is allocated."""

import shutil

import pytest
import torch

from nep.paper.encoders import HEAT
from nep.paper.nep_module import NEPModule
from nep.players.stored_network import build_network, read_features
from sgm.text import load_text
from sgm.text.vectors import PAPER_PIPELINE, SHIPPED_PIPELINE, TextVectors


@pytest.fixture(scope="module")
def network():
    torch.manual_seed(0)
    return NEPModule(HEAT(units=8))


def test_a_network_comes_back(network):
    again = build_network(dict(network.hparams), network.state_dict(), "here")
    for name, tensor in network.state_dict().items():
        assert torch.equal(again.state_dict()[name], tensor)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("num_convolutions", 10**8, "num_convolutions must be at most 4096, .* got 100000000 in"),
        ("num_convolutions", 10**400, "got a number of about 400 digits in here"),
        ("units", 20_000, "units must be at most 4096"),
        ("units", 4096, r"got .* of shape .*8\) instead of .*4096"),
        ("units", -3, "must be those of a network, got ValueError: units must be at least 1"),
        ("heads", 3, "must be those of a network, got ValueError"),
        ("heads", True, "heads must be a value like 1, got True"),
        ("heads", None, "heads must be a value like 1, got None"),
        ("heads", "x" * 1000, r"got 'x{190,200}\.\.\. in here"),
        pytest.param(
            "layers",
            3000,
            r"none called predictor\.query_attention\.layers\.10",
            marks=pytest.mark.slow,
        ),
        ("attention heads", 0, "hyper-parameters must be those of a network, got"),
        ("dropout", float("nan"), r"dropout must be a value like 0\.1, got nan"),
        ("dropout", "much", r"dropout must be a value like 0\.1, got 'much'"),
        ("taste", 1, "must be those of a network, got TypeError"),
    ],
)
def test_odd_hyper_parameters_are_refused(network, name, value, message):
    parameters = dict(network.hparams)
    encoder, attention = parameters["encoder"], parameters["attention"]
    name_there = name.removeprefix("attention ")
    if name != name_there or (name not in encoder["init_args"] and name in attention):
        parameters["attention"] = {**attention, name_there: value}
    elif name in encoder["init_args"]:
        parameters["encoder"] = {**encoder, "init_args": {**encoder["init_args"], name: value}}
    else:
        parameters[name] = value
    with pytest.raises(ValueError, match=message):
        build_network(parameters, network.state_dict(), "here")


@pytest.mark.parametrize(
    "encoder", ["HEAT", None, {}, {"class_path": "nep.paper.encoders.HEAT", "init_args": "units"}]
)
def test_an_encoder_without_names_of_arguments_is_refused(network, encoder):
    parameters = {**network.hparams, "encoder": encoder}
    with pytest.raises(ValueError, match=r"encoder must have a class_path .* in here"):
        build_network(parameters, network.state_dict(), "here")


def test_weights_that_are_no_numbers_are_refused(network):
    weights = dict(network.state_dict())
    name = next(iter(weights))
    weights[name] = torch.full_like(weights[name], torch.nan)
    with pytest.raises(ValueError, match=f"got {name} that is not finite everywhere in here"):
        build_network(dict(network.hparams), weights, "here")


@pytest.mark.parametrize("change", [{"temporal": 1}, {"threshold": "low"}, {"text_pipeline": []}])
def test_odd_features_are_refused(change):
    assert read_features({}).temporal
    with pytest.raises((TypeError, ValueError), match=r"features|threshold|text"):
        read_features(change)


def test_a_file_makes_nobody_load_a_text_pipeline(tmp_path, monkeypatch):
    """A folder or package of that name may be anybody's."""
    folder = tmp_path / "pipeline"
    shutil.copytree(SHIPPED_PIPELINE, folder)
    (tmp_path / "en_stolen").mkdir()
    (tmp_path / "en_stolen" / "__init__.py").write_text("raise SystemExit('imported')\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    for name in (str(folder), "pipeline", "en_stolen"):
        with pytest.raises(ValueError, match=r"text_pipeline of a file must be .*Load it before"):
            read_features({"text_pipeline": name})
    load_text("pipeline")  # whoever calls may
    assert read_features({"text_pipeline": "pipeline"}).text_pipeline == "pipeline"


def test_a_folder_is_not_taken_for_the_papers_pipeline(tmp_path, monkeypatch):
    shutil.copytree(SHIPPED_PIPELINE, tmp_path / PAPER_PIPELINE)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("spacy.util.is_package", lambda name: False)
    with pytest.raises(ModuleNotFoundError, match="must be an installed package"):
        TextVectors(PAPER_PIPELINE)
