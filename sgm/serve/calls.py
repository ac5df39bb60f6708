"""The calls, each declared once: HTTP routes, tools, schemas and the documentation follow."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Final, get_type_hints

from sgm.finder.read_calls import ReadCalls
from sgm.finder.service import MemoryService
from sgm.finder.where_calls import MOST_ROWS
from sgm.memory.thing import ROBOT
from sgm.messages import shorten
from sgm.serve.answer_schema import make_schema
from sgm.serve.argument_rules import (
    COST,
    EXTENTS,
    FURNITURE,
    NUMBER,
    PLACE,
    POSITION,
    RELATION,
    ROOM,
    ROOMS,
    SEEN,
    SHARE,
    START,
    TEXT,
    THINGS,
    TIME,
    YES_NO,
    Rule,
    make_choice_rule,
    make_number_rule,
    make_text_rule,
    make_whole_rule,
)
from sgm.serve.coerced import coerce

VERSION: Final = "v1"  # of the schema: fields may be added in it, and none changes or goes
REQUIRED: Final = object()
MOST_LOOKS = 1_000_000  # of a search


@dataclass(frozen=True, slots=True)
class Argument:
    """An argument of a call.

    Attributes:
        name: in JSON.
        rule: what it must be.
        about: in one line.
        default: `REQUIRED`, or what is documented as the value of one that is left out.
        python: its name in Python, if another.
        also: other names under which it is understood.
    """

    name: str
    rule: Rule
    about: str
    default: Any = None
    python: str = ""
    also: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Call:
    """A call of `MemoryService`.

    Attributes:
        about: in one or two sentences, for people and language models.
        arguments: in order.
        method: of `MemoryService`.
        is_write: whether it changes the memory.
    """

    about: str
    arguments: tuple[Argument, ...]
    method: Callable[..., Any]
    is_write: bool = False

    @property
    def name(self) -> str:
        """That of the method."""
        return self.method.__name__

    @property
    def only_reads(self) -> bool:
        """Whether it needs nothing but the memory and a finder: any copy of them answers alike."""
        return getattr(ReadCalls, self.name, None) is self.method

    def make_input_schema(self) -> dict[str, Any]:
        """Return the JSON Schema of its arguments."""
        properties = {}
        for argument in self.arguments:
            described = {**argument.rule.schema, "description": argument.about}
            if argument.default not in (None, REQUIRED):
                described["default"] = argument.default
            properties[argument.name] = described
        return {
            "type": "object",
            "properties": properties,
            "required": [
                argument.name for argument in self.arguments if argument.default is REQUIRED
            ],
            "additionalProperties": False,
        }

    def make_output_schema(self) -> dict[str, Any]:
        """Return the JSON Schema of its answer."""
        return make_schema(get_type_hints(self.method)["return"])

    def read(
        self, values: Any, *, is_query: bool = False, is_coerced: bool = False
    ) -> dict[str, Any]:
        """Return the arguments for Python, of JSON values by name, or of texts of a query.

        With `is_coerced`, values of a near type are taken as what is declared (`coerce`).

        Raises:
            ValueError: if one is missing, unknown, or breaks its rule.
        """
        if not isinstance(values, Mapping):
            raise ValueError(
                f"arguments of {self.name} must be one JSON object, got {shorten(values)}. Write "
                '{"name": value}.'
            )
        values = self._name_as_declared(values)
        read = {}
        for argument in self.arguments:
            value = values.get(argument.name)
            if is_coerced and value is not None:
                value = coerce(value, argument.rule.schema)
            if value is None:  # null is as good as nothing
                if argument.default is REQUIRED:
                    raise ValueError(
                        f"arguments of {self.name} must name {argument.name}, got none. Give it: "
                        f"{argument.about}"
                    )
                continue
            read_one = argument.rule.read_text if is_query else argument.rule.read
            read[argument.python or argument.name] = read_one(argument.name, value)
        return read

    def _name_as_declared(self, values: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return values by the names of the arguments; raises ValueError for unknown ones."""
        names = [argument.name for argument in self.arguments]
        others = {
            other: argument.name
            for argument in self.arguments
            for other in argument.also
            if argument.name not in values
        }
        for name in values:
            if name in names or name in others:
                continue
            missing = [
                argument
                for argument in self.arguments
                if argument.default is REQUIRED and values.get(argument.name) is None
            ]
            advice = "Leave it out."
            if missing:
                advice = f"Say {missing[0].name}: {missing[0].about}."
            raise ValueError(
                f"arguments of {self.name} must be some of {', '.join(names) or 'none'}, got "
                f"{shorten(name)}. {advice}"
            )
        return {others.get(name, name): value for name, value in values.items()}

    def run(self, service: ReadCalls, arguments: Mapping[str, Any]) -> Any:
        """Make the call with arguments that `read` gave, and return its answer."""
        return self.method(service, **arguments)


