"""Searches in lockstep: the same as an agent that walks the grid, only faster."""

from dataclasses import replace

import numpy as np
import pytest

from simulator.igridson.agent import GridAgent, plan_turns
from simulator.igridson.find_object import RunConfig, Runs, Searcher, run_searches
from simulator.igridson.layout_file import parse_layout
from simulator.igridson.navigation import ByTravel, Routes, Walk, compute_belief
from simulator.policies import make_policy

pytestmark = pytest.mark.slow


def searcher_of(name, **options):
    return Searcher(lambda homes: make_policy(name, homes), **options)


@pytest.mark.parametrize(
    ("name", "is_travel_aware"),
    [("random", False), ("bayesian", False), ("prior_filter", True), ("ceiling", False)],
)
def test_agents_on_the_grid_do_what_the_table_says(make_env, default_prior, name, is_travel_aware):
    searcher = searcher_of(name, is_travel_aware=is_travel_aware)
    env = make_env(max_steps=5000)
    agent = GridAgent(env, searcher)
    ours = []
    for number in range(25):
        for _ in agent.search(seed=11 if number == 0 else None):
            pass
        ours.append((env.is_found, len(env.looked_at), env.path_length))
    config = RunConfig(25, queries_per_home=25, seed=env.homes.streams.seed)
    runs = run_searches(searcher, default_prior, env.layout, config)
    found, actions, path = (np.array(column) for column in zip(*ours, strict=True))
    assert runs.is_found[0].tolist() == found.tolist()
    assert runs.num_actions[0].tolist() == np.where(found, actions, 11).tolist()
    assert runs.path_length[0].tolist() == path.tolist()


def test_runs_do_not_depend_on_how_many_homes_are_in_lockstep(default_prior, home, monkeypatch):
    config = RunConfig(60, queries_per_home=10)
    together = run_searches(searcher_of("prior_filter"), default_prior, home, config)
    monkeypatch.setattr("simulator.igridson.find_object._HOMES_AT_ONCE", 4)
    apart = run_searches(searcher_of("prior_filter"), default_prior, home, config)
    assert (together.num_actions == apart.num_actions).all()
    assert (together.path_length == apart.path_length).all()
    again = run_searches(searcher_of("prior_filter"), default_prior, home, replace(config, seed=1))
    assert (together.num_actions != again.num_actions).any()


def test_summary_by_hand():
    # two homes, two searches each, 10 attempts: looks 1, 3 and 2, not found
    runs = Runs(
        is_found=np.array([[True, True], [True, False]]),
        num_actions=np.array([[1, 3], [2, 11]]),
        path_length=np.array([[4, 8], [0, 20]]),
        shortest_path=np.array([[4, 2], [0, 6]]),
    )
    summary = runs.summarise()
    assert summary["success_rate"] == 0.75
    assert summary["num_actions"] == 4.25  # 17 / 4
    # squares 1 + 9 + 4 + 121 = 135, 135 / 4 - 4.25 ** 2 = 15.6875
    assert summary["num_actions_std"] == pytest.approx(15.6875**0.5)
    # home means 2 and 6.5: standard deviation 4.5 / sqrt(2), over sqrt(2) homes
    assert summary["num_actions_standard_error"] == pytest.approx(2.25)
    assert summary["path_length"] == 8.0
    assert summary["shortest_path"] == 3.0


def test_random_finds_what_combinatorics_say(default_prior, home):
    # An object in one of 21 places is found within 10 looks with 10 / 21 = .476, and takes
    # (1 + ... + 10) / 21 + 11 * 11 / 21 = 8.38 actions. Several objects may share a description:
    # m places give 1 - C(21 - m, 10) / C(21, 10), hence a little more than .476 on the whole.
    runs = run_searches(
        searcher_of("random"), default_prior, home, RunConfig(6000, queries_per_home=60)
    )
    assert 0.476 < runs.is_found.mean() < 0.56
    assert 7.6 < runs.num_actions.mean() < 8.38


