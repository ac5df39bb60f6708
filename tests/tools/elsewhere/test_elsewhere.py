"""What is known of things that are out: the sums by hand, homes, questions, and the command."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from nep.games.game import checksum_code
from simulator.trace.events import GONE
from simulator.trace.trace import load_trace
from tools.elsewhere.homes import KINDS, leave_out, list_recorded, list_simulated
from tools.elsewhere.questions import Answers, ask
from tools.elsewhere.suite import ElsewhereGame, main
from tools.elsewhere.summary import (
    NUM_BINS,
    compute_calibration_error,
    compute_chance_error,
    make_tables,
    summarise,
)

ROOT = Path(__file__).parents[3]


def make_answers(said, right, is_out, goes_out):
    said = np.array(said)
    return Answers(
        said,
        np.array(right),
        said > 0.5,
        np.array(is_out, bool),
        np.array(goes_out, bool),
        np.where(goes_out, 1.0, 3.0),
    )


def test_one_home_by_hand():
    # Three questions about what goes out: out with .8, in with .4 and .1; one about another thing.
    answers = make_answers([0.8, 0.4, 0.1, 0.05], [0.8, 0.5, 0.9, 0.95], [1, 0, 0, 0], [1, 1, 1, 0])
    found = summarise(answers)
    assert (found["num_questions"], found["num_out"]) == (3, 1)
    assert found["said_out"] == pytest.approx(0.8)
    assert found["said_in"] == pytest.approx(0.25)
    assert found["first_out"] == 1
    assert found["elsewhere_nll"] == pytest.approx(-math.log(0.8 * 0.6 * 0.9) / 3)
    assert found["nll"] == pytest.approx(-math.log(0.8 * 0.5 * 0.9) / 3)
    assert found["others_nll"] == pytest.approx(-math.log(0.95))
    # Bins 8, 4 and 1: (.2 + .4 + .1) / 3.
    assert compute_calibration_error([found["bins"]]) == pytest.approx(0.7 / 3)
    # In two such homes, one with the thing out at .4: bin 4 has .8 said and 1 out of two.
    other = summarise(make_answers([0.4], [0.4], [1], [1]))
    error = compute_calibration_error([found["bins"], other["bins"]])
    assert error == pytest.approx((0.2 + abs(0.8 - 1) + 0.1) / 4)


def test_what_chance_alone_does_to_a_calibration_error():
    # One question each with .2 and .9: |0 - .2| with .8, |1 - .2| with .2: .32; likewise .18.
    bins = np.zeros((3, NUM_BINS))
    bins[:2, 2], bins[:2, 9] = (1, 0.2), (1, 0.9)
    assert compute_chance_error([bins]) == pytest.approx((0.32 + 0.18) / 2)
    # Of many answers that are right: as often as they are drawn.
    rng = np.random.default_rng(0)
    said = rng.beta(0.5, 1.5, 300)
    found = [
        summarise(make_answers(said, said, rng.random(300) < said, np.ones(300)))["bins"]
        for _ in range(200)
    ]
    errors = [compute_calibration_error([own]) for own in found]
    assert compute_chance_error([found[0]]) == pytest.approx(np.mean(errors), rel=0.06)
    assert math.isnan(compute_chance_error([np.zeros((3, NUM_BINS))]))


def test_others_count_as_all_that_stay_in_the_home():
    # .3 said of one that is out; .3 of one that is in and stands for three: 1.2 said, one is out.
    answers = make_answers([0.3, 0.3], [0.3, 0.7], [1, 0], [1, 0])
    found = summarise(answers)
    assert compute_calibration_error([found["bins"]]) == pytest.approx(0.7)
    assert compute_calibration_error([found["all_bins"]]) == pytest.approx(0.2 / 4)


def test_a_home_without_such_questions_is_left_out_of_means():
    nothing = summarise(make_answers([0.1], [0.9], [0], [0]))
    assert math.isnan(nothing["nll"])
    assert np.array(nothing["bins"]).shape == (3, NUM_BINS)
    own = summarise(make_answers([0.8, 0.1], [0.8, 0.9], [1, 0], [1, 0]))
    scores = {
        "a": {"rule": own, "network": own},
        "b": {"rule": nothing, "network": nothing},
    }
    tables = make_tables(scores, "rule")
    assert "| rule | 0.80 | n/a |" in tables
    assert tables.count("| network | rule | ") == 1
    assert "| rule | network | " not in tables
    assert "nan" not in tables


def test_kinds_are_what_their_titles_say():
    for kind in KINDS:
        rules = [home.source.home for home in list_simulated(kind, 3, 2, 0)]
        assert [own.furniture_per_room for own in rules] == [3, 6, 9]
        assert all((own.dynamics.carry_share > 0) == (kind != "routine") for own in rules)
    with pytest.raises(ValueError, match="kinds must be some of carrying, anything, routine"):
        list_simulated("castle", 1, 2, 0)


def test_questions_know_what_is_out():
    (home,) = list_simulated("carrying", 1, 4, 3)
    life = ElsewhereGame(home, {"days": 1}).live(48)
    questions = list(ask(life, 40))
    assert 0 < len(questions) <= 40
    assert any(question.goes_out for question in questions)
    assert all(question.goes_out for question in questions if not question.places)
    for question in questions:
        assert question.memory.last_seen(question.description) is not None


LAYOUT = """{
 "version": 1, "rooms": ["kitchen", "garden"],
 "furniture": [
  {"name": "lawn", "room": "garden"}, {"name": "table", "room": "kitchen"},
  {"name": "shelf", "room": "kitchen"}
 ],
 "start": "2024-05-06T00:00", "end_s": 172800
}"""
EVENTS = """time_s,object,furniture,relation,description
0,mug,table,onTop,
0,lamp,shelf,onTop,
0,bag,lawn,onTop,
3600,mug,lawn,onTop,
7200,mug,shelf,in,
7200,bag,table,onTop,
"""


def test_what_stands_outside_is_out(tmp_path):
    (tmp_path / "flat").mkdir()
    (tmp_path / "flat" / "layout.json").write_text(LAYOUT)
    (tmp_path / "flat" / "events.csv").write_text(EVENTS)
    fewer = leave_out(load_trace(tmp_path / "flat"), ["lawn"])
    assert [row.name for row in fewer.layout.furniture.values()] == ["table", "shelf"]
    assert fewer.layout.room_labels == ("kitchen",)
    # The bag comes into the home at two; the mug leaves at one and is back at two.
    found = [(event.time_s, event.object, event.furniture) for event in fewer.events]
    moves = [(0, "mug", 0), (0, "lamp", 1), (3600, "mug", GONE), (7200, "mug", 1), (7200, "bag", 0)]
    assert found == moves
    (home,) = list_recorded([str(tmp_path / "flat")], ["lawn"], 2, tmp_path / "copies", 0)
    assert (home.unit, home.source.episodes[0].num_steps) == ("flat", 96)


def test_scores_that_are_stored_were_scored_by_this_code():
    stored = json.loads((ROOT / "results" / "elsewhere.json").read_text("utf-8"))
    assert {*stored["code"].values()} == {checksum_code(ElsewhereGame.scored_by)}


@pytest.mark.slow
def test_the_command_plays_resumes_and_writes_tables(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    command = (
        "--kinds carrying --num_homes 2 --days 2 --play_days 1 --questions 12 --looks 4".split()
    )
    main(command)
    text = Path("elsewhere.md").read_text(encoding="utf-8")
    assert "`python -m tools.bench elsewhere --kinds carrying --num_homes 2 --days 2" in text
    assert "## People who carry things out" in text
    for who in ("bayesian", "adaptive", "any_home"):
        assert f"| {who} | " in text
    played = Path("elsewhere.json").read_text(encoding="utf-8")
    main(command)  # nothing is left to play
    assert Path("elsewhere.json").read_text(encoding="utf-8") == played
    with pytest.raises(SystemExit):
        main([*command, "--questions", "0"])
