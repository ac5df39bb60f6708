"""Which things have left the home: laws, and homes in which it is plain."""

import numpy as np
import pytest

from sgm.evidence.leaving import Leaving
from sgm.evidence.look_filter import follow_left
from sgm.policies.adaptive import Adaptive
from simulator import SceneGraphMemory, Sighting
from simulator.tasks.predict_location import predict_locations
from simulator.tasks.rollout import Rollout

THINGS = [f"{colour} mug" for colour in "red green blue white black grey brown pink".split()]


def live(leave: bool, steps: int = 40) -> tuple[SceneGraphMemory, list[int]]:
    """A home whose four places are looked at in turn; from step 20 on, half may be missing."""
    memory = SceneGraphMemory()
    room = memory.add_room("kitchen")
    places = [memory.add_furniture(label, room) for label in ("table", "shelf", "fridge", "bed")]
    for step in range(steps):
        here = [n for n in range(8) if n % 4 == step % 4 and not (leave and step >= 20 and n < 4)]
        memory.observe(places[step % 4], [Sighting(THINGS[n], relation="in") for n in here])
        memory.step()
    return memory, places


def compute(memory: SceneGraphMemory, names: list[str]) -> np.ndarray:
    asked = memory.ask(names)
    return Leaving(asked.batch).compute(asked.batch, asked.queries)


def test_what_is_nowhere_has_left_and_what_was_just_seen_has_not():
    memory, _ = live(leave=True)
    left = compute(memory, THINGS)
    assert (left[:4] > 0.9).all()
    assert (left[4:] < 0.1).all()
    assert compute(memory, ["piano"]) == 0  # never seen: not for the memory to say


def follow(
    seen, looks, last, now, leaving, prior=None, room=None, rate=0.0, crossing=1.0, miss=0.2,
    hours=1.0,
):  # fmt: skip
    """One object; looks are (place, time), last is (place, time) or None."""
    times = np.full((1, len(seen), 8), -1, dtype=np.int32)
    for place, time in looks:
        times[0, place, np.argmin(times[0, place])] = time
    place, time = last or (-1, -1)
    prior = np.zeros(len(seen)) if prior is None else prior
    room = np.zeros(len(seen), dtype=int) if room is None else room
    return follow_left(
        np.array([seen]), np.array([prior]), np.array([room]), int(max(room)) + 1, times,
        np.array([0]), np.array([place]), np.array([time]), now, np.array([hours]),
        np.array([rate]), np.array([crossing]), np.array([miss]), np.array([leaving]),
    )[0]  # fmt: skip


def test_what_looks_do_not_find_has_left_by_hand():
    """Seen five times of nine at place 0, and 1.3 of a sighting anywhere: (5 + .433) / 10.3.

    1 - (.97 + .03 x that) x .8 of all looks there do not find it if it is in the home, which counts
    for .85 of a look. Of all things one in 200 is carried off right after it was seen.
    """
    rates = np.array([0.0, 0.1, 1.0])
    before = 1 - 0.995 * np.exp(-rates)
    about = {"seen": [5, 2, 2], "last": (0, 0), "hours": 0.5, "leaving": rates}
    np.testing.assert_allclose(follow(looks=[], now=2, **about), before)  # nobody looked
    left = follow(looks=[(0, 2)], now=2, **about)
    unseen = 1 - (0.97 + 0.03 * (5 + 1.3 / 3) / 10.3) * 0.8
    np.testing.assert_allclose(left, before / (before + (1 - before) * unseen**0.85))
    later = follow(looks=[(0, 2)], now=4, **about)
    np.testing.assert_allclose(later, 1 - (1 - left) * np.exp(-rates))


