"""A line of a refusal names what a client of HTTP and of MCP has, and nothing of Python."""

import json
import re

import pytest

from sgm.finder.finder import Finder
from sgm.finder.service import MemoryService
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.policies import Bayesian
from sgm.serve.calls import CALLS

from .conftest import Client, run_server
from .test_calls import GOOD

BAD = [
    None, 77, -1, 10**30, 1.5, True, "", "zzz", "the zzz in the attic", "x" * 500, "2999-01-01",
    "2001-01-01", "2026-11-16T18:30+01:00", [], ["zzz"], [1e300, 0], {}, {"thing": 3},
]  # fmt: skip
# Words that may name a function, a method or a class; and paths of HTTP.
NAMES = re.compile(
    r"[A-Za-z]\w*[._]\w+|\b\w+(?=\()|\b[A-Z][a-z]+[A-Z]\w+|(?<![\w<])/[a-z]\w+|\bdatetime\b|keyword"
)


def list_words(schema):
    """All words that a schema has: names of arguments and of their parts, and values."""
    found = set()
    if isinstance(schema, dict):
        found |= {*schema.get("properties", {}), *map(str, schema.get("enum", ()))}
        schema = list(schema.values())
    if isinstance(schema, list):
        found |= {word for part in schema for word in list_words(part)}
    return found


def list_refusals(client, names=tuple(GOOD)):
    """What a server says to arguments that are wrong one by one, or left out."""
    lines = set()
    for name in names:
        good = GOOD[name]
        given = [{**good, key: bad} for key in good for bad in BAD]
        given += [{other: good[other] for other in good if other != key} for key in good]
        for number, arguments in enumerate((*given, {**good, "zzz": 1})):
            if arguments.get("key") == good.get("key") is not None:  # that of another write
                arguments["key"] = f"{name} {number}"
            answer = client.send("POST", f"/v1/{name}", json.dumps(arguments))
            assert answer.status < 500, (name, arguments)
            if answer.status >= 400:
                lines.add(json.loads(answer.text)["error"])
    return lines


def find_strange(lines):
    """Lines with words that no client of a server has, and these words."""
    known = {call.name for call in CALLS}
    for call in CALLS:
        known |= list_words(call.make_input_schema())
    return {line: words for line in lines if (words := {*NAMES.findall(line)} - known)}


@pytest.mark.slow
def test_a_refusal_names_calls_and_arguments_alone(served):
    lines = list_refusals(served.client)
    assert len(lines) > 500  # those of MCP are the same: test_tools.py
    assert find_strange(lines) == {}


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:looks must be few in a time step")
def test_so_does_that_of_a_home_without_a_clock_and_positions(tmp_path):
    service = MemoryService(
        SceneGraphMemory.open(tmp_path / "home.sgm", is_new=True), Finder(Bayesian())
    )
    for room, place in (("kitchen", "counter top"), ("study", "desk")):
        service.add_room(room)
        service.add_place(place, room)
    service.observe("desk", [Sighting("mug"), Sighting("scissors"), Sighting("paper knife")])
    with run_server(service) as running:
        client = Client(running.port)
        lines = list_refusals(client, ("where_is", "search_start", "changes", "observe"))
        client.close()
    assert any(line.startswith("memory must have a clock") for line in lines)
    assert any(line.startswith("since must be a time step or") for line in lines)
    assert find_strange(lines) == {}
