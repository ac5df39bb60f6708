"""A robot in homes recorded by the minute: times, questions, sums by hand, and the command."""

from datetime import datetime

import numpy as np
import pytest

from sgm.finder.finder import Finder
from sgm.policies import Adaptive
from simulator.trace import Event, Furniture, Layout, Room, Trace, save_trace
from tools.kitchens.robot import (
    NUM_BINS,
    POOLS,
    KitchenGame,
    MinuteQuestion,
    add_answer,
    compute_calibration_error,
    make_sums,
)
from tools.kitchens.suite import main, make_robot_tables

MINUTE = 60.0


def make_trace(start=datetime(2024, 2, 2), num_moves=20):
    """A pan goes back and forth every minute for two spells with an hour between; a pot stays."""
    layout = Layout.of(
        [Room("kitchen", "kitchen")],
        (Furniture(name, 0, name, name) for name in ("counter", "hob", "sink", "shelf")),
    )
    events = [Event(0, "pan", "pan", 0, 1), Event(0, "pot", "pot", 3, 1)]
    for spell in (0, 4200):
        events += [
            Event(spell + 60.0 * (n + 1), "pan", "pan", (n + 1) % 2, 1) for n in range(num_moves)
        ]
    return Trace("own", layout, tuple(events), start=start)


def make_game(trace=None, **changed):
    rules = {
        "step_seconds": MINUTE,
        "looks": 4,
        "miss_rate": 0.0,
        "rest_minutes": 30.0,
        "seeds": (0,),
    }
    return KitchenGame(trace or make_trace(), **(rules | changed))


def test_a_robot_rests_while_nothing_moves():
    times = np.array(make_game().list_times()) / MINUTE
    assert times[0] == 1
    # From 0:01 until the last move of the first spell, then from after the first of the second.
    assert times.tolist() == [*range(1, 20), *range(72, 90)]
    assert len(make_game(rest_minutes=90.0).list_times()) == 89


@pytest.mark.parametrize("start", [datetime(2024, 2, 2), None])
def test_questions_are_about_what_was_seen_and_is_there(start):
    questions = list(make_game(make_trace(start)).ask(0))
    # Two a step: of the pan and the pot, and of the pan, which is in use, where it was moved.
    pools = [question.pools[0] for question in questions]
    assert pools.count("seen") == 37
    # In the first minutes the pot, too, is new.
    assert {q.description for q in questions if q.pools[0] == "in use"} <= {"pan", "pot"}
    late = [q for q in questions if q.pools[0] == "in use"][30:]
    assert {question.description for question in late} == {"pan"}
    # All is seen without misses in four looks a step: nothing has moved since it was seen.
    assert not any("moved" in question.pools for question in questions)
    for question in questions[:4]:
        assert len(question.places) == 1


def test_what_had_moved_since_it_was_seen_is_told_apart():
    questions = list(make_game(looks=1, seeds=(3,)).ask(3))
    assert any("moved" in question.pools for question in questions)
    assert {question.description for question in questions if "moved" in question.pools} == {"pan"}


def test_sums_by_hand():
    """Two answers: .6 on the right place, and .6 on a wrong one with .3 on the right one."""

    class Place:
        def __init__(self, furniture, probability):
            self.furniture, self.probability = furniture, probability

    class Said:
        places = (Place(4, 0.6), Place(2, 0.3), Place(7, 0.1))

    class Always:
        def rank(self, memory, description, in_use):
            return Said()

    sums = {pool: make_sums() for pool in POOLS}
    add_answer(sums, Always(), MinuteQuestion(None, "pan", frozenset({4}), ("seen",)))
    add_answer(sums, Always(), MinuteQuestion(None, "pan", frozenset({2}), ("seen", "moved")))
    own = sums["seen"]
    assert (own["number"], own["first"], own["among_first"]) == (2, 1, 2)
    assert own["nll"] == pytest.approx(-np.log(0.6) - np.log(0.3))
    assert own["confidence"] == pytest.approx(1.2)
    # One bin: |1.2 said - 1 right| of two answers.
    assert compute_calibration_error(own["bins"]) == pytest.approx(0.1)
    assert sums["moved"]["number"] == 1
    assert sums["in use"]["number"] == 0
    assert np.isnan(compute_calibration_error(np.zeros((3, NUM_BINS)).tolist()))
    table = make_robot_tables({"rule": sums})
    assert "Asked for anything that it has seen, 2 questions:" in table
    assert "| rule | 0.500 | 1.000 | 0.857 | 0.600 | 0.100 |" in table
    assert "in ten minutes" not in table  # nothing was asked of that kind


def test_all_finders_are_asked_the_same_and_the_same_again():
    game = make_game(looks=1)
    players = {"adaptive": lambda: Finder(Adaptive())}
    once, again = game.play(players), game.play({**players, "other": players["adaptive"]})
    assert once["adaptive"] == again["adaptive"] == again["other"]
    assert game.describe() != make_game(looks=2).describe()


@pytest.mark.slow
def test_the_command_writes_a_page(tmp_path, capsys):
    save_trace(make_trace(num_moves=6), tmp_path / "kitchen")
    save_trace(make_trace(None, num_moves=6), tmp_path / "cut")
    out = tmp_path / "kitchens.md"
    arguments = [
        "--trace",
        str(tmp_path / "kitchen"),
        "--cut",
        str(tmp_path / "cut"),
        "--out",
        str(out),
        "--replays",
        "1",
        "--called",
        "Kitchens",
    ]
    main(arguments)
    text = out.read_text()
    assert text.startswith(
        "# Kitchens\n\n`python -m tools.bench kitchens --called Kitchens --trace"
    )
    assert "## Kitchen, asked by the minute" in text
    assert "## Cut, tasks of the paper" in text
    assert str(tmp_path) not in text
    capsys.readouterr()
    with pytest.raises(SystemExit):
        main(["--out", str(out)])
    assert "trace must be one or more recorded homes, got none" in capsys.readouterr().err
