"""What a training says in words: what it learns from, and commands that can be copied."""

import importlib
import shlex

import pytest

from nep.fit import main

SMALL = (
    "--config mlp.yaml --trainer.max_epochs=1 --data.num_homes=2 --data.steps=8 "
    "--data.num_val_homes=1 --data.batch_size=8 --data.workers=1 --online.num_homes=2 "
    "--online.steps=2 --online.policies=[bayesian] --trainer.log_every_n_steps=1"
).split()
LESS = {
    "nep.evaluate": "--num_homes 1 --steps 2 --workers 1".split(),
    "nep.view": "--steps 3 --save page.html".split(),
}


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:Starting from:UserWarning")
def test_the_commands_at_the_end_of_a_training_run(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    main([*SMALL, "--trainer.enable_progress_bar=false"])
    lines = [line.strip() for line in capsys.readouterr().out.splitlines()]
    (head,) = [line for line in lines if line.startswith("The best epoch is in ")]
    assert (tmp_path / head.split()[5].rstrip(".")).with_suffix(".ckpt").is_file()
    commands = {}
    for line in lines:
        _, _, words = line.partition(" -m ")
        if words:
            name, *arguments = shlex.split(words)
            commands[name] = arguments
    assert list(commands) == ["tensorboard.main", "nep.evaluate", "nep.view"]
    option, folder = commands.pop("tensorboard.main")
    assert option == "--logdir"
    assert list((tmp_path / folder).glob("events.out.tfevents.*"))
    for name, arguments in commands.items():
        command = importlib.import_module("nep.view.__main__" if name == "nep.view" else name)
        command.main([*arguments, *LESS[name]])
    assert (tmp_path / "page.html").is_file()
    assert (tmp_path / "scores" / "results.json").is_file()


@pytest.mark.slow
@pytest.mark.parametrize(("homes", "is_told"), [(2, True), (50, False)])
def test_few_homes_are_said_to_be_few(homes, is_told, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    main([*SMALL, f"--data.num_homes={homes}", "--data.steps=2", "--trainer.logger=false"])
    text = " ".join(capsys.readouterr().out.split())
    assert ("homes are few to learn from" in text) == is_told
    assert "'persistence' is level" in text
    assert "FLOPs" not in text
