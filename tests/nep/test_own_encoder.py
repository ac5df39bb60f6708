"""An encoder of one's own that cannot be rebuilt is refused; every switch is in a config."""

from dataclasses import asdict

import pytest
import yaml

from datamodules.feature_config import FeatureConfig
from nep.fit import main


def test_an_encoder_that_does_not_keep_its_arguments_is_one_line(tmp_path, monkeypatch, capsys):
    """A checkpoint could not rebuild it: this is said before anything is trained."""
    (tmp_path / "forgetful.py").write_text(
        "from nep.paper.encoders import Encoder\n\n\n"
        "class Forgetful(Encoder):\n"
        "    num_hops, uses_edges = 0, False\n\n"
        "    def __init__(self, units: int = 8, depth: int = 2) -> None:\n"
        "        super().__init__(units)\n"
        "        self.num_layers = depth\n\n"
        "    def forward(self, graph, node, edge):\n"
        "        return node\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as stop:
        main(["--model.encoder=forgetful.Forgetful"])
    assert stop.value.code == 2
    error = capsys.readouterr().err
    assert "got no attribute depth in forgetful.Forgetful. Write `self.depth = depth`" in error
    assert "Traceback" not in error


def test_printed_config_shows_every_switch_of_the_features(capsys):
    with pytest.raises(SystemExit) as stop:
        main(["--config=heat.yaml", "--config=no_prior.yaml", "--print_config"])
    assert stop.value.code == 0
    printed = yaml.safe_load(capsys.readouterr().out)["data"]["features"]
    want = asdict(FeatureConfig(prior=False, candidates="random"))
    assert printed == want | {"evidence_without": []}
