"""A prior built from a small table, for tests of the commands that build and read priors."""

from __future__ import annotations

from pathlib import Path

from tools.priors.__main__ import main

TABLE = """room,furniture,object,relation,weight
kitchen,fridge,egg,,6
kitchen,counter,egg,,2
kitchen,counter,mug,,5
kitchen,table,mug,,5
bedroom,bed,book,,9
bedroom,desk,book,,1
bedroom,desk,unicorn,,1
"""


def build_prior(folder: Path) -> Path:
    """Write the table, build a prior from it, and return its file."""
    table, path = folder / "mine.csv", folder / "mine.json"
    table.write_text(TABLE)
    arguments = ["build", "--source", f"table={table}", "--out", str(path), "--min-edges", "1"]
    assert main(arguments) == 0
    return path
