import numpy as np
import pytest

from sgm.memory.queries import Queries
from simulator.policies import make_policy
from simulator.policies.filter_kernel import (
    OTHERS,
    OWN_POSSIBLE,
    TYPE_POSSIBLE,
    Subjects,
    make_transitions,
    update_class_noise,
    update_instance_noise,
)
from simulator.policies.filters import HomeFilter
from simulator.tasks.predict_location import predict_locations
from simulator.tasks.rollout import Rollout
from simulator.world.config import HomeConfig

FRIDGE, SHELF, TABLE, BED, BEDROOM_SHELF, DESK = range(6)
MUG = 0  # in: shelf 0.4; on: table 0.4, desk 0.2
SURVIVES = 0.75


@pytest.fixture
def policy(tiny_prior):
    return HomeFilter(tiny_prior, HomeConfig(rooms=("kitchen", "bedroom")))


def see(policy, memory, furniture, keys, label=11):
    """Look at a furniture node and see mugs of these descriptions, or none."""
    keys = np.array(keys, dtype=int)
    zeros = np.zeros(len(keys), dtype=int)
    rows = memory.ensure_objects(zeros, keys, zeros + label, zeros + MUG)
    change = memory.observe(np.array([0]), np.array([furniture]), rows, np.ones(len(rows), int))
    policy.observe(memory, change)


def ask(memory, key=7):
    return memory.query(np.array([0]), np.array([key]), np.array([11]), np.array([MUG]))


def start(policy, memory, key=7):
    """Return the rules and the belief at t = 0 of an agent that has seen what the memory has."""
    queries = ask(memory, key)
    types = memory.objects["type"][queries.object]
    moves = policy.read_moves(memory, queries)
    subjects = Subjects(queries.home, queries.object, types, moves)
    rules = policy.compute_rules(subjects)
    return rules, policy.start(subjects, rules, policy.compute_basis(memory, subjects))


@pytest.mark.parametrize(
    ("own", "of_type", "believed", "is_seen", "expected"),
    [
        # s = 0.75 x 0.4 / (0.75 x 0.8) = 0.5; own' = 0.75 x 0.5 / (1 - 0.375)
        (0.75, 0.8, 0.4, False, 0.6),
        (1.0, 0.8, 0.9, False, 1.0),  # what is certain is never doubted
        (0.75, 0.8, 0.1, True, 1.0),  # seen there, so certain
        # 2 count as 1: s = 0.75 / 0.6, at most 0.95; own' = 0.75 x 0.05 / (1 - 0.7125)
        (0.75, 0.8, 2.0, False, 0.0375 / 0.2875),
        (0.03, 0.8, 0.9, False, 0.02),  # nothing is ruled out for good
    ],
)
def test_instance_noise_by_hand(own, of_type, believed, is_seen, expected):
    """Seen if possible: s = 0.75 believed / (own x type); own' = own (1 - s) / (1 - own s)."""
    possible = np.array([own, 0.5])
    update_instance_noise(possible, np.array([of_type, 0.8]), believed, 0, is_seen, 0.25)
    np.testing.assert_allclose(possible, [expected, 0.5])


@pytest.mark.parametrize(
    ("possible", "is_type_seen", "expected"),
    [
        # unseen 0.5 at the first place: m = 0.5, e^-0.5 = 0.60653; p' = 0.454898 / 0.704898, at
        # the second place of the group, too; the third is of another group
        ([0.75, 0.75, 0.75], False, [0.645339, 0.645339, 0.75]),
        ([0.75, 0.75, 0.75], True, [0.75] * 3),  # seen there: nothing is doubted
        ([1.0, 1.0, 0.75], False, [1.0, 1.0, 0.75]),  # what is certain is not doubted
    ],
)
def test_class_noise_by_hand(possible, is_type_seen, expected):
    """Expected if possible: m = 0.75 unseen / p; p' = p e^-m / (p e^-m + 1 - p).

    Of the objects of the type that were never seen a quarter was missed; the others are known now.
    """
    of_type, unseen = np.array(possible), np.array([0.5, 0.2, 0.1])
    update_class_noise(of_type, unseen, np.array([0, 0, 1]), 0, is_type_seen, 0.25)
    np.testing.assert_allclose(of_type, expected, rtol=1e-5)
    np.testing.assert_allclose(unseen, [0.125, 0.2, 0.1])


