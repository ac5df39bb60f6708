"""The table of the paper's path in docs/design.md: where to change what."""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FOLDERS = ("datamodules", "nep/paper", "nep/training")


def list_named() -> set[Path]:
    """Files in the tables of the section; one without a folder lies in that of the one before."""
    page = (ROOT / "docs" / "design.md").read_text(encoding="utf-8")
    section = page.split("### The walk of a batch to the paper's loss", 1)[1].split("\n### ", 1)[0]
    named, folder = set(), ROOT
    for row in re.findall(r"^\|.*\| (`.*`) \|$", section, re.MULTILINE):
        for name in re.findall(r"`([\w/]+\.py)`", row):
            folder = (ROOT / name).parent if "/" in name else folder
            named.add(folder / Path(name).name)
    return named


def test_every_file_of_the_path_is_named_and_no_other():
    files = {file for folder in FOLDERS for file in (ROOT / folder).rglob("*.py")}
    assert list_named() == {file for file in files if file.name != "__init__.py"}
