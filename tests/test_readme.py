"""The Python of the README runs and prints what its comments say."""

import re
from pathlib import Path

README = Path(__file__).resolve().parents[1] / "README.md"


def test_the_ten_lines_run(capsys):
    blocks = re.findall(r"```python\n(.*?)```", README.read_text(encoding="utf-8"), re.DOTALL)
    assert len(blocks) == 1
    exec(compile(blocks[0], str(README), "exec"), {})  # our own text
    first, second = capsys.readouterr().out.splitlines()
    said = re.search(r"# (counter top in kitchen \S+), \.\.\.", blocks[0])
    assert first == said[1]
    assert second.startswith("round oak table in kitchen")
