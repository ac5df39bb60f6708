"""Where things have been most of the time, by hand."""

from types import SimpleNamespace

import numpy as np
import pytest

from simulator.policies import POLICIES
from simulator.tasks.evaluation import evaluate_policy
from simulator.tasks.usual_places import UsualPlaces
from simulator.world.source import SampledSource
from simulator.world.streams import Streams


@pytest.fixture
def homes():
    """One home with three places; slots 0 and 1 hold mugs (code 5), slot 2 a book (code 6)."""
    homes = SimpleNamespace(
        num_homes=1,
        num_slots=3,
        num_furniture=3,
        object_code=np.array([[5, 5, 6]]),
        object_place=np.array([[0, 1, 4]]),  # furniture 0, 0 and 2, two relations each
    )
    return homes


def ask(usual, code, *furniture):
    """Is a thing of this code that is there out of its place?"""
    answers = np.zeros((1, 3), dtype=bool)
    answers[0, list(furniture)] = True
    return bool(usual.compute_out_of_place(np.array([0]), np.array([code]), answers)[0])


@pytest.mark.slow
def test_the_usual_place_is_where_things_of_a_name_were_most_often(homes):
    usual = UsualPlaces(homes)  # mugs: 2 on furniture 0
    homes.object_place[0, 0] = 2
    usual.count()  # 3 on furniture 0, 1 on furniture 1
    assert ask(usual, 5, 1)
    assert not ask(usual, 5, 0)
    assert not ask(usual, 5, 0, 1)  # one of them is where they are usually
    homes.object_place[0, :2] = 2
    usual.count()  # 3 on each: both are usual
    assert not ask(usual, 5, 1)
    assert ask(usual, 5, 2)


def test_what_was_never_there_is_not_out_of_place(homes):
    homes.object_place[0, 2] = -1
    usual = UsualPlaces(homes)
    assert not ask(usual, 6, 1)
    assert not ask(usual, 7, 1)


def test_another_thing_in_the_same_slot_starts_anew(homes):
    usual = UsualPlaces(homes)
    homes.object_code[0, 2] = 9  # the book has gone, a pen has come
    assert not ask(usual, 9, 0)
    homes.object_place[0, 2] = 0
    usual.count()
    assert ask(usual, 9, 2)
    assert not ask(usual, 9, 0)


def test_the_same_questions_are_out_of_place_for_every_policy(default_prior):
    found = [
        evaluate_policy(
            POLICIES[name].make, SampledSource(default_prior), Streams(4, "val", range(3)), 15
        ).is_out_of_place
        for name in ("random", "bayesian")
    ]
    np.testing.assert_array_equal(*found)
    assert 0 < found[0].mean() < 1
