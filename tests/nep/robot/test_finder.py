"""Asking a memory where something is: probabilities, reasons, plans, unknown words, restarts."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from datamodules.batch_builder import BatchBuilder
from datamodules.feature_config import FeatureConfig
from nep import ObjectFinder, SceneGraphMemory, Sighting
from nep.paper.encoders import HEAT
from nep.paper.nep_module import NEPModule
from nep.players.checkpoints import TrainedModel
from sgm.belief import Detector


@pytest.fixture(scope="module")
def finder() -> ObjectFinder:
    return ObjectFinder.load("heat")


@pytest.fixture
def home():
    """Two rooms, one of them unknown to the prior, and a look at every place but the sofa."""
    memory = SceneGraphMemory()
    kitchen, attic = memory.add_room("kitchen"), memory.add_room("attic")
    places = {
        "fridge": memory.add_furniture("fridge", kitchen, "white fridge"),
        "counter": memory.add_furniture("counter top", kitchen),
        "table": memory.add_furniture("dining table", kitchen, "round oak table"),
        "hammock": memory.add_furniture("hammock", attic),
        "sofa": memory.add_furniture("sofa", attic),
    }
    memory.observe(places["fridge"], [Sighting("milk", "in")])
    memory.observe(places["counter"], [Sighting("small mug"), Sighting("blue cup")])
    memory.observe(places["table"], [Sighting("large red mug"), Sighting("plate")])
    memory.observe(places["hammock"], [])
    memory.step(2)
    return memory, places


def test_probabilities_of_all_places_and_elsewhere_sum_to_one(finder, home):
    memory, _ = home
    for description in ("large red mug", "milk", "flux capacitor", "кружка", "Zero Fat Milk"):
        ranking = finder.rank(memory, description)
        probability = [place.probability for place in ranking]
        assert sum(probability) + ranking.elsewhere == pytest.approx(1, abs=1e-9)
        assert probability == sorted(probability, reverse=True)
        assert 0 < ranking.elsewhere < 1
        top = finder.rank(memory, description, k=2)
        assert top.places == ranking.places[:2]
        assert top.elsewhere == ranking.elsewhere


def test_says_where_when_and_why(finder, home):
    memory, places = home
    ranking = finder.rank(memory, "Large Red Mug", k=5)
    by_id = {place.furniture: place for place in ranking}
    table = by_id[places["table"]]
    assert table.name == "round oak table in kitchen"
    assert table.relation == "onTop"
    assert table.last_seen == ranking.last_seen == memory.last_seen("large red mug")
    assert table.why == f"seen here 2 steps ago; prior {table.evidence.prior:.0%}"
    counter = by_id[places["counter"]]
    assert counter.last_seen is None
    assert counter.why.startswith(
        "not seen here in 1 look; similar objects: small mug, blue cup; prior "
    )
    memory.observe(places["table"], [])
    memory.step()
    table = {place.furniture: place for place in finder.rank(memory, "large red mug")}[
        places["table"]
    ]
    assert table.why.startswith("seen here 3 steps ago, then gone; prior")
    memory.query("small mug")
    memory.observe(places["table"], [])
    (table,) = (p for p in finder.rank(memory, "small mug") if p.furniture == places["table"])
    assert table.why.startswith("not seen here in 3 looks; similar objects: large red mug; prior")
    text = str(finder.rank(memory, "large red mug", k=1)).splitlines()
    assert text[0] == "large red mug"
    assert text[-1].endswith("elsewhere")


def test_an_unknown_object_may_be_at_all_furniture(finder, home):
    memory, _ = home
    ranking = finder.rank(memory, "flux capacitor")
    assert sorted(place.furniture for place in ranking) == list(memory.furniture_ids)
    assert ranking[0].why == "no evidence"
    assert ranking.last_seen is None


def test_a_negative_look_lowers_a_place_and_raises_the_rest(finder, home):
    memory, _ = home
    before = finder.rank(memory, "large red mug")
    best = before[0].furniture
    memory.observe(best, [])
    after = finder.rank(memory, "large red mug")
    of = {place.furniture: place.probability for place in after}
    odds = [p / (1 - p) for p in (before[0].probability, of[best])]
    assert odds[1] == pytest.approx(Detector().miss_rate * odds[0])
    assert after.elsewhere > before.elsewhere
    for place in before.places[1:]:
        memory.observe(place.furniture, [])
    assert finder.rank(memory, "large red mug").elsewhere > after.elsewhere


def test_an_object_that_is_just_seen_is_there(finder, home):
    memory, places = home
    memory.observe(places["sofa"], [Sighting("remote control")])
    ranking = finder.rank(memory, "remote control")
    assert ranking[0].furniture == places["sofa"]
    assert ranking[0].why.startswith("seen here in this step")


@pytest.mark.slow
def test_answers_go_on_after_a_restart(finder, home, tmp_path):
    memory, places = home
    finder.rank(memory, "milk")
    memory.save(tmp_path / "home.sgm")
    copy = SceneGraphMemory.load(tmp_path / "home.sgm")
    for turn, name in enumerate(places):
        for one in (memory, copy):
            one.observe(places[name], [Sighting("milk"), Sighting(f"thing {turn}")])
            one.step()
        for description in ("milk", "large red mug", "thing 0", f"news {turn}"):
            assert finder.rank(memory, description) == finder.rank(copy, description)


def test_nodes_come_and_go_while_asking(finder, home):
    memory, places = home
    cellar = memory.add_room("cellar")
    shelf = memory.add_furniture("wine rack", cellar)
    memory.observe(shelf, [Sighting("large red mug", "in")])
    assert finder.rank(memory, "large red mug")[0].furniture in (shelf, places["table"])
    memory.remove_room(cellar)
    memory.remove_furniture(places["table"])
    ranking = finder.rank(memory, "large red mug")
    assert shelf not in {place.furniture for place in ranking}
    assert ranking.last_seen.furniture is None
    memory.remove_object("large red mug")
    assert finder.rank(memory, "large red mug").last_seen is None


LABELS = st.sampled_from(("kitchen", "attic", "fridge", "counter top", "mug", "milk", "氷", "vase"))


@pytest.mark.slow
@settings(max_examples=20)
@given(
    layout=st.lists(st.tuples(LABELS, LABELS), min_size=1, max_size=5),
    looks=st.lists(st.tuples(st.integers(0, 4), st.lists(LABELS, max_size=3)), max_size=8),
    asked=LABELS,
)
def test_any_home_gives_probabilities(finder, layout, looks, asked):
    memory = SceneGraphMemory()
    for room, label in layout:
        memory.add_furniture(label, memory.add_room(room))
    for turn, (furniture, seen) in enumerate(looks):
        memory.step(turn % 2)
        memory.observe(furniture % len(layout), [Sighting(one) for one in seen])
    ranking = finder.rank(memory, asked)
    assume(ranking.asked_for == "thing")
    probability = np.array([*(place.probability for place in ranking), ranking.elsewhere])
    assert np.isfinite(probability).all()
    assert (probability >= 0).all()
    # Of several things, each has a row of probabilities that sum to 1; a place has the probability
    # that at least one of them is there. They are as many as were seen in one step, at most.
    in_a_step = [0] * (len(looks) // 2 + 1)
    for turn, (_, seen) in enumerate(looks):
        in_a_step[(turn + 1) // 2] += len(seen)
    total = probability.sum()
    assert 1 - 1e-9 <= total <= max(1, *in_a_step) + 1e-9
    if max(in_a_step) <= 1:
        assert total == pytest.approx(1, abs=1e-9)
    plan = finder.search_plan(memory, asked)
    assert plan.expected_cost <= len(plan)


def test_bad_input_is_refused(finder, home, tmp_path):
    memory, _ = home
    with pytest.raises(ValueError, match=r"description must be a non-empty text, got ' '"):
        finder.rank(memory, " ")
    with pytest.raises(ValueError, match=r"k must be at least 1, got 0"):
        finder.rank(memory, "mug", k=0)
    with pytest.raises(ValueError, match=r"memory must have furniture before a query"):
        finder.rank(SceneGraphMemory(), "mug")
    with pytest.raises(
        ValueError, match=r"an exported folder or one of any_home, heat, got 'teah'"
    ):
        ObjectFinder.load("teah")
    module = NEPModule(HEAT(), reads=["belief"])
    model = TrainedModel(module, BatchBuilder(FeatureConfig(belief=True)))
    with pytest.raises(ValueError, match=r"must read the memory alone, got one with features\.bel"):
        ObjectFinder(model)


@pytest.mark.parametrize("source", [None, 3, b"heat", ["heat"]])
def test_a_network_is_named_by_a_text_or_a_path(source):
    with pytest.raises(ValueError, match=r"checkpoint must be named by a text or a path, got"):
        ObjectFinder.load(source)
