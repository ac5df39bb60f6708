"""The Python of the README runs and prints what its comments say."""

import csv
import re
from pathlib import Path

from nep.experiments import SETTINGS
from nep.paper_numbers import PAPER_TABLE_1

README = Path(__file__).resolve().parents[1] / "README.md"


def test_the_ten_lines_run(capsys):
    blocks = re.findall(r"```python\n(.*?)```", README.read_text(encoding="utf-8"), re.DOTALL)
    assert len(blocks) == 1
    exec(compile(blocks[0], str(README), "exec"), {})  # our own text
    first, second = capsys.readouterr().out.splitlines()
    said = re.search(r"# (counter top in kitchen \S+), \.\.\.", blocks[0])
    assert first == said[1]
    assert second.startswith("round oak table in kitchen")


def test_the_table_is_the_one_in_results():
    """Every number of the README's Table 1 is that of results/table_1.csv, or the paper's."""
    ours: dict[str, dict[str, float]] = {}
    with (README.parent / "results" / "table_1.csv").open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            ours.setdefault(row["policy"], {})[row["setting"]] = float(row["mean"])
    lines = re.findall(
        r"^\| ([\w +-]+) \| (.*[\d*)].*) \|$", README.read_text(encoding="utf-8"), re.M
    )
    found = {name.replace(" ", "_"): cells.split(" | ") for name, cells in lines if "." in cells}
    found = {name: cells for name, cells in found.items() if len(cells) == len(SETTINGS)}
    for name in ours:
        cells = found[name if name in found else name.replace(" ", "_")]
        for position, (setting, cell) in enumerate(zip(SETTINGS, cells, strict=True)):
            digits = 2 if setting.task == "find_object" else 3
            numbers = [float(number) for number in re.findall(r"\d*\.\d+", cell)]
            expected = [ours[name][setting.name]]
            if name in PAPER_TABLE_1:
                expected.append(PAPER_TABLE_1[name][position][0])
            assert numbers == [float(f"{value:.{digits}f}") for value in expected], (name, cell)
