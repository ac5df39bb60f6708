"""Priors counted from traces, by hand and against the rules that made the homes."""

import numpy as np
import pytest

from sgm.prior.prior_graph import PriorGraph
from simulator.priors.__main__ import main
from simulator.trace import load_trace, record_homes, save_trace
from simulator.trace.count_prior import count_prior, fit_sample_probs
from simulator.world.config import HomeConfig
from simulator.world.sampled_homes import SampledHomes
from simulator.world.streams import Streams

LAYOUT = """{"rooms": ["kitchen", "bedroom"], "furniture": [
 {"name": "shelf 1", "room": "kitchen", "description": "oak shelf"},
 {"name": "shelf 2", "room": "kitchen"},
 {"name": "table", "room": "kitchen"},
 {"name": "bed", "room": "bedroom"},
 {"name": "bench", "room": "bedroom"}], "end_s": 40}"""
EVENTS = """time_s,object,furniture,relation,description
0,mug,shelf 1,in,red mug
0,bean 1,table,onTop,long bean
10,mug,table,onTop,
10,bean 2,bed,onTop,bean
20,mug,shelf 2,in,
30,bean 1,,,
30,mug,table,onTop,
"""


@pytest.fixture
def home(tmp_path):
    folder = tmp_path / "home"
    folder.mkdir()
    (folder / "layout.json").write_text(LAYOUT)
    (folder / "events.csv").write_text(EVENTS)
    return folder


def test_a_prior_by_hand(home):
    prior, left_out = count_prior([load_trace(home)], step_seconds=10)
    assert left_out == ["bench in bedroom: nothing was ever put there"]
    assert prior.rooms == ("kitchen", "bedroom")
    nodes = {(row.label, row.room): (row.prob, row.max_count) for row in prior.furniture}
    assert nodes == {
        ("shelf", "kitchen"): (2.0, 2),  # two in the one kitchen
        ("table", "kitchen"): (1.0, 1),
        ("bed", "bedroom"): (1.0, 1),
    }
    rows = {(p.object, p.furniture, p.relation): (p.prob, p.count) for p in prior.placements}
    # The mug arrives 4 times: 2 of them on 2 shelves, 1 per shelf, and 2 at the table. Weights
    # 1 : 2, so 1/3 and 2/3. The bean (unknown to the prior) arrives at the table and on the bed.
    assert rows == {
        ("mug", "shelf", "in"): (pytest.approx(1 / 3, abs=1e-6), 2),
        ("mug", "table", "onTop"): (pytest.approx(2 / 3, abs=1e-6), 2),
        ("bean", "table", "onTop"): (0.5, 1),
        ("bean", "bed", "onTop"): (0.5, 1),
    }
    mug, bean = prior.objects
    assert (mug.label, mug.max_count, mug.move_freq) == ("mug", 1, 1.0)  # 3 moves in 4 steps
    assert (bean.label, bean.max_count, bean.move_freq) == ("bean", 2, 0.0)
    # Beans: one for 1 step, two for 2 steps, one for 1 step: 6 steps; 1 comes, 1 leaves, 4 steps.
    assert bean.add_remove_prob == pytest.approx(2 / (6 + 4))
    assert mug.add_remove_prob == 0
    assert bean.adjectives == (("long",),)
    assert mug.adjectives == next(
        row.adjectives for row in PriorGraph.default().objects if row.label == "mug"
    )


def test_sample_probabilities_give_what_was_present(tiny_prior):
    true = np.linspace(0.1, 1.0, len(tiny_prior.objects))
    weights = tiny_prior.weights.sum(axis=2) * true[:, None]
    taken = weights / weights.sum(axis=0) * [row.prob for row in tiny_prior.furniture]
    np.testing.assert_allclose(fit_sample_probs(tiny_prior, taken.sum(axis=1)), true, rtol=0.02)


def test_a_prior_counted_from_simulated_homes_is_like_theirs(tiny_prior):
    config = HomeConfig(rooms=("kitchen", "bedroom"), furniture_per_room=3)
    traces = record_homes(SampledHomes(tiny_prior, config, Streams(1, "train", range(20))), 100)
    prior, _ = count_prior(traces)
    known = {row.label: row for row in tiny_prior.objects}
    found = {row.label: row for row in prior.objects}
    assert found.keys() == known.keys()

    def correlate(name):
        pairs = [(getattr(found[label], name), getattr(known[label], name)) for label in known]
        return np.corrcoef(np.array(pairs).T)[0, 1]

    assert correlate("move_freq") > 0.9
    assert correlate("add_remove_prob") > 0.9
    assert found["lamp"].move_freq == 0
    places = {(p.room, p.furniture, p.object, p.relation) for p in prior.placements}
    assert ("kitchen", "fridge", "milk", "in") in places
    total = {}
    for row in prior.placements:
        total[row.object] = total.get(row.object, 0) + row.prob
    assert all(value == pytest.approx(1, abs=1e-5) for value in total.values())
    SampledHomes(prior, config, Streams(0, "test", [0]))  # homes can be sampled from it


def test_the_command_line_writes_a_prior_that_checks(home, tmp_path, capsys, tiny_prior):
    out = tmp_path / "prior.json"
    assert main(["from-trace", str(home), "--step-seconds", "10", "--out", str(out)]) == 0
    assert "left out: bench in bedroom" in capsys.readouterr().out
    assert main(["check", str(out)]) == 0
    first = out.read_bytes()
    assert main(["from-trace", str(home), "--step-seconds", "10", "--out", str(out)]) == 0
    assert out.read_bytes() == first
    assert main(["from-trace", str(home), "--step-seconds", "1e9", "--out", str(out)]) == 1
    assert "error: trace must last at least one step of 1e+09 s" in capsys.readouterr().err
    assert main(["from-trace", str(tmp_path / "no"), "--out", str(out)]) == 1
    assert "error: trace must be a folder" in capsys.readouterr().err
    config = HomeConfig(rooms=("kitchen", "bedroom"), furniture_per_room=3)
    for trace in record_homes(SampledHomes(tiny_prior, config, Streams(1, "train", range(2))), 5):
        save_trace(trace, tmp_path / "many" / trace.name)
    assert main(["from-trace", str(tmp_path / "many"), "--out", str(out)]) == 0
    assert PriorGraph.load(out).metadata["sources"] == ["trace (2 recorded homes, 10 steps)"]
