import numpy as np
from scipy import stats

from sgm.policies.policy import Policy
from simulator.tasks.predict_location import predict_locations
from simulator.tasks.rollout import Rollout, compute_answers, sample_query


def test_half_of_the_queries_are_about_an_object_that_has_just_moved(make_default_homes):
    """P(a query is about object i) = 1/2 moved_i / #moved + 1/2 w_i / sum of w."""
    homes = make_default_homes(40, seed=1)
    num_types = len(homes.prior.objects)
    found_moved = expected_moved = variance = 0.0
    found, expected = np.zeros(num_types), np.zeros(num_types)
    rows = np.arange(40)
    for _ in range(40):
        homes.evolve()
        weight = np.where(homes.is_present, homes.move_freq[homes.object_type], 0.0)
        law = 0.5 * homes.object_moved / homes.object_moved.sum(axis=1, keepdims=True)
        law += 0.5 * weight / weight.sum(axis=1, keepdims=True)
        slot = sample_query(homes)
        assert homes.is_present[rows, slot].all()
        moved = (law * homes.object_moved).sum(axis=1)
        found_moved += homes.object_moved[rows, slot].sum()
        expected_moved += moved.sum()
        variance += (moved * (1 - moved)).sum()
        found += np.bincount(homes.object_type[rows, slot], minlength=num_types)
        expected += np.bincount(homes.object_type.ravel(), law.ravel(), minlength=num_types)
    assert abs(found_moved - expected_moved) < 3 * np.sqrt(variance)
    assert 0.5 < found_moved / 1600 < 0.56  # a mover may be drawn by its frequency, too
    common = expected >= 8
    pooled = [*found[common], found[~common].sum()], [*expected[common], expected[~common].sum()]
    assert stats.chisquare(*pooled).pvalue > 0.01


def test_moved_objects_are_asked_for_alike_and_the_others_by_frequency(make_tiny_homes):
    """Two movers, one of them removed again: the other one gets the whole first half."""
    homes = make_tiny_homes(2000, homes=list(range(2000)))
    homes.object_moved[:, [0, 1]] = True
    homes.object_place[:, 1] = -1
    homes.move_freq = np.zeros(10)  # then all that are present alike: 1 in 35
    slot = sample_query(homes)
    assert (slot != 1).all()
    share = 0.5 + 0.5 / 35
    assert stats.binomtest(int((slot == 0).sum()), 2000, share).pvalue > 0.01


def test_without_movers_the_frequency_decides(make_tiny_homes):
    homes = make_tiny_homes(1000)
    weight = homes.move_freq[homes.object_type] * homes.is_present
    expected = np.bincount(
        homes.object_type.ravel(), (weight / weight.sum(axis=1, keepdims=True)).ravel(), 10
    )
    slot = sample_query(homes)
    found = np.bincount(homes.object_type[np.arange(1000), slot], minlength=10)
    assert found[3] == 0  # lamps never move, and are never asked for
    used = expected > 0
    assert stats.chisquare(found[used], expected[used]).pvalue > 0.01


def test_every_holder_of_the_description_is_an_answer(make_default_homes):
    homes = make_default_homes(5)
    for _ in range(10):
        homes.evolve()
        slot = sample_query(homes)
        code = homes.object_code[np.arange(5), slot]
        answers = compute_answers(homes, code)
        for home in range(5):
            holders = {
                int(homes.object_place[home, other]) // 2
                for other in range(homes.num_slots)
                if homes.object_place[home, other] >= 0
                and homes.object_code[home, other] == code[home]
            }
            assert set(np.flatnonzero(answers[home])) == holders
            assert homes.object_furniture[home, slot[home]] in holders


class Fixed(Policy):
    """The same scores whatever is asked."""

    def __init__(self, scores):
        self._scores = np.array(scores, dtype=float)

    def scores(self, memory, queries):
        return np.tile(self._scores, (len(queries.home), 1))


def choose(homes, scores):
    """Where the first question of each home leads to, (H,)."""
    return next(predict_locations(Rollout(homes, Fixed(scores)), 1)).choice


def test_the_best_score_wins(make_tiny_homes):
    assert choose(make_tiny_homes(2), [0, 1, 5, -np.inf, 2, 3]).tolist() == [2, 2]
    assert choose(make_tiny_homes(2), [-np.inf] * 5 + [-7.0]).tolist() == [5, 5]


def test_ties_are_broken_evenly_and_no_opinion_is_a_tie_of_all(make_tiny_homes):
    homes = make_tiny_homes(900)
    counts = np.bincount(choose(homes, [0.0, 3.0, 3.0, -np.inf, 3.0, 1.0]), minlength=6)
    assert counts.sum() == counts[[1, 2, 4]].sum()
    assert stats.chisquare(counts[[1, 2, 4]]).pvalue > 0.01
    counts = np.bincount(choose(homes, [-np.inf] * 6), minlength=6)
    assert stats.chisquare(counts).pvalue > 0.01
