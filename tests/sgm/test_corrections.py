"""What changes an answer after the network: one place, and one table of the guide."""

import re
from dataclasses import FrozenInstanceError, fields
from pathlib import Path

import numpy as np
import pytest

from sgm.belief import CORRECTIONS, Corrections, Detector
from sgm.finder.finder import Finder
from sgm.network.policy import mix_answers
from sgm.policies.heuristics import Bayesian
from sgm.policies.policy import Policy

ROOT = Path(__file__).parents[2]
GUIDE = (ROOT / "docs" / "reference" / "network.md").read_text(encoding="utf-8")
SECTION = GUIDE.partition("\n## After the network\n")[2].partition("\n## ")[0]


def test_every_number_says_what_it_is_and_is_in_the_guide():
    told = (Corrections.__doc__ or "").partition("Attributes:")[2]
    rows = dict(re.findall(r"^\| `(\w+)` \| ([^|]+?) \|", SECTION, re.MULTILINE))
    for field in fields(Corrections):
        assert re.search(rf"^ +[\w, ]*\b{field.name}\b[\w, ]*:", told, re.MULTILINE), field.name
        assert float(rows[field.name].partition(" ")[0]) == getattr(CORRECTIONS, field.name)
    assert set(rows) == {field.name for field in fields(Corrections)}


def test_the_defaults_of_others_are_read_from_there():
    assert Detector().repeated_share == CORRECTIONS.repeated_share
    assert Policy.looks_counted == CORRECTIONS.looks_counted
    assert Finder(Bayesian()).elsewhere_share == CORRECTIONS.elsewhere_share
    with pytest.raises(FrozenInstanceError):
        CORRECTIONS.anywhere = 0.0


class Told:
    """Stands for features: the filter of the prior is sure of the last of three places."""

    def __init__(self, trust, asked=None):
        self._trust, self._asked = np.array([trust]), asked
        self.asked = self
        self.is_place = np.ones((1, 3), dtype=bool)

    def follow_prior(self):
        return self._trust, np.array([[0.0, 0.0, 1.0]])

    def compare_asked(self):
        return self._asked


@pytest.mark.parametrize(("trust", "share"), [(0.0, 0.05), (1.0, 0.5), (0.5, 0.275)])
def test_the_share_of_the_prior_by_hand(trust, share):
    """.05 (1 + 9 trust) of what the network, which is sure of nothing, gives away."""
    scores = mix_answers(np.zeros((1, 3, 1)), Told(trust), 0.05, asks_moved=0.5)
    odds = np.exp(scores[0, :, 0])
    expected = (1 - share) / 3 + np.array([0, 0, share])
    np.testing.assert_allclose(odds / odds.sum(), expected, atol=1e-6)


def test_four_tenths_of_what_other_questions_mean():
    """None of them about what has just moved: .4 of the logarithm; half as many moved: .2."""
    ratio = np.log([[1.0, 2.0, 4.0]])
    for asks_moved, weight in ((0.0, 0.4), (0.25, 0.2), (0.5, 0.0)):
        scores = mix_answers(np.zeros((1, 3, 1)), Told(0.0, ratio), 0.0, asks_moved)
        np.testing.assert_allclose(scores[0, :, 0], weight * ratio[0], atol=1e-6)
