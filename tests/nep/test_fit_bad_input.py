"""What is wrong with a training is said before its data are prepared, in one line."""

import pytest
import torch

from nep.fit import main

SMALL = (
    "--config mlp.yaml --data.num_homes=1 --data.steps=2 --data.num_val_homes=1 "
    "--trainer.max_epochs=1 --trainer.logger=false --trainer.enable_progress_bar=false "
    "--trainer.enable_checkpointing=false"
).split()


@pytest.fixture(autouse=True)
def nothing_is_collected(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)

    def collect(*arguments):
        raise AssertionError("data were prepared")

    monkeypatch.setattr("datamodules.sgm_datamodule.collect", collect)


def run(capsys, *options):
    with pytest.raises(SystemExit) as ended:
        main([*SMALL, *options])
    assert ended.value.code == 2
    said = capsys.readouterr().err
    assert len(said.splitlines()) < 20  # not all 200 options
    return said


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "checkpoint must be a file that can be read, got 'No such file"),
        (b"", "checkpoint must be one that nep.fit wrote, got no whole zip file"),
        (b"\x80\x02}q\x00.", "checkpoint must be one that nep.fit wrote"),
        (b"something else", "checkpoint must be one that nep.fit wrote"),
        ({"epoch": 1}, "checkpoint must be one that nep.fit wrote, got KeyError"),
        ([1, 2], "checkpoint must be one that nep.fit wrote, got TypeError"),
        ("weights", "weights must be those of the network, got none called"),
    ],
)
def test_a_checkpoint_to_go_on_from_is_checked_first(capsys, tmp_path, content, message):
    path = tmp_path / "last.ckpt"
    if isinstance(content, bytes):
        path.write_bytes(content)
    elif content == "weights":
        parts = ("loops", "optimizer_states", "lr_schedulers", "epoch", "global_step")
        torch.save({"state_dict": {}, **dict.fromkeys(parts)}, path)
    elif content is not None:
        torch.save(content, path)
    assert message in run(capsys, f"--ckpt_path={path}")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--model.learning_rate=-1"], "learning_rate must be at least 0, got -1"),
        (["--model.learning_rate=.nan"], "learning_rate must be at least 0, got nan"),
        (["--model.attention.dropout=2"], "dropout must lie in [0, 1], got 2"),
        (["--model.attention.layers=-1"], "layers must be at least 1, got -1"),
        (["--data.batch_size=-1"], "batch_size must be at least 1, got -1"),
        (["--data.seed=-1"], "seed must be"),
        (["--seed_everything=-1"], "seed_everything must lie in 0 to 4294967295, got -1"),
        (["--seed_everything=4294967296"], "seed_everything must lie in 0 to 4294967295"),
        (["--data.features.text_pipeline=en_unknown"], "en_unknown"),
        (["--trainer.devices=100000"], "trainer.devices must be at most"),
        (["--trainer.max_epochs=-7"], "max_epochs"),
        (["--trainer.val_check_interval=9.5"], "val_check_interval"),
        (["--trainer.precision=x"], "precision"),
        (["--config=binary.yaml"], "--config"),
        (["--data.data_dir="], "data_dir must have a value, got an empty one"),
    ],
)
def test_values_out_of_range_are_one_line(capsys, tmp_path, options, message):
    (tmp_path / "binary.yaml").write_bytes(bytes(range(256)))
    assert message in run(capsys, *options)


def test_a_log_folder_that_is_a_file_is_refused(capsys, tmp_path):
    (tmp_path / "runs").touch()
    arguments = [argument for argument in SMALL if "logger" not in argument]
    with pytest.raises(SystemExit):
        main([*arguments, "--trainer.logger.init_args.save_dir=runs/deep"])
    assert "save_dir must be a folder, got a file at runs/deep" in capsys.readouterr().err
