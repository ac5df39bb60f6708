"""The two numbers of `in_use`, fitted where the answer is known."""

import numpy as np
import pytest

from sgm.network.network import Network
from sgm.network.policy import NetworkPolicy
from sgm.network.shipped import find_trained
from tools.kitchens.in_use import UseQuestion, ask, compute_loss, fit, main


def test_the_numbers_of_a_law_are_found():
    rng = np.random.default_rng(0)
    before = rng.normal(2, 2, 20_000)
    after = before + rng.normal(0, 1, len(before))  # looks of the step
    stays = 1 / (1 + np.exp(-(after - 1 + (0.5 - 1) * before)))
    has_moved = rng.random(len(before)) > stays
    questions = [
        UseQuestion(before=b, after=a, has_moved=bool(m))
        for b, a, m in zip(before, after, has_moved, strict=True)
    ]
    bias, slope = fit(questions)
    assert bias == pytest.approx(-1, abs=0.1)
    assert slope == pytest.approx(0.5, abs=0.05)
    assert compute_loss(questions, bias, slope) < compute_loss(questions, 0, 1)


def test_loss_by_hand():
    """Odds of 3 to 1: it stays with .75. By bias -log 3, one to one: .5."""
    odds = np.log(3)
    questions = [UseQuestion(before=odds, after=odds, has_moved=False)]
    assert compute_loss(questions, 0, 1) == pytest.approx(-np.log(0.75))
    assert compute_loss(questions, -odds, 1) == pytest.approx(-np.log(0.5))
    assert compute_loss(questions, 0, 0) == pytest.approx(-np.log(0.5))


@pytest.mark.slow
def test_a_home_is_asked_for_what_was_moved_lately():
    policy = NetworkPolicy(Network.load(find_trained("any_home")), 0.0)
    questions = list(ask(0, policy))
    assert {question.has_moved for question in questions} == {False, True}
    assert questions == list(ask(0, policy))


def test_homes_have_to_be_some(capsys):
    with pytest.raises(SystemExit):
        main(["--homes", "0"])
    assert "homes must be at least 1, got 0" in capsys.readouterr().err