_THINGS = Argument(
    "thing",
    THINGS,
    "in words, such as the red mug, keys and wallet, or the mug in the sink; its id; or a list",
    REQUIRED,
)
_SPEAKER = Argument("speaker", TEXT, "who says my, such as anna")
_KEY = Argument(
    "key",
    TEXT,
    "any text: a write that is sent again with it is made once, and answered as before",
)
_THING = Argument("thing", TEXT, "in words, such as the red mug, or its id", REQUIRED)
_PLACE = Argument("place", PLACE, "id or name, such as desk in study", REQUIRED)
_AT = Argument("at", TIME, "local time, 2026-11-16T18:30, or a time step; not past")
_ROOM = Argument("room", ROOM, "id or name, such as kitchen", REQUIRED)
_LABEL = Argument("label", TEXT, "what it is, such as fridge", REQUIRED)
_STAND = Argument("position", POSITION, "where one stands to look at it, metres")
_ABOUT_EXTENTS = {
    "center": "x, y, z of its middle in the map, metres",
    "size": "depth, width and height, metres",
    "yaw": "where its front looks to, radians from the x axis",
    "interior": "none: a table; open: shelves; door: to be opened",
    "polygon": "corners of its footprint, in place of center and size",
    "bottom": "height of its lower side, with a polygon",
    "top": "height of its upper side, with a polygon",
}
_BOX, _POLYGON = (
    tuple(Argument(name, EXTENTS[name], _ABOUT_EXTENTS[name]) for name in names)
    for names in (("center", "size", "yaw", "interior"), ("polygon", "bottom", "top"))
)
_OPEN_COST = Argument("open_cost", COST, "of opening it to look into it, as metres; else no door")
_COVERAGE = Argument("coverage", SHARE, "share of the place that was in view", 1)
_SEEN = Argument(
    "seen", SEEN, "everything that was seen there, and nothing else; [] if nothing was", REQUIRED
)
_BY = Argument("by", TEXT, "who says so", ROBOT)
_WAS_AT = Argument("was_at", PLACE, "place from which one of several of its kind was taken")


def _rows(about: str, default: int | None) -> Argument:
    return Argument("k", make_whole_rule(1, MOST_ROWS), about, default)


