"""Random sessions over the public calls of a memory, a finder and a service, with their laws."""

from __future__ import annotations

import re
import tempfile
from collections import Counter
from datetime import datetime, timedelta
from functools import cache
from itertools import cycle
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, seed, settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    RuleBasedStateMachine,
    initialize,
    precondition,
    rule,
    run_state_machine_as_test,
)

from sgm.belief import Detector, compute_posterior
from sgm.finder.finder import Finder
from sgm.finder.object_finder import ObjectFinder
from sgm.finder.service import MemoryService
from sgm.layout.box import Box
from sgm.memory.clock import Clock
from sgm.memory.memory_event import read_events
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.policies import Adaptive, Bayesian, Frequentist, Priors
from sgm.replay.replay import replay
from tests.sgm.memory.sessions import CALLS, ODD, call, dump, shares

START = datetime(2026, 10, 24, 22)  # a night before an hour is there twice
ROUNDING = 1e-6
IRRELEVANT = 0.05  # most by which what has nothing to do with a question changes its answer
LABELS = ("table", "fridge", "desk", "shelf", "hammock")
THINGS = ("mug", "keys", "lamp", "large red mug", "flux capacitor")
STRANGER = "garden gnome"  # a thing that no question is about
_MOST_PLACES = 6
_CLOCK_CALLS = {"step", "step_to", "start_clock"}  # of a copy: after an odd time nothing is known
_LOOKS = 3  # most that a search takes at one place

sightings = st.lists(
    st.builds(
        Sighting,
        st.sampled_from(THINGS),
        st.sampled_from(("in", "onTop")),
        st.just(1.0) | shares,
        id=st.sampled_from((None, None, None, "a", "b")),
        position=st.sampled_from((None, None, (1.0, 2.0, 0.8), (3, 1, 1.0))),
    ),
    max_size=4,
)
things = st.sampled_from(THINGS)
coverages = st.sampled_from((1.0, 1.0, 0.4)) | shares
steps = st.sampled_from((1, 1, 2, 13, 400, 30_000))
positions = st.sampled_from((None, (1.0, 2.0), (-3.5, 4)))
costs = st.sampled_from((None, 0.0, 2.5))
boxes = st.none() | st.builds(
    lambda share, access: Box((share, 2, 0.5), (0.6, 1.2, 1.0), share, access),
    shares,
    st.sampled_from(("none", "open", "door")),
)


def list_told(name: str, thing: str, other: str, place: int | str) -> tuple:
    """List the arguments of a call by which something is said of a thing."""
    return {
        "note_moved": (thing, place, "anna"),
        "put_down": (thing, place),
        "rename": (thing, other),
        "merge": (thing, other),
        "split": (thing, place, other),
    }.get(name, (thing,))


@cache
def load_network() -> ObjectFinder:
    return ObjectFinder.load()


def make_finder(name: str) -> Finder:
    if name == "network":
        return ObjectFinder(load_network()._policy.network)
    if name == "sharp":
        return Finder(Bayesian(), Detector(miss_rate=0.0))
    return Finder(_POLICIES[name]())


_POLICIES = {
    "adaptive": Adaptive,
    "bayesian": Bayesian,
    "frequentist": Frequentist,
    "priors": Priors,
}
finders = st.sampled_from(("network", *2 * (*_POLICIES, "sharp")))


def ask(finder: Finder, memory: SceneGraphMemory, thing: str) -> np.ndarray:
    """Return the probability of each place by id, then elsewhere and robot; check their sum."""
    ranking = finder.rank(memory, thing)
    found = {place.furniture: place.probability for place in ranking}
    assert sorted(found) == sorted(memory.furniture_ids)
    answer = np.array([*(found[place] for place in sorted(found)), ranking.elsewhere])
    answer = np.append(answer, ranking.with_robot)
    check_distribution(answer, memory, thing)
    return answer


def check_distribution(answer: np.ndarray, memory: SceneGraphMemory, thing: str) -> None:
    """Check probabilities of what a question means: of one thing they sum to one."""
    assert np.isfinite(answer).all(), answer
    assert (answer >= 0).all(), answer
    assert (answer <= 1 + ROUNDING).all(), answer
    if abs(answer.sum() - 1) < ROUNDING:
        return
    asked = memory.ask(memory.resolve(thing).matches or (thing,), question=thing)
    is_one = len(asked.rows) == 1 and asked.num_instances[0] == 1
    assert not is_one or np.count_nonzero(asked.looks.seen) > 1, answer
    assert answer.sum() > 1, answer  # of several, any may be there


