"""What a robot's looks of one home are worth there: the questions, and how answers are measured."""

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from nep.bench.robot_life import FinderQuestion, RobotLife, measure
from nep.bench.suites.own_home import RULES, main
from sgm.memory.look_log import read_log
from sgm.memory.scene_graph_memory import SceneGraphMemory
from simulator.world.config import HomeConfig
from simulator.world.routine.dynamics import RoutineDynamics
from simulator.world.source import SampledSource


@pytest.fixture(scope="module")
def life():
    rules = HomeConfig(
        furniture_per_room=2, objects_per_furniture=2, dynamics=RoutineDynamics(),
        looks="random", looks_per_step=2,
    )  # fmt: skip
    return RobotLife.record(SampledSource(None, rules), 12, 24, home=1, seed=5)


def test_the_log_holds_the_looks_to_learn_from_alone(life, tmp_path):
    life.write_log(tmp_path / "looks.jsonl")
    lines = read_log(tmp_path / "looks.jsonl")
    looks = [line for line in lines if line.kind == "look"]
    assert len(looks) == 12 * 2
    assert max(line.time for line in lines) == 12
    assert [line.values["furniture"] for line in looks] == [
        look.furniture for look in life.run.looks[:24]
    ]


def test_questions_are_about_what_is_there_half_of_them_about_what_moved(life):
    truth = life.run.truth
    asked = list(life.ask(40, 0.5))
    assert len(asked) == 24 * 40
    num_moved = num_steps = 0
    for one in asked:
        step = one.memory.time
        assert step > 12
        ids = one.memory.furniture_ids
        found = truth.find([one.description], len(ids))
        assert {ids[place] for place in np.flatnonzero(found[step])} == one.places
        any_moved = (truth.furniture[step] != truth.furniture[step - 1])[
            truth.furniture[step] >= 0
        ].any()
        num_steps += any_moved
        num_moved += any_moved and (found[step] != found[step - 1]).any()
    assert num_steps > 200
    # half of them, and by chance some more; two of a kind may have changed places
    assert 0.4 < num_moved / num_steps < 0.75
    again = [(one.memory.time, one.description) for one in life.ask(40, 0.5)]
    assert again == [(one.memory.time, one.description) for one in asked]


def test_of_questions_about_anything_few_are_about_what_moved(life):
    truth, num_moved = life.run.truth, 0
    asked = list(life.ask(40, 0.0))
    for one in asked:
        found = truth.find([one.description], len(one.memory.furniture_ids))
        num_moved += (found[one.memory.time] != found[one.memory.time - 1]).any()
    there = truth.furniture[13:] >= 0
    share = ((truth.furniture[13:] != truth.furniture[12:-1]) & there).sum() / there.sum()
    assert num_moved / len(asked) == pytest.approx(share, abs=0.05)


def test_measures_worked_by_hand():
    # First question: right at once, p 1/2. Second: at the third place, p 1/8.
    places = [
        SimpleNamespace(furniture=n, probability=p) for n, p in enumerate((1 / 2, 1 / 4, 1 / 8))
    ]
    finder = SimpleNamespace(rank=lambda memory, description: places)
    memory = SceneGraphMemory()
    there = {"mug": {0, 2}, "cup": {2}}
    asked = [FinderQuestion(memory, name, frozenset(own)) for name, own in there.items()]
    assert measure(finder, asked) == {
        "accuracy": 0.5,
        "nll": pytest.approx((np.log(2) + np.log(8)) / 2),
        "looks": 2.0,
    }


def test_places_that_tie_share_their_ranks():
    # Four places of .2: the right one is first in one order of four, at (4 + 1) / 2 on average.
    # Then two right ones of three that tie, behind a better one: at 1 + (3 + 1) / (2 + 1).
    memory = SceneGraphMemory()
    by_thing = {"mug": [0.2, 0.2, 0.2, 0.2], "cup": [0.4, 0.1, 0.1, 0.1]}
    finder = SimpleNamespace(
        rank=lambda memory, thing: [
            SimpleNamespace(furniture=n, probability=p) for n, p in enumerate(by_thing[thing])
        ]
    )
    first = measure(finder, [FinderQuestion(memory, "mug", frozenset({0}))])
    assert first == {"accuracy": 0.25, "nll": pytest.approx(np.log(5)), "looks": 2.5}
    second = measure(finder, [FinderQuestion(memory, "cup", frozenset({2, 3}))])
    assert (second["accuracy"], second["looks"]) == (0.0, pytest.approx(1 + 4 / 3))


@pytest.mark.slow
def test_the_command_plays_resumes_and_writes_tables(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    command = [
        "--checkpoint", "heat", "--learn", "adapted", "--num_homes", "2", "--sizes", "1",
        "--days", "2", "--play_days", "1", "--questions", "1", "--looks", "3",
    ]  # fmt: skip
    main(command)
    played = json.loads(Path("own_home.json").read_text(encoding="utf-8"))
    scores = played["scores"]
    assert list(scores) == ["4 places-0", "4 places-1"]
    assert list(scores["4 places-0"]) == [*RULES, "heat", "heat adapted"]
    text = Path("own_home.md").read_text(encoding="utf-8")
    assert "`python -m nep.own_home --checkpoint heat --learn adapted" in text
    assert "A step takes\n3600 s, and the robot looked for 2 days." in text
    assert "| heat adapted | heat | " in text
    assert "| heat adapted | the best rule | " in text
    scores["4 places-1"]["heat"]["nll"] = 77.0  # what is there is not played again
    Path("own_home.json").write_text(json.dumps(played), encoding="utf-8")
    main(command)
    assert json.loads(Path("own_home.json").read_text(encoding="utf-8")) == played
    with pytest.raises(SystemExit):  # other questions
        main([*command, "--asks_moved", "0"])
    with pytest.raises(SystemExit):
        main(["--learn", "by heart"])
    for option in ("num_homes", "days", "play_days", "questions", "looks", "sizes"):
        with pytest.raises(SystemExit):
            main([f"--{option}={10**20}"])
