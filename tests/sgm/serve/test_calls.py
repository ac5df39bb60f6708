"""The declared calls: checked arguments, schemas that answers keep, no logic of its own."""

import inspect
import json
from datetime import datetime

import pytest

from sgm.finder.answers import to_json
from sgm.finder.service import MemoryService
from sgm.memory.sighting import Sighting
from sgm.serve.argument_rules import MOST_SEEN
from sgm.serve.calls import BY_NAME, CALLS, REQUIRED
from sgm.serve.documents import make_openapi, make_page, make_tables

from .conftest import START, open_service

# Good arguments of every call, in JSON.
GOOD = {
    "ask": {"text": "what is on the desk?", "speaker": "anna"},
    "where_is": {"thing": "mug", "at": "2026-11-16T18:30", "k": 2},
    "search_start": {"thing": "mug", "from": [0, 1.5], "budget": 9.5},
    "search_next": {
        "search_id": "x",
        "result": "seen",
        "seen": ["cup"],
        "coverage": 0.5,
        "look": 1,
    },
    "observe": {"place": "desk", "seen": [{"thing": "pen", "relation": "in", "confidence": 0.5}]},
    "note_moved": {
        "thing": "keys",
        "place": "desk",
        "by": "anna",
        "relation": "in",
        "confidence": 0.8,
        "was_at": "counter top",
    },
    "picked_up": {"thing": "milk", "was_at": 0},
    "put_down": {"thing": "milk", "place": "desk", "relation": "onTop"},
    "forget": {"thing": "milk", "by": "anna"},
    "rename": {"thing": "milk", "name": "oat milk", "by": "anna"},
    "merge": {"thing": "scissors", "other": "paper knife", "by": "anna"},
    "split": {"thing": "scissors", "by": "anna"},
    "list_places": {"room": "kitchen", "k": 1},
    "list_things": {"kind": "mug", "k": 1},
    "history": {"thing": "mug", "k": 1},
    "expect": {"place": "desk", "at": "2026-11-16T18:30", "k": 2},
    "learnt": {"k": 2},
    "next_looks": {"k": 2},
    "changes": {"since": "2026-11-16T00:00", "k": 2},
    "add_room": {"label": "bath"},
    "rename_room": {"room": "kitchen", "label": "canteen"},
    "remove_room": {"room": 0},
    "add_place": {
        "label": "sink",
        "room": "kitchen",
        "name": "white sink",
        "position": [1, 2],
        "center": [1, 3, 0.5],
        "size": [0.5, 0.5, 1],
        "yaw": -1.5,
        "interior": "door",
        "open_cost": 2,
    },
    "name_place": {"place": "desk", "label": "table", "name": "white table"},
    "move_place": {
        "place": "desk",
        "room": "kitchen",
        "position": [1, 2, 0],
        "polygon": [[0, 0], [1, 0], [0, 1]],
        "bottom": 0,
        "top": 1,
        "yaw": 0.5,
    },
    "merge_places": {"place": "desk", "other": 1},
    "remove_place": {"place": "desk"},
    "set_map": {
        "rooms": [{"name": "kitchen"}, {"name": "bath", "floor": [[0, 0], [2, 3]]}],
        "furniture": [{"name": "sink", "room": "bath", "position": [1, 2], "open_cost": 1}],
        "frame": "map",
    },
    "transform_map": {"angle": 1.5, "shift": [1, 2], "map_id": "new"},
}
GOOD = {
    name: {**arguments, "key": "one"} if BY_NAME[name].is_write else arguments
    for name, arguments in GOOD.items()
}


def fits(schema, value):
    """Tell whether a JSON value keeps a schema, by the part of JSON Schema that is used here."""
    if "anyOf" in schema:
        return any(fits(one, value) for one in schema["anyOf"])
    if "enum" in schema and value not in schema["enum"]:
        return False
    kinds = {
        "object": dict,
        "array": list,
        "string": str,
        "boolean": bool,
        "null": type(None),
        "integer": int,
        "number": (int, float),
    }
    kind = schema["type"]
    if not isinstance(value, kinds[kind]) or (isinstance(value, bool) and kind != "boolean"):
        return False
    if kind == "object":
        own = schema["properties"]
        return set(schema["required"]) <= value.keys() <= own.keys() and all(
            fits(own[name], inner) for name, inner in value.items()
        )
    if kind == "array":
        in_bounds = schema.get("minItems", 0) <= len(value) <= schema.get("maxItems", 10**9)
        return in_bounds and all(fits(schema["items"], inner) for inner in value)
    return True


@pytest.mark.parametrize("call", CALLS, ids=lambda call: call.name)
def test_a_call_is_a_method_in_python(call):
    assert call.method is getattr(MemoryService, call.name)
    assert call.method.__module__.startswith("sgm.finder.")
    parameters = list(inspect.signature(call.method).parameters.values())[1:]
    assert [argument.python or argument.name for argument in call.arguments] == [
        parameter.name for parameter in parameters
    ]
    for argument, parameter in zip(call.arguments, parameters, strict=True):
        is_required = parameter.default is inspect.Parameter.empty
        assert (argument.default is REQUIRED) == is_required
        if argument.default not in (None, REQUIRED):
            assert argument.default == parameter.default


