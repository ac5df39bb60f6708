import numpy as np
import pytest

from sgm.policies.persistence import compute_presence, follow_interval


def test_presence_by_hand():
    """Leaves at 0.03, comes at 0.01 a step: there a quarter of the time; e^-0.04D of the rest.

    After ln 2 / 0.04 steps half of what is over the quarter is left: 1 -> 0.625, 0 -> 0.125.
    """
    steps = np.log(2) / 0.04
    found = compute_presence(np.array([1.0, 0.0, 0.25]), 0.03, 0.01, steps)
    np.testing.assert_allclose(found, [0.625, 0.125, 0.25])
    np.testing.assert_allclose(compute_presence(np.array([0.3]), 0.03, 0.01, 0.0), [0.3])


def test_a_look_by_hand():
    """There with 0.8 before, no time passes: a miss of 1/4 leaves 0.8 x 0.25 / (0.2 + 0.2) = 0.5.

    Seen instead, which nothing else explains: there. Nothing has moved, no step has passed.
    """
    looks = (np.array([0.25, 0.75]), np.array([1.0, 0.0]))
    found = follow_interval(np.array([0.8, 0.8]), 0.1, 0.2, 0.0, *looks)
    np.testing.assert_allclose(found.presence, [0.5, 1.0])
    np.testing.assert_allclose(found.evidence, [0.4, 0.6])
    for nothing in (found.departures, found.arrivals, found.time_present):
        np.testing.assert_allclose(nothing, 0, atol=1e-15)


@pytest.mark.slow
@pytest.mark.parametrize(("leave", "come"), [(0.05, 0.02), (0.4, 0.3)])
@pytest.mark.parametrize("looks", [(0.25, 1.0), (0.75, 0.0), (0.7, 0.1)])
def test_expectations_are_those_of_a_long_simulation(leave, come, looks):
    """A million small steps of a chain, weighed by what the look at the end would have seen."""
    rng = np.random.default_rng(0)
    num, small, steps = 200_000, 0.02, 6.0
    state = np.zeros((num,), dtype=bool)
    state[: int(0.6 * num)] = True
    departures, arrivals, present = np.zeros(num), np.zeros(num), np.zeros(num)
    for _ in range(int(steps / small)):
        present += state * small
        moves = rng.random(num) < np.where(state, leave, come) * small
        departures += moves & state
        arrivals += moves & ~state
        state ^= moves
    weight = np.where(state, *looks)
    found = follow_interval(np.array(0.6), leave, come, steps, *(np.array(p) for p in looks))
    assert found.evidence == pytest.approx(weight.mean(), abs=0.005)
    assert found.presence == pytest.approx((weight * state).sum() / weight.sum(), abs=0.01)
    for expected, seen in (
        (found.departures, departures),
        (found.arrivals, arrivals),
        (found.time_present, present),
    ):
        mean = (weight * seen).sum() / weight.sum()
        error = np.sqrt((weight**2 * (seen - mean) ** 2).sum()) / weight.sum()
        assert expected == pytest.approx(mean, abs=4 * error + 0.02 * mean)


def test_counts_agree_with_each_other():
    """Arrivals less departures are the change of presence, expected before the look is known."""
    rng = np.random.default_rng(1)
    before, leave, come, steps = rng.random((4, 100)) * [[1], [0.5], [0.5], [30]]
    found = follow_interval(before, leave, come, steps, np.ones(100), np.ones(100))
    np.testing.assert_allclose(found.arrivals - found.departures, found.presence - before)
    np.testing.assert_allclose(found.presence, compute_presence(before, leave, come, steps))
    np.testing.assert_allclose(found.departures, leave * found.time_present)
    np.testing.assert_allclose(found.arrivals, come * (steps - found.time_present))
