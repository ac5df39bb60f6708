"""Homes with routines as traces."""

from datetime import datetime

import numpy as np
import pytest

from simulator.policies import make_policy
from simulator.tasks.evaluation import evaluate_policy
from simulator.trace import RecordedSource, load_trace, record_homes, save_trace
from simulator.trace.events import GONE
from simulator.world.config import HomeConfig
from simulator.world.routine.dynamics import RoutineDynamics
from simulator.world.source import SampledSource
from simulator.world.streams import Streams

RULES = RoutineDynamics(start_time="2024-05-08T06:00", step_seconds=1800)
HOMES = (0, 1)
STEPS = 96


def make_source(dynamic_nodes=True):
    return SampledSource(
        home=HomeConfig(
            furniture_per_room=3,
            objects_per_furniture=4,
            dynamic_nodes=dynamic_nodes,
            dynamics=RULES,
        )
    )


def test_the_trace_has_the_clock_of_the_home_and_every_move(tmp_path):
    source = make_source()
    (trace, _) = record_homes(source.make(Streams(0, "test", HOMES)), STEPS)
    save_trace(trace, tmp_path / "home")
    trace = load_trace(tmp_path / "home")
    assert trace.start == datetime(2024, 5, 8, 6)
    assert trace.end_s == STEPS * 1800
    assert trace.truth.config.dynamics == RULES
    # Who is carried out comes back under the same name, and nobody else comes.
    gone = {event.object for event in trace.events if event.furniture == GONE}
    assert gone
    at_first = {event.object for event in trace.events if event.time_s == 0}
    homes = source.make(Streams(0, "test", HOMES[:1]))
    was_out = np.zeros(homes.num_slots, dtype=bool)
    for _ in range(STEPS):
        homes.evolve()
        was_out |= homes.object_place[0] < 0
    assert len({event.object for event in trace.events} - at_first) <= was_out.sum() - 2


@pytest.mark.parametrize("name", ["bayesian", "oracle"])
def test_where_nothing_is_carried_out_a_replay_gives_the_same_scores(tmp_path, name):
    source = make_source(dynamic_nodes=False)
    streams = Streams(0, "test", HOMES)
    for trace in record_homes(source.make(streams), STEPS):
        save_trace(trace, tmp_path / trace.name)
    recorded = RecordedSource(folders=[str(tmp_path)])
    played, replayed = (
        evaluate_policy(lambda homes: make_policy(name, homes), homes, streams, STEPS)
        for homes in (source, recorded)
    )
    np.testing.assert_array_equal(played.values, replayed.values)
