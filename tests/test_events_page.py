"""docs/events.md: its commands and its code, word for word but in small homes."""

import os
import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "events.md").read_text("utf-8")
SMALL = "--num_homes 5 --steps 6 --home.furniture_per_room 2 --home.objects_per_furniture 2"


def run(folder: Path, python: str, arguments: list[str]) -> str:
    path = os.pathsep.join([str(folder), str(ROOT)])
    done = subprocess.run(
        [python, *arguments],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONPATH": path, "OMP_NUM_THREADS": "1"},
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.slow
def test_from_the_command_to_a_trained_tgn(tmp_path, python):
    command = re.search(r"^python (-m simulator\.collect .*)$", PAGE, re.MULTILINE).group(1)
    small = command.replace("--num_homes 100 --steps 100", SMALL)
    assert small != command
    run(tmp_path, python, [*small.split(), "--workers", "1"])
    convert, network = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    (tmp_path / "convert.py").write_text(convert)
    run(tmp_path, python, ["convert.py"])
    assert (tmp_path / "tgb" / "thgl-homes_edgelist.csv").is_file()
    (tmp_path / "my_tgn.py").write_text(network)
    lines = run(tmp_path, python, ["my_tgn.py"]).splitlines()
    assert len(lines) == 5
    # 8 places: the MRR of ranks in the middle is 1 / 4.5, and no MRR is below 1 / 8
    assert all(0.125 <= float(line.rpartition(" ")[2]) <= 1 for line in lines)
    assert (tmp_path / "my_tgn.pt").is_file()


def test_the_page_names_every_rule():
    from simulator.policies.registry import EVENT_RULES

    rows = [line.split("`")[1] for line in PAGE.splitlines() if line.startswith("| `")]
    assert [*EVENT_RULES] == rows[-len(EVENT_RULES) :]


def test_the_table_names_every_file_and_column():
    from dataclasses import fields

    from simulator.events.files import EVENTS, MANIFEST, NODES, QUESTIONS
    from simulator.events.table import EventQuestions, Events, Nodes

    for name in (EVENTS, NODES, QUESTIONS, MANIFEST):
        assert f"| `{name}` |" in PAGE
    rows = {line.split("`")[1]: line for line in PAGE.splitlines() if line.startswith("| `")}
    for name, columns in ((EVENTS, Events), (NODES, Nodes), (QUESTIONS, EventQuestions)):
        for column in fields(columns):
            assert f"`{column.name}`" in rows[name], (name, column.name)
