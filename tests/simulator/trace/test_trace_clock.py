"""What time it is in recorded homes: in episodes, in shards, in what is recorded or imported."""

import json
from dataclasses import replace
from datetime import datetime

import numpy as np
import pytest

from sgm.arrays.week import compute_week_seconds
from sgm.memory.clock import Clock
from sgm.memory.scene_graph_memory import SceneGraphMemory
from simulator.collect.folder import collect
from simulator.collect.settings import CollectConfig
from simulator.policies import make_policy
from simulator.snapshots.shards import load_shard
from simulator.tasks.predict_location import predict_locations
from simulator.tasks.rollout import Rollout
from simulator.trace import RecordedSource, load_trace, make_episode, split_days
from simulator.trace.__main__ import main
from simulator.trace.trace import remember_trace
from simulator.world.streams import Streams

HOUR = 3600
MONDAY = "2024-05-06T18:00"
EVENTS = "time_s,object,furniture,relation\n" + "".join(
    f"{hour * HOUR},mug,{('table', 'shelf 1')[hour % 2]},in\n" for hour in range(3, 60)
)


@pytest.fixture
def evening(write_home):
    """Recorded from second 10800 on, Monday 21:00, because second 0 is Monday 18:00."""
    return load_trace(write_home(events=EVENTS, start=MONDAY))


def test_episodes_have_a_clock(evening):
    assert make_episode(evening, HOUR).clock == Clock(datetime(2024, 5, 6, 21), HOUR)
    days, _ = split_days(evening, 1800)
    assert [day.clock for day in days] == [
        Clock(datetime(2024, 5, 7), 1800), Clock(datetime(2024, 5, 8), 1800)
    ]  # fmt: skip
    unknown = replace(evening, start=None)
    assert make_episode(unknown, HOUR).clock is None


def test_memories_tell_the_time_at_every_step(evening, tiny_prior):
    """Three homes in lockstep: one evening, and the two days that follow it."""
    for by_day, home, first in ((False, [0], [21]), (True, [0, 1], [24, 48])):  # hours of the week
        source = RecordedSource.from_traces([evening], tiny_prior, HOUR, by_day)
        homes = source.make(Streams(0, "test", home))
        rollout = Rollout(homes, make_policy("bayesian", homes))
        for step, _ in enumerate(predict_locations(rollout, 20), start=1):
            now = compute_week_seconds(rollout.memory.clock, np.full(len(home), step))
            assert (now / HOUR).tolist() == [hour + step for hour in first]


def test_a_home_without_a_start_stays_without(evening, tiny_prior, write_home):
    unknown = replace(evening, name="unknown", start=None)
    both = RecordedSource.from_traces([unknown, evening], tiny_prior)
    clock = both.make(Streams(0, "test", [0, 1])).clock
    np.testing.assert_array_equal(clock, [[np.nan] * 2, [21 * HOUR, HOUR]])
    assert both.make(Streams(0, "test", [0])).clock is None
    RecordedSource.from_traces([evening], tiny_prior).check_clock()
    with pytest.raises(ValueError, match=r"got no start in the layout.json of unknown. Add a line"):
        both.check_clock()
    assert both.describe()["starts"] == [None, "2024-05-06T21:00:00"]


def test_shards_hold_the_clock(write_home, tmp_path):
    for name, more in (("a", {"start": MONDAY}), ("b", {})):
        write_home(events=EVENTS, name=name, **more)
    folders = (str(tmp_path / "a"), str(tmp_path / "b"))
    config = CollectConfig(
        num_homes=2, steps=3, homes=RecordedSource(folders=folders, step_seconds=1800.5)
    )
    collect(config, tmp_path / "out", progress=False)
    known, unknown = (
        load_shard(tmp_path / "out" / f"home_00000{home}.safetensors") for home in (0, 1)
    )
    assert known["home_clock"].tolist() == [21 * HOUR, 1800.5]
    assert "home_clock" not in unknown


def test_recorded_and_imported_homes_can_say_when(tmp_path, capsys):
    out = tmp_path / "traces"
    record = ["record", "--steps", "2", "--out", str(out), "--start"]
    assert main([*record, "2026-11-16T07:30"]) == 0
    assert "in 2.0 hours from Monday 2026-11-16 07:30" in capsys.readouterr().out
    trace = load_trace(out / "home_000000")
    assert trace.start == datetime(2026, 11, 16, 7, 30)
    for start, message in (
        ("soon", "start must be a date and time, got 'soon'. Write it like 2024-05-06T07:30"),
        ("2026-11-16T07:30+01:00", "start must be local time, got the time zone of"),
    ):
        assert main([*record, start]) == 1
        assert message in capsys.readouterr().err
    home = {
        "rooms": [{"id": "room|2", "roomType": "Kitchen"}],
        "objects": [{"id": "DiningTable|2|0", "children": [{"id": "Mug|surface|2|2"}]}],
    }
    (tmp_path / "house.json").write_text(json.dumps(home))
    bring = ["import", "procthor", str(tmp_path / "house.json"), "--start", "2026-11-16T07:30"]
    assert main([*bring, "--out", str(tmp_path / "in"), "--memory", str(tmp_path / "a.sgm")]) == 0
    assert load_trace(tmp_path / "in").start == datetime(2026, 11, 16, 7, 30)
    memory = SceneGraphMemory.load(tmp_path / "a.sgm")
    assert memory.clock == Clock(datetime(2026, 11, 16, 7, 30), HOUR)


def test_a_memory_of_a_trace_starts_when_it_looks(evening):
    assert remember_trace(evening).clock.start == datetime(2024, 5, 9, 5)  # 59 h after 18:00