def _check_message(name: str, error: Exception) -> None:
    """Check that it says what must hold, in a short line."""
    text = str(error.args[0])
    assert " must " in text, f"{name}: {text[:300]}"
    assert "\n" not in text, f"{name}: {text[:300]}"
    assert len(text) < 1000, f"{name}: {text[:300]}"


def _has_places(machine: MemoryMachine) -> bool:
    return machine.memory.num_furniture > 0


class MemoryMachine(RuleBasedStateMachine):
    """A robot that looks, asks and is told, by any calls in any order."""

    def __init__(self) -> None:
        super().__init__()
        self.folder = tempfile.TemporaryDirectory()
        self.file = Path(self.folder.name) / "home.sgm"

    def teardown(self) -> None:
        self.folder.cleanup()

    @initialize(
        finder=finders,
        has_clock=st.booleans(),
        has_log=st.sampled_from((True, True, False)),
        labels=st.lists(st.tuples(st.sampled_from(LABELS), st.integers(0, 1)), max_size=4),
    )
    def start(self, finder, has_clock, has_log, labels):
        self.finder = make_finder(finder)
        self.log = Path(self.folder.name) / "looks.sgm" if has_log else None
        clock = Clock(START, 600) if has_clock else None
        self.memory = SceneGraphMemory(clock=clock, path=self.log)
        self.rooms = [self.memory.add_room(label) for label in ("kitchen", "study")]
        for label, room in labels:
            self.add_place(label, room)

    @property
    def places(self) -> list[int]:
        return sorted(self.memory.furniture_ids)

    @precondition(lambda self: self.memory.num_furniture < _MOST_PLACES)
    @rule(
        label=st.sampled_from(LABELS),
        room=st.integers(0, 1),
        position=positions,
        box=boxes,
    )
    def add_place(self, label, room, position=None, box=None):
        if self.rooms[room] not in self.memory.layout.rooms:
            self.rooms[room] = self.memory.add_room(("kitchen", "study")[room])
        self.memory.add_furniture(label, self.rooms[room], None, position, box)

    @precondition(_has_places)
    @rule(
        data=st.data(),
        label=st.sampled_from(LABELS),
        name=st.sampled_from(
            (
                "move_furniture",
                "name_furniture",
                "remove_furniture",
                "remove_room",
                "rename_room",
                "transform",
            )
        ),
    )
    def change_map(self, data, name, label):
        place = data.draw(st.sampled_from(self.places))
        room = data.draw(st.sampled_from(self.rooms))
        arguments = {
            "move_furniture": (place, room, *map(data.draw, (positions, boxes, costs))),
            "name_furniture": (place, label),
            "remove_furniture": (place,),
            "remove_room": (room,),
            "rename_room": (room, "pantry"),
            "transform": (0.5, (1.0, -2.0)),
        }
        self._change(name, *arguments[name])

    @precondition(lambda self: self.memory.num_furniture > 2)
    @rule(data=st.data(), seen=sightings)
    def merge_places(self, data, seen):
        """Two that are one, of which either may have been looked at."""
        place, other = data.draw(st.permutations(self.places))[:2]
        self.memory.observe(other, seen)
        self._change("merge_furniture", place, other)

    @rule(data=st.data(), name=st.sampled_from(sorted(CALLS)), is_odd=st.booleans())
    def call_any(self, data, name, is_odd):
        """Any call that writes, with any arguments, of which one may be of any kind."""
        arguments = list(data.draw(CALLS[name]))
        if is_odd:
            position = data.draw(st.integers(0, len(arguments) - 1))
            arguments[position] = data.draw(st.sampled_from(ODD))
        if name in _CLOCK_CALLS:
            self._change(name, *arguments, of=self.memory.copy())
        else:
            self._change(name, *arguments)

    def _change(self, name: str, *arguments: object, of: SceneGraphMemory | None = None) -> None:
        """Change the memory; what is refused in one short line changes nothing, nor its log."""
        memory = self.memory if of is None else of
        before = dump(memory), self._count_events()
        error = call(memory, name, arguments)
        if error is not None:
            _check_message(name, error)
            assert (dump(memory), self._count_events()) == before, name

    def _count_events(self) -> int:
        return 0 if self.log is None else len(read_events(self.log))

    @precondition(lambda self: self.memory.num_furniture == 0)
    @rule(thing=things)
    def ask_without_places(self, thing):
        with pytest.raises(ValueError, match="must have furniture") as caught:
            self.finder.rank(self.memory, thing)
        _check_message("rank", caught.value)

    @precondition(_has_places)
    @rule(data=st.data(), seen=sightings, coverage=coverages, number=st.sampled_from((1, 1, 2, 9)))
    def look(self, data, seen, coverage, number):
        place = data.draw(st.sampled_from(self.places))
        read, give = (
            data.draw(st.sampled_from(given))
            for given in ((int, np.int32, np.int64), (list, tuple, iter))
        )
        for _ in range(number):
            self.memory.observe(read(place), give(seen), coverage)

    @precondition(_has_places)
    @rule(data=st.data(), thing=things, coverage=coverages, number=st.sampled_from((1, 3)))
    def look_for_one_thing(self, data, thing, coverage, number):
        """It never raises the place, nor anything that is asked for in other words."""
        place = data.draw(st.sampled_from(self.places))
        position = self.places.index(place)
        for _ in range(number):
            before = ask(self.finder, self.memory, thing)[position]
            self.memory.note_absent(place, thing, coverage)
            after = ask(self.finder, self.memory, thing)[position]
            assert after <= before + ROUNDING, (before, after)

    @precondition(_has_places)
    @rule(
        thing=things,
        results=st.lists(st.sampled_from(("not found", "seen", "found")), min_size=1, max_size=4),
        is_to_end=st.booleans(),
        seen=sightings,
    )
    def search(self, thing, results, is_to_end, seen):
        """It ends, with few looks at a place, and an outcome."""
        search = self.finder.search(self.memory, thing)
        looks: Counter[int] = Counter()
        for result in cycle(results) if is_to_end else results:
            going = search.next()
            if going is None:
                assert search.outcome
                return
            looks[going.place.furniture] += 1
            assert looks.total() <= _LOOKS * self.memory.num_furniture, looks
            position = self.places.index(going.place.furniture)
            before = ask(self.finder, self.memory, thing)[position]
            if result == "not found":
                search.not_found()
                after = ask(self.finder, self.memory, thing)[position]
                assert after <= before + ROUNDING, (before, after)
            elif result == "found":
                search.found()
                after = ask(self.finder, self.memory, thing)[position]
                assert after >= 0.5, after
            else:
                search.seen(seen)

    @rule(number=steps)
    def wait(self, number):
        self.memory.step(number)

    @precondition(lambda self: self.memory.clock is not None)
    @rule(hours=st.sampled_from((-30, -1, 0, 1, 20)))
    def set_clock(self, hours):
        """Time forward, and back: then nothing changes."""
        clock, before = self.memory.clock, dump(self.memory)
        now = clock.start + timedelta(seconds=clock.step_seconds * self.memory.time)
        try:
            self.memory.step_to(now + timedelta(hours=hours))
        except ValueError:
            assert hours < 0
            assert dump(self.memory) == before

    @precondition(_has_places)
    @rule(
        data=st.data(),
        thing=things,
        other=things,
        name=st.sampled_from(
            (
                "note_moved",
                "picked_up",
                "put_down",
                "rename",
                "merge",
                "split",
                "forget",
                "remove_object",
                "query",
            )
        ),
    )
    def tell(self, data, thing, other, name):
        place = data.draw(st.sampled_from(self.places))
        self._change(name, *list_told(name, thing, other, place))

    @precondition(_has_places)
    @rule(thing=things, later=st.sampled_from((0, 0, 3, 900)))
    def ask(self, thing, later):
        """What was asked before, and for what else, changes no bit; asking changes nothing."""
        before = dump(self.memory)
        answer = ask(self.finder, self.memory, thing)
        ranking = self.finder.rank(self.memory, thing, at=self.memory.time + later)
        found = [place.probability for place in ranking]
        assert found == sorted(found, reverse=True)
        assert str(ranking)
        alone = Finder(self.finder._policy, self.finder._detector)
        np.testing.assert_array_equal(ask(alone, self.memory, thing), answer)
        assert dump(self.memory) == before
        asked = self.memory.ask([thing])
        prior = self.finder._believe(asked.batch, asked.queries)
        np.testing.assert_allclose(prior.probabilities.sum(axis=1), 1)
        compute_posterior(prior, asked, Detector())  # checks its sum
        self.finder.search_plan(self.memory, thing)

    @precondition(_has_places)
    @rule(thing=things, kind=st.sampled_from(("copy", "file", "log")))
    def ask_of_copies(self, thing, kind):
        """A copy, what was saved and loaded, and what the log makes again answer alike."""
        answer, content = ask(self.finder, self.memory, thing), dump(self.memory)
        if kind == "log" and self.log is not None:
            *_, (other, _, _) = replay(read_events(self.log))
        elif kind == "file":
            self.memory.save(self.file)
            other = SceneGraphMemory.load(self.file)
        else:
            other = self.memory.copy()
        assert dump(other) == content
        np.testing.assert_array_equal(ask(self.finder, other, thing), answer)

    @rule(thing=things, label=st.sampled_from(LABELS))
    def read(self, thing, label):
        """What is no question of probability is answered without a change, too, or in one line."""
        before = dump(self.memory)
        for name, word in (("find_furniture", label), ("places_of", thing), ("resolve", thing)):
            error = call(self.memory, name, (word,))
            if error is not None:
                assert isinstance(error, KeyError), error
                _check_message(name, error)
        assert dump(self.memory) == before

    @rule(is_closed=st.booleans())
    def go_on(self, is_closed):
        """The session goes on with what was saved and loaded, or opened as after a crash."""
        content = dump(self.memory)
        if self.log is None:
            self.memory.save(self.file)
            self.memory = SceneGraphMemory.load(self.file)
        else:
            if is_closed:
                self.memory.close()
            self.memory = SceneGraphMemory.open(self.log)
        assert dump(self.memory) == content

    def _knows(self, thing: str) -> bool:
        """Whether one thing is surely where it was last seen.

        Doubtful sightings and several things leave more to the others.
        """
        if not self.memory.num_furniture:
            return False
        seen = self.memory.last_seen(thing)
        matches = self.memory.resolve(thing).matches
        is_one = len(matches) == 1 and len(self.memory.ask(matches).rows) == 1
        if not is_one or seen is None or not seen.is_there:
            return False
        return self.memory.history(thing)[0].confidence == 1

    @precondition(lambda self: self._knows("keys"))
    @rule(data=st.data(), seen=sightings)
    def look_with_a_stranger(self, data, seen):
        """A thing that nothing is asked about, in a look, changes other answers by little."""
        place = data.draw(st.sampled_from(self.places))
        before = self.memory.copy()
        self.memory.observe(place, seen)
        before.observe(place, [*seen, Sighting(STRANGER)])
        for passed in (0, 1):
            pair = []
            for memory in (self.memory, before):
                later = memory.copy()
                later.step(passed)
                pair.append(ask(self.finder, later, "keys"))
            change = pair[1] - pair[0]
            assert np.abs(change).max() <= IRRELEVANT, change

    @precondition(lambda self: self._knows("keys"))
    @rule()
    def add_a_place_that_holds_nothing(self):
        """A place where a thing does not belong changes little where it was seen."""
        before = self.memory.copy()
        before.step()
        after = before.copy()
        place = after.add_furniture("bathtub", after.add_room("bathroom"))
        kept = [n for n, number in enumerate(sorted(after.furniture_ids)) if number != place]
        change = ask(self.finder, after, "keys")[[*kept, -2, -1]]
        change -= ask(self.finder, before, "keys")
        assert np.abs(change).max() <= IRRELEVANT, change