def test_what_is_possible_before_any_doubt(make_tiny_memory, policy):
    """Each noise keeps 0.75; where it was seen both have; where its type was, class noise has."""
    memory = make_tiny_memory()
    policy.reset(memory)
    memory.step()
    see(policy, memory, TABLE, [7])
    see(policy, memory, SHELF, [8])
    for key, own_table in ((7, 1.0), (9, 0.75)):
        _, belief = start(policy, memory, key)
        by_type = [0.75, 1, 1, 0.75, 0.75, 0.75]  # the shelf of the bedroom is another one
        np.testing.assert_allclose(belief[TYPE_POSSIBLE, 0], by_type)
        np.testing.assert_allclose(belief[OWN_POSSIBLE, 0], [0.75, 0.75, own_table, *[0.75] * 3])


def test_movers_follow_the_prior_at_possible_places(make_tiny_memory, policy):
    memory = make_tiny_memory()
    policy.reset(memory)
    memory.step()
    see(policy, memory, TABLE, [7])
    rules, belief = start(policy, memory)
    transitions = np.empty((4, 6))
    make_transitions(
        rules.moves[0],
        belief[TYPE_POSSIBLE, 0],
        belief[OWN_POSSIBLE, 0],
        memory.furniture_room[0],
        transitions,
    )
    # shelf 0.4 x 0.5625, table 0.4 x 1, desk 0.2 x 0.5625 -> / 0.7375
    expected = np.array([0, 0.225, 0.4, 0, 0, 0.1125]) / 0.7375
    np.testing.assert_allclose(transitions[0], expected, rtol=1e-6)
    # shelf 0.4 x 0.75, table 0.4 x 1, desk 0.2 x 0.75 -> / 0.85
    expected = np.array([0, 0.3, 0.4, 0, 0, 0.15]) / 0.85
    np.testing.assert_allclose(transitions[2], expected, rtol=1e-6)
    # How many are expected in all does not depend on where they can be.
    assert belief[OTHERS].sum() == pytest.approx(rules.initial.sum())


def test_unseen_where_expected_lowers_the_place(make_tiny_memory, policy):
    """The mug is seen on the table, leaves, and is not on the shelf either: doubt the shelf."""
    memory = make_tiny_memory()
    policy.reset(memory)
    shares = []
    for places in ([TABLE], [TABLE, SHELF], [SHELF]):
        memory.step()
        for place in places:
            see(policy, memory, place, [] if shares else [7])
        belief = policy.follow(memory, ask(memory))
        shares.append((belief[TYPE_POSSIBLE] * belief[OWN_POSSIBLE])[0, SHELF])
    assert shares[0] == SURVIVES**2
    assert shares[0] > shares[1] > shares[2]


def test_unknown_objects_are_followed_without_a_prior(make_tiny_memory, policy):
    memory = make_tiny_memory()
    policy.reset(memory)
    memory.step()
    see(policy, memory, TABLE, [7])
    strange = memory.query(np.array([0]), np.array([8]), np.array([11]), np.array([-1]))
    scores = policy.scores(memory, strange)[0]
    assert np.ptp(np.delete(scores, TABLE)) < 1e-9 < scores[TABLE] < scores[0]


@pytest.mark.parametrize("name", ["prior_filter", "ceiling"])
def test_a_search_that_goes_on_is_followed_from_where_it_was(name, make_default_homes):
    """Asked after each look, or once after all of them: the same belief to the last bit."""
    fields = ("home", "object", "prior")
    beliefs = []
    for asks_between in (True, False):
        homes = make_default_homes(4, seed=1)
        policy = make_policy(name, homes)
        rollout = Rollout(homes, policy)
        for _ in range(3):
            rollout.evolve()
            rollout.look(np.arange(4))
        _, queries = rollout.ask()
        policy.follow(rollout.memory, queries)
        for turn in range(4):
            rollout.look(np.array([turn, 5 + turn, -1, 9]))
            if asks_between:
                part = (getattr(queries, field)[[0, 1, 3]] for field in fields)
                policy.follow(rollout.memory, Queries(*part))
        part = (getattr(queries, field)[:2] for field in fields)
        beliefs.append(policy.follow(rollout.memory, Queries(*part)))
    np.testing.assert_array_equal(*beliefs)


def test_it_learns_the_home(make_default_homes):
    """On the same 24 homes it answers better than the filter that keeps to the prior."""
    accuracy = {}
    for name in ("prior_filter", "home_filter"):
        homes = make_default_homes(24, seed=5)
        rollout = Rollout(homes, make_policy(name, homes))
        accuracy[name] = np.mean(
            [step.is_correct for step in predict_locations(rollout, 60)], axis=0
        )
    gain = accuracy["home_filter"] - accuracy["prior_filter"]
    assert gain.mean() > 2 * gain.std() / np.sqrt(len(gain))
