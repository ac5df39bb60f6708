"""A real client of MCP: the same session as over plain HTTP, and a dialogue of an agent."""

import json
import sys
from contextlib import asynccontextmanager

import pytest

from sgm.finder.finder import Finder
from sgm.finder.service import MemoryService
from sgm.memory.clock import Clock
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.policies import Bayesian
from sgm.replay.kept_home import KeptHome
from sgm.serve.caller import Caller
from sgm.serve.calls import BY_NAME, CALLS

from .conftest import START, Client, open_service, run_server

anyio = pytest.importorskip("anyio", reason="anyio is not installed: extra serve")
mcp = pytest.importorskip("mcp", reason="mcp is not installed: extra serve")

# A session that uses every call; None stands for the number of the search that was started.
SESSION = [
    ("ask", {"text": "where is the mug?"}),
    ("where_is", {"thing": "mug"}),
    ("where_is", {"thing": "glasses", "k": 1}),
    ("where_is", {"thing": "flux capacitor", "at": "2026-11-16T18:30"}),
    ("add_room", {"label": "bath"}),
    ("add_place", {"label": "sink", "room": "bath", "position": [2, 2]}),
    ("observe", {"place": "the sink", "seen": ["soap", {"thing": "comb", "confidence": 0.7}]}),
    ("search_start", {"thing": "scissors", "from": [0, 0], "budget": 50}),
    ("search_next", {"search_id": None, "result": "not_found", "coverage": 0.5}),
    ("search_next", {"search_id": None, "result": "found"}),
    ("note_moved", {"thing": "keys", "place": "desk", "by": "anna"}),
    ("picked_up", {"thing": "scissors"}),
    ("put_down", {"thing": "scissors", "place": "counter top"}),
    ("forget", {"thing": "soap", "by": "anna"}),
    ("rename", {"thing": "keys", "name": "car keys", "by": "anna"}),
    ("merge", {"thing": "scissors", "other": "paper knife"}),
    ("split", {"thing": "paper knife"}),
    ("rename_room", {"room": "bath", "label": "bathroom"}),
    ("move_place", {"place": "sink", "center": [2, 3, 0.5], "size": [0.5, 0.5, 1.0]}),
    ("name_place", {"place": "sink", "label": "bathtub"}),
    ("set_map", {"rooms": ["hall"], "furniture": [{"name": "bench", "room": "hall"}]}),
    ("merge_places", {"place": "bathtub", "other": "bench"}),
    ("remove_place", {"place": "bathtub"}),
    ("remove_room", {"room": "hall"}),
    ("transform_map", {"shift": [1, 0], "map_id": "new"}),
    ("add_place", {"label": "sink", "room": "bathroom", "key": "a sink"}),
    ("add_place", {"label": "sink", "room": "bathroom", "key": "a sink"}),
    ("forget", {"place": "sink"}),
    ("list_places", {"room": "kitchen"}),
    ("list_things", {"k": 3}),
    ("history", {"thing": "scissors"}),
    ("changes", {"since": 0}),
]
# What is refused is refused with the same line.
REFUSED = [
    ("where_is", {}),
    ("where_is", {"thing": "mug", "k": 99}),
    ("observe", {"place": 77, "seen": []}),
    ("put_down", {"thing": "mug", "place": "desk"}),
    ("forget", {}),
    ("split", {"thing": "large red mug"}),
]


def fill(arguments, search_id):
    return {key: search_id if value is None else value for key, value in arguments.items()}


def hide_number(answer):
    """Numbers of searches are drawn at random."""
    return {key: "x" if key == "search_id" and value else value for key, value in answer.items()}


async def play(client):
    """The answers of the session, and the lines of what is refused, to a client of MCP."""
    answers, search_id = [], ""
    for name, arguments in SESSION:
        result = await client.call_tool(name, fill(arguments, search_id))
        assert not result.is_error, result.content[0].text
        answer = result.structured_content
        assert json.loads(result.content[0].text) == answer
        search_id = answer.get("search_id") or search_id
        answers.append(hide_number(answer))
    lines = []
    for name, arguments in REFUSED:
        result = await client.call_tool(name, arguments)
        assert result.is_error
        lines.append(result.content[0].text)
    return answers, lines


def play_http(client):
    answers, search_id = [], ""
    for name, arguments in SESSION:
        answer = client.call(name, **fill(arguments, search_id))
        search_id = answer.get("search_id") or search_id
        answers.append(hide_number(answer))
    lines = [
        json.loads(client.send("POST", f"/v1/{name}", json.dumps(arguments)).text)["error"]
        for name, arguments in REFUSED
    ]
    return answers, lines


def test_a_session_uses_every_call():
    assert {name for name, _ in SESSION} == set(BY_NAME)


@pytest.mark.slow
def test_mcp_and_http_do_the_same_session_with_equal_answers(tmp_path):
    home, service = open_service(tmp_path / "a.sgm")
    with run_server(service, home, tools=False) as running:
        client = Client(running.port)
        plain = play_http(client)
        client.close()

    async def ask(port):
        async with mcp.Client(f"http://127.0.0.1:{port}/mcp") as client:
            return await play(client)

    home, service = open_service(tmp_path / "b.sgm")
    with run_server(service, home) as running:
        tools = anyio.run(ask, running.port)
    assert tools == plain
    assert all(answer["status"] in ("ok", "ambiguous", "unknown") for answer in plain[0])
    assert [answer["status"] for answer in plain[0]].count("ok") == len(SESSION) - 2


