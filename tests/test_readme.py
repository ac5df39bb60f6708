"""The Python of the README runs and prints what it says there; its results are those stored."""

import re
from pathlib import Path

from nep.headlines import main

README = Path(__file__).resolve().parents[1] / "README.md"


def test_the_twenty_lines_print_what_the_readme_says(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = README.read_text(encoding="utf-8")
    ((block, printed),) = re.findall(r"```python\n(.*?)```\n\n```\n(.*?)```", text, re.DOTALL)
    assert len([line for line in block.splitlines() if line]) <= 20
    exec(compile(block, str(README), "exec"), {})  # our own text
    assert capsys.readouterr().out == printed
    assert (tmp_path / "home.sgm").stat().st_size < 5000


def test_what_is_said_of_results_is_what_the_command_prints(capsys):
    """Every table and sentence of `nep.headlines` stands in the README, word for word."""
    main(["--results", str(README.parent / "results")])
    readme = README.read_text(encoding="utf-8")
    parts = capsys.readouterr().out.strip().split("\n\n")
    assert len(parts) == 5
    for part in parts:
        assert part in readme, f"README.md must have what `python -m nep.headlines` prints:\n{part}"


def test_other_numbers_are_those_of_the_results():
    claims = (README.parent / "results" / "claims.md").read_text(encoding="utf-8")
    found = re.search(r"\| 32 places, on \| informed \| 0(\.\d+) \|", claims)
    assert found is not None
    assert f"(`informed`, {found[1]})" in README.read_text(encoding="utf-8")
