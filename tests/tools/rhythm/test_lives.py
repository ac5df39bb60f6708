"""Robots among things with habits are asked what is true, of what they have seen."""

from itertools import islice

import numpy as np
import pytest

from tools.rhythm.answers import MOST_PLACES, POLICIES, collect_answers, read_past
from tools.rhythm.habits import live_by_habits
from tools.rhythm.lives import NUM_DAYS, STEPS_PER_DAY


def test_questions_are_about_what_was_seen_and_about_times_to_come():
    asked = []
    for question in islice(live_by_habits(0), 40):
        names = {thing.description for thing in question.memory._state.things}
        assert question.thing in names
        assert question.memory.time <= question.at < NUM_DAYS * STEPS_PER_DAY
        assert question.place is None or question.place in question.memory.furniture_ids
        asked.append((question.memory.time, question.thing, question.at, question.place))
    again = [(q.memory.time, q.thing, q.at, q.place) for q in islice(live_by_habits(0), 40)]
    assert asked == again
    assert any(at > time for time, _, at, _ in asked)


@pytest.mark.slow
def test_answers_are_probabilities_and_read_again():
    answers = collect_answers(islice(live_by_habits(1), 12))
    for policy in POLICIES:
        assert answers[policy].shape == (12, MOST_PLACES + 1)
        np.testing.assert_allclose(answers[policy].sum(axis=1), 1, atol=1e-5)
    past = read_past(answers)
    assert len(past.now) == 12
    assert (np.diff(past.query) >= 0).all()
    assert ((answers["answer"] == MOST_PLACES) | (answers["answer"] < past.is_place.sum(1))).all()
