"""Who opens a database closes it: Python 3.13 warns of one that the collector finds open."""

import re

from tests.imports import ROOT

FOLDERS = ("sgm", "simulator", "nep", "datamodules", "tools", "tests", "benchmarks", "docs")


def test_every_connection_is_closed_where_it_is_opened():
    files = [
        path
        for folder in FOLDERS
        for ending in ("py", "md", "ipynb")
        for path in (ROOT / folder).rglob(f"*.{ending}")
    ]
    opened = [
        (path.relative_to(ROOT).as_posix(), line.strip())
        for path in files
        for line in path.read_text("utf-8").splitlines()
        if re.search(r"sqlite3\.connect\(.", line) and "closing(sqlite3.connect(" not in line
    ]
    # In quotes: pandas closes nothing, and a page names the call in a sentence.
    assert [where for where, line in opened if "read_sql" not in line] == []
    assert len(files) > 500
