"""A finder that learns its home from the log of its looks."""

from dataclasses import replace

import numpy as np
import pytest

from nep.robot.finder import ObjectFinder
from sgm.finder.adaptation import (
    MIN_QUESTIONS,
    Adaptation,
    Questions,
    compute_accuracy,
    compute_nll,
    fit_adaptation,
)
from simulator import SceneGraphMemory, Sighting

PLACES = ("fridge", "cooktop", "sink", "counter", "table")


def make_questions(rng, bias, num_questions=400) -> Questions:
    """Answers drawn from softmax(logit + bias)."""
    scores = rng.normal(size=(num_questions, len(bias)))
    changed = scores + bias + rng.gumbel(size=scores.shape)
    belief = np.full(scores.shape, 1 / len(bias))
    has_moved = np.zeros(num_questions, dtype=bool)
    return Questions(scores, belief, changed.argmax(axis=1), has_moved, tuple(range(len(bias))))


def test_a_home_that_differs_is_learnt_and_held_out_looks_are_likelier():
    bias = np.array([1.5, -1.5, 0, 0])
    questions = make_questions(np.random.default_rng(0), bias, 4000)
    found = fit_adaptation(questions)
    assert found.is_used
    assert found.nll_after < found.nll_before - 0.1
    assert found.bias[0] - found.bias[1] == pytest.approx(3, abs=0.25)
    fresh = make_questions(np.random.default_rng(1), bias)
    assert compute_nll(fresh, found) < compute_nll(fresh, Adaptation()) - 0.1


def test_a_gain_that_may_be_chance_is_left_out():
    """Homes that are as the network says, where what has moved is rare and counts for much."""
    kept = 0
    for seed in range(60):
        rng = np.random.default_rng(seed)
        questions = make_questions(rng, np.zeros(12), 300)
        has_moved = rng.random(300) < 0.07
        kept += fit_adaptation(replace(questions, has_moved=has_moved, asks_moved=0.5)).is_used
    assert kept <= 5  # 12 where any gain will do


def test_what_does_not_help_is_left_out():
    """The first looks say the opposite of the latest."""
    rng = np.random.default_rng(0)
    one, other = (make_questions(rng, np.array(bias)) for bias in ([2.0, 0], [-2.0, 0]))
    both = Questions(
        np.concatenate([one.scores, other.scores[:180]]),
        np.concatenate([one.belief, other.belief[:180]]),
        np.concatenate([one.answer, other.answer[:180]]),
        np.zeros(580, dtype=bool),
        one.furniture,
    )
    found = fit_adaptation(both)
    assert not found.is_used
    assert found.nll_after == found.nll_before
    scores = rng.normal(size=(3, 2))
    assert found.change(scores, scores, (0, 1)) is scores


def test_what_has_moved_makes_half_of_the_weight_where_it_is_asked_for_as_often():
    # Four questions, one about what moved: weights 2 and 2/3. Two places, logits ln 3 and 0: 3/4
    # for the first. The moved one is at the second place: nll = (2 ln 4 + 3 2/3 ln 4/3) / 4; right
    # are those that stayed: half of the weight.
    scores = np.tile([np.log(3.0), 0.0], (4, 1))
    has_moved = np.array([True, False, False, False])
    questions = Questions(scores, scores, np.array([1, 0, 0, 0]), has_moved, (0, 1), 0.5)
    np.testing.assert_allclose(questions.weights, [2, 2 / 3, 2 / 3, 2 / 3])
    assert compute_nll(questions, Adaptation()) == pytest.approx(np.log(4) - np.log(3) / 2)
    assert compute_accuracy(questions) == pytest.approx(0.5)
    for asks_moved in (0.0, 0.25):  # no less than as it comes
        np.testing.assert_array_equal(replace(questions, asks_moved=asks_moved).weights, 1)


def test_too_few_questions_are_an_error():
    questions = make_questions(np.random.default_rng(0), np.zeros(3), MIN_QUESTIONS - 1)
    with pytest.raises(ValueError, match=rf"at least {MIN_QUESTIONS} things, got 29"):
        fit_adaptation(questions)


def test_files(tmp_path):
    found = Adaptation(0.9, 0.2, {3: 0.5, 7: -0.25}, 50, 1.5, 1.25)
    found.save(tmp_path / "home.adapted.json")
    assert Adaptation.load(tmp_path / "home.adapted.json") == found
    for text in ("{}", "[1]", '{"format": "scene graph memory: adaptation", "bias": {"a": 1}}'):
        (tmp_path / "bad.json").write_text(text)
        with pytest.raises(ValueError, match=r"adaptation must be a file .* in .*bad.json"):
            Adaptation.load(tmp_path / "bad.json")


@pytest.fixture(scope="module")
def home(tmp_path_factory):
    """Forks lie in the sink here, as no other home has it: looked at everywhere for 20 steps."""
    log = tmp_path_factory.mktemp("home") / "looks.jsonl"
    memory = SceneGraphMemory(log=log)
    kitchen = memory.add_room("kitchen")
    places = [memory.add_furniture(label, kitchen) for label in PLACES]
    for step in range(20):
        for place, label in zip(places, PLACES, strict=True):
            things = {"sink": ["fork"], "counter": ["mug"] if step % 2 else []}
            things["table"] = [] if step % 2 else ["mug"]
            memory.observe(place, [Sighting(name) for name in things.get(label, ())])
        memory.step()
    return memory, log


def test_questions_say_what_has_moved(home):
    """The mug is elsewhere in each of 20 steps, after the first; the fork stays."""
    _, log = home
    questions = ObjectFinder.load("heat").ask_again(log)
    assert len(questions) == 40
    assert questions.has_moved.sum() == 19
    assert set(questions.answer[questions.has_moved]) == {3, 4}


def test_a_finder_adapts_to_the_log_of_a_home(home, tmp_path):
    memory, log = home
    finder = ObjectFinder.load("heat")
    before = finder.rank(memory, "fork")
    found = finder.adapt(log)
    assert found.num_questions == 40
    assert found.is_used
    assert found.nll_after < found.nll_before
    after = finder.rank(memory, "fork")
    assert after[0].name == "sink in kitchen"
    assert after[0].probability > before[0].probability
    found.save(tmp_path / "home.adapted.json")
    other = ObjectFinder.load("heat")
    other.adaptation = Adaptation.load(tmp_path / "home.adapted.json")
    assert [place.probability for place in other.rank(memory, "fork")] == [
        place.probability for place in after
    ]
