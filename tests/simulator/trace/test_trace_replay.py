"""Recorded homes play every task; a simulated home replays to the very same scores."""

from dataclasses import fields, replace
from functools import partial

import numpy as np
import pytest

from simulator.policies import POLICIES, check_policies, list_policies, make_policy
from simulator.tasks.evaluation import evaluate_policy
from simulator.tasks.predict_location import predict_locations
from simulator.tasks.registry import TASKS
from simulator.tasks.rollout import Rollout
from simulator.tasks.scores import TaskScores
from simulator.trace import (
    RecordedSource,
    load_trace,
    record_homes,
    save_trace,
)
from simulator.world.config import HomeConfig
from simulator.world.sampled_homes import SampledHomes
from simulator.world.source import Group, SampledSource
from simulator.world.streams import Streams

STEPS = 12
HOMES = (0, 1, 2)


def make_config(dynamic_nodes=True):
    return HomeConfig(
        rooms=("kitchen", "bedroom"), furniture_per_room=3, dynamic_nodes=dynamic_nodes
    )


@pytest.fixture(scope="module")
def recorded(tiny_prior, tmp_path_factory):
    """Three simulated homes, through files."""
    folder = tmp_path_factory.mktemp("traces")
    homes = SampledHomes(tiny_prior, make_config(), Streams(4, "test", HOMES))
    for trace in record_homes(homes, STEPS):
        save_trace(trace, folder / trace.name)
    return RecordedSource(tiny_prior, folders=[str(folder)])


@pytest.mark.slow
@pytest.mark.parametrize("task", TASKS)
@pytest.mark.parametrize("policy", POLICIES)
def test_replay_gives_the_same_scores_step_by_step(recorded, tiny_prior, policy, task):
    make = partial(make_policy, policy)
    streams = Streams(4, "test", HOMES)
    played = evaluate_policy(
        make, SampledSource(tiny_prior, make_config()), streams, STEPS, task=task
    )
    replayed = evaluate_policy(make, recorded, streams, STEPS, task=task)
    for field in fields(TaskScores):
        np.testing.assert_array_equal(getattr(played, field.name), getattr(replayed, field.name))


def test_replay_makes_the_same_choices(recorded, tiny_prior):
    homes = SampledHomes(tiny_prior, make_config(), Streams(4, "test", HOMES))
    played = Rollout(homes, make_policy("bayesian", homes))
    choices = np.array([step.choice for step in predict_locations(played, STEPS)])
    for home in HOMES:  # one at a time: lockstep changes nothing
        replay = recorded.make(Streams(4, "test", [home]))
        rollout = Rollout(replay, make_policy("bayesian", replay))
        own = [int(step.choice[0]) for step in predict_locations(rollout, STEPS)]
        assert own == choices[:, home].tolist()


def test_every_step_of_a_replay_is_the_simulated_home(make_tiny_homes, tiny_prior):
    """Slot by slot, with objects that leave and others that take their slots."""
    traces = record_homes(make_tiny_homes(3, seed=2), 40)
    homes = make_tiny_homes(3, seed=2)
    replay = RecordedSource.from_traces(traces, tiny_prior).make(Streams(2, "train", range(3)))
    text = homes.object_descriptions.text
    for step in range(41):
        np.testing.assert_array_equal(homes.object_place, replay.object_place)
        np.testing.assert_array_equal(homes.object_moved, replay.object_moved)
        here = homes.is_present
        np.testing.assert_array_equal(homes.object_type[here], replay.object_type[here])
        assert [text(code) for code in homes.object_code[here]] == [
            replay.object_descriptions.text(code) for code in replay.object_code[here]
        ]
        if step < 40:
            homes.evolve()
            replay.evolve()
    assert sum(trace.num_slots for trace in traces) == 3 * homes.num_slots
    with pytest.raises(ValueError, match=r"at most the 40 that were recorded, got 41. Play fewer"):
        replay.evolve()


def test_without_the_truth_dynamics_are_counted(write_home, tiny_prior):
    trace = load_trace(write_home())
    source = RecordedSource.from_traces([trace], tiny_prior, step_seconds=3600)
    homes = source.make(Streams(0, "test", [0]))
    code = {homes.object_descriptions.text(c): c for c in range(4)}
    rows = homes.transition_rows(
        np.zeros(3, int), np.array([code["large red mug"], code["book"], code["pen"]])
    )
    # Arrivals of the mug: twice on the table (place 1), twice in shelf 1 (place 2).
    np.testing.assert_allclose(rows[0], [0, 0.5, 0.5, 0, 0, 0])
    np.testing.assert_allclose(rows[1], [0, 0, 0.5, 0, 0, 0.5])
    np.testing.assert_allclose(rows[2], [0, 0, 0, 0, 0, 1])
    # Rules: 3 objects at 3 furniture nodes; moves of 1 / 3 in steps 3 and 6 of 6.
    assert homes.configs[0].objects_per_furniture == 1
    assert homes.configs[0].move_share == pytest.approx((1 / 3 + 1 / 3) / 6)
    assert homes.configs[0].dynamic_nodes
    assert homes.configs[0].cross_room_moves
    assert homes.configs[0].detection_error == 0.25
    assert list_policies(source) == tuple(name for name in POLICIES if name != "ceiling")
    with pytest.raises(
        ValueError,
        match=r"is unknown of the homes, got ceiling, which reads .*place weights. Leave it",
    ):
        check_policies(["bayesian", "ceiling"], source)
    with pytest.raises(ValueError, match="ceiling must play in simulated homes, got the recorded"):
        homes.get_place_weights()


