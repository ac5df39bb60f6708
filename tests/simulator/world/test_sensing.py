import numpy as np
import pytest
from scipy import stats

from simulator.world.config import HomeConfig
from simulator.world.sampled_homes import SampledHomes
from simulator.world.sensing import (
    Confidences,
    MissesPerFurniture,
    MissesPerType,
    PartialViews,
    observe,
)
from simulator.world.streams import Streams


def list_truth(homes, home, furniture):
    here = homes.object_furniture[home] == furniture
    codes, places = homes.object_code[home, here], homes.object_place[home, here]
    return sorted(zip(codes.tolist(), (places % 2).tolist(), strict=True))


def list_seen(observation, home):
    own = observation.seen_home == home
    pairs = zip(
        observation.seen_code[own].tolist(), observation.seen_relation[own].tolist(), strict=True
    )
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


def count_by_type(homes, label, num_looks=32):
    """Look everywhere; return how many objects of a type were seen and how many there are."""
    home = np.arange(homes.num_homes)
    number = list(homes.object_labels).index(label)
    seen = there = 0
    for furniture in range(num_looks):
        observation = observe(homes, np.full(len(home), furniture))
        seen += (homes.object_descriptions.type_of_code[observation.seen_code] == number).sum()
        is_there = (homes.object_furniture == furniture) & (homes.object_type == number)
        there += is_there.sum()
    return int(seen), int(there)


def test_misses_per_type_have_their_rates(make_default_homes):
    sensing = MissesPerType({"book": 0.9, "mug": 0.0})
    homes = make_default_homes(100, sensing=sensing, detection_error=0.5)
    seen, there = count_by_type(homes, "book")
    assert there > 300
    assert stats.binomtest(seen, there, 0.1).pvalue > 0.01
    seen, there = count_by_type(homes, "mug")
    assert seen == there > 50
    other = next(label for label in homes.object_labels if label not in sensing.rates)
    seen, there = count_by_type(homes, other)
    assert stats.binomtest(seen, there, 0.5).pvalue > 0.01


def test_misses_per_furniture_have_their_rates(make_default_homes):
    homes = make_default_homes(60, sensing=MissesPerFurniture({"bed": 0.8}), detection_error=0.1)
    counts = {True: [0, 0], False: [0, 0]}
    for furniture in range(32):
        seen = observe(homes, np.full(60, furniture))
        num_seen = np.bincount(seen.seen_home, minlength=60)
        there = (homes.object_furniture == furniture).sum(axis=1)
        is_bed = homes.furniture_labels[:, furniture] == "bed"
        for kind in (True, False):
            counts[kind][0] += int(num_seen[is_bed == kind].sum())
            counts[kind][1] += int(there[is_bed == kind].sum())
    assert counts[True][1] > 200
    assert stats.binomtest(*counts[True], 0.2).pvalue > 0.01
    assert stats.binomtest(*counts[False], 0.9).pvalue > 0.01


def test_partial_views_show_what_is_in_view(make_default_homes):
    """Coverage is uniform on [0.2, 1]; of what is there, coverage x (1 - 0.25) is seen."""
    homes = make_default_homes(100, sensing=PartialViews(lowest=0.2))
    coverages, expected, found = [], 0.0, 0
    variance = 0.0
    for furniture in range(32):
        seen = observe(homes, np.full(100, furniture))
        coverages.append(seen.coverage)
        there = (homes.object_furniture == furniture).sum(axis=1)
        share = 0.75 * seen.coverage
        expected += (there * share).sum()
        variance += (there * share * (1 - share)).sum()
        found += len(seen.seen_code)
    coverage = np.concatenate(coverages)
    assert stats.kstest(coverage, stats.uniform(0.2, 0.8).cdf).pvalue > 0.01
    assert abs(found - expected) < 3 * np.sqrt(variance)


def test_confidences_are_how_often_they_are_right(make_default_homes):
    homes = make_default_homes(100, sensing=Confidences(lowest=0.3), detection_error=0.0)
    rows = []
    for furniture in range(32):
        seen = observe(homes, np.full(100, furniture))
        truth = [set(list_truth(homes, home, furniture)) for home in range(100)]
        pairs = zip(seen.seen_home, seen.seen_code, seen.seen_relation, strict=True)
        is_right = [(code, relation) in truth[home] for home, code, relation in pairs]
        rows.append(np.stack([is_right, seen.seen_confidence], axis=1))
    right, confidence = np.concatenate(rows).T
    assert len(right) == homes.num_objects.sum()  # nothing is missed
    assert stats.kstest(confidence, stats.uniform(0.3, 0.7).cdf).pvalue > 0.01
    for low, high in ((0.3, 0.5), (0.5, 0.8), (0.8, 1.0)):
        own = (confidence >= low) & (confidence < high)
        error = np.sqrt((confidence[own] * (1 - confidence[own])).sum())
        assert abs(right[own].sum() - confidence[own].sum()) < 3 * error


def test_homes_of_one_group_may_have_sensing_of_their_own(make_default_homes, default_prior):
    blind = HomeConfig(detection_error=1.0)
    configs = [
        blind,
        HomeConfig(sensing=PartialViews(), detection_error=0.0),
        blind,
        HomeConfig(detection_error=0.0),
    ]
    homes = SampledHomes(default_prior, configs, Streams(0, "test", range(4)))
    seen = observe(homes, np.array([0, 3, -1, 1]))
    assert seen.home.tolist() == [0, 1, 3]
    assert seen.furniture.tolist() == [0, 3, 1]
    assert set(seen.seen_home) == {1, 3}
    assert (np.diff(seen.seen_home) >= 0).all()
    assert seen.coverage[0] == seen.coverage[2] == 1 > seen.coverage[1]
    nobody = observe(homes, np.full(4, -1))
    assert len(nobody.home) == len(nobody.coverage) == len(nobody.seen_code) == 0


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: MissesPerType({"mug": 1.2}), r"rate of 'mug' must lie in \[0, 1\], got 1\.2\. G"),
        (lambda: MissesPerFurniture({"bed": -1}), r"rate of 'bed' must lie in \[0, 1\], got -1"),
        (lambda: PartialViews(lowest=0), r"lowest must be above 0 and at most 1, got 0\. Give"),
        (lambda: Confidences(lowest=2), r"lowest must lie in \[0, 1\], got 2\. Give"),
    ],
)
def test_bad_numbers_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


@pytest.mark.parametrize(
    ("sensing", "message"),
    [
        (MissesPerType({"mugg": 0.5}), r"rates must be of object types .*, got mugg\. Check the"),
        (MissesPerFurniture({"bedd": 0.5}), r"rates must be of furniture .*, got bedd\. Check"),
    ],
)
def test_labels_that_no_home_has_are_refused(make_default_homes, sensing, message):
    homes = make_default_homes(1, sensing=sensing)
    with pytest.raises(ValueError, match=message):
        observe(homes, np.array([0]))
