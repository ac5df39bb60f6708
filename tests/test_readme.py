"""The Python of the README runs and prints what it says there; the table is that of results/."""

import csv
import re
from pathlib import Path

from nep.paper.experiments import SETTINGS
from nep.paper.paper_numbers import PAPER_TABLE_1

README = Path(__file__).resolve().parents[1] / "README.md"


def test_the_twenty_lines_print_what_the_readme_says(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = README.read_text(encoding="utf-8")
    ((block, printed),) = re.findall(r"```python\n(.*?)```\n\n```\n(.*?)```", text, re.DOTALL)
    assert len([line for line in block.splitlines() if line]) <= 20
    exec(compile(block, str(README), "exec"), {})  # our own text
    assert capsys.readouterr().out == printed
    assert (tmp_path / "home.sgm").stat().st_size < 5000


def test_the_table_is_the_one_in_results():
    """Every number of the README's Table 1 is that of results/table_1.csv, or the paper's."""
    ours: dict[str, dict[str, float]] = {}
    with (README.parent / "results" / "table_1.csv").open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            ours.setdefault(row["policy"], {})[row["setting"]] = float(row["mean"])
    lines = re.findall(
        r"^\| ([\w +()-]+) \| (.*[\d*)].*) \|$", README.read_text(encoding="utf-8"), re.M
    )
    found = {name.replace(" ", "_"): cells.split(" | ") for name, cells in lines if "." in cells}
    found = {name: cells for name, cells in found.items() if len(cells) == len(SETTINGS)}
    for name in ours:
        cells = found[name if name in found else name.replace(" ", "_")]
        for setting, cell in zip(SETTINGS, cells, strict=True):
            digits = 2 if setting.task == "find_object" else 3
            numbers = [float(number) for number in re.findall(r"\d*\.\d+", cell)]
            expected = [ours[name][setting.name]]
            if name in PAPER_TABLE_1[setting.name]:
                expected.append(PAPER_TABLE_1[setting.name][name][0])
            assert numbers == [float(f"{value:.{digits}f}") for value in expected], (name, cell)
