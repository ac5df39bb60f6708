"""Settings and their groups."""

import ast
from pathlib import Path

import pytest

from nep.config_files import list_groups, name_groups
from nep.fit import FitCLI
from nep.model.module import NEPModule
from nep.model.settings import GROUPS, group_settings

ROOT = Path(__file__).resolve().parents[2]
MOST_PARAMETERS = 8


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    ("typed", "named"),
    [
        ("--data.num_homes=3", "--data.collection.num_homes=3"),
        ("--data.num-homes", "--data.collection.num_homes"),
        ("--data.no_relevance", "--data.collection.no_relevance"),
        ("--data.homes.init_args.largest=5", "--data.source.homes.init_args.largest=5"),
        ("--data.home.max_looks=4", "--data.source.home.max_looks=4"),
        ("--data.dynamics=paper", "--data.source.dynamics=paper"),
        ("--data.collection.num_homes=3", "--data.collection.num_homes=3"),
        ("--data.features.belief=true", "--data.features.belief=true"),
        ("--model.learning_rate=1", "--model.optimiser.learning_rate=1"),
        ("--model.encoder=nep.encoders.MLP", "--model.encoder=nep.encoders.MLP"),
        ("--online.num_homes=3", "--online.num_homes=3"),
        ("5", "5"),
    ],
)
def test_an_option_may_leave_out_its_group(typed, named):
    from datamodules.sgm_datamodule import SGMDataModule

    groups = {"model": list_groups(NEPModule), "data": list_groups(SGMDataModule)}
    assert name_groups([typed], groups) == [named]


def test_both_spellings_in_one_command(folder):
    (folder / "new.yaml").write_text("data:\n  collection:\n    steps: 7\n  num_homes: 5\n")
    cli = FitCLI(
        ["--config=mlp.yaml", "--config=new.yaml", "--data.num_homes", "4",
         "--data.loading.batch_size=3", "--model.network.dropout=0.2", "--model.schedule=cosine",
         "--data.dynamics", "paper", "--data.no_relevance"]
    )  # fmt: skip
    assert (cli.datamodule.train_config.steps, cli.datamodule.train_config.num_homes) == (7, 4)
    assert cli.datamodule.loading.batch_size == 3
    assert cli.model.hparams["dropout"] == 0.2
    assert cli.model.optimiser.schedule == "cosine"


def test_a_setting_twice_in_one_config_is_refused(folder, capsys):
    text = "data:\n  collection:\n    steps: 7\n  steps: 8\n"
    (folder / "twice.yaml").write_text(text)
    with pytest.raises(SystemExit):
        FitCLI(["--config=mlp.yaml", "--config=twice.yaml"])
    assert "steps must be set once, got it with and without its group" in capsys.readouterr().err


@pytest.mark.parametrize("change", [{"reads": "belief"}, {"reads": 1}])
def test_odd_groups_of_features_are_refused(change):
    with pytest.raises(TypeError, match="groups of features"):
        group_settings(change)


def test_settings_belong_to_one_group_each():
    names = [name for cls in GROUPS.values() for name in cls.__dataclass_fields__]
    assert len(names) == len(set(names))


def test_no_constructor_has_more_parameters_than_one_remembers():
    """Settings are frozen dataclasses; a constructor takes these."""
    large = {}
    for package in ("sgm", "simulator", "datamodules", "nep"):
        for path in (ROOT / package).rglob("*.py"):
            for node in ast.walk(ast.parse(path.read_text("utf-8"))):
                if not isinstance(node, ast.ClassDef):
                    continue
                for method in node.body:
                    if isinstance(method, ast.FunctionDef) and method.name == "__init__":
                        own = method.args
                        count = len(own.posonlyargs + own.args + own.kwonlyargs) - 1
                        if count > MOST_PARAMETERS:
                            large[node.name] = count
    assert large == {}
