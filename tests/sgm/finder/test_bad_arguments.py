"""Arguments of a robot's calls that are of the wrong kind: said in words, and nothing changes."""

from fractions import Fraction

import pytest

from sgm.belief import Detector
from sgm.finder.finder import Finder
from simulator import Bayesian, SceneGraphMemory, Sighting


@pytest.fixture
def memory():
    memory = SceneGraphMemory()
    memory.observe(memory.add_furniture("shelf", memory.add_room("kitchen")), [Sighting("mug")])
    return memory


@pytest.mark.parametrize("seen", [None, 3, "mug", ["mug"]])
def test_what_was_seen_is_a_list_of_sightings(memory, seen):
    with pytest.raises(TypeError, match=r"seen must hold Sighting objects, got"):
        memory.observe(0, seen)


@pytest.mark.parametrize("coverage", ["x", None, float("nan"), 0, 2])
def test_coverage_is_a_share(memory, coverage):
    with pytest.raises(ValueError, match=r"coverage must be above 0 and at most 1, got"):
        memory.observe(0, [], coverage=coverage)


@pytest.mark.parametrize("k", ["x", 1.5, 0, -1])
def test_k_is_a_whole_number(memory, k):
    with pytest.raises(ValueError, match=r"k must be at least 1, got .*whole number"):
        Finder(Bayesian()).rank(memory, "mug", k=k)


@pytest.mark.parametrize("name", ["a\nb", "a\r\nb", "a\u2028b", "a\x85b"])
def test_names_are_one_line(memory, name):
    for call in (memory.add_room, lambda text: memory.add_furniture(text, 0), Sighting):
        with pytest.raises(ValueError, match=r"must be one line, got '.*'\. Leave line breaks out"):
            call(name)


@pytest.mark.parametrize("thing", [7, None, b"mug", ["mug"]])
def test_what_was_found_has_a_name(memory, thing):
    with pytest.raises(ValueError, match="thing must"):
        memory.note_found(0, thing)


@pytest.mark.parametrize("share", ["x", None, float("nan")])
def test_shares_are_numbers(share):
    with pytest.raises(ValueError, match=r"confidence must lie in \[0, 1\], got"):
        Sighting("mug", confidence=share)


def test_a_room_is_an_id(memory):
    with pytest.raises(KeyError, match=r"room must be an id from add_room, got True"):
        memory.add_furniture("table", True)


def test_the_id_of_a_room_is_none_of_furniture(memory):
    """Both are numbers from 0 on, so that one would otherwise be taken for the other."""
    room = memory.add_room("hall")
    memory.add_furniture("desk", room)
    line = r"got 1, the id of the room hall\. list_furniture\(1\) tells what stands there"
    for call in (
        lambda: memory.observe(room, [Sighting("mug")]),
        lambda: memory.note_moved("mug", room, by="anna"),
        lambda: memory.describe(next(reversed(memory.layout.rooms))),
        lambda: memory.copy().remove_furniture(memory.layout.furniture[1].room),
    ):
        with pytest.raises(KeyError, match=line):
            call()
    assert memory.describe(1) == "desk in hall"
    with pytest.raises(KeyError, match="furniture must be an id from add_furniture, got 7"):
        memory.observe(7, [])


def test_a_time_that_has_passed_is_named_as_the_argument(memory):
    memory.step(3)
    with pytest.raises(ValueError, match=r"^at must not be before .*, got 2 at time step 3"):
        Finder(Bayesian()).rank(memory, "mug", at=2)
    with pytest.raises(ValueError, match=r"^at must be a datetime or a time step, got 'soon'"):
        memory.ask(["mug"], at="soon")


def test_furniture_is_an_id(memory):
    for call in (lambda: memory.observe(False, []), lambda: memory.move_furniture(False, 0)):
        with pytest.raises(KeyError, match=r"furniture must be an id from add_furniture, got Fal"):
            call()


@pytest.mark.parametrize("value", ["x", None, True, float("nan")])
def test_rates_are_probabilities(value):
    with pytest.raises(ValueError, match=r"miss_rate must lie in \[0, 1\), got"):
        Detector(miss_rate=value)


def test_parts_are_what_they_are_called(memory):
    with pytest.raises(TypeError, match=r"policy must be a Policy, got <class .* Adaptive\(\)"):
        Finder(Bayesian)
    with pytest.raises(TypeError, match="detector must be a Detector, got 'x'"):
        Finder(Bayesian(), "x")
    finder = Finder(Bayesian())
    with pytest.raises(TypeError, match="memory must be a SceneGraphMemory, got None"):
        finder.rank(None, "mug")
    for name in ("prior", "clock"):
        with pytest.raises(TypeError, match=rf"{name} must be a \w+, got 'x'. Leave it out"):
            SceneGraphMemory(**{name: "x"})
    for ask in (finder.search, finder.search_plan):
        with pytest.raises(TypeError, match=r"distance must be a function of .*, got \{\}"):
            ask(memory, "mug", distance={})


@pytest.mark.parametrize("cost", ["x", None, -1, float("nan"), 10**400, 1e308, Fraction(10**400)])
def test_a_distance_is_a_number(memory, cost):
    with pytest.raises(
        ValueError, match=r"distance from 'door' to 0 must be a number, 0 to 1e\+100"
    ):
        Finder(Bayesian()).search_plan(memory, "mug", "door", lambda a, b: cost)


def test_a_memory_file_has_a_name(memory, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(OSError, match=r"memory file must have a name, got \.\. Name it home\.sgm"):
        memory.save("")


@pytest.mark.parametrize("exclude", [3, "x", None, [1.5]])
def test_what_is_excluded_is_a_list_of_ids(memory, exclude):
    finder = Finder(Bayesian())
    for ask in (finder.rank, finder.search, finder.search_plan):
        with pytest.raises(ValueError, match=r"exclude must be furniture ids, got .* Give a list"):
            ask(memory, "mug", exclude=exclude)


@pytest.mark.parametrize("value", ["x", None, [1], float("nan"), 10**400, Fraction(10**400)])
def test_costs_and_bounds_of_a_search_are_numbers(memory, value):
    finder = Finder(Bayesian())
    for ask in (finder.search, finder.search_plan):
        with pytest.raises(ValueError, match=r"look_cost must be a number, 0 to 1e\+100, got"):
            ask(memory, "mug", look_cost=value)
    with pytest.raises(ValueError, match=r"give_up_at must lie above 0 and at most at 1, got"):
        finder.search(memory, "mug", give_up_at=value)


@pytest.mark.parametrize("name", ["x" * 100_000, "x\n" * 90])
def test_a_message_repeats_little_of_a_value(memory, name):
    for call in (memory.add_room, Sighting, lambda text: memory.move_furniture(text, 0)):
        with pytest.raises((ValueError, KeyError)) as caught:
            call(name)
        assert len(str(caught.value)) < 500