# Every call; those that write have a key besides.
_CALLS: Final[tuple[Call, ...]] = (
    Call(
        "Answer a sentence of a person, as it was said: where a thing is, was or will be, whether "
        "it is somewhere, what is at a place, in which room, who moved what, what has changed.",
        (
            Argument("text", TEXT, "the sentence, such as is the remote on the sofa?", REQUIRED),
            _SPEAKER,
        ),
        MemoryService.ask,
    ),
    Call(
        "Where a thing is, now or at a time to come: the likeliest places with probabilities and "
        "reasons. If the status is ambiguous, ask the user what `ask` says.",
        (
            _THINGS,
            _AT,
            _rows("most places; else three, or fewer", None),
            _SPEAKER,
            Argument("in_use", YES_NO, "whether it was in hand minutes ago"),
        ),
        MemoryService.where_is,
    ),
    Call(
        "Begin to look for a thing, or for several in one tour: says where to go and look first.",
        (
            _THINGS,
            Argument(
                "from",
                START,
                "where you are: a place, or [x, y] in metres; in homes with positions",
                None,
                "start",
            ),
            Argument(
                "budget",
                make_number_rule(0, 1e6),
                "most that all looks together may cost: metres "
                "and 1 for each; without from, the number of looks",
            ),
            _SPEAKER,
        ),
        MemoryService.search_start,
    ),
    Call(
        "Say what came of the latest look of a search, and get the next one.",
        (
            Argument("search_id", make_text_rule(40), "from search_start", REQUIRED),
            Argument(
                "result",
                make_choice_rule("found", "not_found", "seen"),
                "found or not_found, of the thing alone; seen, with all that was seen",
                REQUIRED,
            ),
            Argument("seen", SEEN, "everything that was seen there, if the result is seen"),
            _COVERAGE,
            Argument("thing", TEXT, "which of several was found, as left has it"),
            Argument(
                "look",
                make_whole_rule(1, MOST_LOOKS),
                "number of that look, next.look: one that is sent again is noted once",
            ),
        ),
        MemoryService.search_next,
        is_write=True,
    ),
    Call(
        "Note everything that was seen in one look at a place. What is not named was not there.",
        (_PLACE, _SEEN, _COVERAGE),
        MemoryService.observe,
        is_write=True,
    ),
    Call(
        "Note where a thing is now, as a person says: I put the keys in the drawer. It is "
        "believed as far as the confidence says, and later looks outweigh it.",
        (
            _THING,
            _PLACE,
            Argument("by", TEXT, "who says so, such as anna", REQUIRED),
            Argument("relation", RELATION, "how it lies there", "in"),
            Argument("confidence", SHARE, "that it is right, 0.5 or more; else 0.9"),
            _WAS_AT,
        ),
        MemoryService.note_moved,
        is_write=True,
    ),
    Call(
        "Note that the robot has taken a thing, and carries it until it is put down.",
        (_THING, _WAS_AT),
        MemoryService.picked_up,
        is_write=True,
    ),
    Call(
        "Note that the robot has put down what it carried.",
        (_THING, _PLACE, Argument("relation", RELATION, "how it lies there", "onTop")),
        MemoryService.put_down,
        is_write=True,
    ),
    Call(
        "Forget a thing that is not there at all (there is no vase), or a place that is gone.",
        (
            Argument("thing", TEXT, "in words; left out for a place"),
            Argument("place", PLACE, "id or name; left out for a thing"),
            _BY,
        ),
        MemoryService.forget,
        is_write=True,
    ),
    Call(
        "Call a thing otherwise: that is no cup, it is a bowl.",
        (_THING, Argument("name", TEXT, "what it is called from now on", REQUIRED), _BY),
        MemoryService.rename,
        is_write=True,
    ),
    Call(
        "Note that two things are one (this is the same mug), called as the first; see split.",
        (_THING, Argument("other", TEXT, "in words, or its id", REQUIRED), _BY),
        MemoryService.merge,
        is_write=True,
    ),
    Call(
        "Note that what was held to be one thing is two; merge undoes it.",
        (
            _THING,
            Argument(
                "place", PLACE, "what was seen there is another thing; else a merge is undone"
            ),
            Argument("name", TEXT, "of that other thing, with a place"),
            _BY,
        ),
        MemoryService.split,
        is_write=True,
    ),
    Call(
        "List the places where things may be.",
        (Argument("room", TEXT, "its name; left out for all"), _rows("most rows", 20)),
        MemoryService.list_places,
    ),
    Call(
        "List what is at a place, or all things of a kind, or all that is known; seen last first.",
        (
            Argument("place", PLACE, "id or name; left out for all"),
            Argument("kind", TEXT, "such as mug; left out for all"),
            _rows("most rows", 20),
        ),
        MemoryService.list_things,
    ),
    Call(
        "List what is known of a thing over time, the latest first: where it was seen, who said "
        "what of it.",
        (_THING, _rows("most rows", 20)),
        MemoryService.history,
    ),
    Call(
        "List what is new, was moved, is gone or was picked up since a time, the latest first.",
        (
            Argument("since", TIME, "local time, 2026-11-16T18:30, or a time step", REQUIRED),
            _rows("most rows", 20),
        ),
        MemoryService.changes,
    ),
    Call(
        "List what may be at a place, now or later, the likeliest first.",
        (
            _PLACE,
            _AT,
            _rows("most rows", 20),
        ),
        MemoryService.expect,
    ),
    Call(
        "Say where a robot with nothing to do should look: where most is to be learnt.",
        (_rows("most places", 3),),
        MemoryService.next_looks,
    ),
    Call(
        "Say which thing is where at which hours, as was learnt.",
        (_rows("most rows", 20),),
        MemoryService.learnt,
    ),
    Call(
        "Add a room.",
        (Argument("label", TEXT, "such as kitchen", REQUIRED, also=("name",)),),
        MemoryService.add_room,
        is_write=True,
    ),
    Call(
        "Call a room otherwise: this is no bedroom, it is a study.",
        (_ROOM, Argument("label", TEXT, "what it is", REQUIRED, also=("name",))),
        MemoryService.rename_room,
        is_write=True,
    ),
    Call(
        "Remove a room with all its places, and what is remembered of them.",
        (_ROOM,),
        MemoryService.remove_room,
        is_write=True,
    ),
    Call(
        "Add a place where things may be, such as a fridge or a desk. Its extents are center and "
        "size, or polygon, bottom and top.",
        (
            _LABEL,
            _ROOM,
            Argument("name", TEXT, "for people, such as white fridge; else the label"),
            _STAND,
            *_BOX,
            _OPEN_COST,
            *_POLYGON,
        ),
        MemoryService.add_place,
        is_write=True,
    ),
    Call(
        "Note what a place is, where that was not known, or was known wrongly.",
        (_PLACE, _LABEL, Argument("name", TEXT, "for people; else the label")),
        MemoryService.name_place,
        is_write=True,
    ),
    Call(
        "Note that a place was moved: what was seen there moves with it. What is left out stays.",
        (
            _PLACE,
            Argument("room", ROOM, "where it stands now, by id or name"),
            _STAND,
            *_BOX,
            _OPEN_COST,
            *_POLYGON,
        ),
        MemoryService.move_place,
        is_write=True,
    ),
    Call(
        "Note that two places are one, which is called as the first.",
        (_PLACE, Argument("other", PLACE, "id or name of the other one, which goes", REQUIRED)),
        MemoryService.merge_places,
        is_write=True,
    ),
    Call(
        "Remove a place of the map, and what is remembered of it; its things have no place then.",
        (_PLACE,),
        MemoryService.remove_place,
        is_write=True,
    ),
    Call(
        "Take a whole map over. What the home has already is moved and not added again; nothing is "
        "removed.",
        (
            Argument("rooms", ROOMS, "all rooms: a name of each, or more about it", REQUIRED),
            Argument(
                "furniture",
                FURNITURE,
                "all places, each with its room by name, and more as for add_place",
                REQUIRED,
            ),
            Argument("frame", TEXT, "of the coordinates", "map"),
        ),
        MemoryService.set_map,
        is_write=True,
    ),
    Call(
        "Move all positions into the frame of another map of the same home: turn, then shift.",
        (
            Argument("angle", NUMBER, "radians around the origin, counter-clockwise", 0.0),
            Argument("shift", POSITION, "metres, x, y; left out for none", None),
            Argument("map_id", TEXT, "of the new map"),
        ),
        MemoryService.transform_map,
        is_write=True,
    ),
)
CALLS: Final[tuple[Call, ...]] = tuple(
    replace(call, arguments=(*call.arguments, _KEY)) if call.is_write else call for call in _CALLS
)
BY_NAME: Final[Mapping[str, Call]] = {call.name: call for call in CALLS}