def test_ceiling_beats_random_and_walks_at_least_the_shortest_way(default_prior, home):
    config = RunConfig(600, queries_per_home=60)
    random = run_searches(searcher_of("random"), default_prior, home, config)
    ceiling = run_searches(searcher_of("ceiling"), default_prior, home, config)
    assert ceiling.is_found.mean() > 0.97
    assert ceiling.num_actions.mean() < 0.4 * random.num_actions.mean()
    found = ceiling.is_found
    assert (ceiling.path_length[found] >= ceiling.shortest_path[found]).all()
    assert (ceiling.num_actions[~found] == 11).all()


def test_travel_aware_searches_walk_less(default_prior, home):
    config = RunConfig(600, queries_per_home=20)
    plain = run_searches(searcher_of("prior_filter"), default_prior, home, config)
    aware = run_searches(
        searcher_of("prior_filter", is_travel_aware=True), default_prior, home, config
    )
    assert aware.path_length.mean() < 0.9 * plain.path_length.mean()


def test_a_near_place_comes_before_a_slightly_likelier_far_one(small_text):
    # Fridge .4 at 1 step, bed .6 at 4 steps, 5 steps from the fridge to the bed, look cost 0:
    # bed first 4 + .4 * 5 = 6, fridge first 1 + .6 * 5 = 4.
    walk = Walk(Routes(parse_layout(small_text)), 1)
    scores = np.array([[0.4, 0.0, 0.6]])
    is_open = np.array([[True, False, True]])
    home, uniform = np.zeros(1, dtype=int), np.zeros(1)
    order = ByTravel(walk, look_cost=0.0)
    assert order.choose(home, scores, is_open, uniform).tolist() == [0]
    # At a look cost of 100 steps, probability decides.
    order = ByTravel(walk, look_cost=100.0)
    assert order.choose(home, scores, is_open, uniform).tolist() == [2]


def test_walks_add_up(small_text):
    walk = Walk(Routes(parse_layout(small_text)), 2)
    walk.go(np.array([0, 1]), np.array([2, 0]))
    walk.go(np.array([0]), np.array([0]))  # from (6, 2) to (2, 1): 5 steps
    assert walk.path_length.tolist() == [4 + 5, 1]
    walk.start_episode()
    assert walk.path_length.tolist() == [0, 0]
    walk.go(np.array([0]), np.array([0]))  # it stands there already
    assert walk.path_length.tolist() == [0, 0]


def test_scores_become_beliefs_over_open_places():
    is_open = np.array([[True, True, False, True]])
    scores = np.array([[3.0, -np.inf, 5.0, 1.0]])
    assert compute_belief(scores, "weights", is_open).tolist() == [[0.75, 0.0, 0.0, 0.25]]
    # a tenth spread over three open places: .9 * .75 + .1 / 3 and so on
    mixed = compute_belief(scores, "weights", is_open, floor=0.1)
    assert mixed == pytest.approx(np.array([[0.675 + 0.1 / 3, 0.1 / 3, 0.0, 0.225 + 0.1 / 3]]))
    logits = np.log([[3.0, 1.0, 5.0, 1.0]])
    expected = np.array([[0.6, 0.2, 0.0, 0.2]])
    assert compute_belief(logits, "logits", is_open) == pytest.approx(expected)
    nothing, even = np.full((1, 4), -np.inf), np.array([[1, 1, 0, 1]]) / 3
    for kind in ("weights", "logits"):
        assert compute_belief(nothing, kind, is_open) == pytest.approx(even)


def test_turns():
    assert plan_turns(0, 0) == []
    assert [int(a) for a in plan_turns(0, 3)] == [0]  # right to up: one turn left
    assert [int(a) for a in plan_turns(3, 0)] == [1]
    assert [int(a) for a in plan_turns(1, 3)] == [1, 1]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"runs": 0}, "runs must be at least 1, got 0"),
        ({"attempts": 0}, "attempts must be at least 1, got 0"),
        ({"runs": 150}, "multiple of the 100 queries per home, got 150"),
        ({"seed": -1}, "seed must be non-negative, got -1"),
    ],
)
def test_bad_numbers_of_runs_are_refused(options, message):
    with pytest.raises(ValueError, match=message):
        RunConfig(**options)


def test_bad_travel_settings_are_refused(small_text):
    walk = Walk(Routes(parse_layout(small_text)), 1)
    with pytest.raises(ValueError, match=r"look_cost must be non-negative, got -1"):
        ByTravel(walk, look_cost=-1.0)