@pytest.mark.parametrize("call", CALLS, ids=lambda call: call.name)
def test_arguments_and_answers_keep_their_schemas(call, tmp_path):
    _, service = open_service(tmp_path / "home.sgm")
    arguments = GOOD[call.name]
    assert fits(call.make_input_schema(), arguments)
    least = {one.name: arguments[one.name] for one in call.arguments if one.default is REQUIRED}
    for values in (arguments, least):
        if call.name == "search_next":
            values = {**values, "search_id": service.search_start("mug").search_id}
        elif call.name == "put_down":
            service.picked_up("milk")
        elif call.name == "rename" and values is least:
            values = {"thing": "oat milk", "name": "soy milk"}
        elif call.name == "merge":
            service.observe("desk", [Sighting("scissors"), Sighting("paper knife")])
            if values is least:
                service.split("scissors")
        elif call.name == "split":
            service.merge("scissors", "paper knife")
        elif call.name in ("rename_room", "remove_room", "merge_places", "remove_place") or (
            call.name == "name_place" and values is least
        ):
            service = open_service(tmp_path / f"{values is least}.sgm")[1]
        elif call.name == "forget":
            values = arguments
            service.observe("desk", [Sighting("milk")])
        if "key" in values:
            values = {**values, "key": f"{values is least}"}
        answer = to_json(call.run(service, call.read(values)))
        assert fits(call.make_output_schema(), json.loads(json.dumps(answer)))
        assert answer["status"] == "ok"


BAD = [
    ("where_is", {}, "arguments of where_is must name thing"),
    ("where_is", [], "arguments of where_is must be one JSON object"),
    ("where_is", {"thing": "mug", "of": 1}, "arguments of where_is must be some of thing, at, k"),
    ("where_is", {"thing": ""}, "thing must be a text of 1 to 200 characters"),
    ("where_is", {"thing": 3}, "thing must be a text"),
    ("where_is", {"thing": "x" * 201}, "thing must be a text"),
    ("where_is", {"thing": "mug", "k": 0}, "k must be a whole number from 1 to 50, got 0"),
    ("where_is", {"thing": "mug", "k": True}, "k must be a whole number"),
    ("where_is", {"thing": "mug", "k": 1.5}, "k must be a whole number"),
    ("where_is", {"thing": "mug", "at": "soon"}, "at must be local time such as"),
    ("where_is", {"thing": "mug", "at": "2026-11-16T18:30+01:00"}, "at must be local time"),
    ("where_is", {"thing": "mug", "at": -1}, "at must be local time"),
    ("search_start", {"thing": "mug", "from": [1]}, "from must be two numbers"),
    ("search_start", {"thing": "mug", "from": [1, float("nan")]}, "from must be two numbers"),
    ("search_start", {"thing": "mug", "from": {}}, "from must be the id of a place"),
    ("search_next", {"search_id": "x", "result": "maybe"}, "result must be one of found, not_fou"),
    ("observe", {"place": -1, "seen": []}, "place must be the id of a place"),
    ("observe", {"place": 10**400, "seen": []}, "place must be the id of a place"),
    ("observe", {"place": 1, "seen": "mug"}, "seen must be a list of at most 500 things"),
    ("observe", {"place": 1, "seen": ["a"] * (MOST_SEEN + 1)}, "seen must be a list"),
    ("observe", {"place": 1, "seen": [1]}, r"seen\[0\] must be a name, or an object of thing"),
    ("observe", {"place": 1, "seen": [{"name": "a"}]}, r"seen\[0\] must be a name, or an object"),
    ("observe", {"place": 1, "seen": [{"thing": "a", "relation": "by"}]}, r"relation must be one"),
    ("observe", {"place": 1, "seen": [{"thing": "a", "confidence": 2}]}, "be a number above 0"),
    ("observe", {"place": 1, "seen": [], "coverage": 0}, "coverage must be a number above 0"),
    ("observe", {"place": 1, "seen": [{"thing": "a", "id": ""}]}, r"seen\[0\].id must be a text"),
    (
        "observe",
        {"place": 1, "seen": [{"thing": "a", "embedding": []}]},
        "embedding must be a list",
    ),
    (
        "observe",
        {"place": 1, "seen": [{"thing": "a", "embedding": ["b"]}]},
        "embedding must be a l",
    ),
    ("add_place", {"label": "a", "room": "b", "position": [1, 1e300]}, "position must be two"),
    ("add_place", {"label": "a", "room": "b", "position": [1, 10**400]}, "position must be two"),
    ("observe", {"place": 1, "seen": [], "coverage": 10**400}, "coverage must be a number above 0"),
    ("search_start", {"thing": "mug", "budget": float("inf")}, "budget must be a number above 0"),
    ("where_is", {"name": "mug"}, r"got 'name'. Say thing: in words, such as the red mug"),
    ("observe", {"furniture": "desk", "seen": []}, r"got 'furniture'. Say place: id or name"),
    ("add_room", {"lable": "bath"}, r"got 'lable'. Say label: such as kitchen"),
    ("add_room", {"label": "bath", "name": "bath"}, r"got 'name'. Leave it out"),
    ("add_room", {"label": "bath", "key": ""}, "key must be a text of 1 to 200"),
    ("add_place", {"label": "a", "room": "b", "center": [1, 2]}, "center must be three numbers"),
    ("add_place", {"label": "a", "room": "b", "open_cost": -1}, "open_cost must be a number from"),
    ("add_place", {"label": "a", "room": "b", "interior": "x"}, "interior must be one of none, op"),
    ("move_place", {"place": 0, "polygon": [[0, 0], [1, 1]]}, "polygon must be 3 to 64 corners"),
    ("move_place", {"place": 0, "yaw": "west"}, "yaw must be a number"),
    ("set_map", {"rooms": [], "furniture": []}, "rooms must be a list of 1 to 10000 entries"),
    ("search_next", {"search_id": "x", "result": "found", "look": 0}, "look must be a whole"),
]