def test_the_tools_are_the_declared_calls(tmp_path):
    async def ask(port):
        async with mcp.Client(f"http://127.0.0.1:{port}/mcp") as client:
            return (await client.list_tools()).tools, await client.call_tool("no_such_tool", {})

    home, service = open_service(tmp_path / "home.sgm")
    with run_server(service, home) as running:
        tools, refused = anyio.run(ask, running.port)
        # The guard stands before the tools, too.
        client = Client(running.port)
        for headers in ({"Origin": "http://evil.example"}, {"Host": "evil.example"}):
            assert client.send("POST", "/mcp", "{}", headers).status == 403
        assert client.send("POST", "/mcp", "x" * 300_000).status == 413
        for body in ("", "{", "[]", '{"jsonrpc":"2.0"}', "\0"):
            assert 400 <= client.send("POST", "/mcp", body).status < 500
        client.close()
    for tool, call in zip(tools, CALLS, strict=True):
        assert (tool.name, tool.description) == (call.name, call.about)
        assert tool.input_schema == call.make_input_schema()
        assert tool.output_schema == call.make_output_schema()
        assert tool.annotations.read_only_hint == (not call.is_write)
    assert refused.is_error
    assert "tool must be one of ask, where_is" in refused.content[0].text


@asynccontextmanager
async def start_stdio(path, names):
    """A client of a server that is a process of its own, over standard streams."""
    arguments = ["-m", "sgm.serve", str(path), "--stdio", "--finder", "bayesian"]
    arguments += ["--aliases", str(names), "--accept_jump"]
    parameters = mcp.StdioServerParameters(command=sys.executable, args=arguments)
    async with mcp.Client(parameters) as client:
        yield client


def make_home(path):
    """A home to talk about, and a table of other names."""
    memory = SceneGraphMemory(clock=Clock(START, 10**7))
    kitchen, study = memory.add_room("kitchen"), memory.add_room("study")
    memory.add_furniture("drawer", kitchen)
    desk = memory.add_furniture("desk", study)
    memory.observe(desk, [Sighting("scissors"), Sighting("paper knife"), Sighting("stapler")])
    memory.save(path)
    names = path.with_name("names.csv")
    names.write_text(
        "name,kind,aliases\nscissors,,thing to cut paper\npaper knife,,thing to cut paper\n"
    )
    return names


@asynccontextmanager
async def connect(path, names):
    """A client of a server in this process."""
    kept = KeptHome.open(path, aliases=names)
    service = MemoryService(kept.memory, Finder(Bayesian()), accept_jump=True)
    caller = Caller(service, kept)
    tools = pytest.importorskip("sgm.serve.tools", reason="mcp is not installed")
    async with mcp.Client(tools.MCPTools(caller)._server) as client:
        yield client
    caller.close()


@pytest.mark.parametrize("start", [connect, pytest.param(start_stdio, marks=pytest.mark.slow)])
def test_an_agent_asks_back_searches_and_puts_down(tmp_path, start):
    """The dialogue of docs/agents.md."""
    home = tmp_path / "home.sgm"
    names = make_home(home)

    async def talk():
        async with start(home, names) as client:

            async def call(name, **arguments):
                result = await client.call_tool(name, arguments)
                assert not result.is_error, result.content[0].text
                return result.structured_content

            # User: where is the thing to cut paper?
            asked = await call("where_is", thing="the thing to cut paper")
            assert asked["status"] == "ambiguous"
            assert asked["ask"] == "Do you mean the scissors or the paper knife?"
            # Agent asks that; user: the scissors. Bring them to me.
            thing = asked["candidates"][0]
            found = await call("where_is", thing=thing)
            assert found["status"] == "ok"
            begun = await call("search_start", thing=thing)
            assert begun["next"]["name"] == "desk in study"
            # They are not there: somebody has put them into the drawer.
            begun = await call(
                "search_next",
                search_id=begun["search_id"],
                result="seen",
                seen=["paper knife", "stapler"],
            )
            while begun["next"]["name"] != "drawer in kitchen":
                begun = await call("search_next", search_id=begun["search_id"], result="not_found")
            begun = await call("search_next", search_id=begun["search_id"], result="found")
            assert begun["is_found"]
            await call("picked_up", thing=thing)
            carried = await call("where_is", thing=thing)
            assert carried["with_robot"] > 0.9
            # User: put them on the desk.
            put = await call("put_down", thing=thing, place="the desk")
            assert put["said"] == "the robot put scissors at desk in study"
            again = await call("where_is", thing=thing)
            assert again["places"][0]["name"] == "desk in study"
            assert again["places"][0]["why"].startswith("put here by the robot")
            assert again["last_seen"]["by"] == "robot"
            # User: and the flux capacitor? There is none; nothing is made up.
            unknown = await call("where_is", thing="flux capacitor")
            assert unknown["status"] == "unknown"
            assert "list_things" in unknown["ask"]
            things = await call("list_things")
            assert {row["thing"] for row in things["rows"]} == {
                "scissors",
                "paper knife",
                "stapler",
            }

    anyio.run(talk)
    kept = KeptHome.open(home)
    assert kept.memory.last_seen("scissors").by == "robot"
