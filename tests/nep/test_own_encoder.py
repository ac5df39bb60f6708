"""docs/research.md, "An encoder of one's own": its files and commands, word for word but small."""

import os
import re
import shlex
import subprocess
from dataclasses import asdict
from pathlib import Path

import pytest
import yaml

from datamodules.features import FeatureConfig
from nep.fit import main
from nep.players.checkpoints import load_trained

pytestmark = pytest.mark.dgl

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "research.md"
# What makes each command small.
SMALL = {
    "nep.fit": "--data.num_homes 2 --data.steps 4 --data.num_val_homes 1 --data.batch_size 4 "
    "--trainer.max_epochs 1 --online.policies [] --online.num_homes 1 --online.steps 1 --threads 1",
    "nep.evaluate": "--policies none --tasks predict_location --num_homes 2 --steps 2 --workers 2",
    "nep.export": "--num_homes 1 --steps 1 --threads 1",
    "nep.reproduce": "--table figure --tiny --workers 1",
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """The two files of the page, outside the repository."""
    folder = tmp_path_factory.mktemp("research")
    text = PAGE.read_text(encoding="utf-8")
    section = text[text.index("## An encoder of one's own") :]
    for language, name in (("python", "my_encoder.py"), ("yaml", "my_model.yaml")):
        block = re.search(rf"```{language}\n(.*?)```", section, re.DOTALL)
        assert f"`{name}`" in section[: block.start()]
        (folder / name).write_text(block.group(1))
    return folder


def list_commands() -> list[str]:
    text = PAGE.read_text(encoding="utf-8")
    block = re.search(r"```bash\nexport PYTHONPATH=.\n(.*?)```", text, re.DOTALL)
    return block.group(1).strip().split("\n")


def run(python: str, folder: Path, arguments: list[str]) -> subprocess.CompletedProcess:
    path = os.pathsep.join([".", str(ROOT)])
    return subprocess.run(
        [python, *arguments],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONPATH": path, "OMP_NUM_THREADS": "1", "COLUMNS": "200"},
    )


@pytest.mark.slow
def test_every_command_of_the_page(python, folder):
    for command in list_commands():
        _, *arguments = shlex.split(command)
        done = run(python, folder, [*arguments, *SMALL[arguments[1]].split()])
        assert done.returncode == 0, (command, done.stdout[-2000:], done.stderr[-2000:])
    assert (folder / "exported" / "weights.safetensors").is_file()
    assert "my_model" in (folder / "scores" / "table.md").read_text()
    assert (folder / "results" / "figure_4.png").is_file()
    # A file that names a module does not make us import it.
    checkpoint = folder / "runs/my_model/version_0/checkpoints/best.ckpt"
    (command,) = [line for line in list_commands() if "nep.evaluate" in line]
    _, *arguments = shlex.split(command.replace("--encoders my_encoder", ""))
    done = run(python, folder, [*arguments, *SMALL["nep.evaluate"].split()])
    assert done.returncode == 2
    assert "got 'my_encoder.MyEncoder'" in done.stderr.replace("\n", " ")
    for source in (checkpoint, folder / "exported"):
        with pytest.raises(ValueError, match=r"got 'my_encoder.MyEncoder' .*--encoders"):
            load_trained(source)


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