@pytest.mark.parametrize(("name", "values", "line"), BAD)
def test_what_breaks_a_rule_is_told_in_one_line(name, values, line):
    with pytest.raises(ValueError, match=line) as caught:
        BY_NAME[name].read(values)
    assert len(str(caught.value)) < 500
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("written", "read"), [("in", "in"), ("onTop", "onTop"), ("on", "onTop"), ("inside", "in")]
)
def test_relations_are_spelled_as_in_python(written, read):
    seen = [{"thing": "pen", "relation": written}]
    assert BY_NAME["observe"].read({"place": 2, "seen": seen})["seen"] == [Sighting("pen", read)]
    values = {"thing": "pen", "place": "desk", "relation": written}
    assert BY_NAME["put_down"].read(values, is_query=True)["relation"] == read
    assert fits(BY_NAME["put_down"].make_input_schema(), values)
    values["relation"] = "under"
    with pytest.raises(ValueError, match=r"relation must be one of in, onTop, .*, got 'under'"):
        BY_NAME["put_down"].read(values)


def test_null_is_as_good_as_nothing():
    assert BY_NAME["where_is"].read({"thing": "mug", "k": None}) == {"thing": "mug"}


def test_arguments_are_what_python_takes():
    read = BY_NAME["where_is"].read({"thing": "mug", "at": "2026-11-16T18:30:00"})
    assert read["at"] == datetime(2026, 11, 16, 18, 30)
    read = BY_NAME["search_start"].read({"thing": "mug", "from": [1, 2]})
    assert read == {"thing": "mug", "start": (1.0, 2.0)}
    seen = BY_NAME["observe"].read({"place": 2, "seen": ["cup", {"thing": "pen", "owner": "Ann"}]})
    assert seen["seen"] == [Sighting("cup"), Sighting("pen", owner="Ann")]
    one = {
        "thing": "cup",
        "id": "7",
        "embedding": [1, 0.5],
        "position": [1, 2, 0.9],
        "position_sd": 0,
    }
    (sighting,) = BY_NAME["observe"].read({"place": 2, "seen": [one]})["seen"]
    assert sighting == Sighting(
        "cup", id="7", embedding=(1.0, 0.5), position=(1.0, 2.0, 0.9), position_sd=0.0
    )


def test_a_query_says_numbers_as_text():
    call = BY_NAME["list_things"]
    assert call.read({"place": "2", "k": "3"}, is_query=True) == {"place": 2, "k": 3}
    assert call.read({"place": "desk", "kind": "7"}, is_query=True) == {
        "place": "desk",
        "kind": "7",
    }
    with pytest.raises(ValueError, match="k must be a whole number"):
        call.read({"k": "[" * 1000}, is_query=True)


def test_openapi_lists_every_call():
    document = make_openapi()
    assert json.loads(json.dumps(document)) == document
    assert {path.removeprefix("/v1/") for path in document["paths"]} == {*BY_NAME, "feed"}
    for call in CALLS:
        routes = document["paths"][f"/v1/{call.name}"]
        assert set(routes) == ({"post"} if call.is_write else {"get", "post"})
        schema = routes["post"]["requestBody"]["content"]["application/json"]["schema"]
        assert schema == call.make_input_schema()
        assert f"<code>{call.name}(" in make_page()
        assert f"\n### {call.name}\n" in f"\n{make_tables()}"


def test_the_time_of_a_test_stands_still(tmp_path):
    _, service = open_service(tmp_path / "home.sgm")
    assert service.where_is("mug").at.iso == START.isoformat()
