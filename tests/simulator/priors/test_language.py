"""Priors from word vectors and from filled-in tables."""

from __future__ import annotations

import re
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest

from sgm.prior.prior_graph import FurnitureType, ObjectType, Placement, PriorGraph
from simulator.priors.__main__ import main
from simulator.priors.language import COLUMNS, make_prompt, make_word_prior, read_filled

DOCS = Path(__file__).parents[3] / "docs"
PAGE = (DOCS / "priors.md").read_text("utf-8")
BASE = PriorGraph(
    rooms=("kitchen", "bedroom"),
    furniture=tuple(
        FurnitureType(label, room, 1.0, 2, ())
        for label, room in (("fridge", "kitchen"), ("shelf", "kitchen"), ("shelf", "bedroom"))
    ),
    objects=(ObjectType("milk", 0.5, 3, 0.25, 0.01, ()),),
    placements=(
        Placement("kitchen", "fridge", "milk", "in", 0.75),
        Placement("kitchen", "shelf", "milk", "onTop", 0.2),
        Placement("bedroom", "shelf", "milk", "onTop", 0.05),
    ),
)


class Vectors:
    """Labels along three axes."""

    name = "by hand"
    known: ClassVar = {
        "milk": (1, 0, 0), "fridge": (2, 0, 0), "shelf": (0, 1, 0), "kitchen": (0, 0, 3),
        "bedroom": (-1, 0, 0),
    }  # fmt: skip

    def vectors(self, labels):
        return np.array([self.known[label] for label in labels], dtype=float)


def test_word_prior_by_hand(monkeypatch):
    """Cosine of milk: fridge 1 + kitchen 0, shelf 0 + 0, shelf of the bedroom 0 - 1."""
    prior = make_word_prior(BASE, Vectors(), temperature=0.5)
    weights = {(row.room, row.furniture): row.prob for row in prior.placements}
    total = np.exp(2) + 1 + np.exp(-2)
    assert weights == pytest.approx(
        {
            ("kitchen", "fridge"): np.exp(2) / total,
            ("kitchen", "shelf"): 1 / total,
            ("bedroom", "shelf"): np.exp(-2) / total,
        },
        abs=1e-6,
    )
    assert {row.furniture: row.relation for row in prior.placements} == {
        "fridge": "in",
        "shelf": "onTop",
    }
    assert prior.objects == BASE.objects
    monkeypatch.setattr("simulator.priors.language.NUM_PLACES", 2)
    two = make_word_prior(BASE, Vectors(), temperature=0.5)
    assert [row.furniture for row in two.placements] == ["fridge", "shelf"]
    with pytest.raises(ValueError, match="temperature must be above 0, got 0"):
        make_word_prior(BASE, Vectors(), temperature=0)


def test_word_prior_reads_no_placement():
    other = PriorGraph(
        BASE.rooms,
        BASE.furniture,
        BASE.objects,
        (
            Placement("kitchen", "fridge", "milk", "in", 0.01),
            Placement("kitchen", "shelf", "milk", "onTop", 0.98),
            Placement("bedroom", "shelf", "milk", "onTop", 0.01),
        ),
    )
    one, two = (make_word_prior(base, Vectors()) for base in (BASE, other))
    assert one.placements == two.placements


def write(tmp_path: Path, *rows: str) -> Path:
    path = tmp_path / "table.csv"
    path.write_text("\n".join([",".join(COLUMNS), *rows]) + "\n")
    return path


def test_a_filled_table_by_hand(tmp_path):
    """Milk 3 : 1; a mug with weight 2 on any shelf, one on each; rows of a place add up."""
    prior = read_filled(
        write(
            tmp_path,
            "kitchen,fridge,Milk,in,2",
            "kitchen,fridge,milk,in,1",
            "kitchen,shelf,milk,,1",
            ",shelf,mug,,2",
        ),
        BASE,
    )
    found = {
        (row.object, row.room, row.furniture, row.relation): row.prob for row in prior.placements
    }
    assert found == {
        ("milk", "kitchen", "fridge", "in"): 0.75,
        ("milk", "kitchen", "shelf", "onTop"): 0.25,
        ("mug", "kitchen", "shelf", "onTop"): 0.5,
        ("mug", "bedroom", "shelf", "onTop"): 0.5,
    }
    assert prior.objects[0] == BASE.objects[0]  # what is known of it stays
    assert prior.objects[1].label == "mug"


