"""Measures of behaviour, worked out by hand, and the report of the command line."""

import numpy as np
import pytest

from simulator.trace import Event, Furniture, Layout, Room, Trace, save_trace
from simulator.world.config import HomeConfig
from simulator.world.routine.dynamics import RoutineDynamics
from simulator.world.source import SampledSource
from tools.realism import MEASURES, follow_homes, measure_behaviour
from tools.realism.__main__ import main
from tools.realism.measures import NOT_THERE, OUT
from tools.realism.report import RealismColumn, list_outside, make_table, measure_source

# Seven hours, 5:00 to 11:00, of three objects.
HOURS = np.arange(5, 12)
AT = np.array(
    [
        [0, 0, 0, 1, 1, 0, 0],  # two hours away, moves twice
        [0, 0, 0, 1, 0, 0, 0],  # one hour away, moves twice: there with the first one
        [2, 2, 2, 2, 2, 2, 2],
    ]
)


def test_a_home_worked_out_by_hand():
    found = measure_behaviour(AT, HOURS)
    # 4 changes in 3 objects x 6 hours; all of them from 8:00 on: 3 objects x 5 hours from 7:00.
    assert found.changes_per_hour == pytest.approx(4 / 18)
    assert found.changes_per_waking_hour == pytest.approx(4 / 15)
    assert found.moves_per_day == pytest.approx(24 * 4 / 18)
    assert found.ever_moves == pytest.approx(2 / 3)
    assert found.places == pytest.approx((2 + 2 + 1) / 3)
    # Shares 5/7 and 2/7; 6/7 and 1/7; 1.
    bits = [-(p * np.log2(p) + (1 - p) * np.log2(1 - p)) for p in (5 / 7, 6 / 7)]
    assert found.entropy == pytest.approx(sum(bits) / 3)
    assert found.at_usual == pytest.approx((5 + 6 + 7) / 21)
    assert found.at_usual_by_hour == 1.0  # each hour of the day occurs once
    assert found.median_absence == 1.5
    assert found.long_absence == pytest.approx(1.9)
    # At 8:00 both go together; at 9:00 and 10:00 each comes back alone.
    assert found.with_company == pytest.approx(2 / 4)
    assert found.same_way == pytest.approx(2 / 4)


def test_the_hour_of_the_day_tells_what_recurs_daily():
    hours = np.arange(48) % 24
    at = np.where((hours >= 9) & (hours < 17), 1, 0)[None]
    found = measure_behaviour(at, hours)
    assert found.at_usual == pytest.approx(16 / 24)
    assert found.at_usual_by_hour == 1.0


def test_out_of_the_home_is_a_place_and_before_and_after_are_not():
    row = [NOT_THERE, 3, OUT, OUT, 3, 3, NOT_THERE]
    found = measure_behaviour(np.array([row]), np.arange(7))
    assert found.at_usual == pytest.approx(3 / 5)
    assert found.changes_per_hour == pytest.approx(2 / 4)
    assert found.median_absence == 2


def test_what_leaves_and_comes_back_is_followed(make_default_homes):
    homes = make_default_homes(dynamic_nodes=True, dynamics=RoutineDynamics())
    ((at, types),) = follow_homes(homes, 72)
    assert np.array_equal(types[at[:, 0] >= 0], homes.object_type[homes.is_present])
    assert at.shape == (homes.num_objects[0] + (at[:, -1] == OUT).sum(), 73)
    assert (at == OUT).any()
    assert ((at != NOT_THERE).all(axis=1)).mean() > 0.95  # the first and the last hour may be out


def test_homes_are_refused_that_cannot_be_measured():
    with pytest.raises(ValueError, match=r"at least two hours, got 1 objects and 1 hours"):
        measure_behaviour(np.zeros((1, 1), dtype=int), np.zeros(1))
    rules = HomeConfig(dynamics=RoutineDynamics(step_seconds=600))
    with pytest.raises(ValueError, match="steps must be an hour, got 600 s"):
        measure_source(SampledSource(home=rules), 1, 1, 0)


def test_a_mean_outside_the_spread_is_marked():
    recorded = {"a": measure_behaviour(AT, HOURS), "b": measure_behaviour(AT[:2], HOURS)}
    still = RealismColumn("still", (measure_behaviour(AT[2:], HOURS),))
    assert "ever_moves" in list_outside(list(recorded.values()), still.compute_means())
    assert (
        list_outside(
            list(recorded.values()), RealismColumn("same", (recorded["a"],)).compute_means()
        )
        == []
    )
    lines = make_table(recorded, [still]).splitlines()
    assert lines[0] == "| measure | a | b | still |"
    (row,) = (line for line in lines if MEASURES["ever_moves"] in line)
    assert row == "| objects that ever move | 0.667 | 1 | *0 ± 0* |"
    # Without recorded homes nothing is marked: the command ended with "min() arg is an empty ...".
    assert "| objects that ever move | 0 ± 0 |" in make_table({}, [still]).splitlines()


def test_routines_are_as_regular_as_the_recorded_homes_that_we_know():
    # The spread of five households of HOMER, as results/realism.md says it, with a margin: these
    # are few homes and days.
    rules = HomeConfig(furniture_per_room=6, objects_per_furniture=2, dynamics=RoutineDynamics())
    homes = RealismColumn("routine", tuple(measure_source(SampledSource(home=rules), 12, 30, 2)))
    means = homes.compute_means()
    assert 0.025 < means["changes_per_hour"] < 0.06
    assert 0.82 < means["at_usual"] < 0.89
    assert means["at_usual"] < means["at_usual_by_hour"] < 0.93
    assert 1.5 < means["median_absence"] < 9


@pytest.mark.slow
def test_the_command_writes_a_report(tmp_path, capsys):
    layout = Layout.of(
        [Room("kitchen", "kitchen")],
        (Furniture(name, 0, name, name) for name in ("table", "shelf")),
    )
    events = (Event(0, "mug", "mug", 0, 1), Event(7200, "mug", "mug", 1, 1))
    save_trace(Trace("home", layout, events, until_s=48 * 3600.0), tmp_path / "home")
    out = tmp_path / "report"
    arguments = [
        "--trace",
        str(tmp_path / "home"),
        "--out",
        str(out),
        "--num_homes",
        "1",
        "--days",
        "2",
    ]
    main(arguments)
    text = (out / "realism.md").read_text()
    assert text.strip() == capsys.readouterr().out.strip()
    assert "| measure | home | routine, 48 objects |" in text
    assert "Outside the spread of the recorded homes, routine, 48 objects: " in text
    assert (out / "realism.png").stat().st_size > 10_000
    with pytest.raises(SystemExit, match="error: trace must be a folder"):
        main(["--trace", str(tmp_path / "none"), "--out", str(out)])
    with pytest.raises(SystemExit, match="error: days must be at least 1, got 0"):
        main(["--days", "0", "--out", str(out)])
