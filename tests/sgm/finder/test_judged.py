"""What is judged along with what is asked for: the same answers to the bit, in fewer passes."""

from datetime import datetime

import pytest

from sgm.belief import Detector
from sgm.finder import finder as finders
from sgm.finder import judged
from sgm.finder.finder import Finder
from sgm.finder.object_finder import ObjectFinder
from sgm.memory.clock import Clock
from sgm.memory.sighting import Sighting
from sgm.policies import Bayesian


@pytest.fixture(scope="module")
def network():
    """The network that ships, read once."""
    return ObjectFinder.load()._policy.network


def count_passes(finder, monkeypatch):
    """How many things each pass of the network of a finder was about."""
    passes, ask = [], finder._policy.ask_anew

    def ask_anew(memory, queries):
        passes.append(len(queries.object))
        return ask(memory, queries)

    monkeypatch.setattr(finder._policy, "ask_anew", ask_anew)
    return passes


@pytest.mark.slow
def test_other_things_come_along_and_have_their_own_answers(make_home, network, monkeypatch):
    home = make_home(clock=Clock(datetime(2026, 11, 16), 2 * 3600))
    finder = ObjectFinder(network)
    passes = count_passes(finder, monkeypatch)
    names = list(home.at)

    def ask(name):
        found = finder.rank(home.memory, name)
        assert found == ObjectFinder(network).rank(home.memory, name)

    for name in names:  # none of which was asked for before: what was seen last comes along
        ask(name)
    assert passes[:3] == [1, 2, 4]
    assert sum(passes) == len(names)
    for name in names[:10]:  # the latest that are asked for
        ask(name)
    assert len(names) > judged.MOST_TOGETHER
    # Many were asked for in the state before: as many as any. Then fewer were: the first alone,
    # then as many more as are known. These ten come before all others.
    for expected in ([16], [1, 2, 4, 8], [1, 2, 4, 8]):
        home.live(3)
        passes.clear()
        for name in names[:10]:
            ask(name)
        assert passes == expected
    num_passes = len(passes)
    home.memory.observe(home.furniture[0], [Sighting(names[0])])
    ask(names[0])
    assert (
        len(passes) == num_passes
    )  # a look of the step changes no belief about the time before it


def test_names_of_several_things_come_along_as_they_would_be_asked_for(
    make_home, network, monkeypatch
):
    """How many things a question is about is evidence: each has its own count in a joint pass."""
    home = make_home()
    finder, new = ObjectFinder(network), ObjectFinder(network)
    passes = count_passes(finder, monkeypatch)
    for kind, count in (("lamp", 2), ("kettle", 3)):
        seen = [Sighting(f"{colour} {kind}") for colour in ("red", "blue", "green")[:count]]
        home.memory.observe(home.furniture[11], seen)
    home.memory.step()
    names = ["kettle", "milk", "lamp", "keys", "pen"]
    for _ in range(3):
        home.memory.step()
        passes.clear()
        for name in names:
            assert finder.rank(home.memory, name) == ObjectFinder(network).rank(home.memory, name)
    # Four kettles, then milk with as many things: keys, a pen and both lamps.
    assert passes == [4, 5]
    evidence = [  # alike but for the count of what was asked for
        new._policy.ask_anew(asked.batch, asked.queries)[0].tolist()
        for asked in (
            home.memory.ask([f"red {kind}" for kind in own])
            for own in (("kettle",), ("kettle", "lamp"))
        )
    ]
    assert evidence[0] != evidence[1]


@pytest.mark.slow
def test_what_changes_in_the_memory_changes_what_comes_along(make_home, network, monkeypatch):
    """Statements, ids, names of several things, merges, what is new or gone, another detector."""
    home = make_home()
    memory, names = home.memory, list(home.at)
    finder = ObjectFinder(network)
    passes = count_passes(finder, monkeypatch)
    desk = home.furniture[11]
    memory.observe(desk, [Sighting("tea cup", id="1"), Sighting("tea cup", id="2")])
    changes = [
        lambda: memory.step(),
        lambda: memory.note_moved(names[1], desk, "anna"),
        lambda: memory.observe(desk, [Sighting(names[2])]),
        lambda: memory.merge(names[3], names[4], "anna"),
        lambda: memory.forget(names[0], "anna"),
        lambda: memory.add_furniture("wardrobe", room=2),
        lambda: memory.rename(names[5], "thing of brass", "anna"),
        lambda: setattr(finder, "detector", Detector(miss_rate=0.4)),
    ]
    for change in changes:
        change()
        memory.step()
        for name in [*names[:6], "tea cup", "1", "flux capacitor"]:
            new = ObjectFinder(network, detector=finder._detector)
            assert finder.rank(memory, name) == new.rank(memory, name)
    assert max(passes) > 2


def test_one_finder_of_two_memories(make_home, network):
    """What comes along is of the memory that is asked."""
    homes, finder = [make_home(0), make_home(1)], ObjectFinder(network)
    homes[1].memory.forget("milk", "anna")
    for _ in range(2):
        for home in homes:
            home.live(3)
            for name in ("milk", "keys", "pen", "book"):
                found = finder.rank(home.memory, name)
                assert found == ObjectFinder(network).rank(home.memory, name)


def test_other_policies_are_asked_for_one_thing_at_a_time(make_home, monkeypatch):
    """Only who declares it is asked for several: another may mix what is asked for at once."""
    home, finder = make_home(), Finder(Bayesian())
    asked, score = [], finder._policy.scores
    monkeypatch.setattr(
        finder._policy,
        "scores",
        lambda memory, queries: asked.append(len(queries.object)) or score(memory, queries),
    )
    for _ in range(2):
        home.live(3)
        for name in list(home.at)[:4]:
            finder.rank(home.memory, name)
    assert asked == [1] * 8


def test_what_is_kept_is_bounded(make_home, network, monkeypatch):
    monkeypatch.setattr(judged, "_MOST_LATELY", 3)
    monkeypatch.setattr(judged, "_MOST_BELIEFS", 5)
    home, finder = make_home(), ObjectFinder(network)
    for _ in range(2):
        home.live(3)
        for name in list(home.at)[:12]:
            finder.rank(home.memory, name)
            assert len(finder._judged._lately) <= 3
            assert len(finder._judged._beliefs) <= 5


def test_many_things_are_judged_a_few_at_a_time(make_home, network, monkeypatch):
    home = make_home()
    memory = home.memory
    for number, furniture in enumerate(home.furniture[:7]):
        memory.observe(furniture, [Sighting("teapot", id=f"teapot {number}")])
    memory.step()
    expected = ObjectFinder(network).rank(memory, "teapot")
    finder = ObjectFinder(network)
    passes = count_passes(finder, monkeypatch)
    monkeypatch.setattr(finders, "_MOST_PAIRS", 3 * memory.num_furniture)
    assert finder.rank(memory, "teapot") == expected
    assert len(passes) > 1
    assert max(passes) == 3