class RenamedMachine(RuleBasedStateMachine):
    """A home, and the same one where all is called by other words, which nobody knows.

    Furniture was added in another order, too. Policies that read no words answer alike.
    """

    places = ("zorb", "quib", "frell", "mimsy")
    others = ("tove", "rath", "wabe", "gimble")

    @initialize(
        policy=st.sampled_from((Frequentist, Bayesian, Adaptive)),
        room_of=st.tuples(*[st.integers(0, 1)] * 4),
        order=st.permutations(range(4)),
    )
    def start(self, policy, room_of, order):
        self.finder = Finder(policy())
        self.homes = []
        for labels, by in ((self.places, range(4)), (self.others, order)):
            memory = SceneGraphMemory()
            rooms = [memory.add_room(label) for label in ("kitchen", "study")]
            ids = {n: memory.add_furniture(labels[n], rooms[room_of[n]]) for n in by}
            self.homes.append((memory, ids))

    @rule(place=st.integers(0, 3), seen=st.lists(st.tuples(st.integers(0, 3), st.booleans())))
    def look(self, place, seen):
        for names, (memory, ids) in zip((self.others, self.places), self.homes, strict=True):
            looked = [Sighting(names[n], "in" if is_in else "onTop") for n, is_in in seen[:4]]
            memory.observe(ids[place], looked)

    @rule(place=st.integers(0, 3), thing=st.integers(0, 3))
    def miss(self, place, thing):
        for names, (memory, ids) in zip((self.others, self.places), self.homes, strict=True):
            memory.note_absent(ids[place], names[thing])

    @rule(number=steps)
    def wait(self, number):
        for memory, _ in self.homes:
            memory.step(number)

    @rule(thing=st.integers(0, 3))
    def ask(self, thing):
        answers = []
        for names, (memory, ids) in zip((self.others, self.places), self.homes, strict=True):
            answer = ask(self.finder, memory, names[thing])
            by_id = dict(zip(sorted(ids.values()), answer, strict=False))
            answers.append([*(by_id[ids[n]] for n in range(4)), *answer[-2:]])
        np.testing.assert_allclose(answers[0], answers[1], atol=ROUNDING)


