"""docs/research.md: the files and commands of its sections, word for word but small."""

import json
import re
import runpy
import shlex
import subprocess
import sys
from pathlib import Path

import matplotlib.image
import pytest
import torch

from nep import evaluate, fit

# Lightning warns of folders that are there already, and of few batches.
pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore")]

PAGE = (Path(__file__).parents[2] / "docs" / "research.md").read_text(encoding="utf-8")
SECTIONS = {part.partition("\n")[0]: part for part in PAGE.split("\n## ")[1:]}
FIT = shlex.split(
    "--data.num_homes 2 --data.steps 4 --data.num_val_homes 1 --data.batch_size 4 "
    "--data.workers 1 --online.policies [] --online.num_homes 1 --online.steps 1 --threads 1 "
    "--trainer.enable_progress_bar false"
)
EVALUATE = shlex.split("--policies none --num_homes 2 --steps 2")


def list_commands(section: str) -> list[list[str]]:
    """The arguments of each `python` of a section, loops unrolled by the shell."""
    script = "".join(re.findall(r"```bash\n(.*?)```", section, re.DOTALL))
    echo = "python() { printf '%q ' \"$@\"; echo; }\n"
    done = subprocess.run(
        ["bash", "-ec", echo + script], capture_output=True, text=True, check=True
    )
    return [shlex.split(line) for line in done.stdout.splitlines()]


def run(arguments: list[str], patch: pytest.MonkeyPatch) -> None:
    """Run one command, shrunk: the last of two equal options counts."""
    if arguments[:2] == ["-m", "nep.evaluate"]:
        evaluate.main([*arguments[2:], *EVALUATE])
        return
    short = [] if "--trainer.max_epochs" in arguments else ["--trainer.max_epochs", "1"]
    if arguments[:2] == ["-m", "nep.fit"]:
        fit.main([*arguments[2:], *FIT, *short])
        return
    patch.setattr(sys, "argv", [*arguments, *FIT, *short])
    runpy.run_path(arguments[0], run_name="__main__")


@pytest.fixture
def follow(tmp_path, monkeypatch, capsys):
    """Writes the files of a section and runs its commands; returns what they print."""
    monkeypatch.chdir(tmp_path)

    def follow_section(title: str, **changes: str) -> str:
        section = SECTIONS[title]
        files = re.findall(r"ave this as `(\S+)`:\n\n```\w+\n(.*?)```", section, re.DOTALL)
        for name, text in files:
            for old, new in changes.items():
                assert f"{old}=" in text
                text = re.sub(rf"{old}=\w+", f"{old}={new}", text)
            (tmp_path / name).write_text(text, "utf-8")
        for arguments in list_commands(section):
            run(arguments, monkeypatch)
        return capsys.readouterr().out

    return follow_section


def test_a_sweep_ends_with_a_table(follow, tmp_path):
    printed = follow("A sweep to a table", n_trials="2")
    rows = re.findall(r"\| \d \| \d\.\de-0\d \| [124] \| (\d\.\d{3}) \|", printed)
    assert len(rows) == 2
    assert rows == sorted(rows, reverse=True)
    assert re.search(r"\| second +\|", (tmp_path / "swept" / "table.md").read_text("utf-8"))
    assert (tmp_path / "sweep.db").is_file()


def test_a_training_goes_on(follow, tmp_path):
    follow("Go on with a training")
    epochs = [
        torch.load(folder / "checkpoints" / "last.ckpt", weights_only=True)["epoch"]
        for folder in sorted((tmp_path / "runs" / "heat").iterdir())
    ]
    assert epochs == [1, 3]  # counted from 0


def test_loggers_by_class_path(follow, tmp_path, monkeypatch):
    wandb = pytest.importorskip("wandb", reason="wandb is not installed: extra wandb")
    for name in ("CACHE", "CONFIG", "DATA"):
        monkeypatch.setenv(f"WANDB_{name}_DIR", str(tmp_path / "wandb"))
    monkeypatch.setenv("WANDB_SILENT", "true")
    follow("Loggers")
    wandb.finish()
    table = (tmp_path / "runs" / "logged" / "version_0" / "metrics.csv").read_text("utf-8")
    assert "val/hits_at_1" in table
    assert list((tmp_path / "runs" / "logged").rglob("events.out.tfevents*"))
    (run,) = (tmp_path / "runs" / "wandb").glob("offline-run-*")
    media = run / "files" / "media"
    for name in ("accuracy_over_steps", "calibration", "searches"):
        (picture,) = (media / "images" / "online").glob(f"{name}_*.png")
        assert matplotlib.image.imread(picture).ndim == 3
    (table_file,) = (media / "table" / "online").glob("table_*.table.json")
    content = json.loads(table_file.read_text("utf-8"))
    assert content["columns"][:2] == ["policy", "accuracy"]
    assert [row[0] for row in content["data"]] == ["NEP-HEAT"]


def test_several_seeds_and_their_spread(follow, tmp_path):
    printed = follow("Several seeds, and their spread")
    assert re.search(r"\d\.\d{3} ± \d\.\d{3} over 3 seeds", printed)
    seeds = [
        re.search(r"^seed_everything: (\d)", path.read_text("utf-8"), re.MULTILINE)[1]
        for path in sorted((tmp_path / "runs" / "seeds").glob("*/config.yaml"))
    ]
    assert seeds == ["0", "1", "2"]


def test_half_precision(follow, tmp_path):
    follow("GPU and precision")
    config = (tmp_path / "runs" / "heat" / "version_0" / "config.yaml").read_text("utf-8")
    assert "precision: bf16-mixed" in config


def test_every_section_is_followed():
    assert next(iter(SECTIONS)) == "An encoder of one's own"  # tests/nep/test_own_encoder.py
    assert len(SECTIONS) == 6
