"""A memory and a finder behind calls with short answers: what robots and agents ask in words."""

from __future__ import annotations

import secrets
from collections import OrderedDict
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from datetime import datetime
from typing import Literal

from sgm.finder.answers import Noted, Searching
from sgm.finder.asked_things import read_asked
from sgm.finder.finder import Finder
from sgm.finder.home_map import read_stand
from sgm.finder.map_calls import MapCalls
from sgm.finder.meanings import (
    Unclear,
    ask_which,
    doubt,
    find_place,
    find_thing,
    find_things,
    tell_doubt,
)
from sgm.finder.running_search import RunningSearch
from sgm.finder.seen import Seen, read_seen
from sgm.finder.travel_costs import find_distance
from sgm.finder.written import compute_digest, writes
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.thing import ROBOT
from sgm.messages import shorten
from sgm.names.ignored import IgnoredNames

MOST_SEARCHES = 100  # at once; the one that was not used for longest ends

Result = Literal["found", "not_found", "seen"]


class MemoryService(MapCalls):
    """Every call that `python -m sgm.serve` offers over HTTP and MCP, in Python.

    Those that only read are of `ReadCalls`, those that change the map of `MapCalls`. Names are as
    people say them. A name that means several things, or none, is an answer with a question to the
    user and candidates, no error. Answers hold at most k rows. Time passes by itself, by the
    memory's clock. Threads may share a service: writes are made one after the other, and what only
    reads waits for no disk.

    A write may have a `key`, any text of its own. A write that is sent again with the same key, as
    its answer was lost, is not made again: it gets the same answer. The latest 5,000 keys are
    known, of a memory with a file also in the next process.

    Example:
        >>> service = MemoryService(memory, ObjectFinder.load())
        >>> service.where_is("the red mug").places[0].name
        'desk in study'
    """

    def __init__(
        self,
        memory: SceneGraphMemory,
        finder: Finder,
        now: Callable[[], datetime] | None = datetime.now,
        *,
        accept_jump: bool = False,
        ignore: Iterable[str] = (),
        monotonic: Callable[[], float] | None = None,
    ) -> None:
        """Serve a memory.

        Args:
            memory: with a clock, or time does not pass.
            finder: such as `ObjectFinder.load()`.
            now: tells the local time; None where the caller itself calls `memory.step`. Where it
                jumps, steps go on evenly (`SteadyClock`), and `clock_fault`, the answers of writes
                and the file say so.
            accept_jump: whether the first time is right, however far ahead of the memory's.
            ignore: names of what is no thing, such as "person" and "wall": `observe` leaves it out.
            monotonic: seconds that pass, from any start, by a clock that is never set; None for
                those of this machine, or, where `now` is given, for what that passes ahead.

        Raises:
            TypeError: if `ignore` is a text.
            ValueError: if that time is more than a month ahead, or a name to ignore is none.
        """
        super().__init__(memory, finder, now, monotonic)
        self._ignored = IgnoredNames(ignore)
        self._searches: OrderedDict[str, RunningSearch] = OrderedDict()
        self.let_time_pass(accept_jump=accept_jump)

    def search_start(
        self,
        thing: str | Sequence[str],
        start: str | int | Sequence[float] | None = None,
        budget: float | None = None,
        speaker: str = "",
    ) -> Searching:
        """Begin to look for a thing, or several in one tour, and say where to look first.

        Args:
            thing: in words, "keys and wallet"; or a list of them.
            start: where the searcher is: a position in metres, x, y or x, y, z, or a place by id
                or name; where places have no positions, None.
            budget: most that all looks together may cost: metres and 1 for each look; without a
                start, the number of looks. None for no bound.
            speaker: who says "my".

        Raises:
            KeyError: if there is no place of that id.
            ValueError: if a name is none, the home has no place, or the start or the budget is out
                of range.
        """
        asked = read_asked(self.memory, self.finder, thing, speaker)
        unclear = asked.unclear
        try:
            if unclear is None and asked.time_words:
                ask = self._asking.tell_unused((asked.time_words,))
                unclear = Unclear("ambiguous", ask, ())
            if unclear is not None:
                raise unclear
            for name in asked.things:
                resolution = self.finder.resolve(self.memory, name)
                unclear = doubt(resolution) or unclear
                if unclear is not None and (resolution.means_several or resolution.unused):
                    raise unclear
            if isinstance(start, str):
                start = find_place(self.memory, start)
        except Unclear as asks:
            words = self._join(asked.things)
            told = tell_doubt(asks)
            return Searching(
                search_id="", thing=words, outcome=self._asking.say("no search"), **told
            )
        if isinstance(start, int):
            find_place(self.memory, start)
        elif start is not None:
            start = read_stand(start, "from")
        if start is not None and find_distance(self.memory, start) is None:
            layout = self.memory.layout
            place = next(n for n, at in layout.compute_positions().items() if at is None)
            raise ValueError(
                f"from must be left out where places have no position, got {shorten(start)}, and "
                f"none of {layout.describe(place)} (place {place}). Give all places positions, "
                "such as by move_place, or leave it out."
            )
        search = self.finder.search_several(self.memory, asked.things, start, budget=budget)
        search.next()
        search_id = secrets.token_hex(4)
        running = RunningSearch(search_id, search)
        with self._writing:
            self._searches[search_id] = running
            while len(self._searches) > MOST_SEARCHES:
                self._searches.popitem(last=False)
        is_place = all(part.ranking.asked_for != "thing" for part in search.searches)
        return running.tell(None if is_place else unclear)

    @writes
    def search_next(
        self,
        search_id: str,
        result: Result,
        seen: Seen = (),
        coverage: float = 1.0,
        thing: str = "",
        look: int | None = None,
        *,
        key: str | None = None,
    ) -> Searching:
        """Say what came of the latest look of a search, and get the next one.

        Args:
            search_id: from `search_start`.
            result: "found" or "not_found" of the thing alone, or "seen": all that was seen.
            seen: all that was seen, if the result is "seen".
            coverage: share of the place that was in view.
            thing: of several that are looked for, the one that was found, as `left` has it.
            look: number of that look, `next.look`: what is sent again is noted once, and gets the
                same answer. None for the look that is next.
            key: of this write; see the class.

        Raises:
            ValueError: if the result or the coverage is out of range, what was seen is none, or
                the look is not the next one and was none of the latest.
        """
        if result not in ("found", "not_found", "seen"):
            raise ValueError(
                f"result must be found, not_found or seen, got {shorten(result)}. Say what came of "
                "the look."
            )
        sightings = read_seen(seen)
        running = self._searches.get(search_id)
        about = (result, tuple(sightings), coverage, thing)
        if running is None:
            told = self._find_look(search_id, look, about)
            if told is not None:
                return told
            return Searching("unknown", search_id, "", outcome=self._asking.say("search ended"))
        self._searches.move_to_end(search_id)
        before = running.find_told(look, about)
        if before is not None:
            return before
        search = running.search
        going, left = search.going, search.left
        if going is None:  # it is over
            return running.tell()
        if result == "found" and len(left) > 1 and thing not in left:
            asks = ask_which(left, search.description, self.memory.language)
            return replace(running.tell(asks), status="ambiguous")
        self.let_time_pass()
        if result == "found":
            search.found(thing if len(left) > 1 else "")
        elif result == "not_found":
            search.not_found(coverage)
        else:
            search.seen(sightings, coverage)
        search.next()
        found = [name for name in left if name not in search.left]
        names, where = ", ".join(found) or search.description, going.place.furniture
        sentence = "note found" if found else "note not found"
        said = self._say(sentence, names=names, place=self._tell_place(where))
        self._note("search_next", search.description, where, said)
        answer = running.note(about)
        if self.memory.path is not None:  # a search ends with the process, its answers do not
            key = f"look {search_id} {search.num_looks}"
            self._keep_answer(key, compute_digest(about), answer)
        return answer

    def _find_look(self, search_id: str, look: int | None, about: object) -> Searching | None:
        """Return the answer of a look of a search in a process before this one; None of a new one.

        Raises:
            ValueError: if something else was said to come of it.
        """
        found = None if look is None else self._find_answer(f"look {search_id} {look}")
        if found is None:
            return None
        said, answer = found
        if said != compute_digest(about):
            raise ValueError(
                f"look {shorten(look)} must have come to one result, got another one than before. "
                "Send the look that is next."
            )
        assert isinstance(answer, Searching)
        return answer

    @writes
    def observe(
        self, place: int | str, seen: Seen, coverage: float = 1.0, *, key: str | None = None
    ) -> Noted:
        """Note all that was seen in a look at a place; what was not seen counts as absent.

        Args:
            place: id or name.
            seen: all that was seen there: names, mappings such as {"thing": "mug"}, or sightings.
            coverage: share of the place that was in view.
            key: of this write; see the class.

        Raises:
            KeyError: if there is no place of that id.
            ValueError: if a name is none, or the coverage is out of range.
        """
        sightings = read_seen(seen)
        furniture = find_place(self.memory, place, acts=True)
        self.let_time_pass()
        shown = [sighting for sighting in sightings if sighting.description not in self._ignored]
        self.memory.observe(furniture, shown, coverage)
        place_name = self._tell_place(furniture)
        said = self._asking.count("note observe", len(shown), place=place_name)
        return self._note("observe", "", furniture, said)

    @writes
    def note_moved(
        self,
        thing: str,
        place: int | str,
        by: str,
        relation: str = "in",
        confidence: float | None = None,
        was_at: int | str | None = None,
        *,
        key: str | None = None,
    ) -> Noted:
        """Note where a thing is now, as a person says: "I put the keys in the drawer".

        Args:
            thing: its exact name or its id; another name is a new thing.
            place: id or name.
            by: who says so.
            relation: such as "in" or "onTop" it.
            confidence: probability that it is right, from 0.5 on; None for 0.9.
            was_at: place from which one of several of its kind was taken; None for the only one.
            key: of this write; see the class.

        Raises:
            KeyError: if there is no place of an id.
            ValueError: if a name is none, or a value is out of range.
        """
        furniture = find_place(self.memory, place, thing, acts=True)
        before = self._find_any(was_at, thing)
        named = find_things(self.memory, thing, "always", by)
        self.let_time_pass()
        for known, was in named:
            taken = was if before is None else before
            self.memory.note_moved(known, furniture, by, relation, confidence, taken)
        names = [known for known, _ in named]
        who, where = self._asking.tell_who(by), self._tell_place(furniture)
        said = self._asking.tell_several("note moved", names, who=who, place=where)
        return self._note("note_moved", self._join(names), furniture, said)

    @writes
    def picked_up(
        self, thing: str, was_at: int | str | None = None, *, key: str | None = None
    ) -> Noted:
        """Note that the robot has taken a thing, and carries it until it is put down.

        Args:
            thing: its exact name or its id; a name that is like none is a new thing.
            was_at: place from which one of several of its kind was taken; None for the only one.
            key: of this write; see the class.

        Raises:
            KeyError: if there is no place of that id.
            ValueError: if a name is none.
        """
        before = self._find_any(was_at, thing)
        named = find_things(self.memory, thing, "if_unlike")
        self.let_time_pass()
        for known, was in named:
            self.memory.picked_up(known, was if before is None else before)
        names = [known for known, _ in named]
        said = self._asking.tell_several("note picked up", names)
        return self._note("picked_up", self._join(names), before, said)

    @writes
    def put_down(
        self, thing: str, place: int | str, relation: str = "onTop", *, key: str | None = None
    ) -> Noted:
        """Note that the robot has put down what it carried.

        Args:
            thing: in words, among what it carries.
            place: id or name.
            relation: such as "in" or "onTop" it.
            key: of this write; see the class.

        Raises:
            KeyError: if there is no place of that id.
            ValueError: if a name is none, or the robot carries no such thing.
        """
        furniture = find_place(self.memory, place, thing, acts=True)
        held = [
            self.memory.find_carried(name) or name
            for name in self.memory.read_sentence(thing).things or (thing,)
        ]
        if self.memory.carried:  # else the memory says that nothing is
            named = [find_things(self.memory, name, "if_unlike") for name in held]
            held = [known for things in named for known, _ in things]
        self.let_time_pass()
        for known in held:
            self.memory.put_down(known, furniture, relation)
        said = self._asking.tell_several("note put down", held, place=self._tell_place(furniture))
        return self._note("put_down", self._join(held), furniture, said)

    @writes
    def forget(
        self,
        thing: str | None = None,
        place: int | str | None = None,
        by: str = ROBOT,
        *,
        key: str | None = None,
    ) -> Noted:
        """Forget a thing that is not there at all, "there is no vase", or a place that is gone.

        A thing comes back when it is seen again.

        Args:
            thing: in words; None for a place.
            place: id or name; None for a thing.
            by: who says so.
            key: of this write; see the class.

        Raises:
            KeyError: if there is no place of that id.
            ValueError: if not exactly one of the two is given, or a name is none.
        """
        if (thing is None) == (place is None):
            raise ValueError(
                "forget must get a thing or a place, got "
                f"{'none of them' if thing is None else 'both'}. Give one."
            )
        if thing is not None:
            named = find_things(self.memory, thing, speaker=by)
            self.let_time_pass()
            for known, _ in named:
                self.memory.forget(known, by)
            names = [known for known, _ in named]
            told = self._asking.translate(names[0])
            for name in names[1:]:
                told = self._say("no and no", names=told, name=self._asking.translate(name))
            said = self._say("note gone", by, names=told)
            return self._note("forget", self._join(names), None, said)
        assert place is not None
        furniture = find_place(self.memory, place, acts=True)
        said = self._say("note gone", by, names=self._tell_place(furniture))
        self.let_time_pass()
        self.memory.forget(furniture, by)
        return self._note("forget", "", furniture, said)

    @writes
    def rename(self, thing: str, name: str, by: str = ROBOT, *, key: str | None = None) -> Noted:
        """Call a thing otherwise: "that is no cup, it is a bowl".

        What a detector calls so where it was seen is called so until the thing is renamed again.
        Of several things of one name, that holds for those with ids alone.

        Args:
            thing: in words, or its id.
            name: what it is called from now on.
            by: who says so.
            key: of this write; see the class.

        Raises:
            ValueError: if a name is none, or another thing has the new one.
        """
        known = find_thing(self.memory, thing)
        self.let_time_pass()
        has_places = self.memory.num_furniture > 0
        several = has_places and self.memory.ask([known]).num_instances.max() > 1
        self.memory.rename(known, name, by)
        thing_name = self._asking.translate(known)
        said = self._say("note called", by, thing=thing_name, name=name)
        if several:
            said = self._say("note several", told=said, thing=thing_name)
        return self._note("rename", name, None, said)

    @writes
    def merge(self, thing: str, other: str, by: str = ROBOT, *, key: str | None = None) -> Noted:
        """Note that two things are one, "this is the same mug", which is called as the first.

        Args:
            thing: in words, or its id.
            other: in words, or its id.
            by: who says so.
            key: of this write; see the class.

        Raises:
            ValueError: if a name is none, both are one already, or one is carried.
        """
        first, second = (find_thing(self.memory, name) for name in (thing, other))
        self.let_time_pass()
        self.memory.merge(first, second, by)
        names = {"thing": self._asking.translate(first), "other": self._asking.translate(second)}
        return self._note("merge", first, None, self._say("note one", by, **names))

    @writes
    def split(
        self,
        thing: str,
        place: int | str | None = None,
        name: str | None = None,
        by: str = ROBOT,
        *,
        key: str | None = None,
    ) -> Noted:
        """Note that what was held to be one thing is two.

        Args:
            thing: in words, or its id; one that was merged is one of its own again.
            place: id or name, to tell apart what words did not: what was seen there is another
                thing; None to undo a merge.
            name: of that other thing.
            by: who says so.
            key: of this write; see the class.

        Raises:
            KeyError: if there is no place of that id, or no such thing.
            ValueError: if a name is none, nothing was merged, or the thing was seen at no other
                place.
        """
        furniture, known = self._find_any(place, thing), find_thing(self.memory, thing)
        self.let_time_pass()
        self.memory.split(known, furniture, name or "", by)
        said = self._say("note two", by, thing=self._asking.translate(known))
        return self._note("split", known, furniture, said)

    def _find_any(self, place: int | str | None, thing: str) -> int | None:
        return None if place is None else find_place(self.memory, place, thing, acts=True)

    def _join(self, names: Sequence[str]) -> str:
        """Return the names of the things of a write in one text, as they stand in the memory."""
        return self._asking.join(names, "and", most=len(names))