@pytest.mark.parametrize("task", TASKS)
def test_recorded_homes_play_every_task(write_home, tiny_prior, task):
    source = RecordedSource.from_traces([load_trace(write_home())], tiny_prior, step_seconds=1200)
    for policy in list_policies(source):
        make = partial(make_policy, policy)
        scores = evaluate_policy(make, source, Streams(0, "test", [0]), 18, task=task)
        assert scores.values.shape == (1, 18)
        assert np.isfinite(scores.values).all()
        assert scores.has_candidate.any()


def test_names_that_the_prior_does_not_know(write_home, tiny_prior):
    """Two bedrooms, a bench and a hamster: unknown types have no prior, and can be found."""
    layout = {
        "rooms": ["bedroom 1", "bedroom 2", "attic"],
        "furniture": [
            {"name": "bed", "room": "bedroom 1"},
            {"name": "bench", "room": "bedroom 2"},
            {"name": "desk", "room": "attic"},
        ],
    }
    rows = [f"{hour * 3600},old hamster,{('bed', 'bench')[hour % 2]},in" for hour in range(9)]
    events = "\n".join(["time_s,object,furniture,relation", *rows])
    source = RecordedSource.from_traces([load_trace(write_home(layout, events))], tiny_prior)
    assert source.list_unknown_types() == ["hamster"]
    homes = source.make(Streams(0, "test", [0]))
    assert homes.room_labels[0].tolist() == ["bedroom", "bedroom", "attic"]
    assert homes.move_freq[-1] == pytest.approx(np.mean([o.move_freq for o in tiny_prior.objects]))
    rollout = Rollout(homes, make_policy("bayesian", homes))
    for step in predict_locations(rollout, 8):
        row = step.queries.object[0]
        assert rollout.memory.objects["type"][row] == -1
        assert rollout.memory.labels[rollout.memory.objects["label"][row]] == "hamster"
        assert not step.queries.prior.any()
        assert np.isfinite(step.scores).all()  # every furniture node is a candidate
    labels = [rollout.memory.labels[label] for label in rollout.memory.furniture_label[0]]
    assert labels == ["bed", "bench", "desk"]


def test_different_layouts_play_together(recorded, write_home, tiny_prior):
    traces = [*recorded.traces[:2], load_trace(write_home()), recorded.traces[2]]
    other = replace(traces[2], name="later")
    source = RecordedSource.from_traces([*traces, other], tiny_prior)
    assert source.list_groups(range(5)) == [Group((0, 1, 2, 3, 4), 6)]
    homes = source.make(Streams(0, "test", range(5)))
    own = source.make(Streams(0, "test", [2]))
    assert homes.num_furniture > own.num_furniture
    assert homes.home_num_furniture[2] == own.num_furniture
    assert (
        homes.furniture_labels[2, : own.num_furniture].tolist() == own.furniture_labels[0].tolist()
    )
    make = partial(make_policy, "bayesian")
    together = evaluate_policy(make, source, Streams(4, "test", range(5)), 6)
    alone = evaluate_policy(
        make, RecordedSource.from_traces(traces[:2], tiny_prior), Streams(4, "test", range(2)), 6
    )
    np.testing.assert_array_equal(together.values[:2], alone.values)
    with pytest.raises(ValueError, match=r"at most the 6 steps of 3600 s that home was recorded"):
        source.check_steps(7)
    with pytest.raises(ValueError, match="must be one of the 5 that were recorded, got 5"):
        source.make(Streams(0, "test", [5]))


def test_a_simulated_step_keeps_its_length(recorded, tiny_prior):
    with pytest.raises(ValueError, match=r"step must be the 3600 s that home_000000 was simulated"):
        RecordedSource.from_traces(recorded.traces, tiny_prior, step_seconds=60)
    bare = [replace(trace, truth=None) for trace in recorded.traces]
    assert RecordedSource.from_traces(bare, tiny_prior, step_seconds=1800).num_steps == 2 * STEPS


def test_days_are_homes_of_their_own(write_home, tiny_prior):
    rows = [f"{hour * 3600},mug,{('table', 'shelf 1')[hour % 2]},in" for hour in range(49)]
    events = "\n".join(["time_s,object,furniture,relation", *rows])
    source = RecordedSource(tiny_prior, folders=[str(write_home(events=events))], by_day=True)
    assert [episode.name for episode in source.episodes] == ["home 0", "home 1"]
    assert (source.num_homes, source.num_steps) == (2, 24)
    assert source.list_groups([0, 1]) == [Group((0, 1), 24)]
    homes = source.make(Streams(0, "test", [0, 1]))
    for hour in range(24):
        assert homes.object_furniture[:, 0].tolist() == [hour % 2] * 2
        homes.evolve()
    for values, message in (
        (((),), "traces must be one or more folders"),
        ((("a",), 0.0), "step must be a number of seconds > 0, got 0.0"),
        ((("a",), float("inf")), "got inf"),
    ):
        with pytest.raises(ValueError, match=message):
            RecordedSource(None, None, *values)