def follow_plainly(seen, looks, last, now, leaving, prior, room, rate, crossing, miss, hours):
    """The same, with the probability of every place after every look."""
    share = prior / prior.sum() if prior.any() else prior
    goes = seen + share + (0.3 if prior.any() else 1.3) / len(seen)
    goes = goes / goes.sum()
    start = last[1] if last else -1
    since = sorted((time, place) for place, time in looks if time >= start)
    since = [one for one in since if last is None or one != (start, last[0])]
    belief = goes if last is None else 0.03 * goes
    if last is not None:
        belief = belief + 0.97 * np.eye(len(seen))[last[0]]
    left, time = np.full(len(leaving), 0.005), start
    if last is None:
        time = since[0][0] if since else now
    for when, place in [*since, (now, None)]:
        elapsed, time = (when - time) * hours, when
        of_room = lambda values: np.array([values[room == own].sum() for own in room])  # noqa: E731
        inside, usual = of_room(belief), of_room(goes)
        then = usual + np.exp(-rate * crossing * elapsed) * (inside - usual)
        stays = np.exp(-rate * elapsed)
        belief = then * goes / usual + stays * (belief - inside * goes / usual)
        left = 1 - (1 - left) * np.exp(-leaving * elapsed)
        if place is not None:
            unseen = 1 - belief[place] * (1 - miss)
            belief = belief * np.where(np.arange(len(seen)) == place, miss, 1.0) / unseen
            left = left / (left + (1 - left) * unseen**0.85)
    return left


@pytest.mark.parametrize("seed", range(12))
def test_it_is_what_following_every_place_says(seed):
    rng = np.random.default_rng(seed)
    num = int(rng.integers(2, 9))
    looks = {
        (int(place), int(time))
        for place, time in zip(rng.integers(num, size=30), rng.integers(60, size=30), strict=True)
    }
    looks = [one for place in range(num) for one in sorted(looks) if one[0] == place]
    looks = [one for n, one in enumerate(looks) if [o[0] for o in looks[:n]].count(one[0]) < 8]
    about = {
        "seen": rng.integers(5, size=num), "last": looks[3] if seed % 4 else None,
        "now": 10**4 if seed == 5 else 70, "leaving": 10.0 ** np.arange(-3, 1),
        "prior": rng.random(num) * (seed % 3 > 0), "room": rng.integers(3, size=num),
        "rate": 10.0 ** rng.uniform(-3, 0), "crossing": rng.random(), "miss": rng.random(),
        "hours": 0.5,
    }  # fmt: skip
    found = follow(looks=looks, **about)
    np.testing.assert_allclose(found, follow_plainly(looks=looks, **about), rtol=1e-9)


def test_it_is_learnt_whether_things_leave_here():
    """The same thing, seen as long ago, and not looked for since."""
    left = []
    for leave in (True, False):
        memory, places = live(leave)
        memory.observe(places[0], [Sighting("green bottle", relation="in")])
        memory.step(24)
        left.append(compute(memory, ["green bottle"])[0])
    assert left[0] > 2 * left[1] > 0


def test_it_grows_with_time_and_survives_the_step():
    memory, _ = live(leave=True)
    before = compute(memory, THINGS)
    memory.step()
    after = compute(memory, THINGS)
    assert (after > before).all()
    assert after == pytest.approx(before, abs=0.05)


def test_many_homes_are_each_by_themselves(make_tiny_homes):
    """Shares are those of a home alone, and probabilities; more things than are learnt from."""
    rollout = Rollout(make_tiny_homes(3), Adaptive())
    for _ in predict_locations(rollout, 30):
        pass
    memory = rollout.memory
    _, queries = rollout.ask()
    together = Leaving(memory)
    assert together.weights.sum(axis=1) == pytest.approx(1)
    left = together.compute(memory, queries)
    assert ((left >= 0) & (left < 1)).all()
    only = memory.objects["home"] == 1
    assert only.any()
    seen = memory.objects["num_observed"]
    seen[~only] = 0  # nothing was seen in the other homes
    alone = Leaving(memory)
    np.testing.assert_allclose(alone.weights[1], together.weights[1])
    assert not np.allclose(alone.weights[0], together.weights[0])
    np.testing.assert_allclose(alone.weights[0], alone.weights[2])


def test_things_asked_for_are_followed_with_those_learnt_from():
    """In one call: the same weights and the same answers, to the bit; others are followed later."""
    memory, _ = live(leave=True)
    asked, others = memory.ask([*THINGS[:3], "piano"]), memory.ask(THINGS[2:])
    alone, together = Leaving(asked.batch), Leaving(asked.batch, asked.queries)
    np.testing.assert_array_equal(alone.weights, together.weights)
    for one in (asked, others):
        found = [own.compute(asked.batch, one.queries) for own in (alone, together)]
        np.testing.assert_array_equal(*found)
