"""A network beside the best rule: units, duplicates and corrections, by hand."""

import numpy as np
import pytest

from tests.tools.bench.test_recorded import write_home
from tools.bench.comparisons import compare_with_rules, count_decided, make_overview
from tools.bench.home_games import list_benchmark, list_recorded, list_simulated


def make_kind(net, rule, looks=(2.0, 3.0)):
    """Scores of a network and of a rule: their first guesses, and their looks in every home."""
    num_homes = len(net)
    return {
        who: {"accuracy": guesses, "nll": [1.0] * num_homes, "looks": [mean] * num_homes}
        for who, guesses, mean in (("net", net, looks[0]), ("adaptive", rule, looks[1]))
    }


def describe(*units, is_recorded=False):
    return {"title": "Small homes", "units": list(units), "is_recorded": is_recorded}


def test_plays_of_a_household_are_one_unit_by_hand():
    # Household a: differences .3 and .1, b: .4 and .4. Means .2 and .4: .3 -+ 12.706 x .1.
    scores = {"small": make_kind([0.5, 0.7, 0.6, 0.8], [0.2, 0.6, 0.2, 0.4])}
    about = {"small": describe("a", "a", "b", "b")}
    row = compare_with_rules(about, scores, "net")[0]
    assert row.num_units == 2
    assert row.difference.mean == pytest.approx(0.3)
    assert (row.difference.low, row.difference.high) == pytest.approx((-0.971, 1.571), abs=1e-3)
    assert row.difference.p == pytest.approx(0.2048, abs=1e-4)  # t = 3 of one degree
    text = make_overview(about, scores, "net")
    assert "| Small homes | 2 | 0.650 | 0.350 adaptive | +0.300 [-0.971, +1.571] | 1." in text


def test_the_same_plays_count_once():
    rng = np.random.default_rng(0)
    guesses = [rng.normal(size=6).tolist() for _ in range(4)]
    looks = rng.normal(size=6).tolist()
    scores = {"short": make_kind(*guesses[:2]), "long": make_kind(*guesses[2:])}
    for own in scores.values():
        own["net"]["looks"], own["adaptive"]["looks"] = looks, [0.0] * 6
    about = {kind: describe(*"abcdef") for kind in scores}
    rows = compare_with_rules(about, scores, "net")
    # First guesses differ; NLL is alike in both, and looks are the very same.
    assert [row.same_as for row in rows] == [None, None, None, "short", None, "short"]
    assert [np.isnan(row.corrected) for row in rows] == [bool(row.same_as) for row in rows]
    counted = [row for row in rows if row.same_as is None]
    least = min(counted, key=lambda row: row.difference.p)
    assert least.corrected == pytest.approx(min(1.0, 4 * least.difference.p))  # Holm: of four
    text = count_decided(about, rows)
    assert "| all | 4 |" in text
    assert "2 more rows are the very plays of another row, and count once." in text


def test_who_is_ahead_is_counted_on_both_sides_and_by_kind_of_home():
    # Six homes, differences about .1 with s = .01: t = 24, p = 2e-6, in either direction.
    near = [0.09, 0.11, 0.1, 0.1, 0.09, 0.11]
    up, down = [0.5 + x for x in near], [0.5 - x for x in near]
    scores = {
        "won": make_kind(up, [0.5] * 6, looks=(3.0, 3.0)),
        "lost": make_kind(down, [0.5] * 6, looks=(3.0, 3.0)),
    }
    about = {"won": describe(*"abcdef"), "lost": describe(*"abcdef", is_recorded=True)}
    lines = count_decided(about, compare_with_rules(about, scores, "net")).splitlines()
    # First guesses 2, NLL 1 and looks 1 (the same numbers in both kinds): 4 x .025 by chance.
    assert lines[2] == "| all | 4 | 1 | 1 | 0.1 | 1 | 1 |"
    assert lines[3] == "| in simulated homes | 3 | 1 | 0 | 0.1 | 1 | 0 |"
    assert lines[4] == "| in households | 1 | 0 | 1 | 0.0 | 0 | 1 |"


def test_units_are_homes_that_were_drawn_and_households_that_are_replayed(tmp_path):
    drawn = list_simulated(3, 2, 1)["paper-8"]
    assert len(set(drawn.list_units())) == 3
    assert not drawn.is_recorded
    homes = [write_home(tmp_path / name, name) for name in ("shelf", "fridge")]
    played = list_recorded(homes, 1, (0, 1, 2, 3), "Scripted households")
    for kind in played.values():
        first, *_, last = units = kind.list_units()  # by what is in them
        assert units == [first] * 4 + [last] * 4
        assert first != last
        assert kind.is_recorded
    assert played["recorded-hour-200"].title == "Scripted households, 200 hourly steps"
    for kind in list_benchmark(homes, 6, 14400.0, 2).values():
        assert len(set(kind.list_units())) == 2
