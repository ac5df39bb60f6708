"""Patrols: where they look, what a home shows them, and the table of their scores."""

import numpy as np
import pytest

from sgm.finder.finder import Finder
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.policies import Adaptive
from tools.patrols.__main__ import main, make_table
from tools.patrols.lives import PatrolledHome, make_patrols


@pytest.fixture(scope="module")
def finder():
    return Finder(Adaptive())


def make_memory(num_places=3):
    memory = SceneGraphMemory()
    room = memory.add_room("kitchen")
    for number in range(num_places):
        memory.add_furniture(f"shelf {number}", room)
    return memory


def test_round_robin_goes_around(finder):
    memory, look = make_memory(), make_patrols(finder, 0)["round_robin"]
    assert [look(memory, 2) for _ in range(3)] == [[0, 1], [2, 0], [1, 2]]


def test_longest_not_seen_looks_at_new_places_then_at_the_oldest_look(finder):
    memory, look = make_memory(), make_patrols(finder, 0)["longest_not_seen"]
    for place in (2, 0):
        memory.observe(place, [])
        memory.step()
    assert look(memory, 3) == [1, 2, 0]


def test_random_draws_different_places_and_next_looks_asks_the_finder(finder):
    memory, patrols = make_memory(), make_patrols(finder, 0)
    rounds = [patrols["random"](memory, 2) for _ in range(20)]
    assert all(len(set(places)) == 2 for places in rounds)
    assert {place for places in rounds for place in places} == {0, 1, 2}
    memory.observe(1, [Sighting("mug")])
    memory.step()
    expected = [look.furniture for look in finder.next_looks(memory, 2)]
    assert patrols["next_looks"](memory, 2) == expected


@pytest.mark.slow
def test_a_home_shows_what_is_there_and_scores_are_those_of_its_answers(finder):
    home = PatrolledHome.make(0, 0, 1)
    for step, place in ((5, 0), (20, 3)):
        seen = [sighting.description for sighting in home.look(step, place)]
        there = home.truth.list_there(step, place)
        assert set(seen) <= set(there)
        assert [each.description for each in home.look(step, place)] == seen
    patrols = make_patrols(finder, 0)
    nats, right = home.patrol(patrols["round_robin"], 4, finder)
    assert 0 < right <= 1
    assert 0 < nats < np.log(len(home.run.memory_at(0).furniture_ids) + 1)
    # A patrol that never looks knows less.
    blind = home.patrol(lambda memory, k: [], 4, finder)
    assert blind[0] > nats
    assert blind[1] < right


def test_a_table_has_means_and_paired_differences():
    # Two homes: nats .2 and .4 against .3 and .5, right .9 and .7 against .7 and .8.
    scores = {
        "0": {"next_looks": [0.2, 0.9], "random": [0.3, 0.7]},
        "1": {"next_looks": [0.4, 0.7], "random": [0.5, 0.8]},
    }
    page = make_table(scores, "COMMAND", {"days": 7, "looks": 4, "seed": 2}, "abc")
    assert "`COMMAND`" in page
    assert page.endswith("SHA-256 `abc`.\n")
    assert "| next_looks | 0.300 | 0.800 |  |  |" in page
    assert "| random | 0.400 | 0.750 | -0.100 [-0.100, -0.100] | +0.050 [" in page


@pytest.mark.slow
def test_a_stopped_command_goes_on(tmp_path, capsys):
    out = tmp_path / "patrols.md"
    arguments = ["--days", "1", "--out", str(out)]
    main([*arguments, "--homes", "1"])
    first = out.with_suffix(".json").read_text("utf-8")
    main([*arguments, "--homes", "1"])
    assert out.with_suffix(".json").read_text("utf-8") == first
    assert "1 homes." in out.read_text("utf-8")
    with pytest.raises(SystemExit, match="2"):
        main([*arguments, "--homes", "0"])
    assert "homes must be at least 1" in capsys.readouterr().err
