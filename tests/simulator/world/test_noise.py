import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from simulator.world.noise import compute_noisy_weights, sum_pairwise


def add_noise(weights, draws, place_room, **rules):
    """Noise on whole rows (n, P) with two draws for every place, (n, P, 2)."""
    noisy = np.zeros(weights.shape)
    rows, places = np.nonzero(weights)
    rules = {
        name: value if name == "min_kept" else np.array([float(value)])
        for name, value in rules.items()
    }
    noisy[rows, places] = compute_noisy_weights(
        weights[rows, places],
        rows,
        places,
        draws[rows, places],
        np.zeros(len(weights), int),
        place_room[None],
        np.array([len(place_room)]),
        **rules,
    )
    return noisy


def test_zeroing_scaling_and_normalising_by_hand():
    weights = np.array([[0.4, 0.4, 0.2, 0.0]])
    draws = np.array([[[0.30, 0.5], [0.20, 0.9], [0.90, 1.0], [0.99, 0.5]]])
    noisy = add_noise(weights, draws, np.zeros(4, int), zero_prob=0.25, scale=0.25, min_kept=1)
    # Kept where the first draw is >= 0.25: places 0 and 2; place 3 had no weight.
    # Scales 0.75 + 0.5 u: 1.0 and 1.25 -> 0.4 and 0.25, total 0.65.
    np.testing.assert_allclose(noisy, [[0.4 / 0.65, 0, 0.25 / 0.65, 0]])


@pytest.mark.slow
def test_the_two_places_that_came_nearest_survive():
    weights = np.array([[0.5, 0.3, 0.2, 0.0]])
    draws = np.array([[[0.01, 0.5], [0.20, 0.5], [0.10, 0.5], [0.99, 0.5]]])
    noisy = add_noise(weights, draws, np.zeros(4, int), zero_prob=0.25, scale=0.25)
    # All three are below 0.25; the two with the highest draws stay: 0.3 and 0.2, total 0.5.
    np.testing.assert_allclose(noisy, [[0, 0.6, 0.4, 0]])


def compute_plainly(weights, draws, place_room, zero_prob, scale, min_kept):
    noisy = [0.0] * len(weights)
    for room in set(place_room):
        places = [place for place in np.flatnonzero(place_room == room) if weights[place] > 0]
        by_draw = sorted(places, key=lambda place: -draws[place][0])
        for rank, place in enumerate(by_draw):
            if draws[place][0] >= zero_prob or rank < min_kept:
                noisy[place] = weights[place] * (1 - scale + 2 * scale * draws[place][1])
    total = sum(noisy)
    return [weight / total if total else 0.0 for weight in noisy]


@given(st.integers(0, 2**32), st.floats(0, 1), st.floats(0, 0.99), st.integers(0, 3))
def test_equal_to_a_plain_loop(seed, zero_prob, scale, min_kept):
    rng = np.random.default_rng(seed)
    place_room = np.array([0, 0, 0, 0, 0, 2, 3, 3, 3])
    weights = rng.random((3, 9)) * (rng.random((3, 9)) < 0.6)
    draws = rng.random((3, 9, 2))
    # At least one place is always kept here, so that the sum cannot vanish by chance.
    min_kept = max(min_kept, 1)
    found = add_noise(
        weights, draws, place_room, zero_prob=zero_prob, scale=scale, min_kept=min_kept
    )
    for row in range(3):
        expected = compute_plainly(weights[row], draws[row], place_room, zero_prob, scale, min_kept)
        np.testing.assert_allclose(found[row], expected, atol=1e-12)


def test_statistics_of_class_noise():
    """40 equal places: a quarter is zeroed, the others are scaled by U(0.75, 1.25)."""
    rng = np.random.default_rng(0)
    weights = np.full((500, 40), 1 / 40)
    noisy = add_noise(
        weights, rng.random((500, 40, 2)), np.zeros(40, int), zero_prob=0.25, scale=0.25
    )
    zeroed = int((noisy == 0).sum())
    assert stats.binomtest(zeroed, 500 * 40, 0.25).pvalue > 0.01
    np.testing.assert_allclose(noisy.sum(axis=1), 1)
    kept = noisy > 0
    # Normalising divides a row by the sum of its scales; their mean is 1, so that the row's
    # mean weight gives the factor back up to the noise of some 30 scales.
    ratio = noisy / (noisy.sum(axis=1) / kept.sum(axis=1))[:, None]
    assert ratio[kept].min() > 0.75 * 0.85
    assert ratio[kept].max() < 1.25 * 1.15
    spread = (noisy.max(axis=1) / np.where(kept, noisy, 1).min(axis=1)).max()
    assert 1.5 < spread <= 1.25 / 0.75
    # Var U(0.75, 1.25) = 0.5^2 / 12
    assert ratio[kept].var() == pytest.approx(0.25 / 12, rel=0.05)


def test_no_noise_only_normalises():
    weights = np.array([[2.0, 6.0, 0.0], [0.0, 0.0, 0.0]])
    noisy = add_noise(weights, np.full((2, 3, 2), 0.1), np.zeros(3, int), zero_prob=0, scale=0)
    np.testing.assert_array_equal(noisy, [[0.25, 0.75, 0], [0, 0, 0]])


@given(st.integers(0, 2**32), st.sampled_from([0, 1, 7, 8, 9, 64, 127, 128, 129, 400, 1000]))
def test_rows_are_summed_up_in_the_order_of_numpy(seed, count):
    """To the last bit: homes that were sampled when numpy did it stay what they were."""
    numbers = np.random.default_rng(seed).random(count) ** 9
    assert sum_pairwise(numbers) == np.atleast_2d(numbers).sum(axis=1)[0]
