"""What a `MemoryService` answers: plain values, few of them, with the time in words and in ISO."""

from __future__ import annotations

import json
from dataclasses import dataclass, field, is_dataclass
from datetime import datetime
from types import UnionType
from typing import Any, Literal, Union, cast, get_args, get_origin, get_type_hints

from sgm.layout.box import Box
from sgm.memory.clock import Clock
from sgm.memory.sighting import Point
from sgm.names.asking import make_asking
from sgm.names.sections import ENGLISH

MOST_BYTES = 600  # of an answer of `where_is` for which no number of rows was asked
_DIGITS = 3  # of probabilities and costs
# Of a field that an answer does not have where it is None.
LEFT_OUT = {"is_left_out": True}
_PLAIN = frozenset((str, int, bool, type(None)))

Status = Literal["ok", "ambiguous", "unknown"]
PositionOf = Literal["thing", "place"]
Pose = tuple[float, float, float]  # x, y in the map, metres, and yaw, radians
# What each status means, for the documentation.
STATUSES = {
    "ok": "the call was done",
    "ambiguous": "the name means several things, or words were not understood; nothing was done: "
    "`ask` is what to ask the user, `candidates` are names to call again with",
    "unknown": "nothing of that name is known; `candidates` are near names, if there are any",
}


@dataclass(frozen=True, slots=True)
class Moment:
    """A time.

    Attributes:
        step: time step of the memory.
        iso: local date and time in ISO 8601; None without a clock.
        words: "at 9:10", "yesterday at 21:40"; without a clock "now", "3 steps ago".
    """

    step: int
    iso: str | None
    words: str

    @classmethod
    def tell(cls, step: int, now: int, clock: Clock | None, language: str = ENGLISH) -> Moment:
        """Tell a time step, as it is said at another one."""
        asking = make_asking(language)
        date: datetime | None = None if clock is None else clock.get_date(step)
        present = None if clock is None else clock.get_date(now)
        if date is None or present is None:
            return cls(step, None, asking.tell_steps(step, now))
        return cls(step, date.isoformat(timespec="seconds"), asking.tell_time(date, present))


@dataclass(frozen=True, slots=True)
class PlaceFound:
    """A place where a thing may be.

    Attributes:
        place: its id.
        name: "white fridge in kitchen".
        relation: such as "in" or "onTop" it; "is" or "part" where the place itself, or its room,
            was asked for.
        probability: that the thing is there.
        why: what the memory holds for and against it.
        position: x, y, z in the map, metres: where it was seen last there, else of the place; left
            out where unknown.
        position_of: "thing" or "place"; left out without a position.
        picture: path or id of the latest picture that shows it there; left out without one.
    """

    place: int
    name: str
    relation: str
    probability: float
    why: str
    position: Point | None = field(default=None, metadata=LEFT_OUT)
    position_of: PositionOf | None = field(default=None, metadata=LEFT_OUT)
    picture: str | None = field(default=None, metadata=LEFT_OUT)


@dataclass(frozen=True, slots=True)
class LastSeen:
    """Where and when a thing was last seen.

    Attributes:
        place: id of the place; None if it was removed since.
        name: of the place.
        is_there: whether the last look there still showed it.
        by: who said so; "robot" for what it did itself, empty for what was seen.
        at: when that was.
        position: as in `PlaceFound`; of the place where the thing is not there any more.
        position_of: as in `PlaceFound`.
        picture: path or id of the latest picture that shows it there; left out without one.
    """

    place: int | None
    name: str
    is_there: bool
    by: str
    at: Moment
    position: Point | None = field(default=None, metadata=LEFT_OUT)
    position_of: PositionOf | None = field(default=None, metadata=LEFT_OUT)
    picture: str | None = field(default=None, metadata=LEFT_OUT)


