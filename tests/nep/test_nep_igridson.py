"""iGridson with a network: that of a very short fit is enough."""

import json

import pytest

from nep import fit
from nep.igridson import main


@pytest.fixture(scope="module")
def checkpoint(tmp_path_factory):
    folder = tmp_path_factory.mktemp("fit")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        fit.main(
            ["--config", "mlp.yaml", "--trainer.max_epochs=1", "--data.num_homes=1",
             "--data.steps=4",
             "--data.num_val_homes=1", "--data.batch_size=4", "--data.workers=1",
             "--online.num_homes=1",
             "--online.steps=2", "--trainer.log_every_n_steps=1",
             "--trainer.enable_progress_bar=false"]
        )  # fmt: skip
    return folder / "runs" / "mlp" / "version_0" / "checkpoints" / "last.ckpt"


@pytest.mark.slow
def test_run_with_a_checkpoint(checkpoint, tmp_path, capsys):
    out = tmp_path / "runs.json"
    args = ["run", "--policy", "nep", "nep+travel", "random", "--checkpoint", str(checkpoint),
            "--threads", "1", "--runs", "12", "--queries-per-home", "4", "--quiet",
            "--out", str(out)]  # fmt: skip
    assert main(args) == 0
    assert "| nep | " in capsys.readouterr().out
    policies = json.loads(out.read_text("utf-8"))["policies"]
    assert list(policies) == ["nep", "nep+travel", "random"]


def test_missing_checkpoints_are_named(tmp_path, capsys):
    assert main(["run", "--checkpoint", str(tmp_path / "no.ckpt")]) == 2
    message = capsys.readouterr().err
    assert "must be a file that can be read" in message
    assert "no.ckpt" in message
    assert main(["run", "--policy", "nep", "--runs", "100"]) == 2  # no checkpoint at all
    assert "--checkpoint CKPT" in capsys.readouterr().err


def test_the_shipped_network_plays(tmp_path, capsys):
    """Options of the network may stand before the command."""
    args = ["--checkpoint", "heat", "run", "--policy", "nep", "--runs", "4",
            "--queries-per-home", "4", "--quiet", "--out", str(tmp_path / "runs.json")]  # fmt: skip
    assert main(args) == 0
    assert "| nep | " in capsys.readouterr().out


def test_the_network_is_in_the_help_and_its_options_are_checked(capsys):
    with pytest.raises(SystemExit) as stop:
        main(["run", "--help"])
    assert stop.value.code == 0
    text = " ".join(capsys.readouterr().out.split())
    assert "the network: a checkpoint, an exported folder or one that ships" in text
    assert main(["run", "--threads", "0"]) == 2
    assert capsys.readouterr().err == "error: threads must be at least 1, got 0. Raise it.\n"
