"""The prior for homes that people live in."""

import numpy as np
import pytest

from sgm.files import read_table
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.policies.heuristics import Bayesian
from sgm.prior.household import ROOMS
from sgm.prior.prior_graph import PriorGraph, find_shipped, load_prior
from simulator.tasks.rollout import Rollout
from simulator.world.config import HomeConfig
from simulator.world.source import SampledSource
from simulator.world.streams import Streams


@pytest.fixture(scope="module")
def household():
    return PriorGraph.household()


def test_it_knows_all_that_the_default_knows_and_much_more(household):
    default = PriorGraph.default()
    things = {row.label for row in household.objects}
    assert {row.label for row in default.objects} < things
    assert len(things) >= 800
    assert {row.label for row in default.furniture} < {row.label for row in household.furniture}
    assert set(default.rooms) < set(household.rooms)


def test_every_row_names_rooms_and_furniture_that_there_are():
    furniture = {row["label"] for row in read_table("sgm.prior", "household_furniture.csv")}
    for row in read_table("sgm.prior", "household.csv"):
        for place in row["places"].split("|"):
            room, _, label = place.rsplit(" ", 1)[0].partition("/")
            assert room in {*ROOMS, "*"}, place
            assert label in furniture, place


def test_a_toothbrush_worked_by_hand(household):
    """`bathroom/sink 5|bathroom/counter 5|bathroom/cabinet 2`, under every name of each.

    A sink has 5 names, washbasin among them, a counter 9, a cabinet 14:
    5 x 5 + 9 x 5 + 14 x 2 = 98, so that a sink has 5 / 98 and a cabinet 2 / 98.
    """
    own = {row.furniture: row for row in household.placements if row.object == "toothbrush"}
    assert len(own) == 5 + 9 + 14
    assert {row.room for row in own.values()} == {"bathroom"}
    assert own["washbasin"].prob == own["sink"].prob == pytest.approx(5 / 98, abs=1e-6)
    assert own["medicine cabinet"].prob == pytest.approx(2 / 98, abs=1e-6)
    assert (own["sink"].relation, own["counter"].relation) == ("in", "onTop")


def test_it_is_loaded_by_its_name_and_a_file_of_that_name_by_its_path(
    household, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    PriorGraph.default().save("household")
    assert load_prior("household") is household
    assert load_prior("./household").checksum == PriorGraph.default().checksum
    assert load_prior(None) is load_prior("default") is PriorGraph.default()
    assert household.metadata["checksum"] == household.checksum
    with pytest.raises(ValueError, match="must be default or household, or a file"):
        load_prior("househould")


def test_a_memory_is_loaded_with_the_prior_that_it_was_saved_with(household, tmp_path):
    memory = SceneGraphMemory(household)
    bathroom = memory.add_room("bathroom")
    for label in ("sink", "toilet", "shower"):
        memory.add_furniture(label, bathroom)
    memory.query("toothbrush")
    memory.save(tmp_path / "home.sgm")
    loaded = SceneGraphMemory.load(tmp_path / "home.sgm")
    prior = loaded.query("toothbrush").prior.sum(axis=2)
    np.testing.assert_allclose(prior, [[1, 0, 0]])
    assert find_shipped(household.checksum) is household
    assert find_shipped("0" * 64) is None


def test_what_it_calls_otherwise_is_found(household):
    """A kitchen table may be a dining table, a basin a sink."""
    memory = SceneGraphMemory(household)
    kitchen, bathroom = memory.add_room("kitchen"), memory.add_room("bathroom")
    memory.add_furniture("kitchen table", kitchen)
    memory.add_furniture("basin", bathroom)
    prior = memory.query("blue placemat").prior.sum(axis=2)
    np.testing.assert_allclose(prior, [[1, 0]])


def test_homes_can_be_sampled_from_it(household):
    """Furniture by its first name alone; a policy plays in them."""
    homes = SampledSource(household, HomeConfig()).make(Streams(0, "test", range(3)))
    own = {row["label"] for row in read_table("sgm.prior", "household_furniture.csv")}
    assert set(homes.furniture_labels.ravel().tolist()) <= own
    rollout = Rollout(homes, Bayesian())
    for _ in range(3):
        _, queries = rollout.ask()
        scores = rollout.score(queries)
        assert scores.shape == (3, 32)
        rollout.look_around(scores.argmax(axis=1))
