"""A training whose output is no terminal, on a machine where nothing ran before."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]


@pytest.mark.slow
@pytest.mark.parametrize("has_home", [True, False])
def test_a_first_run_prints_its_own_lines_alone_and_leaves_nothing_at_home(tmp_path, has_home):
    home = tmp_path / "home"
    home.mkdir()
    left_out = ("MPLCONFIGDIR", "XDG_CACHE_HOME", "XDG_CONFIG_HOME", "DGLBACKEND")
    environment = {name: text for name, text in os.environ.items() if name not in left_out}
    (tmp_path / "run").mkdir()
    done = subprocess.run(
        [
            sys.executable,
            "-m",
            "nep.fit",
            "--config=heat.yaml",
            "--model.encoder.units=8",
            "--data.num_homes=2",
            "--data.steps=3",
            "--data.num_val_homes=1",
            "--online.num_homes=1",
            "--online.steps=2",
            "--online.policies=[bayesian]",
            "--trainer.max_epochs=3",
            "--data.workers=1",
            "--threads=1",
        ],
        cwd=tmp_path / "run",
        capture_output=True,
        text=True,
        check=False,
        env=environment
        | {"HOME": str(home) if has_home else "/dev/null/nobody", "PYTHONPATH": str(ROOT)},
    )
    assert done.returncode == 0, done.stderr
    epochs = re.findall(
        r"^epoch (\d) of 3: .*train/loss \d.*val/hits_at_1 .*, \d+ s$", done.stdout, re.MULTILINE
    )
    assert epochs == ["1", "2", "3"]
    for advice in ("GPU", "litlogger", "logging interval", "Setting the default", "\x1b", "cache"):
        assert advice not in done.stdout + done.stderr
    assert list(home.iterdir()) == []
    assert sorted(path.name for path in (tmp_path / "run").iterdir()) == ["data", "runs"]
