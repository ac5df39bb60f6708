"""Asking any policy: what was seen now, several of a kind, and questions that leave no trace."""

import threading
from datetime import datetime

import pytest

from sgm.belief import Detector
from sgm.evidence.adaptive_filter import FilterSettings
from sgm.finder.finder import Finder
from sgm.memory.clock import Clock
from sgm.memory.home_history import HomeHistory
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.policies.adaptive import Adaptive
from sgm.policies.heuristics import Bayesian


@pytest.fixture
def finder():
    return Finder(Bayesian())


def test_in_plain_sight(make_home, finder):
    """After a look at everything, nothing missed, each thing is where it is."""
    home = make_home()
    for furniture in home.furniture:
        home.memory.observe(furniture, home.look(furniture))
    for thing, place in home.at.items():
        ranking = finder.rank(home.memory, thing)
        assert ranking[0].furniture == home.furniture[place]
        assert ranking[0].probability >= 0.95
        assert ranking.elsewhere < 0.05


def test_a_negative_look_is_bayes_rule(make_home):
    """Exactly the miss rate against any other place, whatever the policy makes of it."""
    home = make_home()
    finder = Finder(Bayesian(), Detector(miss_rate=0.1, repeated_share=0))
    before = {p.furniture: p.probability for p in finder.rank(home.memory, "wallet")}
    best, other = sorted(before, key=before.__getitem__)[:-3:-1]
    for times in (1, 2):
        home.memory.observe(best, [])
        after = {p.furniture: p.probability for p in finder.rank(home.memory, "wallet")}
        odds = before[best] / before[other]
        assert after[best] / after[other] == pytest.approx(odds * 0.1**times)


def test_people_ask_for_anything_whether_it_has_just_moved_or_not(make_home):
    home = make_home()
    for _ in range(3):
        for furniture in home.furniture:
            home.memory.observe(furniture, home.look(furniture))
        home.memory.step()
    thing, place = next(iter(home.at.items()))

    def ask(policy, **options):
        found = Finder(policy, **options).rank(home.memory, thing)
        return {place.furniture: place.probability for place in found}

    anything = ask(Adaptive())
    assert anything == ask(Adaptive(FilterSettings(asks_moved=0.0)))
    moved = ask(Adaptive(), asks_moved=0.5)
    assert anything[home.furniture[place]] > moved[home.furniture[place]]
    assert ask(Bayesian()) == ask(Bayesian(), asks_moved=0.5)  # does not reckon with it
    for wrong in (-0.1, 1.1, float("nan"), "half", True):
        with pytest.raises(ValueError, match=r"asks_moved must lie in \[0, 1\], got "):
            Finder(Bayesian(), asks_moved=wrong)


def test_a_time_to_come_is_asked_of_as_if_it_had_come(make_home, finder):
    """Looks of this step are earlier ones then; the memory stays as it is."""
    home = make_home()
    counter, other = home.furniture[:2]
    home.memory.observe(counter, [Sighting("wallet")])
    home.memory.observe(other, [])
    now = finder.rank(home.memory, "wallet")
    later = finder.rank(home.memory, "wallet", at=home.memory.time + 30)
    assert later[0].probability < now[0].probability
    home.memory.step(30)
    come = finder.rank(home.memory, "wallet")
    expected = {place.furniture: place.probability for place in come}
    assert {place.furniture: place.probability for place in later} == pytest.approx(expected)
    assert later.elsewhere == pytest.approx(come.elsewhere)
    with pytest.raises(ValueError, match=r"must not be before the present step.*Time only goes"):
        finder.rank(home.memory, "wallet", at=home.memory.time - 1)
    with pytest.raises(ValueError, match=r"must be a datetime or a time step, got 'soon'"):
        finder.rank(home.memory, "wallet", at="soon")


def test_a_date_to_come(finder):
    memory = SceneGraphMemory(clock=Clock(datetime(2026, 11, 16, 7, 30), step_seconds=600))
    table = memory.add_furniture("table", memory.add_room("kitchen"))
    memory.observe(table, [Sighting("mug")])
    by_date = finder.rank(memory, "mug", at=datetime(2026, 11, 16, 8, 5))
    assert by_date.elsewhere == finder.rank(memory, "mug", at=3).elsewhere
    assert memory.time == 0


def test_no_place_is_ruled_out(finder):
    memory = SceneGraphMemory()
    kitchen = memory.add_room("kitchen")
    for label in ("fridge", "counter top", "gizmo stand"):
        memory.add_furniture(label, kitchen)
    ranking = finder.rank(memory, "milk")
    assert len(ranking) == 3
    assert min(place.probability for place in ranking) > 0


def test_two_of_a_kind(finder):
    memory = SceneGraphMemory()
    room = memory.add_room("kitchen")
    shelf, table, _ = (memory.add_furniture(label, room) for label in ("shelf", "table", "sink"))
    memory.observe(shelf, [Sighting("mug"), Sighting("mug")])
    memory.observe(table, [Sighting("mug")])
    ranking = finder.rank(memory, "a mug")
    both = {place.furniture: place.probability for place in ranking}
    assert both[shelf] >= 0.95
    assert both[table] >= 0.95
    memory.step()
    memory.observe(table, [Sighting("mug")])  # finding one does not move the others
    after = {p.furniture: p.probability for p in finder.rank(memory, "mug")}
    assert after[table] >= 0.95
    assert after[shelf] > 0.5
    single = SceneGraphMemory()
    room = single.add_room("kitchen")
    for label in ("shelf", "table", "sink"):
        single.add_furniture(label, room)
    single.observe(shelf, [Sighting("mug")])
    single.step()
    single.observe(table, [Sighting("mug")])
    assert {p.furniture: p.probability for p in finder.rank(single, "mug")}[shelf] < 0.05


