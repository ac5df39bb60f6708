import numpy as np
from scipy import stats

from simulator.dynamics import evolve
from simulator.tasks.predict_location import choose_furniture, compute_answers, sample_query


def test_half_of_the_queries_are_about_an_object_that_has_just_moved(make_default_houses):
    """P(a query is about object i) = 1/2 moved_i / #moved + 1/2 w_i / sum of w."""
    houses = make_default_houses(40, seed=1)
    num_types = len(houses.prior.objects)
    found_moved = expected_moved = variance = 0.0
    found, expected = np.zeros(num_types), np.zeros(num_types)
    rows = np.arange(40)
    for _ in range(40):
        evolve(houses)
        weight = np.where(houses.is_present, houses.move_freq[houses.object_type], 0.0)
        law = 0.5 * houses.object_moved / houses.object_moved.sum(axis=1, keepdims=True)
        law += 0.5 * weight / weight.sum(axis=1, keepdims=True)
        slot = sample_query(houses)
        assert houses.is_present[rows, slot].all()
        moved = (law * houses.object_moved).sum(axis=1)
        found_moved += houses.object_moved[rows, slot].sum()
        expected_moved += moved.sum()
        variance += (moved * (1 - moved)).sum()
        found += np.bincount(houses.object_type[rows, slot], minlength=num_types)
        expected += np.bincount(houses.object_type.ravel(), law.ravel(), minlength=num_types)
    assert abs(found_moved - expected_moved) < 3 * np.sqrt(variance)
    assert 0.5 < found_moved / 1600 < 0.56  # a mover may be drawn by its frequency, too
    common = expected >= 8
    pooled = [*found[common], found[~common].sum()], [*expected[common], expected[~common].sum()]
    assert stats.chisquare(*pooled).pvalue > 0.01


def test_moved_objects_are_asked_for_alike_and_the_others_by_frequency(make_tiny_houses):
    """Two movers, one of them removed again: the other one gets the whole first half."""
    houses = make_tiny_houses(2000, houses=list(range(2000)))
    houses.object_moved[:, [0, 1]] = True
    houses.object_place[:, 1] = -1
    houses.move_freq = np.zeros(10)  # then all that are present alike: 1 in 35
    slot = sample_query(houses)
    assert (slot != 1).all()
    share = 0.5 + 0.5 / 35
    assert stats.binomtest(int((slot == 0).sum()), 2000, share).pvalue > 0.01


def test_without_movers_the_frequency_decides(make_tiny_houses):
    houses = make_tiny_houses(1000)
    weight = houses.move_freq[houses.object_type] * houses.is_present
    expected = np.bincount(
        houses.object_type.ravel(), (weight / weight.sum(axis=1, keepdims=True)).ravel(), 10
    )
    slot = sample_query(houses)
    found = np.bincount(houses.object_type[np.arange(1000), slot], minlength=10)
    assert found[3] == 0  # lamps never move, and are never asked for
    used = expected > 0
    assert stats.chisquare(found[used], expected[used]).pvalue > 0.01


def test_every_holder_of_the_description_is_an_answer(make_default_houses):
    houses = make_default_houses(5)
    for _ in range(10):
        evolve(houses)
        slot = sample_query(houses)
        code = houses.object_code[np.arange(5), slot]
        answers = compute_answers(houses, code)
        for house in range(5):
            holders = {
                int(houses.object_place[house, other]) // 2
                for other in range(houses.num_slots)
                if houses.object_place[house, other] >= 0
                and houses.object_code[house, other] == code[house]
            }
            assert set(np.flatnonzero(answers[house])) == holders
            assert houses.object_furniture[house, slot[house]] in holders


def test_the_best_score_wins(make_tiny_houses):
    houses = make_tiny_houses(2)
    scores = np.array([[0, 1, 5, -np.inf, 2, 3], [-np.inf] * 5 + [-7.0]])
    assert choose_furniture(scores, houses).tolist() == [2, 5]


def test_ties_are_broken_evenly_and_no_opinion_is_a_tie_of_all(make_tiny_houses):
    houses = make_tiny_houses(900)
    tied = np.tile([0.0, 3.0, 3.0, -np.inf, 3.0, 1.0], (900, 1))
    counts = np.bincount(choose_furniture(tied, houses), minlength=6)
    assert counts.sum() == counts[[1, 2, 4]].sum()
    assert stats.chisquare(counts[[1, 2, 4]]).pvalue > 0.01
    counts = np.bincount(choose_furniture(np.full((900, 6), -np.inf), houses), minlength=6)
    assert stats.chisquare(counts).pvalue > 0.01