class ServiceMachine(RuleBasedStateMachine):
    """A service that is asked and told anything by names, while the clock goes to and fro."""

    def __init__(self) -> None:
        super().__init__()
        self.now = START

    @initialize(finder=finders, num_places=st.integers(0, 4))
    def start(self, finder, num_places):
        memory = SceneGraphMemory(clock=Clock(START, 600))
        self.service = MemoryService(memory, make_finder(finder), lambda: self.now)
        self.searching = None
        for room in ("kitchen", "study"):
            self.service.add_room(room)
        for number in range(num_places):
            self.service.add_place(LABELS[number], ("kitchen", "study")[number % 2])

    def _call(self, name: str, *args, **kwargs):
        """Call, and return the answer; None where it was refused in one line, with no effect."""
        before = dump(self.service.memory)
        try:
            return getattr(self.service, name)(*args, **kwargs)
        except (ValueError, KeyError) as error:
            _check_message(name, error)
            assert _without_time(dump(self.service.memory)) == _without_time(before)
            return None

    @rule(hours=st.sampled_from((0.1, 0.2, 1, 9, 30, 200, -1, -0.2, -20)))
    def pass_time(self, hours):
        before = self.service.memory.time
        self.now += timedelta(hours=hours)
        self.service.let_time_pass()
        assert self.service.memory.time >= before

    @rule(place=st.sampled_from((*LABELS, "0", 0, 1, 9)), seen=sightings, coverage=coverages)
    def observe(self, place, seen, coverage):
        self._call("observe", place, seen, coverage)

    @rule(
        name=st.sampled_from(
            ("note_moved", "picked_up", "put_down", "forget", "rename", "merge", "split")
        ),
        thing=things,
        other=things,
        place=st.sampled_from((*LABELS, 0, 1)),
    )
    def tell(self, name, thing, other, place):
        self._call(name, *list_told(name, thing, other, place))

    @rule(
        label=st.sampled_from(LABELS),
        room=st.sampled_from(("kitchen", "study", "attic")),
        position=positions,
    )
    def add_place(self, label, room, position):
        if self.service.memory.num_furniture < _MOST_PLACES:
            self._call("add_place", label, room, None, position)

    @rule(
        name=st.sampled_from(
            (
                "move_place",
                "name_place",
                "merge_places",
                "remove_place",
                "rename_room",
                "transform_map",
                "set_map",
            )
        ),
        place=st.sampled_from((*LABELS, 0, 1)),
        label=st.sampled_from(LABELS),
        room=st.sampled_from(("kitchen", "study", "attic")),
        position=positions,
    )
    def change_map(self, name, place, label, room, position):
        arguments = {
            "move_place": (place, room, position),
            "name_place": (place, label),
            "merge_places": (place, label),
            "remove_place": (place,),
            "rename_room": (room, "pantry"),
            "transform_map": (0.5, position),
            "set_map": ([room], [{"name": label, "room": room, "position": position or (0, 1)}]),
        }
        self._call(name, *arguments[name])

    @precondition(lambda self: self.service.memory.num_furniture > 0)
    @rule(
        text=st.sampled_from(
            (
                "where is the {}?",
                "is the {} on the {}?",
                "where was the {} yesterday?",
                "what is on the table?",
                "has the {} been moved?",
                "how many {} are there?",
            )
        ),
        thing=things,
        place=st.sampled_from(LABELS),
    )
    def ask(self, text, thing, place):
        """A sentence has an answer in a sentence; asking changes nothing."""
        content = dump(self.service.memory)
        answer = self._call("ask", text.format(thing, place))
        assert answer is None or answer.said
        assert dump(self.service.memory) == content

    @rule(thing=things, later=st.sampled_from((None, None, 5)))
    def where_is(self, thing, later):
        content = dump(self.service.memory)
        at = None if later is None else self.service.memory.time + later
        answer = self._call("where_is", thing, at, 50)
        assert dump(self.service.memory) == content
        if answer is not None and answer.asked_for == "thing":
            found = [place.probability for place in answer.places]
            total = sum(found) + answer.elsewhere + answer.with_robot
            assert total > 1 - ROUNDING, answer
            assert all(0 <= p <= 1 + ROUNDING for p in (*found, answer.elsewhere))

    @rule(thing=things)
    def search(self, thing):
        self.searching = self._call("search_start", thing)

    @precondition(lambda self: self.searching is not None and self.searching.next is not None)
    @rule(result=st.sampled_from(("not_found", "not_found", "seen", "found")), seen=sightings)
    def go_on(self, result, seen):
        """To say that a thing was not found does not raise the place; nor to say so twice."""
        place, look, thing = (
            self.searching.next.place,
            self.searching.next.look,
            self.searching.thing,
        )
        if place not in self.service.memory.furniture_ids:
            return
        before = self._get_probability(thing, place)
        is_same_step = self.service.let_time_pass() == 0
        told = self.searching.search_id, result, seen if result == "seen" else ()
        answer = self.service.search_next(*told, look=look)
        assert answer.outcome
        if result == "not_found" and is_same_step:
            after = self._get_probability(thing, place)
            assert after <= before + ROUNDING, (before, after)
        content = dump(self.service.memory)
        assert self.service.search_next(*told, look=look) == answer
        assert dump(self.service.memory) == content
        self.searching = answer

    def _get_probability(self, thing: str, place: int) -> float:
        ranking = self.service.finder.rank(self.service.memory, thing)
        return {found.furniture: found.probability for found in ranking}[place]

    @rule(thing=things, since=st.sampled_from((0, 3)))
    def list_all(self, thing, since):
        content = dump(self.service.memory)
        for name, arguments in (
            ("list_places", ()),
            ("list_things", ()),
            ("history", (thing,)),
            ("changes", (since,)),
            ("learnt", ()),
            ("next_looks", ()),
        ):
            self._call(name, *arguments)
        assert dump(self.service.memory) == content


def _without_time(content: str) -> str:
    """Leave out the time, which passes in calls that are refused, too."""
    return re.sub(r'"time": \d+', '"time": 0', content)


def play(
    machine: type[RuleBasedStateMachine], num_sessions: int, seed_number: int | None = None
) -> None:
    """Play sessions of 20 calls: those of a seed, or the same on every run."""
    phases = [Phase.generate] if seed_number is not None else list(settings().phases)
    rules = settings(
        max_examples=num_sessions,
        stateful_step_count=20,
        deadline=None,
        database=None,
        derandomize=seed_number is None,
        phases=phases,
        suppress_health_check=list(HealthCheck),
    )
    if seed_number is not None:
        machine = seed(seed_number)(type(machine.__name__, (machine,), {}))
    run_state_machine_as_test(machine, settings=rules)


MACHINES = (MemoryMachine, RenamedMachine, ServiceMachine)
