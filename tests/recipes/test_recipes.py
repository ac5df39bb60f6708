"""The recipes of docs/extend, followed word for word in a copy of the packages."""

import os
import re
import shlex
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("sgm", "simulator", "datamodules", "nep", "tools")
# What the commands of a recipe print: the thing itself, in its table.
EXPECTED = {
    "A model": r"own +0\.\d+",
    "A policy": r"most_seen:MostSeen +0\.\d+",
    "A task": r"Two Guesses",
    "A source of homes": r"3 unseen flats x 5 steps(.|\n)*NEP +0\.\d+(.|\n)*3 test flats x 5 steps",
    "Dynamics": r'"name": "shuffle.Shuffle",\n *"share": 0.2\n',
    "Sensing": r'"name": "dark.DarkInside",\n *"inside": 0.6,\n *"on_top": 0.1\n',
    "A feature": r"crowded +0\.\d+",
    "A column of the memory": (
        r"\('mug',\) \[1\]\n\"num_asked\":\[1\](.|\n)*"
        r"features of an edge: 10\nmost looks that did not show it: [1-9]"
    ),
    # of 32 places, ties averaged: the MRR of no opinion is below .1, of one that is free it is 1
    "A metric": r"\| mrr \| rank above 1 \|(.|\n)*\| random \|.*\| 0\.0\d\d \| 1\.00 \|",
    "A suite": r"16 places(.|\n)*\| any_home \| 0\.\d+(.|\n)*Played with",
    "An importer of recorded homes": r"placed: 2 rooms, 3 furniture nodes, 4 objects",
    "A prior source": r"diary: 12 read(.|\n)*kitchen",
}


def read_recipes() -> dict[str, list[tuple[str, str]]]:
    """Title of each recipe, and its blocks as (language, text)."""
    pages = [path.read_text("utf-8") for path in sorted((ROOT / "docs" / "extend").glob("*.md"))]
    blocks = {
        page.partition("\n")[0].removeprefix("# "): re.findall(
            r"```(\w+)\n(.*?)```", page, re.DOTALL
        )
        for page in pages
    }
    return {title: found for title, found in blocks.items() if found}


RECIPES = read_recipes()


def apply_diff(folder: Path, text: str) -> None:
    """Add the lines of a diff to a file; the others must be there, one after the other."""
    name, _, body = text.removeprefix("--- ").partition("\n")
    path = folder / name
    content = path.read_text("utf-8")
    for hunk in body.split("@@\n"):
        lines = hunk.splitlines()
        before = "".join(line[1:] + "\n" for line in lines if not line.startswith("+"))
        after = "".join(line[1:] + "\n" for line in lines if not line.startswith("-"))
        assert content.count(before) == 1, f"{name} must have these lines once:\n{before}"
        content = content.replace(before, after)
    path.write_text(content, "utf-8")


def test_a_feature_is_an_entry_in_one_file():
    """Of a node, an edge and a query edge alike."""
    diffs = [text for language, text in RECIPES["A feature"] if language == "diff"]
    assert [text.split()[1] for text in diffs] == ["datamodules/features.py"]


def test_a_column_that_networks_read_takes_its_declaration_and_a_feature():
    """Whoever counts it aside, which the first part of the recipe shows."""
    diffs = [text for language, text in RECIPES["A column of the memory"] if language == "diff"]
    names = [text.split()[1] for text in diffs]
    assert names[:2] == ["sgm/schema.py", "sgm/memory/memory_batch.py"]
    assert names[2:] == ["sgm/schema.py", "datamodules/features.py"]


def follow(folder: Path, python: str, language: str, text: str) -> str:
    """Do what one block says; returns what its commands print."""
    if language == "diff":
        apply_diff(folder, text)
        return ""
    if language != "bash":
        path = folder / re.match(r"# (\S+)\n", text).group(1)
        assert path.parent.is_dir(), f"{path.parent} must be there, or be made by the recipe"
        path.write_text(text.partition("\n")[2], "utf-8")
        return ""
    script = f'set -e\npython() {{ {shlex.quote(python)} "$@"; }}\n{text}'
    environment = os.environ | {
        "PYTHONPATH": str(folder),
        "OMP_NUM_THREADS": "1",
        "COLUMNS": "200",
    }
    done = subprocess.run(
        ["bash", "-c", script],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_every_recipe_is_expected_to_show_something():
    assert RECIPES.keys() == EXPECTED.keys()


@pytest.mark.slow
@pytest.mark.parametrize("title", RECIPES)
def test_a_recipe_leads_to_its_table(tmp_path, python, title):
    for package in PACKAGES:  # with what Python and numba have compiled
        shutil.copytree(ROOT / package, tmp_path / package)
    printed = "".join(follow(tmp_path, python, *block) for block in RECIPES[title])
    assert re.search(EXPECTED[title], printed), printed