@dataclass(frozen=True, slots=True)
class WhereOne:
    """Where one thing is, or was.

    Attributes:
        status: "ok" only if every word that says something was used. "unknown" has places, too:
            where such things tend to be.
        thing: as it was asked for.
        taken_for: what was seen of that name; a thing is found when one of them is.
        places: the likeliest first.
        left_out: how many more places there are, less likely than these; ask with k for them.
        elsewhere: probability that it is at no known place.
        with_robot: probability that the robot carries it.
        last_seen: None if it never was.
        at: the time that is asked about.
        ask: what to ask the user, if the name is ambiguous or unknown; else empty.
        candidates: what else may be meant.
        asked_for: "thing"; "place" or "room" where the name is of furniture or of a room, which is
            in `places` itself, or with what stands in it.
        num_known: how many such things there are at least, as many as were seen at once; left out
            where no more than one is known.
    """

    status: Status
    thing: str
    taken_for: tuple[str, ...]
    places: tuple[PlaceFound, ...]
    left_out: int
    elsewhere: float
    with_robot: float
    last_seen: LastSeen | None
    at: Moment
    ask: str
    candidates: tuple[str, ...]
    asked_for: str = "thing"
    num_known: int | None = field(default=None, metadata=LEFT_OUT)


@dataclass(frozen=True, slots=True)
class WhereIs(WhereOne):
    """Where things are: the first that was asked for, and the others.

    Attributes:
        also: the others that were asked for in the same call, each with a status of its own; left
            out where one was. The status and what to ask are then those of all.
    """

    also: tuple[WhereOne, ...] | None = field(default=None, metadata=LEFT_OUT)


@dataclass(frozen=True, slots=True)
class NextLook:
    """Where to go and look.

    Attributes:
        place: its id.
        name: "desk in study".
        probability: that the thing is there.
        cost: of going there and looking: metres and 1, where places have positions; else 1.
        look: number of this look in its search, 1 for the first, for `search_next`.
        position: as in `PlaceFound`.
        position_of: as in `PlaceFound`.
        pose: where to stand to see that, x, y in the map, metres, and yaw, radians, which is 0
            where it is not known which way to look; left out where unknown.
        box: extents of the place; left out where unknown.
    """

    place: int
    name: str
    probability: float
    cost: float
    look: int
    position: Point | None = field(default=None, metadata=LEFT_OUT)
    position_of: PositionOf | None = field(default=None, metadata=LEFT_OUT)
    pose: Pose | None = field(default=None, metadata=LEFT_OUT)
    box: Box | None = field(default=None, metadata=LEFT_OUT)


@dataclass(frozen=True, slots=True)
class Searching:
    """How a search stands.

    Attributes:
        status: "unknown" of a search that there is not, or no longer.
        search_id: for `search_next`; empty if no search was started.
        thing: what is looked for.
        next: where to look; None when the search is over.
        is_found: whether it was found.
        looks: so far.
        outcome: in one line.
        ask: as in `WhereIs`; of what the latest look showed that may be it and may be another
            thing, too. That does not end the search: report it as found if it is.
        candidates: as in `WhereIs`.
        left: of several things, those that are not found yet; left out of a search for one.
    """

    status: Status
    search_id: str
    thing: str
    next: NextLook | None = None
    is_found: bool = False
    looks: int = 0
    outcome: str = ""
    ask: str = ""
    candidates: tuple[str, ...] = ()
    left: tuple[str, ...] | None = field(default=None, metadata=LEFT_OUT)


@dataclass(frozen=True, slots=True)
class Noted:
    """What was written into the memory.

    Attributes:
        status: nothing was written unless it is "ok".
        thing: what it was about; empty if it was about a place.
        place: id of the place; None if it was about a thing alone.
        said: what was noted, in one line.
        at: when.
        ask: as in `WhereIs`.
        candidates: as in `WhereIs`.
        clock_fault: what is wrong with the clock of the machine; empty if nothing is.
        position: of the place, x, y, z in the map, metres; left out where unknown.
        room: id of the room, of what was noted of one; else left out.
    """

    status: Status
    thing: str
    place: int | None
    said: str
    at: Moment
    ask: str = ""
    candidates: tuple[str, ...] = ()
    clock_fault: str = ""
    position: Point | None = field(default=None, metadata=LEFT_OUT)
    room: int | None = field(default=None, metadata=LEFT_OUT)


