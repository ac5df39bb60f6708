"""Find Object for Gymnasium: its checker, its rules, and the graphs that it shows."""

from dataclasses import replace

import numpy as np
import pytest

from simulator.policies import make_policy
from simulator.tasks.find_object import FindObject
from simulator.tasks.search import SearchOrder
from simulator.world.config import HomeConfig
from simulator.world.sampled_homes import SampledHomes
from simulator.world.source import Group, SampledSource
from simulator.world.streams import Streams

gymnasium = pytest.importorskip("gymnasium", reason="gymnasium is not installed: extra gym")

from gymnasium.utils.env_checker import check_env  # noqa: E402
from gymnasium.vector import AutoresetMode  # noqa: E402

from simulator.gym.memory_graph import EDGE_FEATURES, NODE_FEATURES  # noqa: E402

ENV = "simulator.gym:FindObject-v0"
NODE = {name: column for column, name in enumerate(NODE_FEATURES)}
EDGE = {name: column for column, name in enumerate(EDGE_FEATURES)}


@pytest.fixture
def source(tiny_prior):
    """Homes of two rooms with three furniture nodes each."""
    return SampledSource(tiny_prior, HomeConfig(rooms=("kitchen", "bedroom"), furniture_per_room=3))


@pytest.fixture
def env(source):
    return gymnasium.make(ENV, homes=source, policy="ceiling", queries_per_home=20)


def choose(scores, mask):
    """The open place of the highest score, the first of equal ones."""
    places = np.flatnonzero(mask)
    return places[np.argmax(scores[places])]


class FirstBest(SearchOrder):
    def choose(self, homes, scores, is_open, uniform):
        return np.array([choose(*row) for row in zip(scores, is_open, strict=True)])


def test_gymnasium_checks_it_without_a_warning(source):
    check_env(gymnasium.make(ENV).unwrapped)
    check_env(gymnasium.make(ENV, homes=source, max_looks=3).unwrapped)


def test_searches_are_those_of_the_task(env, source):
    """Looks, memory and homes are those of `FindObject` with the same order."""
    _, info = env.reset(seed=11)
    home_seed = int(np.random.default_rng(11).integers(2**31))
    homes = source.make(Streams(home_seed, "train", [0]))
    task = FindObject(homes, make_policy("ceiling", homes), order=FirstBest())
    for episode in task.search(20):
        assert info["query"] == homes.object_descriptions.text(int(episode.codes[0]))
        total, is_found = 0.0, False
        while not is_found:
            action = choose(env.unwrapped.compute_scores(), info["action_mask"])
            _, reward, is_found, is_cut_off, info = env.step(action)
            total += reward
            assert not is_cut_off
        assert total == -episode.num_looks[0]
        assert info["num_looks"] == episode.num_looks[0]
        memory, expected = env.unwrapped.searches.rollout.memory, task.rollout.memory
        np.testing.assert_array_equal(memory.edges["num_true"], expected.edges["num_true"])
        _, info = env.reset()
    assert env.unwrapped.searches.num_searches == 1  # 20 searches are over: a new home


def test_the_same_seed_gives_the_same_episodes(env):
    def play(seed):
        env.action_space.seed(0)
        observation, info = env.reset(seed=seed)
        seen = [observation["graph"].nodes, observation["query"]]
        for _ in range(3):
            is_over = False
            while not is_over:
                action = env.action_space.sample(mask=info["action_mask"])
                observation, _, is_found, is_cut_off, info = env.step(action)
                seen += [observation["graph"].nodes, observation["graph"].edges, action]
                is_over = is_found or is_cut_off
            observation, info = env.reset()
        return seen

    first, again, other = play(5), play(5), play(6)
    assert len(first) == len(again)
    for one, two in zip(first, again, strict=True):
        np.testing.assert_array_equal(one, two)
    assert not np.array_equal(first[0], other[0]) or first[1] != other[1]


