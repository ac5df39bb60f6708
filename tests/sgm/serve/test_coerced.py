"""What clients of MCP send in the place of what is declared."""

import json

import pytest

from sgm.memory.sighting import Sighting
from sgm.serve.calls import BY_NAME, CALLS
from sgm.serve.coerced import coerce

from .conftest import open_service, run_server


def read(name, **values):
    return BY_NAME[name].read(values, is_coerced=True)


@pytest.mark.parametrize("value", [3, 3.0, "3", "3.0", " 3 ", '"3"'])
def test_a_whole_number(value):
    assert read("where_is", thing="mug", k=value) == {"thing": "mug", "k": 3}
    assert type(read("where_is", thing="mug", k=value)["k"]) is int


@pytest.mark.parametrize("value", ["3.5", 3.5, "true", True, "three", "", "[3]", "NaN", "1e999"])
def test_what_is_no_whole_number_is_refused(value):
    with pytest.raises(ValueError, match=r"k must be a whole number from 1 to"):
        read("where_is", thing="mug", k=value)


@pytest.mark.parametrize("value", [0.5, "0.5", "5e-1"])
def test_a_number(value):
    assert read("observe", place=0, seen=[], coverage=value)["coverage"] == 0.5


@pytest.mark.parametrize(
    "value",
    [
        ["mug", {"thing": "pen", "confidence": 0.5}],
        '["mug", {"thing": "pen", "confidence": 0.5}]',
        ["mug", '{"thing": "pen", "confidence": 0.5}'],
        '["mug", {"thing": "pen", "confidence": "0.5"}]',
        json.dumps('["mug", {"thing": "pen", "confidence": 0.5}]'),
        [{"thing": "mug"}, {"thing": "pen", "confidence": "0.5"}],
    ],
)
def test_a_list_of_things(value):
    for call, other in (("observe", {"place": "desk"}), ("search_next", {"search_id": "x"})):
        result = {"result": "seen"} if call == "search_next" else {}
        seen = read(call, seen=value, **other, **result)["seen"]
        assert seen == [Sighting("mug"), Sighting("pen", confidence=0.5)]


def test_an_empty_list_and_an_embedding():
    assert read("observe", place="desk", seen="[]")["seen"] == []
    (seen,) = read("observe", place=1.0, seen=[{"thing": "mug", "embedding": "[1, 0.5]"}])["seen"]
    assert seen.embedding == (1, 0.5)


@pytest.mark.parametrize("value", ["mug", "{}", "['mug']", '{"thing": "mug"', "[[1]]"])
def test_what_is_no_list_of_things_is_refused(value):
    with pytest.raises(ValueError, match=r"seen(\[0\])? must be"):
        read("observe", place=0, seen=value)


def test_a_place_a_position_and_a_time():
    assert read("search_start", thing="mug", **{"from": "[1.5, 4]"})["start"] == (1.5, 4)
    assert read("search_start", thing="mug", **{"from": ["1.5", 4]})["start"] == (1.5, 4)
    assert read("search_start", thing="mug", **{"from": "the desk"})["start"] == "the desk"
    assert read("search_start", thing="mug", **{"from": "2"})["start"] == 2
    assert read("where_is", thing="mug", at="9")["at"] == 9
    assert read("where_is", thing="mug", at=9.0)["at"] == 9
    assert read("where_is", thing="mug", at="2026-11-16T18:30")["at"].hour == 18
    assert read("observe", place=2.0, seen=[])["place"] == 2


@pytest.mark.parametrize("name", ["3", '"mug"', "true", "null", "[mug]", '["mug"]', '{"a": 1}'])
def test_a_name_that_looks_like_json_is_a_name(name):
    assert read("history", thing=name)["thing"] == name
    if not name.startswith("{"):
        assert read("observe", place=0, seen=[name])["seen"] == [Sighting(name)]


def test_several_things_may_be_a_list_or_its_text():
    assert read("where_is", thing='["mug", "keys"]')["thing"] == ["mug", "keys"]
    assert read("where_is", thing=["mug", 3])["thing"] == ["mug", "3"]
    assert read("where_is", thing=3)["thing"] == "3"
    assert read("where_is", thing="3")["thing"] == "3"


def test_a_number_is_a_name_where_names_alone_may_be():
    assert read("search_next", search_id=12, result="found")["search_id"] == "12"
    assert read("search_next", search_id=12.0, result="found")["search_id"] == "12"
    with pytest.raises(ValueError, match="thing must be a text"):
        read("where_is", thing=True)


def test_null_is_left_out():
    assert read("where_is", thing="mug", k=None, at=None) == {"thing": "mug"}
    assert read("where_is", thing="mug", k="null") == {"thing": "mug"}
    assert read("where_is", thing="null")["thing"] == "null"
    thing = {"thing": "mug", "confidence": None, "position": "null", "owner": None, "id": None}
    for seen in ([thing], json.dumps([thing])):
        assert read("observe", place=0, seen=seen)["seen"] == [Sighting("mug")]
    assert BY_NAME["observe"].read({"place": 0, "seen": [{"thing": "mug", "id": None}]})["seen"]
    for seen in ([None], [{"thing": None}], [{}]):
        with pytest.raises(ValueError, match=r"seen\[0\] must be a name, or an object"):
            read("observe", place=0, seen=seen)
    with pytest.raises(ValueError, match="arguments of observe must name seen"):
        read("observe", place=0, seen="null")


def test_what_is_as_declared_stays():
    for call in CALLS:
        for argument in call.arguments:
            for value in ("mug", 3, 0.5, [1, 2], ["mug"], None, True, {"thing": "mug"}):
                try:
                    expected = argument.rule.read(argument.name, value)
                except (ValueError, TypeError):
                    continue
                coerced = coerce(value, argument.rule.schema)
                assert argument.rule.read(argument.name, coerced) == expected


def test_a_client_of_mcp_observes_with_texts(tmp_path):
    anyio = pytest.importorskip("anyio", reason="anyio is not installed: extra serve")
    mcp = pytest.importorskip("mcp", reason="mcp is not installed: extra serve")

    async def ask(port):
        async with mcp.Client(f"http://127.0.0.1:{port}/mcp") as client:
            done = await client.call_tool(
                "observe", {"place": "2", "seen": '["soap", {"thing": "comb"}]', "coverage": "1"}
            )
            assert not done.is_error, done.content[0].text
            found = await client.call_tool("where_is", {"thing": "comb", "k": "1.0"})
            assert not found.is_error, found.content[0].text
            return found.structured_content

    _home, service = open_service(tmp_path / "home.sgm")
    with run_server(service) as running:
        answer = anyio.run(ask, running.port)
    assert [place["name"] for place in answer["places"]] == ["desk in study"]