@dataclass(frozen=True, slots=True)
class PlaceRow:
    """A place.

    Attributes:
        place: its id.
        name: "white fridge in kitchen".
        room: label of its room.
        label: what it is.
        position: x, y, z in the map, metres: the middle of its box, or, without one, on the floor
            where one stands to look at it; None if it is not known.
        last_looked: when it was last looked at; None if it never was.
        things: how many things are there by the last look.
        room_id: id of its room.
        pose: as in `NextLook`.
        box: as in `NextLook`.
        open_cost: of opening it to look into it; left out where there is nothing to open.
    """

    place: int
    name: str
    room: str
    label: str
    position: Point | None
    last_looked: Moment | None
    things: int
    room_id: int
    pose: Pose | None = field(default=None, metadata=LEFT_OUT)
    box: Box | None = field(default=None, metadata=LEFT_OUT)
    open_cost: float | None = field(default=None, metadata=LEFT_OUT)


@dataclass(frozen=True, slots=True)
class AnswerList:
    """A list that is cut off after k rows.

    Attributes:
        status: of what was named.
        rows: k at most.
        left_out: how many more there are.
        at: when this was so.
        ask: as in `WhereIs`.
        candidates: as in `WhereIs`.
    """

    status: Status
    rows: tuple[Any, ...]
    left_out: int
    at: Moment
    ask: str = ""
    candidates: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class PlaceList(AnswerList):
    """Places of the home, in the order of their ids.

    Attributes:
        status: of the room that was named.
    """

    rows: tuple[PlaceRow, ...]


@dataclass(frozen=True, slots=True)
class ThingRow:
    """A thing at a place.

    Attributes:
        thing: its description.
        place: id of the place; None if it was removed.
        name: of the place.
        relation: such as "in" or "onTop" it.
        is_there: whether the last look there showed it.
        times_seen: looks there that showed it.
        times_looked: looks there since it was first seen there.
        last_seen: when it was last seen there.
        position: as in `LastSeen`.
        position_of: as in `PlaceFound`.
        picture: path or id of the latest picture that shows it there; left out without one.
    """

    thing: str
    place: int | None
    name: str
    relation: str
    is_there: bool
    times_seen: int
    times_looked: int
    last_seen: Moment
    position: Point | None = field(default=None, metadata=LEFT_OUT)
    position_of: PositionOf | None = field(default=None, metadata=LEFT_OUT)
    picture: str | None = field(default=None, metadata=LEFT_OUT)


@dataclass(frozen=True, slots=True)
class ThingList(AnswerList):
    """Things at places, those seen last first.

    Attributes:
        status: of the place or kind that was named, or of the thing.
        num_known: of a kind, how many such things there are at least, as many as were seen at
            once; left out without a kind.
    """

    rows: tuple[ThingRow, ...]
    num_known: int | None = field(default=None, metadata=LEFT_OUT)


@dataclass(frozen=True, slots=True)
class EventRow:
    """Something that is known of a thing at a time.

    Attributes:
        thing: its description.
        what: "seen"; "missed" by a look at where it had been seen; or what was said or done:
            "moved", "picked_up", "put_down".
        place: id of the place; None with the robot, or if it was removed.
        name: of the place.
        relation: such as "in" or "onTop" it; None without a place.
        confidence: of the sighting or statement.
        by: who said so; "robot" for what it did itself, empty for looks.
        at: when.
        position: as in `LastSeen`.
        position_of: as in `PlaceFound`.
        picture: path or id of the latest picture that shows it there; left out without one.
    """

    thing: str
    what: str
    place: int | None
    name: str
    relation: str | None
    confidence: float
    by: str
    at: Moment
    position: Point | None = field(default=None, metadata=LEFT_OUT)
    position_of: PositionOf | None = field(default=None, metadata=LEFT_OUT)
    picture: str | None = field(default=None, metadata=LEFT_OUT)