def test_any_of_the_kind(make_home, finder):
    home = make_home()
    red = finder.rank(home.memory, "large red mug")
    any_mug = finder.rank(home.memory, "mug")
    assert any_mug.resolution.matches == ("large red mug", "small blue mug")
    of = {place.furniture: place.probability for place in any_mug}
    assert all(of[place.furniture] >= place.probability - 1e-9 for place in red)
    assert any_mug.elsewhere < red.elsewhere


def test_asking_is_reading(make_home, finder, tmp_path):
    """300 questions for unknown things stayed in the memory and its file for good."""
    home = make_home()
    home.memory.save(tmp_path / "before.sgm")
    for number in range(100):
        finder.rank(home.memory, f"gadget {number}")
        finder.search_plan(home.memory, f"gizmo {number}")
    home.memory.save(tmp_path / "after.sgm")
    assert (tmp_path / "after.sgm").read_bytes() == (tmp_path / "before.sgm").read_bytes()


def test_threads_ask_beside_one_that_observes(make_home, finder):
    home = make_home()
    errors = []

    def ask(worker):
        try:
            for number in range(40):
                finder.rank(home.memory, f"new word {worker} {number}")
                finder.rank(home.memory, "large red mug")
        except Exception as error:  # pytest does not see those of threads
            errors.append(error)

    threads = [threading.Thread(target=ask, args=(worker,)) for worker in range(4)]
    for thread in threads:
        thread.start()
    for number in range(60):
        furniture = home.furniture[number % 18]
        home.memory.observe(furniture, [*home.look(furniture), Sighting(f"thing {number}")])
        if number % 7 == 0:
            home.pass_time()
    for thread in threads:
        thread.join()
    assert errors == []
    assert not any(name.startswith("new word") for name in home.memory.descriptions)


def test_last_seen_goes_by_the_same_names(make_home):
    memory = make_home().memory
    assert memory.last_seen("the red mug") == memory.last_seen("large red mug")
    mugs = [memory.last_seen(name) for name in ("large red mug", "small blue mug")]
    assert memory.last_seen("mugs") == max(mugs, key=lambda seen: seen.time)
    assert memory.find_furniture("the fridge") == (0,)
    assert len(memory.find_furniture("shelves")) == 2
    assert memory.find_furniture("hammock") == ()


def test_a_given_miss_rate_is_that_of_every_part(monkeypatch):
    """Of a policy and of Bayes' rule; the memory goes on counting its own."""
    told = []

    def compute(history, given=None, original=HomeHistory.compute_miss_rate):
        told.append(original(history, given).tolist())
        return original(history, given)

    monkeypatch.setattr(HomeHistory, "compute_miss_rate", compute)
    memory = SceneGraphMemory()
    shelf = memory.add_furniture("shelf", memory.add_room("study"))
    for seen in (["mug"], [], ["mug"]):
        memory.observe(shelf, [Sighting(name) for name in seen])
        memory.step()
    counted = memory.batch.history.compute_miss_rate().tolist()
    finder = Finder(Adaptive())
    told.clear()
    finder.rank(memory, "mug")
    assert told  # once: the filter and the rule of *elsewhere* share the rates
    assert {rate for rates in told for rate in rates} == {*counted}
    for given in (Finder(Adaptive(), Detector(miss_rate=0.6)), finder):
        given.detector = Detector(miss_rate=0.6)
        told.clear()
        given.rank(memory, "mug")
        assert told
        assert {rate for rates in told for rate in rates} == {0.6}
    assert memory.batch.history.compute_miss_rate().tolist() == counted != [0.6]
    with pytest.raises(TypeError, match=r"detector must be a Detector, got 0\.6"):
        finder.detector = 0.6


class CountedBayesian(Bayesian):
    """Counts how often it is asked."""

    num_asked = 0

    def scores(self, memory, queries):
        """Count, and score."""
        self.num_asked += 1
        return super().scores(memory, queries)


def test_a_thing_is_judged_once_a_step_and_answers_are_the_same(make_home):
    """Looks of the step change what follows, not what the policy made of the memory before it."""
    home = make_home()
    for furniture in home.furniture:
        home.memory.observe(furniture, home.look(furniture))
    home.memory.step()
    finder = Finder(CountedBayesian())
    policy, (thing, other) = finder._policy, list(home.at)[:2]

    def ask(name):
        """The finder's answer, which is that of a new one to the bit."""
        ranking = finder.rank(home.memory, name)
        assert ranking == Finder(Bayesian()).rank(home.memory, name)
        return ranking

    first = ask(thing)
    assert ask(thing) == first
    assert policy.num_asked == 1
    home.memory.observe(first[0].furniture, [])
    assert ask(thing) != first
    home.memory.observe(first[1].furniture, [Sighting("new thing")])
    ask(thing)
    ask(f"the {thing}")
    assert policy.num_asked == 1
    for name in (other, "new thing", "flux capacitor", "warp drive"):
        ask(name)
    assert policy.num_asked == 5
    home.memory.note_moved(thing, first[2].furniture, "anna")
    ask(thing)
    home.memory.step()
    ask(thing)
    assert policy.num_asked >= 6
    assert finder.rank(home.memory, thing, at=home.memory.time + 5) != ask(thing)
