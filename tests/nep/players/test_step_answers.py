"""Answers within a time step: the network's first, and what looks in vain say by Bayes' rule."""

import numpy as np
import pytest
import torch

from datamodules.batch_builder import BatchBuilder
from datamodules.feature_config import FeatureConfig
from nep.any_home.any_home_module import AnyHomeModule
from nep.players.policy import NEPPolicy
from sgm.memory.queries import Queries
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.policies.policy import compute_probabilities
from simulator.tasks.registry import TASKS
from simulator.tasks.rollout import Rollout
from simulator.world.config import HomeConfig
from simulator.world.sensing import PartialViews
from simulator.world.source import SampledSource
from simulator.world.streams import Streams

FEATURES = FeatureConfig(temporal=False, semantic=False, candidates="all", evidence=True)


class Counting(NEPPolicy):
    """Counts the questions that the network itself is asked."""

    num_asked = 0

    def score_places(self, memory, queries):
        self.num_asked += len(queries.home)
        return super().score_places(memory, queries)


def make_rollout(num_homes=3, **rules):
    torch.manual_seed(0)
    module = AnyHomeModule(16, members=1).eval()
    home = HomeConfig(furniture_per_room=3, objects_per_furniture=4, **rules)
    homes = SampledSource(home=home).make(Streams(0, "test", range(num_homes)))
    rollout = Rollout(homes, Counting(module, BatchBuilder(FEATURES, num_hops=0)))
    for _ in range(5):
        _, queries = rollout.ask()
        rollout.look(rollout.score(queries).argmax(axis=1))
    rollout.policy.num_asked = 0
    return rollout


def look_and_miss(rollout, queries):
    """Look where the things that are asked for are not; the places, (H,)."""
    homes, answers = rollout.homes, np.ones((3, rollout.memory.num_furniture), dtype=bool)
    keys = rollout.memory.objects["key"][queries.object]
    for home, slot in np.argwhere(homes.object_code == keys[:, None]):
        if homes.object_place[home, slot] >= 0:
            answers[home, homes.object_place[home, slot] // 2] = False
    places = answers.argmax(axis=1)
    rollout.look(places)
    return places


@pytest.mark.parametrize("sensing", [None, PartialViews()])
def test_a_negative_look_multiplies_the_odds_of_its_place_by_what_it_misses(sensing):
    rollout = make_rollout(**({} if sensing is None else {"sensing": sensing}))
    coverages = []
    rollout.on_change = lambda change: coverages.append(change.coverage)
    _, queries = rollout.ask()
    first = rollout.score(queries)
    places = look_and_miss(rollout, queries)
    again = rollout.score(queries)
    assert rollout.policy.num_asked == 3  # once each
    homes = np.arange(3)
    miss = rollout.memory.history.compute_miss_rate()
    missed = 1 - coverages[-1] * (1 - miss)
    assert np.all(missed < 1)
    np.testing.assert_allclose((again - first)[homes, places], np.log(missed))
    others = np.arange(first.shape[1]) != places[:, None]
    np.testing.assert_array_equal(again[others], first[others])
    # Bayes' rule: prior times likelihood of the look, normalised
    before, after = (compute_probabilities(scores, "logits") for scores in (first, again))
    likelihood = np.where(others, 1.0, missed[:, None])
    expected = before * likelihood / (before * likelihood).sum(axis=1, keepdims=True)
    np.testing.assert_allclose(after, expected)


def test_the_network_is_asked_again_in_the_next_step_and_of_what_was_seen():
    rollout = make_rollout(detection_error=0.0)
    _, queries = rollout.ask()
    rollout.score(queries)
    keys = rollout.memory.objects["key"][queries.object]
    slot = (rollout.homes.object_code == keys[:, None]).argmax(axis=1)
    there = rollout.homes.object_place[np.arange(3), slot] // 2
    rollout.look(np.where(np.arange(3) == 1, there, -1))  # home 1 finds what it asks for
    scores = rollout.score(queries)
    assert rollout.policy.num_asked == 4
    assert scores[1].argmax() == there[1]
    fresh = NEPPolicy(rollout.policy._module, rollout.policy._builder)  # told of no look
    np.testing.assert_array_equal(scores[1], fresh.scores(rollout.memory, queries)[1])
    rollout.evolve()
    rollout.score(queries)
    assert rollout.policy.num_asked == 7


def test_looks_that_the_policy_was_not_told_of_make_it_ask_anew():
    rollout = make_rollout()
    _, queries = rollout.ask()
    first = rollout.score(queries)
    none = np.zeros(0, dtype=np.int64)
    home = np.arange(3)
    rollout.memory.observe(home, first.argmax(axis=1), none, none)
    again = rollout.score(queries)
    assert rollout.policy.num_asked == 6
    fresh = NEPPolicy(rollout.policy._module, rollout.policy._builder)
    np.testing.assert_array_equal(again, fresh.scores(rollout.memory, queries))


def test_furniture_that_is_added_within_a_step_has_an_answer():
    torch.manual_seed(0)
    module = AnyHomeModule(16, members=1).eval()
    policy = NEPPolicy(module, BatchBuilder(FEATURES, num_hops=0))
    memory = SceneGraphMemory()
    kitchen = memory.add_room("kitchen")
    memory.add_furniture("fridge", kitchen)
    policy.reset(memory.batch)
    assert policy.scores(memory.batch, memory.query("mug")).shape == (1, 1)
    memory.add_furniture("table", kitchen)
    assert policy.scores(memory.batch, memory.query("mug")).shape == (1, 2)


def test_answers_do_not_depend_on_who_else_is_asked_or_looks():
    together, apart = make_rollout(), make_rollout()
    _, queries = together.ask()
    apart.ask()
    together.score(queries)
    part = Queries(queries.home[:1], queries.object[:1], queries.prior[:1])
    apart.score(part)
    places = look_and_miss(together, queries)
    look_and_miss(apart, queries)
    assert places.max() >= 0
    np.testing.assert_array_equal(apart.score(part), together.score(queries)[:1])
    some = np.array([2, 0])
    part = Queries(queries.home[some], queries.object[some], queries.prior[some])
    np.testing.assert_array_equal(together.score(part), together.score(queries)[some])


def test_a_search_goes_down_the_first_answer():
    """Where no look misses anything, no place but the first answer's next best comes next."""
    rollout = make_rollout(num_homes=1)
    game = TASKS["find_object"](rollout.homes, rollout.policy)
    asked = []
    game.on_answer = asked.append
    for _ in game.run(8):
        pass
    searches = [[]]
    for answer in asked:
        if not answer.is_repeat:
            searches.append([])
        searches[-1].append(answer)
    long = [search for search in searches if len(search) > 2]
    assert long
    for search in long:
        order = np.argsort(-search[0].scores[0], kind="stable")[: len(search)]
        scores = search[0].scores[0][[answer.choice[0] for answer in search]]
        np.testing.assert_allclose(scores, search[0].scores[0][order])
