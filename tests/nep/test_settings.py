"""Settings of a training: each has one name, on the command line, in a config and in Python."""

import pytest
import yaml
from jsonargparse import ArgumentParser

from datamodules.sgm_datamodule import SGMDataModule
from nep.any_home.any_home_module import AnyHomeModule
from nep.config_files import CONFIG_FOLDER
from nep.fit import FitCLI
from nep.paper.nep_module import NEPModule


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_command_line_changes_a_config(folder):
    (folder / "new.yaml").write_text("data:\n  steps: 7\n  num_homes: 5\n")
    cli = FitCLI(
        (
            "--config=mlp.yaml --config=new.yaml --data.num-homes 4 --data.batch_size=3 "
            "--model.attention.dropout=0.2 --model.schedule=cosine --data.home.dynamics paper "
            "--data.home.max_looks=4 --data.no_relevance"
        ).split()
    )
    assert (cli.datamodule.train_config.steps, cli.datamodule.train_config.num_homes) == (7, 4)
    assert cli.datamodule.train_config.homes.home.max_looks == 4
    assert cli.datamodule.batch_size == 3
    assert cli.model.hparams["attention"]["dropout"] == 0.2
    assert cli.model.schedule == "cosine"


@pytest.mark.parametrize("option", ["--data.collection.num_homes=3", "--model.dropout=0"])
def test_a_setting_has_no_second_name(option, capsys):
    with pytest.raises(SystemExit):
        FitCLI(["--config=mlp.yaml", option])
    assert option.removeprefix("--").partition("=")[0] in capsys.readouterr().err


@pytest.mark.parametrize("path", sorted(CONFIG_FOLDER.glob("*.yaml")), ids=lambda path: path.stem)
def test_configs_name_arguments_of_the_classes(path):
    config = yaml.safe_load(path.read_text("utf-8"))
    model = AnyHomeModule if "model_class" in config else NEPModule
    for part, cls in (("model", model), ("data", SGMDataModule)):
        options = {name.partition(".")[0] for name in ArgumentParser().add_class_arguments(cls)}
        assert config.get(part, {}).keys() <= options
