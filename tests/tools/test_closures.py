"""How many files of ours an import loads, and what a call walks through."""

import re
from pathlib import Path

import pytest

from tools.closures import (
    MOST_FILES,
    MOST_STAYS,
    MOST_WALKED,
    list_closure,
    profile,
    walk_calls,
    walk_step,
)

ROOT = Path(__file__).resolve().parents[2]
FORBIDDEN = (
    *("nep.games", "nep.reproduce", "nep.robot"),
    *("sgm.finder", "simulator.trace", "simulator.events", "tools"),
)


@pytest.mark.slow
@pytest.mark.parametrize("module", MOST_FILES)
def test_an_import_loads_no_more_files_than_it_may(module):
    found = list_closure(module)
    assert module in found
    assert [name for name in found if name.startswith(FORBIDDEN)] == []
    assert len(found) <= MOST_FILES[module], found


def test_a_walk_is_counted_by_hand():
    from sgm.checks import check_at_least
    from sgm.messages import shorten

    def call():
        shorten(1)
        check_at_least(1, steps=1)
        shorten(2)

    walk = profile(call)
    assert walk.files == ("sgm/checks.py", "sgm/messages.py")
    assert walk.returns >= 1
    assert walk.calls >= 3
    assert walk.stays == 2 + walk.returns


def test_a_look_and_a_question_cross_no_more_files_than_they_may():
    walks = walk_calls()
    for name, (most_files, most_returns) in MOST_WALKED.items():
        assert len(walks[name].files) <= most_files, (name, walks[name].files)
        assert walks[name].returns <= most_returns, name
    assert {"sgm/evidence/question.py"} <= {*walks["rank first"].files} - {*walks["rank"].files}


def test_a_training_step_makes_no_more_stays_than_it_may():
    walk = walk_step()
    assert {"nep/paper/encoders/heat.py", "nep/paper/loss.py"} <= {*walk.files}
    assert walk.stays <= MOST_STAYS


def test_the_map_of_a_question_names_the_files_that_it_crosses():
    """Of the folders that know about a question; every file in the map is one of them."""
    page = (ROOT / "docs" / "design.md").read_text(encoding="utf-8")
    table = re.split(r"\n##+ ", page.split("### The walk of a question", 1)[1])[0]
    named = {Path(name).name for name in re.findall(r"`([\w/]+\.py)`", table)}
    walks = walk_calls()
    crossed = {Path(file) for file in walks["rank first"].files}
    about_questions = {"evidence", "network", "belief", "finder"}
    needed = {file.name for file in crossed if file.parent.name in about_questions}
    assert needed <= named, needed - named
    assert named <= {file.name for file in crossed} | {"columns.py"}  # of names alone
    again = {Path(file).parent.name for file in walks["rank"].files}
    assert not again & {"evidence", "network"}