@dataclass(frozen=True, slots=True)
class EventList(AnswerList):
    """What is known of a thing over time, the latest first.

    Attributes:
        status: of the thing.
    """

    rows: tuple[EventRow, ...]


@dataclass(frozen=True, slots=True)
class ExpectedRow:
    """A thing that may be at a place at a time.

    Attributes:
        thing: its id, or its description where it has none.
        probability: that it is there then.
        why: on how many such days looks at that hour showed it there; empty if there were none.
    """

    thing: str
    probability: float
    why: str


@dataclass(frozen=True, slots=True)
class ExpectedList(AnswerList):
    """What may be at a place, the likeliest first.

    Attributes:
        status: of the place.
        at: the time that is asked about.
    """

    rows: tuple[ExpectedRow, ...]


@dataclass(frozen=True, slots=True)
class PatrolRow:
    """A place to look at on a patrol.

    Attributes:
        place: its id.
        name: "desk in study".
        gain: nats that a look there tells of where things are, beside the looks before it.
        is_new: whether it was never looked at.
        position: of the place, x, y, z in the map, metres; left out where unknown.
        pose: as in `NextLook`.
    """

    place: int
    name: str
    gain: float
    is_new: bool
    position: Point | None = field(default=None, metadata=LEFT_OUT)
    pose: Pose | None = field(default=None, metadata=LEFT_OUT)


@dataclass(frozen=True, slots=True)
class PatrolList(AnswerList):
    """Where to look next on a patrol, in this order.

    Attributes:
        status: always "ok".
    """

    rows: tuple[PatrolRow, ...]


@dataclass(frozen=True, slots=True)
class LearntRow:
    """What was learnt of a thing.

    Attributes:
        thing: its description.
        said: where it is at which hours or where it goes next, and its usual place.
        rhythm: what tells best where it is: "hour" of the day, hour and kind of "day", "lag" since
            it was seen, both as "hour_lag"; "any" if it keeps to none of these.
        place: id of the place that showed it most often.
        name: of that place.
        share: of the looks there, how many showed it, 0 to 1.
        position: of the place, x, y, z in metres; left out if it is not known.
        position_of: as in `PlaceFound`.
    """

    thing: str
    said: str
    rhythm: str
    place: int
    name: str
    share: float
    position: Point | None = field(default=None, metadata=LEFT_OUT)
    position_of: PositionOf | None = field(default=None, metadata=LEFT_OUT)


@dataclass(frozen=True, slots=True)
class LearntList(AnswerList):
    """What was learnt of things, those with the clearest rhythm first.

    Attributes:
        status: always "ok".
        said: how well similar moments foretold the latest looks, in one line; empty without any.
        sure: how likely they held what they held for the likeliest; left out without such looks.
        right: share of these looks that showed it; left out without such looks.
        num_looks: how many they were.
    """

    rows: tuple[LearntRow, ...]
    said: str = ""
    sure: float | None = field(default=None, metadata=LEFT_OUT)
    right: float | None = field(default=None, metadata=LEFT_OUT)
    num_looks: int = 0


