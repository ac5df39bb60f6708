"""The twenty lines of docs/robot.md run, and the numbers of that page hold."""

import re
from pathlib import Path

from nep.search_plan import EXACT_PLACES

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "robot.md").read_text(encoding="utf-8")


def test_the_twenty_lines_run(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (block,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    assert len([line for line in block.splitlines() if line]) <= 20
    exec(compile(block, "robot.md", "exec"), {})  # our own text
    out = capsys.readouterr().out
    assert out.startswith("large red mug\n")
    for words in ("counter top in kitchen", "seen here 1 step ago, then gone", "elsewhere", "cost"):
        assert words in out
    assert (tmp_path / "home.sgm").stat().st_size < 5000


def test_numbers_of_the_page():
    assert EXACT_PLACES == 9
    assert PAGE.count("nine") == 2
