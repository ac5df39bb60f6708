"""EdgeBank, PopTrack and Base3, by hand."""

import numpy as np
import pytest

from simulator.policies import POLICIES, find_policy, list_policies, make_policy
from simulator.policies.event_rules import Base3, EdgeBank, EdgeBankWindow, PopTrack
from simulator.policies.registry import EVENT_RULES
from simulator.testing import check_policy
from simulator.world.source import SampledSource

FRIDGE, SHELF, TABLE, BED, BEDROOM_SHELF, DESK = range(6)
IN, ON = 0, 1
MUG, PLATE = (0, 7, 11, 0), (0, 8, 11, 0)


@pytest.fixture
def memory(make_tiny_memory):
    return make_tiny_memory()


def ask(memory, thing):
    return memory.query(*(np.array([value]) for value in thing))


def play(memory, policy, *looks):
    """One step per look (furniture, the things that are seen on it); then one more, and ask."""
    policy.reset(memory)
    things = [MUG, PLATE]
    rows = [int(memory.ensure_objects(*(np.array([v]) for v in thing))[0]) for thing in things]
    for furniture, seen in looks:
        memory.step()
        found = np.array([rows[things.index(thing)] for thing in seen], dtype=int)
        change = memory.observe(
            np.zeros(1, dtype=int), np.array([furniture]), found, np.full(len(found), ON)
        )
        policy.observe(memory, change)
    memory.step()
    return ask(memory, MUG)


def test_edgebank_knows_where_the_thing_ever_was(memory):
    queries = play(memory, EdgeBank(), (TABLE, [MUG]), (BED, [PLATE]), (TABLE, []), (DESK, [MUG]))
    assert EdgeBank().scores(memory, queries).tolist() == [[0, 0, 1, 0, 0, 1]]
    assert EdgeBank().scores(memory, ask(memory, PLATE)).tolist() == [[0, 0, 0, 1, 0, 0]]


def test_a_window_forgets(memory, monkeypatch):
    """Seen on the table at 1 and on the desk at 3; asked at 4, with a window of two steps."""
    monkeypatch.setattr(EdgeBankWindow, "window", 2)
    queries = play(memory, EdgeBankWindow(), (TABLE, [MUG]), (BED, []), (DESK, [MUG]))
    assert EdgeBankWindow().scores(memory, queries).tolist() == [[0, 0, 0, 0, 0, 1]]
    monkeypatch.setattr(EdgeBankWindow, "window", 3)
    assert EdgeBankWindow().scores(memory, queries).tolist() == [[0, 0, 1, 0, 0, 1]]


def test_popularity_decays_by_the_step(memory):
    """Two things on the table at 1, one on the bed at 2, none at 3; asked at 4.

    Table 2 x .95^3, bed .95^2, whatever is asked for.
    """
    policy = PopTrack()
    queries = play(memory, policy, (TABLE, [MUG, PLATE]), (BED, [PLATE]), (TABLE, []))
    want = [[0, 0, 2 * 0.95**3, 0.95**2, 0, 0]]
    np.testing.assert_allclose(policy.scores(memory, queries), want)
    np.testing.assert_allclose(policy.scores(memory, ask(memory, PLATE)), want)
    policy.reset(memory)
    assert not policy.scores(memory, queries).any()


def test_base3_by_hand(memory):
    """The mug on the table at 1 and 2, on the bed at 3; asked at 4.

    Popularity: table .95^3 + .95^2 = 1.759875, bed .95; shares 1 and .5398.
    Table: EdgeBank 1; t-CoMem exp(-2/25) / (1 + exp(-1.759875)) + .8 x 2/3 = .7876 + .5333.
    Bed: 1; exp(-1/25) / (1 + exp(-.95)) + .8 x 1/2 = .6928 + .4.
    """
    policy = Base3()
    queries = play(memory, policy, (TABLE, [MUG]), (TABLE, [MUG]), (BED, [MUG]))
    got = policy.scores(memory, queries)[0]
    table = (1 + 1 + 0.7876 + 0.5333) / 3
    bed = (1 + 0.5398 + 0.6928 + 0.4) / 3
    np.testing.assert_allclose(got, [0, 0, table, bed, 0, 0], atol=1e-4)
    # of a thing that was never seen, the popular places alone
    got = policy.scores(memory, ask(memory, PLATE))[0]
    np.testing.assert_allclose(got, [0, 0, 1 / 3, 0.5398 / 3, 0, 0], atol=1e-4)


@pytest.mark.parametrize("name", EVENT_RULES)
def test_they_keep_the_contract_and_play_where_they_are_named(name, make_tiny_homes):
    check_policy(find_policy(name).make)
    assert isinstance(make_policy(name, make_tiny_homes(1)), EVENT_RULES[name])
    assert name not in POLICIES
    assert name not in list_policies(SampledSource())
