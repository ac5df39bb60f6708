import numpy as np
from scipy import stats

from simulator.world.sensing import observe


def list_truth(homes, home, furniture):
    here = homes.object_furniture[home] == furniture
    codes, places = homes.object_code[home, here], homes.object_place[home, here]
    return sorted(zip(codes.tolist(), (places % 2).tolist(), strict=True))


def list_seen(observation, home):
    own = observation.seen_home == home
    pairs = zip(observation.seen_code[own].tolist(), observation.seen_relation[own].tolist(),
                strict=True)  # fmt: skip
    return sorted(pairs)


def test_what_is_seen_is_there(make_default_homes):
    homes = make_default_homes(8)
    rng = np.random.default_rng(0)
    for _ in range(20):
        homes.evolve()
        furniture = rng.integers(0, 32, 8)
        observation = observe(homes, furniture)
        np.testing.assert_array_equal(observation.home, np.arange(8))
        np.testing.assert_array_equal(observation.furniture, furniture)
        for home in range(8):
            truth = list_truth(homes, home, furniture[home])
            for pair in list_seen(observation, home):
                truth.remove(pair)  # fails if it is not there, or not that often


def test_a_perfect_detector_sees_all_and_a_blind_one_nothing(make_default_homes):
    furniture = np.array([3, 9, 30])
    perfect = observe(homes := make_default_homes(3, detection_error=0), furniture)
    for home in range(3):
        assert list_seen(perfect, home) == list_truth(homes, home, furniture[home])
    blind = observe(make_default_homes(3, detection_error=1), furniture)
    assert len(blind.seen_code) == 0
    assert blind.home.tolist() == [0, 1, 2]


def test_a_home_may_pass(make_default_homes):
    homes = make_default_homes(3, detection_error=0)
    observation = observe(homes, np.array([4, -1, 0]))
    assert observation.home.tolist() == [0, 2]
    assert observation.furniture.tolist() == [4, 0]
    assert set(observation.seen_home) == {0, 2}


def test_what_a_home_sees_does_not_depend_on_who_else_looks(make_default_homes):
    alone, beside = make_default_homes(homes=[1], seed=4), make_default_homes(3, seed=4)
    rng = np.random.default_rng(0)
    for furniture in rng.integers(-1, 32, 60):
        others = rng.integers(-1, 32, 3)
        others[1] = furniture
        expected = list_seen(observe(alone, furniture[None]), 0)
        assert list_seen(observe(beside, others), 1) == expected


def test_a_quarter_is_missed_independently(make_default_homes):
    """Misses per look at 6 objects are binomial: (6 over k) 0.25^k 0.75^(6-k)."""
    homes = make_default_homes(40, seed=1)
    misses = []
    for furniture in range(32):
        observation = observe(homes, np.full(40, furniture))
        seen = np.bincount(observation.seen_home, minlength=40)
        there = (homes.object_furniture == furniture).sum(axis=1)
        misses.extend((there - seen)[there == 6])
    counts = np.bincount(misses, minlength=7)
    law = stats.binom.pmf(np.arange(7), 6, 0.25) * counts.sum()
    pooled = [*counts[:4], counts[4:].sum()], [*law[:4], law[4:].sum()]
    assert counts.sum() > 1000
    assert stats.chisquare(*pooled).pvalue > 0.01
