import numpy as np
import pytest

from sgm.policies.heuristics import Random
from simulator.policies import POLICIES, make_policy
from simulator.tasks.evaluation import evaluate_policy
from simulator.tasks.metrics import METRICS
from simulator.tasks.predict_location import predict_locations
from simulator.tasks.rollout import Rollout, make_memory
from simulator.world.source import SampledSource
from simulator.world.streams import Streams


def play(homes, policy, num_steps):
    """Scores, choices and answers of every step, (H, T, ...)."""
    rollout = Rollout(homes, make_policy(policy, homes))
    steps = [(s.scores.copy(), s.choice, s.answers) for s in predict_locations(rollout, num_steps)]
    return [np.stack(column, axis=1) for column in zip(*steps, strict=True)]


@pytest.mark.slow
def test_a_home_is_played_the_same_whatever_is_played_beside_it(make_default_homes):
    """For every policy: a collection must not depend on how homes are split over workers."""
    for policy in POLICIES:
        many = play(make_default_homes(5, seed=8), policy, 20)
        few = play(make_default_homes(homes=[3, 0], seed=8), policy, 20)
        for column_many, column_few in zip(many, few, strict=True):
            np.testing.assert_array_equal(column_few, column_many[[3, 0]], err_msg=policy)


def test_homes_and_queries_do_not_depend_on_the_policy(make_default_homes):
    _, first, answers = play(make_default_homes(4), "random", 15)
    _, second, same_answers = play(make_default_homes(4), "bayesian", 15)
    np.testing.assert_array_equal(answers, same_answers)
    assert (first != second).any()


def test_the_look_comes_after_the_answer(make_tiny_homes):
    homes = make_tiny_homes(2, detection_error=0)
    rollout = Rollout(homes, Random())
    looks = np.zeros((2, 6), dtype=int)
    for number, step in enumerate(predict_locations(rollout, 12), start=1):
        assert rollout.memory.time == number
        np.testing.assert_array_equal(rollout.memory.furniture_num_observed, looks)
        looks[np.arange(2), step.choice] += 1
    np.testing.assert_array_equal(rollout.memory.furniture_num_observed, looks)


def test_the_memory_believes_what_was_there_at_the_last_look(make_tiny_homes):
    """With a perfect detector, an edge's state is the truth at its last look."""
    homes = make_tiny_homes(3, detection_error=0, dynamic_nodes=True)
    rollout = Rollout(homes, make_policy("bayesian", homes))
    truth = {}
    for step in predict_locations(rollout, 30):
        for home, furniture in enumerate(step.choice):
            here = homes.object_furniture[home] == furniture
            truth[home, int(furniture)] = {
                (int(code), int(place) % 2)
                for code, place in zip(
                    homes.object_code[home, here], homes.object_place[home, here], strict=True
                )
            }
    memory = rollout.memory
    believed = {place: set() for place in truth}
    for edge in range(memory.edges.num_rows):
        place = (int(memory.edges["home"][edge]), int(memory.edges["furniture"][edge]))
        assert place in truth, "an edge to furniture that nobody looked at"
        if memory.edges["is_true"][edge]:
            key = int(memory.objects["key"][memory.edges["object"][edge]])
            believed[place].add((key, int(memory.edges["relation"][edge])))
    assert believed == truth


def test_answers_are_scored_by_what_the_chosen_furniture_holds(make_tiny_homes):
    rollout = Rollout(make_tiny_homes(3), Random())
    for step in predict_locations(rollout, 20):
        expected = [step.answers[home][step.choice[home]] for home in range(3)]
        assert step.is_correct.tolist() == expected
        assert step.answers.any(axis=1).all()  # what is asked for is present


def test_labels_and_layout_of_the_memory(make_tiny_homes, tiny_prior):
    homes = make_tiny_homes(2, layout=None, furniture_per_room=3)
    memory = make_memory(homes)
    labels = homes.labels
    assert labels[:4] == ["house", "floor", "kitchen", "bedroom"]
    assert len(set(labels)) == len(labels) == 4 + 5 + 10
    for home in range(2):
        for furniture, node in enumerate(homes.furniture_type[home]):
            row = tiny_prior.furniture[node]
            assert labels[memory.furniture_label[home, furniture]] == row.label
            room = memory.furniture_room[home, furniture]
            assert labels[memory.room_label[home, room]] == row.room
    # The agent's prior knows the layout and nothing of the home's noise.
    clean = make_memory(make_tiny_homes(2, layout=None, furniture_per_room=3, noise_zero_prob=0))
    np.testing.assert_array_equal(memory.place_prior.weights, clean.place_prior.weights)
    total = memory.place_prior.weights.sum(axis=(2, 3))
    assert (np.isclose(total, 1, atol=1e-6) | (total == 0)).all()


def test_candidate_recall_is_near_one(default_prior):
    """docs/design.md, ruling 12. In the shipped prior, whatever the noise leaves is still a
    place of the prior."""
    ticks = []
    scores = evaluate_policy(
        POLICIES["bayesian"].make,
        SampledSource(default_prior),
        Streams(2, "val", range(6)),
        20,
        on_step=lambda: ticks.append(1),
    )
    assert METRICS["candidate_recall"].compute(scores) > 0.99
    assert scores.is_correct.shape == scores.has_candidate.shape == (6, 20)
    assert len(ticks) == 20
