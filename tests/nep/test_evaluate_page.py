"""docs/evaluate.md: what it says of the package, the file of results and other runs."""

import json
import os
import re
import shlex
import subprocess
from pathlib import Path

import pytest

from nep.compare import main as compare
from nep.evaluate import main as evaluate

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "evaluate.md").read_text("utf-8")
SMALL = ["--num_homes", "3", "--steps", "5"]


def run(python, folder, *arguments):
    """Run Python in a folder, with the packages as an installed copy has them."""
    environment = os.environ | {"PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}
    done = subprocess.run(
        [python, *arguments],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def folder(tmp_path_factory, python):
    """A folder of one's own with the files of the page, where the policy was played."""
    folder = tmp_path_factory.mktemp("mine")
    files = re.findall(r"ave this as `(\S+)`.*?\n```\w+\n(.*?)```", PAGE, re.DOTALL)
    assert [name for name, _ in files] == [
        "my_package.py",
        "pyproject.toml",
        "two_guesses.py",
        "my_metrics.py",
    ]
    for name, text in files:
        (folder / name).write_text(text, "utf-8")
    command, *_ = re.findall(r"^python (-m nep\.evaluate .*)$", PAGE, re.MULTILINE)
    run(python, folder, *shlex.split(command), *SMALL)
    return folder


def test_the_page_names_every_metric_of_a_step():
    from simulator.tasks.metrics import STEP_METRICS

    (line,) = [line for line in PAGE.splitlines() if line.startswith("- **`Task.metric`**")]
    assert re.findall(r"`(\w+)`", line) == [*STEP_METRICS]


def test_a_policy_outside_the_repository_is_in_the_tables(folder, python):
    assert "| my_package:MyPolicy |" in (folder / "mine" / "table.md").read_text("utf-8")
    (check,) = re.findall(r'`python -c "(.*?)"`', PAGE)
    run(python, folder, "-c", check)


def test_every_field_of_the_file_is_on_the_page(folder):
    content = json.loads((folder / "mine" / "results.json").read_text())
    named = set(re.findall(r"`([\w.]+)`", PAGE.split("## results.json")[1]))
    named = {name.removeprefix("tasks.TASK.").removeprefix("policies.NAME.") for name in named}
    fields = {*content, *(f"config.{name}" for name in content["config"])} - {"tasks", "config"}
    for task in content["tasks"].values():
        fields |= {*task} - {"policies"}
        fields.add(task["metric"])
        for policy in task["policies"].values():
            fields |= {f".{name}" if name == "std" else name for name in policy}
    assert fields - named == set()


def test_it_is_compared_with_another_persons_run(folder, tmp_path, capsys):
    mine = str(folder / "mine" / "results.json")
    theirs = ["--policies", "bayesian", "--tasks", "find_object", *SMALL]
    evaluate([*theirs, "--out", str(tmp_path / "theirs")])
    compare([str(tmp_path / "theirs" / "results.json"), mine])
    printed = capsys.readouterr().out
    assert re.search(r"\| bayesian \| bayesian .* \[\+0\.00, \+0\.00\]", printed)
    assert "| my_package:MyPolicy | bayesian |" in printed
    evaluate([*theirs, "--out", str(tmp_path / "others"), "--home.no_dynamic_nodes"])
    with pytest.raises(SystemExit):
        compare([str(tmp_path / "others" / "results.json"), mine])
    assert "results must be of the same homes and rules, got" in capsys.readouterr().err


def test_it_can_be_installed(folder, tmp_path, python):
    site = tmp_path / "site"
    options = ["--no-deps", "--no-build-isolation", "--no-index", "--quiet"]
    run(python, folder, "-m", "pip", "install", *options, "--target", str(site), ".")
    code = f"import sys; sys.path.insert(0, {str(site)!r}); from simulator.policies import *; "
    printed = run(
        python, tmp_path, "-c", code + "print(find_policy('my_package:MyPolicy').__doc__)"
    )
    assert printed.startswith("Where such an object was seen")
