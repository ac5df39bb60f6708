"""What is asked for by who had it in hand a minute ago: `in_use`."""

import numpy as np
import pytest

from sgm.belief.in_use import BIAS, SLOPE
from sgm.finder.finder import Finder
from sgm.finder.service import MemoryService
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.policies import Adaptive
from sgm.serve.calls import BY_NAME


def make_memory(num_steps=3):
    memory = SceneGraphMemory()
    room = memory.add_room("kitchen")
    places = [memory.add_furniture(name, room) for name in ("desk", "sink", "shelf")]
    memory.observe(places[0], [Sighting("knife"), Sighting("pan")])
    memory.observe(places[1], [])
    if num_steps:
        memory.step(num_steps)
    return memory, places


def get_shares(finder, memory, **options):
    ranking = finder.rank(memory, "knife", **options)
    return {place.furniture: place.probability for place in ranking}, ranking.elsewhere


def test_the_odds_of_where_it_was_seen_last_are_changed_by_two_numbers():
    memory, (desk, *others) = make_memory()
    finder = Finder(Adaptive())
    before, elsewhere = get_shares(finder, memory)
    after, elsewhere_after = get_shares(finder, memory, in_use=True)
    # log odds = bias + slope * log odds, and what is not there keeps its proportions.
    odds, changed = (np.log(share[desk] / (1 - share[desk])) for share in (before, after))
    assert changed == pytest.approx(BIAS + SLOPE * odds)
    for other in others:
        assert after[other] / before[other] == pytest.approx(elsewhere_after / elsewhere)
    assert sum(after.values()) + elsewhere_after == pytest.approx(1)
    assert after[desk] < before[desk]


def test_without_the_mark_the_answer_is_the_same_before_and_after_one_with_it():
    memory, _ = make_memory()
    finder = Finder(Adaptive())
    once = get_shares(finder, memory)
    assert get_shares(finder, memory, in_use=True) != once
    assert get_shares(finder, memory, in_use=False) == once


def test_what_is_seen_in_this_step_is_there_in_use_or_not():
    memory, (desk, sink, _) = make_memory()
    memory.observe(sink, [Sighting("knife")])
    finder = Finder(Adaptive())
    (seen, _), (in_use, _) = (get_shares(finder, memory, in_use=mark) for mark in (False, True))
    assert in_use[sink] == pytest.approx(seen[sink], abs=0.01)
    assert in_use[sink] > 0.9 > 10 * in_use[desk]


def test_what_was_never_seen_is_as_without_the_mark():
    memory, _ = make_memory()
    finder = Finder(Adaptive())
    plain, marked = (finder.rank(memory, "spoon", in_use=mark) for mark in (False, True))
    assert [place.probability for place in plain] == [place.probability for place in marked]


def test_a_service_and_its_call_take_the_mark_for_each_thing():
    memory, _ = make_memory()
    service = MemoryService(memory, Finder(Adaptive()), None)
    read = BY_NAME["where_is"].read
    plain = service.where_is(["knife", "pan"])
    marked = service.where_is(**read({"thing": ["knife", "pan"], "in_use": True}))
    pairs = zip((plain, *plain.also), (marked, *marked.also), strict=True)
    for before, after in pairs:
        assert after.places[0].probability < before.places[0].probability - 0.1
    assert (
        service.where_is(**read({"thing": "pan", "in_use": False})).places == plain.also[0].places
    )


def test_the_mark_is_true_or_false_in_a_query_and_as_clients_write_it():
    call = BY_NAME["where_is"]
    assert call.read({"thing": "mug", "in_use": "true"}, is_query=True)["in_use"] is True
    assert call.read({"thing": "mug", "in_use": "false"}, is_coerced=True)["in_use"] is False
    for wrong in ("yes", 1, "1"):
        with pytest.raises(ValueError, match="in_use must be true or false"):
            call.read({"thing": "mug", "in_use": wrong}, is_coerced=True)
