"""How many files of ours an import loads, and what a call walks through."""

import pytest

from tools.closures import MOST_FILES, MOST_WALKED, list_closure, profile, walk_calls

FORBIDDEN = ("nep.bench", "nep.robot", "sgm.finder", "simulator.trace", "simulator.events", "tools")


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


def test_a_look_and_a_question_cross_no_more_files_than_they_may():
    walks = walk_calls()
    for name, (most_files, most_returns) in MOST_WALKED.items():
        assert len(walks[name].files) <= most_files, (name, walks[name].files)
        assert walks[name].returns <= most_returns, name
    assert {"sgm/evidence/question.py"} <= {*walks["rank first"].files} - {*walks["rank"].files}
