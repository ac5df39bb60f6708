"""Homes of different sizes in one lockstep group: each is what it is alone."""

import itertools

import numpy as np
import pytest

from sgm.schema import NUM_RELATIONS
from simulator.policies import make_policy
from simulator.tasks.predict_location import predict_locations
from simulator.tasks.rollout import Rollout, compute_answers, sample_query
from simulator.world.config import HomeConfig
from simulator.world.sampled_homes import SampledHomes
from simulator.world.sensing import observe
from simulator.world.streams import Streams
from tests.candidates import list_candidates

CONFIGS = (
    HomeConfig(),
    HomeConfig(rooms=("kitchen",), furniture_per_room=4, objects_per_furniture=2),
    HomeConfig(
        rooms=("bedroom", "bedroom", "kitchen", "bathroom", "bedroom"),
        furniture_per_room=(12, 3, 20, 1, 9),
        move_share=0.1,
        detection_error=0.1,
    ),
    HomeConfig(rooms=("bathroom", "living room"), furniture_per_room=6, dynamic_nodes=False),
    HomeConfig(furniture_per_room=2, cross_room_moves=True, noise_zero_prob=0.5, noise_scale=0.1),
)
NUM_STEPS = 20
BY_SLOT = ("object_type", "object_code", "object_place", "object_moved", "object_move_weight")


@pytest.fixture(scope="module")
def histories(default_prior):
    """What happens in all homes together, then in each of them alone: states by step."""

    def play(homes):
        states = [
            {
                "furniture": homes.furniture_type,
                "furniture code": homes.furniture_code,
                "furniture_room": homes.furniture_room,
                "labels": homes.furniture_labels,
                "weights": homes.place_weights,
                "add": homes.type_add_prob,
            }
        ]
        for _ in range(NUM_STEPS):
            homes.evolve()
            slots = sample_query(homes)
            code = homes.object_code[np.arange(homes.num_homes), slots]
            answers = compute_answers(homes, code)
            seen = observe(homes, answers.argmax(axis=1))
            rows = homes.transition_rows(np.arange(homes.num_homes), code)
            states.append(
                {name: getattr(homes, name).copy() for name in BY_SLOT}
                | {"query": slots, "code": code, "answers": answers, "seen": seen, "T": rows}
            )
        return states

    numbers = range(3, 3 + len(CONFIGS))
    together = SampledHomes(default_prior, CONFIGS, Streams(7, "test", numbers))
    alone = [
        SampledHomes(default_prior, config, Streams(7, "test", [number]))
        for number, config in zip(numbers, CONFIGS, strict=True)
    ]
    return together, play(together), [(homes, play(homes)) for homes in alone]


@pytest.mark.parametrize("home", range(len(CONFIGS)))
def test_a_home_is_the_same_alone_and_beside_larger_ones(histories, home):
    _, together, singles = histories
    _, alone = singles[home]
    for both, own in zip(together, alone, strict=True):
        for name, array in own.items():
            if name == "seen":
                is_own = both[name].seen_home == home
                for column in ("seen_code", "seen_relation"):
                    np.testing.assert_array_equal(
                        getattr(both[name], column)[is_own], getattr(array, column)
                    )
                continue
            row = both[name][home]
            np.testing.assert_array_equal(row[tuple(map(slice, array[0].shape))], array[0])


def test_beyond_a_home_there_is_nothing(histories):
    homes, states, _ = histories
    sizes = np.array([sum(config.room_sizes) for config in CONFIGS])
    np.testing.assert_array_equal(homes.home_num_furniture, sizes)
    is_beyond = np.arange(homes.num_furniture) >= sizes[:, None]
    np.testing.assert_array_equal(homes.is_furniture, ~is_beyond)
    assert (homes.furniture_room[is_beyond] == -1).all()
    assert (homes.furniture_labels[is_beyond] == "").all()
    assert (homes.furniture_type[is_beyond] == -1).all()
    rooms = [config.rooms for config in CONFIGS]
    assert [tuple(label for label in row if label) for row in homes.room_labels] == rooms
    is_beyond = np.repeat(is_beyond, NUM_RELATIONS, axis=1)
    assert not homes.place_weights.transpose(0, 2, 1)[is_beyond].any()
    is_free = np.arange(homes.num_slots) >= homes.home_num_slots[:, None]
    for state in states[1:]:
        assert (state["object_place"][is_free] == -1).all()
        assert not state["object_moved"][is_free].any()
        place = state["object_place"]
        assert (place < 2 * sizes[:, None]).all()
        assert not state["T"][is_beyond].any()