@pytest.mark.parametrize(
    ("row", "message"),
    [
        (
            "kitchen,sofa,mug,in,1",
            r"furniture must be one of the prior's, got 'sofa' at table.csv:2",
        ),
        ("bedroom,fridge,mug,in,1", "room must be one that has a fridge, kitchen, got 'bedroom'"),
        ("kitchen,fridge,mug,under,1", "relation must be in, onTop or empty, got 'under'"),
        ("kitchen,fridge,mug,in,many", "a weight that is a number"),
        ("kitchen,fridge,,in,1", "row must have an object"),
        ("kitchen,fridge,mug,in,-1", "weight must be from 0 on, got '-1'"),
        ("kitchen,fridge,mug,in", "row must have 5 cells, got 4 at table.csv:2"),
        ("kitchen,fridge,mug,in,0", "table must have a row with a weight"),
    ],
)
def test_a_bad_row_is_named(tmp_path, row, message):
    with pytest.raises(ValueError, match=message):
        read_filled(write(tmp_path, row), BASE)


def test_other_columns_are_refused(tmp_path):
    path = tmp_path / "table.csv"
    path.write_text("place,thing\n")
    with pytest.raises(ValueError, match="columns must be room,furniture,object,relation,weight"):
        read_filled(path, BASE)


def test_the_prompt_offers_every_place_and_thing():
    text = make_prompt(BASE, ["mug", "phone charger"])
    assert "- kitchen: fridge, shelf\n- bedroom: shelf" in text
    assert text.endswith("Things:\nmug, phone charger\n")
    assert "room,furniture,object,relation,weight" in text
    assert "milk" in make_prompt(BASE)


def test_the_example_of_the_page_is_a_prior(tmp_path, capsys):
    """What stands in docs/priors.md, with the household prior's own places."""
    assert "written by hand for this page, by no language model" in PAGE
    table = re.search(r"Save this as `table.csv`:\n\n```csv\n(.*?)```", PAGE, re.DOTALL).group(1)
    (tmp_path / "table.csv").write_text(table)
    out = tmp_path / "filled.json"
    assert main(["filled", str(tmp_path / "table.csv"), "--out", str(out)]) == 0
    assert "filled.json" in capsys.readouterr().out
    prior = PriorGraph.load(out)
    assert [row.label for row in prior.objects] == ["soup bowl", "phone charger", "tv remote"]
    bowl = {row.furniture: row.prob for row in prior.placements if row.object == "soup bowl"}
    assert bowl["kitchen cabinet"] == pytest.approx(8 / 21, abs=1e-6)


def test_the_commands(tmp_path, capsys):
    things = tmp_path / "things.txt"
    things.write_text("mug\n\nphone charger\n")
    assert main(["prompt", "--things", str(things)]) == 0
    assert capsys.readouterr().out.endswith("mug, phone charger\n")
    assert main(["words", "--base", "default", "--out", str(tmp_path / "words.json")]) == 0
    prior = PriorGraph.load(tmp_path / "words.json")
    assert prior.metadata["name"] == "words"
    assert {row.label for row in prior.objects} == {
        row.label for row in PriorGraph.default().objects
    }
    assert main(["filled", str(tmp_path / "none.csv"), "--out", str(tmp_path / "x.json")]) == 1


def test_the_table_of_a_language_model_is_the_answer_to_the_prompt_beside_it(tmp_path, capsys):
    folder = DOCS / "language_table"
    assert "written by a large language model" in (folder / "ABOUT.txt").read_text("utf-8")
    assert main(["prompt", "--things", str(folder / "things.txt")]) == 0
    assert capsys.readouterr().out == (folder / "prompt.txt").read_text("utf-8")
    prior = read_filled(folder / "table.csv")
    things = (folder / "things.txt").read_text("utf-8").splitlines()
    assert {row.label for row in prior.objects} == {*things}
    for thing in things:  # "three to six rows for each thing"
        assert 3 <= sum(row.object == thing for row in prior.placements) <= 6
    assert "[table](language_table/table.csv)" in PAGE
