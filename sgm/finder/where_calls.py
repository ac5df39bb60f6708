"""Where things are, were, or will be: one call for one thing or several, in words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace
from datetime import datetime
from typing import TypeVar

from sgm.finder.answers import (
    MOST_BYTES,
    LastSeen,
    Moment,
    PlaceFound,
    WhereIs,
    WhereOne,
    write_json,
)
from sgm.finder.asked_things import AskedThings, read_asked
from sgm.finder.finder import Finder
from sgm.finder.meanings import MOST_CANDIDATES, Unclear, ask_which, doubt, tell_doubt
from sgm.finder.past_places import WasAt, find_past_places
from sgm.finder.ranking import Place, Ranking
from sgm.finder.spots import tell_position
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import SeenAt
from sgm.messages import shorten, shorten_text
from sgm.names.asking import make_asking

MOST_ROWS = 50
DEFAULT_PLACES = 3
_LIKELY = 0.5  # of the first place: below, an answer is one of several places
_MOST_WHY = 80  # characters of the evidence of a place
_MOST_ASKED = 4  # times as many characters of a question as of a name, where an answer is cut
_WORST = ("ok", "unknown", "ambiguous")

_Said = TypeVar("_Said", PlaceFound, LastSeen | None)


class WhereCalls:
    """Says where things are, and how times and places are called.

    Attributes:
        memory: what is remembered.
        finder: says where things are.
    """

    def __init__(self, memory: SceneGraphMemory, finder: Finder) -> None:
        self.memory = memory
        self.finder = finder
        self._asking = make_asking(memory.language)

    def where_is(
        self,
        thing: str | Sequence[str],
        at: datetime | int | None = None,
        k: int | None = None,
        speaker: str = "",
        in_use: bool = False,
    ) -> WhereIs:
        """Say where a thing may be, the likeliest place first; of several things, each.

        Args:
            thing: in words, "the red mug", "keys and wallet", "the mug in the sink", "where were my
                keys yesterday evening?"; or a list of them.
            at: date and time, or time step, to come; None for now, or the time in the words.
            k: most places; None for three, or fewer where the answer would have more than 600
                bytes for each thing.
            speaker: who says "my".
            in_use: whether each was in someone's hand within the last ten minutes (`Finder.rank`).

        Raises:
            ValueError: if the name is none, the home has no place, the time has passed, or k is out
                of range.
        """
        if k is not None:
            check_rows(k)
        self._come_to_present()
        asked = read_asked(self.memory, self.finder, thing, speaker)
        if asked.span is not None and at is not None:
            ask = self._asking.tell_unused((asked.time_words,))
            asked = asked._replace(span=None, unclear=Unclear("ambiguous", ask, ()))
        return self.tell_asked(asked, at, k, in_use)

    def tell_asked(
        self,
        asked: AskedThings,
        at: datetime | int | None = None,
        k: int | None = None,
        in_use: bool = False,
    ) -> WhereIs:
        """Say where the things are that a call is asked for; arguments as of `where_is`."""
        answers = [self._locate(asked, name, at, k, in_use) for name in asked.things]
        if k is None:
            answers = [_fit_beside_picture(answer) for answer in answers]
        first, *others = answers
        told = {field.name: getattr(first, field.name) for field in fields(first)}
        if not others:
            return WhereIs(**told)
        unclear = [answer for answer in answers if answer.status != "ok"]
        candidates = dict.fromkeys(name for answer in unclear for name in answer.candidates)
        told |= {
            "status": max((answer.status for answer in answers), key=_WORST.index),
            "ask": " ".join(dict.fromkeys(answer.ask for answer in unclear)),
            "candidates": tuple(candidates)[:MOST_CANDIDATES],
        }
        return WhereIs(**told, also=tuple(others))

    def _come_to_present(self) -> None:
        """Let time pass until a question, where a clock tells it; that of a copy stands."""

    def _locate(
        self,
        asked: AskedThings,
        thing: str,
        at: datetime | int | None,
        k: int | None,
        in_use: bool,
    ) -> WhereOne:
        """Say where one thing may be, at a time that is given or asked about."""
        if asked.span is not None and asked.is_past:
            return self._locate_past(asked, thing, k)
        if asked.span is not None:
            at = asked.span[0]
        ranking = self.finder.rank(
            self.memory,
            thing,
            k or DEFAULT_PLACES,
            at=at,
            exactly=asked.is_exact,
            in_use=in_use,
        )
        seen = _choose_last_seen(ranking)
        unclear = None if ranking.asked_for != "thing" else self._doubt(ranking)
        layout = self.memory.layout
        return WhereOne(
            thing=ranking.description,
            taken_for=_list_taken(ranking),
            places=tuple(
                PlaceFound(
                    place.furniture,
                    place.name,
                    place.relation,
                    place.probability,
                    _tell_why(place),
                    **tell_position(layout, place.furniture, place.position),
                    picture=place.picture,
                )
                for place in ranking
            ),
            left_out=ranking.left_out,
            elsewhere=ranking.elsewhere,
            with_robot=ranking.with_robot,
            last_seen=self._tell_last_seen(seen),
            at=self._tell_asked_time(at),
            asked_for=ranking.asked_for,
            num_known=ranking.num_known if ranking.num_known > 1 else None,
            **tell_doubt(asked.unclear or unclear),
        )

    def _locate_past(self, asked: AskedThings, thing: str, k: int | None) -> WhereOne:
        """Say where one thing was in a time that has passed."""
        assert asked.span is not None
        begin, end = asked.span
        resolution, now = self.finder.resolve(self.memory, thing), self.memory.time
        if asked.is_exact and thing in resolution.matches:
            resolution = resolution.take_only(thing)
        unclear = asked.unclear or doubt(resolution)
        was: list[WasAt] = []
        for match in resolution.matches:
            was += find_past_places(self.memory, match, begin, end)
        was.sort(key=lambda place: -place.probability)
        if unclear is None and not was:
            name = resolution.matches[0] if len(resolution.matches) == 1 else thing
            words = self._asking.tell("not known then", name)
            unclear = Unclear("unknown", words, ())
        placed = [place for place in was if place.furniture is not None]
        found = tuple(self._tell_past(place) for place in placed[: k or DEFAULT_PLACES])
        total = min(sum(place.probability for place in was), 1.0)
        single = len(resolution.matches) == 1
        return WhereOne(
            thing=thing,
            taken_for=resolution.matches[:MOST_CANDIDATES],
            places=found,
            left_out=len(placed) - len(found),
            elsewhere=1 - total if single else 0.0,
            with_robot=sum(place.probability for place in was if place.furniture is None),
            last_seen=self._tell_last_seen(self.memory.last_seen(thing) if single else None),
            at=self.tell_time(end, now),
            **tell_doubt(unclear),
        )

    def _tell_past(self, was: WasAt) -> PlaceFound:
        """Tell a place where a thing was, and by what that is known."""
        asking, when = self._asking, self.tell_time(was.time, self.memory.time)
        told = asking.say("seen then", when=when.words)
        if was.by:
            told = asking.say("said then", who=asking.tell_who(was.by), when=when.words)
        name = self.tell_name(was.furniture)
        assert was.furniture is not None
        spot = tell_position(self.memory.layout, was.furniture, None)
        return PlaceFound(was.furniture, name, was.relation or "", was.probability, told, **spot)

    def _tell_last_seen(self, seen: SeenAt | None) -> LastSeen | None:
        if seen is None:
            return None
        name, when = self.tell_name(seen.furniture), self.tell_time(seen.time, self.memory.time)
        spot = tell_position(self.memory.layout, seen.furniture, seen.position)
        about = (seen.is_there, seen.by, when)
        return LastSeen(seen.furniture, name, *about, picture=seen.picture, **spot)

    def _doubt(self, ranking: Ranking) -> Unclear | None:
        """Return what to ask about a thing, or about a place that may be meant: "left sofa"."""
        unclear = doubt(ranking.resolution)
        if unclear is None or unclear.candidates or ranking.resolution.unused:
            return unclear
        layout, thing = self.memory.layout, ranking.description
        names = [node.description for node in layout.furniture.values()]
        likely = self.memory.resolve(thing, among=list(dict.fromkeys(names)))
        near = likely.matches or likely.doubtful
        told = [
            layout.describe(n) for n, node in layout.furniture.items() if node.description in near
        ]
        language = self.memory.language
        return ask_which(list(dict.fromkeys(told)), thing, language) if told else unclear

    def tell_time(self, step: int, now: int) -> Moment:
        """Tell a time step, as it is said at another one."""
        return Moment.tell(step, now, self.memory.clock, self.memory.language)

    def _tell_asked_time(self, at: datetime | int | None) -> Moment:
        """Tell the time that is asked about; None for now."""
        now, clock = self.memory.time, self.memory.clock
        step = at if isinstance(at, int) else now
        if isinstance(at, datetime) and clock is not None:
            step = int((at - clock.start).total_seconds() // clock.step_seconds)
        return self.tell_time(step, now)

    def tell_any(self, step: int | None, now: int) -> Moment | None:
        """Tell a time step, if there is one."""
        return None if step is None else self.tell_time(step, now)

    def tell_name(self, place: int | None) -> str:
        """Return the name of a place; empty if it was removed."""
        try:
            return "" if place is None else self.memory.describe(place)
        except KeyError:
            return ""

    def _say(self, sentence: str, by: str = "", **values: object) -> str:
        """Return a sentence of the table of answers; `by` is who said so."""
        return self._asking.say(sentence, who=self._asking.tell_who(by), **values)

    def _tell_place(self, place: int) -> str:
        """Return the name of a place as the language has it."""
        return self._asking.translate(self.tell_name(place))


def check_rows(k: int) -> None:
    """Check how many rows are asked for; raises ValueError unless they are 1 to `MOST_ROWS`."""
    if not isinstance(k, int) or isinstance(k, bool) or not 1 <= k <= MOST_ROWS:
        raise ValueError(
            f"k must be a whole number from 1 to {MOST_ROWS}, got {shorten(k)}. Ask for fewer rows."
        )


def _choose_last_seen(ranking: Ranking) -> SeenAt | None:
    """Return the latest sighting; of those of one time step one where the thing still is."""
    last = ranking.last_seen
    if last is None or last.is_there:
        return last
    sightings = (place.last_seen for place in ranking)
    still = (
        sighting
        for sighting in sightings
        if sighting is not None and sighting.is_there and sighting.time == last.time
    )
    return next(still, last)


def _list_taken(ranking: Ranking) -> tuple[str, ...]:
    """List what a question was taken for: things, or the places themselves."""
    if ranking.asked_for == "place":
        return tuple(place.name for place in ranking)[:MOST_CANDIDATES]
    return ranking.resolution.matches[:MOST_CANDIDATES]


def _tell_why(place: Place) -> str:
    """Say the evidence; where the thing was seen itself, other things and the prior say little."""
    evidence = place.evidence
    if evidence.seen is not None and (evidence.similar or evidence.prior):
        place = replace(place, evidence=replace(evidence, similar=(), prior=0.0))
    return shorten_text(place.why, _MOST_WHY)


def _fit_beside_picture(answer: WhereOne) -> WhereOne:
    """Make an answer short enough beside the picture of the last sighting; places have none."""
    seen = answer.last_seen
    if any(place.picture is not None for place in answer.places):
        places = tuple(replace(place, picture=None) for place in answer.places)
        answer = replace(answer, places=places)
    if seen is None or seen.picture is None:
        return _fit(answer)
    short = _fit(replace(answer, last_seen=replace(seen, picture=None)))
    assert short.last_seen is not None
    return replace(short, last_seen=replace(short.last_seen, picture=seen.picture))


def _fit(answer: WhereOne) -> WhereOne:
    """Leave positions of places out, then places, reasons, and letters, until it is short enough.

    The likeliest place keeps its position longest; `list_places` has all. Where no place is likely,
    more places say more than where and why: their positions and reasons go first.
    """
    size = len(write_json(answer))
    for shorten_more in (_leave_out_last_position, _leave_out_positions, _leave_out_reasons):
        if size <= MOST_BYTES:
            return answer
        shorter = shorten_more(answer)
        if shorter is not answer:
            answer, size = shorter, len(write_json(shorter))
    if size <= MOST_BYTES:
        return answer
    sizes = [len(write_json(place)) + 1 for place in answer.places]  # with a comma, but for one
    left = MOST_BYTES - size + sum(sizes)
    kept = len(sizes)
    while kept > 1 and sum(sizes[:kept]) > left:
        kept -= 1
    num_left_out = answer.left_out + len(sizes) - kept
    answer = replace(answer, places=answer.places[:kept], left_out=num_left_out)
    if sum(sizes[:kept]) <= left:
        return answer
    answer = replace(answer, places=tuple(map(_leave_out_position, answer.places)))
    if len(write_json(answer)) <= MOST_BYTES:
        return answer
    whole = replace(answer, places=tuple(replace(place, why="") for place in answer.places))
    last = whole.last_seen
    if last is not None and last.position in [place.position for place in whole.places]:
        whole = replace(whole, last_seen=replace(last, position=None, position_of=None))
    answer = whole
    for most in (60, 40, 20, 10, 5, 1):  # names may have hundreds of letters
        if len(write_json(answer)) <= MOST_BYTES:
            break
        answer = _shorten_names(whole, most)
    return answer


def _leave_out_last_position(answer: WhereOne) -> WhereOne:
    """Leave out where the place stands at which the thing was last seen."""
    seen = _leave_out_position(answer.last_seen)
    return answer if seen is answer.last_seen else replace(answer, last_seen=seen)


def _leave_out_positions(answer: WhereOne) -> WhereOne:
    """Leave out where places stand, where none is likely."""
    if not answer.places or answer.places[0].probability >= _LIKELY:
        return answer
    return replace(answer, places=tuple(map(_leave_out_position, answer.places)))


def _leave_out_reasons(answer: WhereOne) -> WhereOne:
    """Leave out the reasons of all places but the first, where none is likely."""
    if not answer.places or answer.places[0].probability >= _LIKELY:
        return answer
    first, *others = answer.places
    return replace(answer, places=(first, *(replace(place, why="") for place in others)))


def _leave_out_position(said: _Said) -> _Said:
    """Leave the position of a place out; that of a thing stays."""
    if said is None or said.position_of != "place":
        return said
    return replace(said, position=None, position_of=None)


def _shorten_names(answer: WhereOne, most: int) -> WhereOne:
    def cut(text: str, most: int = most) -> str:
        return text if len(text) <= most else f"{text[:most]}..."

    seen = answer.last_seen
    return replace(
        answer,
        thing=cut(answer.thing),
        taken_for=tuple(map(cut, answer.taken_for)),
        places=tuple(
            replace(place, name=cut(place.name), why=cut(place.why)) for place in answer.places
        ),
        last_seen=None if seen is None else replace(seen, name=cut(seen.name)),
        ask=cut(answer.ask, _MOST_ASKED * most),
        candidates=tuple(map(cut, answer.candidates)),
    )
