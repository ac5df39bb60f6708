import numpy as np
import pytest

from simulator.config import HouseConfig
from simulator.memory.memory_batch import Queries
from simulator.policies import make_policy
from simulator.policies.filters import Belief, Rules
from simulator.policies.home_filter import HomeFilter
from simulator.rollout import Rollout

FRIDGE, SHELF, TABLE, BED, BEDROOM_SHELF, DESK = range(6)
MUG = 0  # in: shelf 0.4; on: table 0.4, desk 0.2


@pytest.fixture
def config():
    return HouseConfig(rooms=("kitchen", "bedroom"))


def see(policy, memory, furniture, keys, label=11):
    """Look at a furniture node and see mugs of these descriptions, or none."""
    keys = np.array(keys, dtype=int)
    zeros = np.zeros(len(keys), dtype=int)
    rows = memory.ensure_objects(zeros, keys, zeros + label, zeros + MUG)
    change = memory.observe(np.array([0]), np.array([furniture]), rows, np.ones(len(rows), int))
    policy.observe(memory, change)


def ask(memory, key=7):
    return memory.query(np.array([0]), np.array([key]), np.array([11]), np.array([MUG]))


def test_doubt_by_hand(tiny_prior, config):
    """P(possible | not seen) = (p - found) / (1 - found), found = 0.75 x belief.

    p = 0.5625, belief 0.4: found 0.3, (0.5625 - 0.3) / (1 - 0.3) = 0.375
    p = 1: certain places are never doubted; no look changes nothing; a sighting makes certain
    p = 0.5625, belief 1.2: found at most 0.95 p = 0.534375, 0.028125 / 0.465625 = 0.0604
    """
    policy = HomeFilter(tiny_prior, config)
    p = 0.5625
    belief = Belief(
        np.array([[0.3, 0.7]] * 5), np.array([[0.1, 0.5]] * 5),
        np.array([[p, 1.0], [p, 1.0], [p, p], [p, p], [p, p]]),
    )  # fmt: skip
    policy.learn(belief, np.array([0, 1, -1, 0, 1]), np.array([0, 0, 0, 1, 0], dtype=bool))
    expected = [[0.375, 1], [p, 1], [p, p], [1, p], [p, 0.028125 / 0.465625]]
    np.testing.assert_allclose(belief.possible, expected)


def test_what_is_possible_before_any_doubt(make_tiny_memory, tiny_prior, config):
    """Two noises that each keep 0.75; a place that was used is certain, its type's place 0.75."""
    memory = make_tiny_memory()
    policy = HomeFilter(tiny_prior, config)
    policy.reset(memory)
    memory.step()
    see(policy, memory, TABLE, [7])
    see(policy, memory, SHELF, [8])
    possible = policy.start(memory, ask(memory, 7), _rules(policy, memory, 7)).possible[0]
    np.testing.assert_allclose(possible, [0.5625, 0.75, 1, 0.5625, 0.5625, 0.5625])
    possible = policy.start(memory, ask(memory, 9), _rules(policy, memory, 9)).possible[0]
    np.testing.assert_allclose(possible, [0.5625, 0.75, 0.75, 0.5625, 0.5625, 0.5625])


def _rules(policy, memory, key) -> Rules:
    return policy.compute_rules(memory, ask(memory, key))


def test_movers_follow_the_prior_at_possible_places(make_tiny_memory, tiny_prior, config):
    memory = make_tiny_memory()
    policy = HomeFilter(tiny_prior, config)
    policy.reset(memory)
    memory.step()
    see(policy, memory, TABLE, [7])
    rules = _rules(policy, memory, 7)
    belief = policy.start(memory, ask(memory, 7), rules)
    # 0.4 x 0.5625, 0.4 x 1, 0.2 x 0.5625 -> / 0.7375
    weights = policy.weigh(rules, belief)[0]
    expected = np.array([0, 0.225, 0.4, 0, 0, 0.1125]) / 0.7375
    np.testing.assert_allclose(weights, expected, rtol=1e-6)
    # How many are expected in all does not depend on where they can be.
    assert belief.others.sum() == pytest.approx(rules.initial.sum())


def test_unseen_where_expected_lowers_the_place(make_tiny_memory, tiny_prior, config):
    """The mug is seen on the table, leaves, and is not on the shelf either: doubt the shelf."""
    memory = make_tiny_memory()
    policy = HomeFilter(tiny_prior, config)
    policy.reset(memory)
    shares = []
    for places in ([TABLE], [TABLE, SHELF], [SHELF]):
        memory.step()
        for place in places:
            see(policy, memory, place, [7] if shares == [] else [])
        belief = policy.follow(memory, ask(memory))
        shares.append(belief.possible[0, SHELF])
    assert shares[0] == 0.5625
    assert shares[0] > shares[1] > shares[2]


def test_unknown_objects_are_followed_without_a_prior(make_tiny_memory, tiny_prior, config):
    memory = make_tiny_memory()
    policy = HomeFilter(tiny_prior, config)
    policy.reset(memory)
    strange = memory.query(np.array([0]), np.array([8]), np.array([11]), np.array([-1]))
    scores = policy.scores(memory, strange)[0]
    assert np.ptp(scores) < 1e-9 < scores[0]


@pytest.mark.parametrize("name", ["prior_filter", "ceiling"])
def test_a_search_that_goes_on_is_followed_from_where_it_was(name, make_default_houses):
    """Asked after each look, or once after all of them: the same belief to the last bit."""
    beliefs = []
    for asks_between in (True, False):
        houses = make_default_houses(4, seed=1)
        policy = make_policy(name, houses)
        rollout = Rollout(houses, policy)
        for _ in range(3):
            rollout.evolve()
            rollout.look(np.arange(4))
        _, queries = rollout.ask()
        policy.follow(rollout.memory, queries)
        for turn in range(4):
            rollout.look(np.array([turn, 5 + turn, -1, 9]))
            if asks_between:
                part = np.array([0, 1, 3])
                asked = [getattr(queries, field)[part] for field in ("home", "object", "prior")]
                policy.follow(rollout.memory, Queries(*asked))
        fields = ("home", "object", "prior")
        belief = policy.follow(rollout.memory, Queries(*(getattr(queries, f)[:2] for f in fields)))
        beliefs.append(belief.stack())
    np.testing.assert_array_equal(*beliefs)


def test_it_learns_the_home(make_default_houses):
    """On the same 24 homes it answers better than the filter that keeps to the prior."""
    accuracy = {}
    for name in ("prior_filter", "home_filter"):
        houses = make_default_houses(24, seed=5)
        rollout = Rollout(houses, make_policy(name, houses))
        accuracy[name] = np.mean([step.is_correct for step in rollout.run(60)], axis=0)
    gain = accuracy["home_filter"] - accuracy["prior_filter"]
    assert gain.mean() > 2 * gain.std() / np.sqrt(len(gain))