def test_a_graph_holds_what_was_seen(env):
    observation, info = env.reset(seed=2)
    graph = observation["graph"]
    assert env.observation_space.contains(observation)
    # House, floor, 2 rooms, 6 furniture nodes, the object asked for; nothing was seen yet.
    assert graph.nodes[:, NODE["kind"]].tolist() == [0, 1, 2, 2] + [3] * 6 + [4]
    assert graph.nodes[-1, NODE["is_query"]] == 1
    assert graph.nodes[-1, NODE["description"]] == observation["query"]
    labels = env.unwrapped.labels
    label = labels[int(graph.nodes[-1, NODE["label"]])]
    assert info["query"].endswith(label)
    # House > floor > 2 rooms > 6 furniture nodes; then hypothetical edges, all to the query object.
    links = graph.edge_links
    assert links[:9].tolist() == [[0, 1], [1, 2], [1, 3]] + [[2, n] for n in (4, 5, 6)] + [
        [3, n] for n in (7, 8, 9)
    ]
    assert (links[9:, 1] == 10).all()
    assert (links[9:, 0] >= 4).all()
    assert not graph.edges[9:, EDGE["is_remembered"]].any()
    assert (graph.edges[9:, EDGE["prior"]] > 0).all()
    assert graph.edges[9:, EDGE["prior"]].sum() == pytest.approx(1, abs=1e-5)

    observation, _, _, _, info = env.step(3)  # the first furniture node of the bedroom
    memory, graph = env.unwrapped.searches.rollout.memory, observation["graph"]
    assert info["action_mask"].tolist() == [1, 1, 1, 0, 1, 1]
    assert graph.nodes[4 + 3, NODE["num_observed"]] == 1
    assert graph.nodes[4 + 3, NODE["steps_since_observed"]] == 0
    assert graph.nodes[4, NODE["steps_since_observed"]] == -1
    known = graph.edges[:, EDGE["is_remembered"]].astype(bool)
    known[:9] = False
    assert known.sum() == memory.edges.num_rows
    assert (graph.edge_links[known, 0] == 4 + 3).all()
    np.testing.assert_array_equal(graph.edges[known, EDGE["is_true"]], memory.edges["is_true"])
    np.testing.assert_array_equal(
        graph.edges[known, EDGE["relation"]], memory.edges["relation"] + 1
    )
    keys = graph.nodes[graph.edge_links[known, 1], NODE["description"]]
    np.testing.assert_array_equal(keys, memory.objects["key"][memory.edges["object"]])


def test_a_second_look_costs_and_changes_nothing(env):
    env.reset(seed=1)
    wrong = np.flatnonzero(~env.unwrapped.searches.search.answers[0])[0]
    first, *_ = env.step(wrong)
    again, reward, is_found, is_cut_off, info = env.step(wrong)
    np.testing.assert_array_equal(first["graph"].nodes, again["graph"].nodes)
    assert (reward, is_found, is_cut_off, info["num_looks"]) == (-1, False, False, 2)
    for _ in range(3, 7):  # as many looks as there is furniture
        _, reward, is_found, is_cut_off, info = env.step(wrong)
    assert (is_found, is_cut_off, info["num_looks"]) == (False, True, 6)
    with pytest.raises(RuntimeError, match=r"search must not be over.*Call reset first"):
        env.step(0)


def test_bad_values(source, env):
    env.reset(seed=0)
    with pytest.raises(ValueError, match=r"from 0 to 5, got 6.*action_mask"):
        env.unwrapped.step(6)
    for name, value in (("max_looks", 0), ("queries_per_home", 0), ("num_envs", 0)):
        make = gymnasium.make_vec if name == "num_envs" else gymnasium.make
        with pytest.raises(ValueError, match=f"{name} must be at least 1, got 0. Raise it"):
            make(ENV, homes=source, **{name: value})
    with pytest.raises(ValueError, match="policy must be one of"):
        gymnasium.make(ENV, policy="nobody")
    homes = gymnasium.make_vec(ENV, num_envs=2, homes=source)
    homes.reset(seed=0)
    with pytest.raises(ValueError, match="actions must be 2 furniture indices from 0 to 5"):
        homes.step(np.array([0, 6]))
    with pytest.raises(ValueError, match=r"homes must be reset together.*vectorization_mode"):
        homes.reset(options={"reset_mask": np.array([True, False])})
    with pytest.raises(ValueError, match="seed must be one number for all homes"):
        homes.reset(seed=[1, 2])


def test_many_homes_in_lockstep(source, env):
    homes = gymnasium.make_vec(ENV, num_envs=4, homes=source, policy="ceiling")
    assert homes.metadata["autoreset_mode"] is AutoresetMode.DISABLED
    observations, infos = homes.reset(seed=11)
    observation, info = env.reset(seed=11)
    for _ in range(5):
        returns, is_over = np.zeros(4), np.zeros(4, dtype=bool)
        total, is_found = 0.0, False
        while not is_over.all():
            assert homes.observation_space.contains(observations)
            scores = homes.unwrapped.compute_scores()
            actions = np.array(
                [
                    choose(own, mask) if mask.any() else 0
                    for own, mask in zip(scores, infos["action_mask"], strict=True)
                ]
            )
            if not is_found:  # home 0 is the home of the single environment
                np.testing.assert_array_equal(
                    observations["graph"][0].edges, observation["graph"].edges
                )
                observation, reward, is_found, _, info = env.step(actions[0])
                total += reward
            waited = is_over.copy()
            observations, rewards, terminations, truncations, infos = homes.step(actions)
            assert (rewards[waited] == 0).all()
            assert (rewards[~waited] == -1).all()
            returns += rewards
            is_over = terminations | truncations
        assert terminations.all()
        assert returns[0] == total
        np.testing.assert_array_equal(returns, -infos["num_looks"])
        observations, infos = homes.reset()
        observation, info = env.reset()
        assert infos["query"][0] == info["query"]


