"""Pages of docs/ as what they are: blocks of Python with what they print, files, commands."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

DOCS = Path(__file__).resolve().parents[1] / "docs"
# A block of Python, and the block of text below it, which is what it prints.
BLOCK = re.compile(r"^```python\n(.*?)^```\n(?:\n^```text\n(.*?)^```\n)?", re.MULTILINE | re.DOTALL)
SAVED = re.compile(r"ave this as `(\S+)`.*?\n```\w+\n(.*?)^```", re.MULTILINE | re.DOTALL)


def read_page(name: str) -> str:
    """The text of a page by its path in docs/."""
    return (DOCS / name).read_text("utf-8")


def run_page(text: str, name: str, capsys: Any) -> list[str]:
    """Run all Python of a page in order, hold it to what stands below, then run it again.

    The second run, in the same folder as a reader has it, must not fail; what it prints may differ,
    as it finds the files of the first.

    Returns:
        What each block prints in the second run.
    """
    blocks = BLOCK.findall(text)
    again: list[str] = []
    for is_first in (True, False):
        names = {"__name__": name}
        for code, printed in blocks:
            exec(compile(code, name, "exec"), names)  # our own text
            out = capsys.readouterr().out
            if is_first:
                assert out == printed, code
            else:
                again.append(out)
    return again


def write_files(text: str, folder: Path) -> list[str]:
    """Write the files that a page says to save; return their names."""
    files = SAVED.findall(text)
    for name, content in files:
        (folder / name).write_text(content, "utf-8")
    return [name for name, _ in files]


def list_commands(text: str) -> Iterator[list[str]]:
    """The arguments of every `python` of a page's blocks of bash."""
    for block in re.findall(r"^```bash\n(.*?)^```", text, re.MULTILINE | re.DOTALL):
        for line in block.replace("\\\n", " ").splitlines():
            if line.startswith("python "):
                yield shlex.split(line, comments=True)[1:]