@dataclass(frozen=True, slots=True)
class ChangeRow:
    """That a thing is new, was moved, is gone, or was picked up, noticed between two looks.

    Attributes:
        what: "new", "moved", "gone" or "picked_up".
        thing: its description.
        thing_id: of a tracker; empty where words alone tell it apart.
        from_place: id of the place where it was; None if it is new, or that was removed.
        from_name: of that place.
        to_place: id of the place where it is, of what is new where it was seen first; None if it
            is gone or carried, or that is not kept.
        to_name: of that place.
        after: the last look that still showed it as before; None if there was none.
        at: when the change was noticed.
        probability: how sure it is.
        by: who said so; "robot" for what it did itself, empty for looks.
        from_position: of the place where it was, x, y, z in the map, metres; left out where
            unknown.
        to_position: where it is, else of the place where it is; left out where unknown.
        to_position_of: "thing" or "place"; left out without a `to_position`.
        picture: path or id of the latest picture that shows it where it is; left out without one.
    """

    what: str
    thing: str
    thing_id: str
    from_place: int | None
    from_name: str
    to_place: int | None
    to_name: str
    after: Moment | None
    at: Moment
    probability: float
    by: str
    from_position: Point | None = field(default=None, metadata=LEFT_OUT)
    to_position: Point | None = field(default=None, metadata=LEFT_OUT)
    to_position_of: PositionOf | None = field(default=None, metadata=LEFT_OUT)
    picture: str | None = field(default=None, metadata=LEFT_OUT)


@dataclass(frozen=True, slots=True)
class ChangeList:
    """What has changed, the latest first.

    Attributes:
        status: always "ok".
        rows: k at most.
        left_out: how many more there are.
        at: when this was so.
    """

    status: Status
    rows: tuple[ChangeRow, ...]
    left_out: int
    at: Moment


@dataclass(frozen=True, slots=True)
class Answered:
    """The answer to a sentence of a person.

    Attributes:
        status: "ok" only if the whole sentence was understood.
        kind: of the question that it was taken for: "where", "past", "future", "room", "place",
            "is_at", "what_at", "count", "when", "when_at", "when_moved", "who", "whose", "moved",
            "together", "history" or "changes"; "command" of what is no question.
        said: the answer in plain words, or what to ask.
        text: the sentence.
        at: the time that is asked about.
        ask: as in `WhereIs`.
        candidates: as in `WhereIs`.
        probability: of "yes", or of the first place; left out where there is none.
        where: where each thing is that was asked for.
        things: what is at a place, or of a kind.
        events: what is known of a thing over time.
        changes: what has changed.
        expected: what may be at a place at a time to come; left out of other questions.
    """

    status: Status
    kind: str
    said: str
    text: str
    at: Moment
    ask: str
    candidates: tuple[str, ...]
    probability: float | None = field(default=None, metadata=LEFT_OUT)
    where: tuple[WhereOne, ...] = ()
    things: tuple[ThingRow, ...] = ()
    events: tuple[EventRow, ...] = ()
    changes: tuple[ChangeRow, ...] = ()
    expected: tuple[ExpectedRow, ...] | None = field(default=None, metadata=LEFT_OUT)


def to_json(answer: Any) -> Any:
    """Return JSON values of an answer; numbers are rounded to three decimals."""
    kind = type(answer)
    if kind in _PLAIN:
        return answer
    if kind is float:
        return round(answer, _DIGITS)
    if kind is tuple or kind is list:
        return [to_json(value) for value in answer]
    if kind is dict:
        return {key: to_json(value) for key, value in answer.items()}
    return {
        name: to_json(value)
        for name, field in kind.__dataclass_fields__.items()
        if (value := getattr(answer, name)) is not None or not field.metadata
    }


def read_answer(kind: Any, value: Any) -> Any:
    """Return the answer of a type that `to_json` has made such JSON values of."""
    if value is None or kind is Any:
        return value
    if is_dataclass(kind):
        hints, make = get_type_hints(kind), cast("Any", kind)
        return make(**{name: read_answer(hints[name], part) for name, part in value.items()})
    origin, parts = get_origin(kind), get_args(kind)
    if origin is tuple and parts[-1] is Ellipsis:
        return tuple(read_answer(parts[0], part) for part in value)
    if origin is tuple:
        return tuple(map(read_answer, parts, value))
    if origin in (Union, UnionType):
        return read_answer(next(part for part in parts if part is not type(None)), value)
    return value


def write_json(answer: Any) -> bytes:
    """Write an answer as it is sent."""
    return json.dumps(to_json(answer), ensure_ascii=False, separators=(",", ":")).encode()