def test_independent_homes_reset_by_themselves(source):
    homes = gymnasium.make_vec(ENV, num_envs=2, homes=source, vectorization_mode="sync")
    observations, infos = homes.reset(seed=0)
    assert len(observations["graph"]) == 2
    for _ in range(30):
        actions = np.array([np.argmax(mask) for mask in infos["action_mask"]])
        observations, _, _, _, infos = homes.step(actions)
    assert homes.observation_space.contains(observations)


class Few(SampledSource):
    """Four homes, of which the first three were recorded for five steps together."""

    num_homes = 4

    def list_groups(self, homes):
        return [Group((0, 1, 2), 5), Group((3,), 2)]


def test_a_source_that_ends(source):
    few = Few(source.prior, source.home)
    env = gymnasium.make(ENV, homes=few)
    drawn, searches = set(), []
    for search in range(60):  # homes begin again when their steps are over
        env.reset(seed=0 if search == 0 else None)
        (home,) = env.unwrapped.searches.rollout.homes.streams.homes
        drawn.add(home)
        searches.append((home == 3, env.unwrapped.searches.num_searches))
    assert drawn == {0, 1, 2, 3}
    assert max(number for is_short, number in searches if is_short) == 2
    assert max(number for is_short, number in searches if not is_short) == 5
    homes = gymnasium.make_vec(ENV, num_envs=3, homes=few)
    homes.reset(seed=1)
    assert sorted(homes.unwrapped.searches.rollout.homes.streams.homes) == [0, 1, 2]
    with pytest.raises(ValueError, match=r"played in lockstep, got 4\. Lower it"):
        gymnasium.make_vec(ENV, num_envs=4, homes=few)


def test_a_smaller_home_has_no_place_beyond_its_own(source):
    env = gymnasium.make(ENV, homes=source, max_furniture=8)
    _, info = env.reset(seed=0)
    assert env.action_space.n == 8
    assert info["action_mask"].tolist() == [1] * 6 + [0] * 2
    assert env.unwrapped.compute_scores()[6:].tolist() == [-np.inf] * 2
    _, reward, is_found, _, info = env.step(7)
    assert (reward, is_found, info["num_looks"]) == (-1, False, 1)
    assert info["action_mask"].tolist() == [1] * 6 + [0] * 2
    with pytest.raises(ValueError, match=r"largest home, got 5 and a home of 6\. Raise it"):
        gymnasium.make(ENV, homes=source, max_furniture=5)


class Mixed(SampledSource):
    """Every second home has one room of two furniture nodes."""

    def make(self, streams):
        small = replace(self.home, rooms=("kitchen",), furniture_per_room=2)
        rules = [small if home % 2 else self.home for home in streams.homes]
        return SampledHomes(self.prior, rules, streams)


def test_homes_of_different_sizes_in_lockstep(source):
    homes = gymnasium.make_vec(ENV, num_envs=4, homes=Mixed(source.prior, source.home))
    rng = np.random.default_rng(0)
    for search in range(6):
        observations, infos = homes.reset(seed=3 if search == 0 else None)
        assert infos["action_mask"].sum(axis=1).tolist() == [6, 2, 6, 2]
        nodes = [graph.nodes for graph in observations["graph"]]
        kinds = [(graph[:, NODE["kind"]] == 3).sum() for graph in nodes]
        assert kinds == [6, 2, 6, 2]
        is_over = np.zeros(4, dtype=bool)
        while not is_over.all():
            assert homes.observation_space.contains(observations)
            actions = rng.integers(6, size=4)  # sometimes where a small home has no place
            observations, _, terminations, truncations, infos = homes.step(actions)
            is_over = terminations | truncations
        assert (infos["num_looks"] <= 6).all()


def test_the_package_says_what_it_needs(monkeypatch):
    import importlib
    import sys

    import simulator.gym

    monkeypatch.setitem(sys.modules, "gymnasium", None)
    with pytest.raises(ModuleNotFoundError, match=r"pip install ./core '.\[gym\]'"):
        importlib.reload(simulator.gym)


def test_pictures_show_the_looks(source):
    env = gymnasium.make(ENV, homes=source, render_mode="rgb_array")
    env.reset(seed=0)
    before = env.render()
    assert before.dtype == np.uint8
    assert before.ndim == 3
    env.step(1)
    assert env.render().shape == before.shape
    assert (env.render() != before).any()
    assert gymnasium.make(ENV, homes=source).unwrapped.render() is None