def test_several_rooms_of_a_kind_are_rooms_of_their_own(histories):
    homes, states, _ = histories
    home = 2  # its rooms 0, 1 and 4 are bedrooms
    assert np.bincount(homes.furniture_room[home, homes.is_furniture[home]]).tolist() == [
        12,
        3,
        20,
        1,
        9,
    ]
    moves = crossed = 0
    for before, after in itertools.pairwise(states[1:]):
        moved = np.flatnonzero(after["object_moved"][home] & (before["object_place"][home] >= 0))
        came = before["object_place"][home, moved]
        went = after["object_place"][home, moved]
        crossed += (homes.place_room[home, came] != homes.place_room[home, went]).sum()
        moves += len(moved)
    assert moves > 100
    assert crossed == 0


@pytest.mark.parametrize("policy", ["random", "bayesian", "last_seen_prior", "oracle"])
def test_the_agent_of_a_home_is_the_same_alone_and_beside_larger_ones(default_prior, policy):
    def play(homes):
        rollout = Rollout(homes, make_policy(policy, homes))
        return rollout.memory, [
            (step.choice, step.is_correct) for step in predict_locations(rollout, NUM_STEPS)
        ]

    numbers = range(len(CONFIGS))
    memory, together = play(SampledHomes(default_prior, CONFIGS, Streams(1, "val", numbers)))
    assert (memory.furniture_label[~memory.is_furniture] == -1).all()
    assert not memory.place_prior.furniture_prob[~memory.is_furniture].any()
    for home, config in enumerate(CONFIGS):
        own, alone = play(SampledHomes(default_prior, config, Streams(1, "val", [home])))
        assert [choice[home] for choice, _ in together] == [choice[0] for choice, _ in alone]
        assert [right[home] for _, right in together] == [right[0] for _, right in alone]
        edges = np.flatnonzero(memory.edges["home"] == home)
        for name in ("furniture", "num_true", "num_observed", "last_true", "prior"):
            np.testing.assert_array_equal(memory.edges[name][edges], own.edges[name])


def test_padding_is_never_a_candidate(default_prior):
    """Not even for an object that the prior does not know, which may be at all furniture."""
    homes = SampledHomes(default_prior, CONFIGS, Streams(1, "val", range(len(CONFIGS))))
    memory = Rollout(homes, make_policy("random", homes)).memory
    home = np.arange(len(CONFIGS))
    queries = memory.query(home, home * 0, home * 0, np.full(len(home), -1))
    candidates = list_candidates(memory, queries)
    np.testing.assert_array_equal(candidates[..., 1], homes.is_furniture)


def test_equal_rules_may_be_given_once_or_for_each_home(default_prior):
    streams = Streams(0, "train", range(2))
    once = SampledHomes(default_prior, HomeConfig(), streams)
    each = SampledHomes(default_prior, [HomeConfig()] * 2, Streams(0, "train", range(2)))
    np.testing.assert_array_equal(once.object_place, each.object_place)
    with pytest.raises(ValueError, match=r"configs must be one, .* of the 2 homes, got 3\. Give"):
        SampledHomes(default_prior, [HomeConfig()] * 3, streams)


def test_a_layout_needs_rooms_that_differ(default_prior):
    config = HomeConfig(rooms=("bedroom", "bedroom"))
    with pytest.raises(ValueError, match=r"rooms must differ where a layout is given, got bedroom"):
        SampledHomes(default_prior, config, Streams(0, "train", [0]), [("bedroom", "bed")])
