"""A real client of MCP: the same session as over plain HTTP, and a dialogue of an agent."""

import json
import re
import socket
import sys
from contextlib import asynccontextmanager
from datetime import datetime

import pytest

from sgm.finder.finder import Finder
from sgm.finder.map_calls import MapCalls
from sgm.finder.service import MemoryService
from sgm.memory.clock import Clock
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.policies import Bayesian
from sgm.serve.caller import Caller
from sgm.serve.calls import BY_NAME, CALLS
from sgm.serve.tool_list import TOOLS, find_call, shorten_schema

from .conftest import START, Client, open_service, run_server
from .test_calls import GOOD, fits

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
    ("expect", {"place": "desk", "at": 9000}),
    ("learnt", {}),
    ("next_looks", {}),
]
# What is refused is refused with the same line.
REFUSED = [
    ("where_is", {}),
    ("where_is", {"thing": "mug", "k": 99}),
    ("observe", {"place": 77, "seen": []}),
    ("put_down", {"thing": "mug", "place": "desk"}),
    ("forget", {}),
    ("split", {"thing": "large red mug"}),
    ("add_place", {"label": "desk"}),
]
MOST_TOOL_BYTES = 15_000  # of all that a model reads of the tools before it begins


def fill(arguments, search_id):
    return {key: search_id if value is None else value for key, value in arguments.items()}


def hide_number(answer):
    """Numbers of searches are drawn at random."""
    return {key: "x" if key == "search_id" and value else value for key, value in answer.items()}


def name_tool(name, arguments):
    """The tool of a call, and its arguments."""
    if name in vars(MapCalls):
        return "change_map", {"change": name, **arguments}
    return name, arguments


async def play(client):
    """The answers of the session, and the lines of what is refused, to a client of MCP."""
    answers, search_id = [], ""
    for name, arguments in SESSION:
        result = await client.call_tool(*name_tool(name, fill(arguments, search_id)))
        assert not result.is_error, result.content[0].text
        answer = result.structured_content
        assert json.loads(result.content[0].text) == answer
        search_id = answer.get("search_id") or search_id
        answers.append(hide_number(answer))
    lines = []
    for name, arguments in REFUSED:
        result = await client.call_tool(*name_tool(name, arguments))
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
    _home, service = open_service(tmp_path / "a.sgm")
    with run_server(service, tools=False) as running:
        client = Client(running.port)
        plain = play_http(client)
        client.close()

    async def ask(port):
        async with mcp.Client(f"http://127.0.0.1:{port}/mcp") as client:
            return await play(client)

    _home, service = open_service(tmp_path / "b.sgm")
    with run_server(service) as running:
        tools = anyio.run(ask, running.port)
    assert tools == plain
    assert all(answer["status"] in ("ok", "ambiguous", "unknown") for answer in plain[0])
    assert [answer["status"] for answer in plain[0]].count("ok") == len(SESSION) - 2


def test_an_answer_of_mcp_has_each_header_once(tmp_path):
    _home, service = open_service(tmp_path / "home.sgm")
    with (
        run_server(service) as running,
        socket.create_connection(("127.0.0.1", running.port), timeout=60) as client,
    ):
        lines = (
            "GET /mcp HTTP/1.1",
            f"Host: 127.0.0.1:{running.port}",
            "Accept: text/event-stream",
        )
        client.sendall("\r\n".join((*lines, "", "")).encode())
        head = b""
        while b"\r\n\r\n" not in head:
            head += client.recv(4096)
    names = [line.partition(b":")[0].lower() for line in head.split(b"\r\n\r\n")[0].split(b"\r\n")]
    assert names[0].startswith(b"http/1.1 200")
    assert len(names) == len({*names})
    assert b"x-content-type-options" in names


def test_the_tools_make_the_declared_calls(tmp_path):
    async def ask(port):
        async with mcp.Client(f"http://127.0.0.1:{port}/mcp") as client:
            return (await client.list_tools()).tools, await client.call_tool("no_such_tool", {})

    _home, service = open_service(tmp_path / "home.sgm")
    with run_server(service) as running:
        tools, refused = anyio.run(ask, running.port)
        # The guard stands before the tools, too.
        client = Client(running.port)
        for headers in ({"Origin": "http://evil.example"}, {"Host": "evil.example"}):
            assert client.send("POST", "/mcp", "{}", headers).status == 403
        assert client.send("POST", "/mcp", "x" * 300_000).status == 413
        for body in ("", "{", "[]", '{"jsonrpc":"2.0"}', "\0"):
            assert 400 <= client.send("POST", "/mcp", body).status < 500
        # What MCP has no method for it refuses itself, as its clients read it.
        for method in ("PUT", "PATCH", "OPTIONS", "HEAD"):
            answer = client.send(method, "/mcp")
            assert (answer.status, answer.headers["Allow"]) == (405, "GET, POST, DELETE")
            if method != "HEAD":
                assert json.loads(answer.text)["error"]["message"] == "Method Not Allowed"
        client.close()
    assert [tool.name for tool in tools] == [tool.name for tool in TOOLS]
    for shown, tool in zip(tools, TOOLS, strict=True):
        assert (shown.description, shown.input_schema) == (tool.about, tool.schema)
        assert shown.output_schema is None
        assert shown.annotations.read_only_hint == (not tool.is_write)
    # With spaces, too, as some clients give them to the model.
    written = [tool.model_dump(mode="json", by_alias=True, exclude_none=True) for tool in tools]
    assert len(json.dumps(written)) <= MOST_TOOL_BYTES
    assert refused.is_error
    assert "tool must be one of ask, where_is" in refused.content[0].text


def test_every_call_has_a_tool_of_one_sentence_that_allows_its_arguments():
    tools = {tool.name: tool for tool in TOOLS}
    assert len(tools) == len(TOOLS)
    for call in CALLS:
        name, arguments = name_tool(call.name, GOOD[call.name])
        tool = tools[name]
        assert tool.is_write == call.is_write
        assert tool.about.endswith(".")
        assert ". " not in tool.about
        assert fits(shorten_schema(call.make_input_schema()), GOOD[call.name])
        assert fits(tool.schema, arguments) or name == "change_map"
        assert arguments.keys() <= tool.schema["properties"].keys()
        found, given = find_call(name, arguments)
        assert found == call
        assert found.read(given) == call.read(GOOD[call.name])
        assert find_call(call.name, GOOD[call.name]) == (call, GOOD[call.name])
    (changes,) = [tool for tool in TOOLS if "change" in tool.schema["properties"]]
    assert set(changes.schema["properties"]["change"]["enum"]) == {
        call.name for call in CALLS if call.name in vars(MapCalls)
    }


@pytest.mark.parametrize("change", [None, "", "observe", 7, [], "add_rooms"])
def test_another_change_of_the_map_is_refused(change):
    with pytest.raises(ValueError, match="change must be one of add_room, rename_room") as raised:
        find_call("change_map", {"change": change, "label": "bath"})
    assert ("got none. " in str(raised.value)) == (change is None)


def test_null_is_no_argument_of_another_change():
    given = {"change": "add_room", "label": "bath", "place": None, "polygon": None}
    call, arguments = find_call("change_map", given)
    assert call.read(arguments, is_coerced=True) == {"label": "bath"}
    with pytest.raises(ValueError, match="arguments of add_room must be some of label"):
        call.read(find_call("change_map", {**given, "place": "desk"})[1])


@pytest.mark.slow
def test_a_client_reads_the_home_a_thing_and_the_changes_of_today(tmp_path):
    async def ask(port):
        async with mcp.Client(f"http://127.0.0.1:{port}/mcp") as client:

            async def read(address):
                (contents,) = (await client.read_resource(address)).contents
                assert (contents.uri, contents.mime_type) == (address, "application/json")
                return json.loads(contents.text)

            listed = (await client.list_resources()).resources
            templates = (await client.list_resource_templates()).resource_templates
            assert [one.uri for one in listed] == ["sgm://home", "sgm://today"]
            assert [one.uri_template for one in templates] == ["sgm://thing/{name}"]
            assert all(one.description and one.mime_type for one in (*listed, *templates))
            lines = []
            for address in ("sgm://attic", "sgm://thing/", "file:///etc/passwd"):
                with pytest.raises(mcp.MCPError) as caught:
                    await client.read_resource(address)
                lines.append(caught.value.message)
            names = "large%20red%20mug", "flux capacitor"
            things = [await read(f"sgm://thing/{name}") for name in names]
            return await read("sgm://home"), await read("sgm://today"), things, lines

    _home, service = open_service(tmp_path / "home.sgm")
    with run_server(service) as running:
        plain = Client(running.port)
        places, things = plain.call("list_places", k=50), plain.call("list_things", k=50)
        changes = plain.call("changes", since=START.date().isoformat(), k=50)
        mug = plain.call("where_is", thing="large red mug")
        history = plain.call("history", thing="large red mug")
        plain.close()
        read_home, today, (read_mug, unknown), lines = anyio.run(ask, running.port)
    assert read_home == {"places": places, "things": things}
    assert len(places["rows"]) == 3
    assert today == changes
    assert today["rows"]
    assert read_mug == {"where_is": mug, "history": history}
    assert unknown["where_is"]["status"] == "unknown"  # no error: it says what to ask
    assert all("\n" not in line and len(line) < 500 for line in lines)
    assert "resource must be one of sgm://home, sgm://today, sgm://thing/{name}, got" in lines[0]


def test_the_changes_of_today_begin_at_midnight(tmp_path):
    """What was moved yesterday evening, and this morning."""
    resources = pytest.importorskip("sgm.serve.resources")
    memory = SceneGraphMemory(clock=Clock(datetime(2026, 11, 15, 20, 0), 3600))
    desk = memory.add_furniture("desk", memory.add_room("study"))
    memory.observe(desk, [Sighting("pen")])
    memory.step(11)
    memory.observe(desk, [Sighting("pen"), Sighting("mug")])

    async def read():
        caller = Caller(MemoryService(memory, Finder(Bayesian()), lambda: START))
        return json.loads(await resources.read_resource(caller, resources.TODAY))

    assert [row["thing"] for row in anyio.run(read)["rows"]] == ["mug"]


def test_a_client_is_given_prompts(tmp_path):
    __home, service = open_service(tmp_path / "home.sgm")
    tools = pytest.importorskip("sgm.serve.tools", reason="mcp is not installed")

    async def ask():
        async with mcp.Client(tools.MCPTools(Caller(service))._server) as client:

            async def get(name, arguments=None):
                (message,) = (await client.get_prompt(name, arguments)).messages
                assert message.role == "user"
                return message.content.text

            prompts = (await client.list_prompts()).prompts
            needed = {one.name: [(a.name, a.required) for a in one.arguments] for one in prompts}
            assert needed == {"tidy_up": [("room", False)], "where_is": [("thing", True)]}
            assert "the whole home" in await get("tidy_up")
            assert "Tidy up: the {kitchen}." in await get("tidy_up", {"room": " the {kitchen} "})
            assert "Where is this: my keys?" in await get("where_is", {"thing": "my keys"})
            named = set()
            for name in ("tidy_up", "where_is"):
                named |= {tool.name for tool in TOOLS} & set(
                    re.findall(
                        r"\w+", await get(name, {"thing": "mug"} if name == "where_is" else {})
                    )
                )
            assert named >= {"where_is", "search_start", "search_next", "picked_up", "put_down"}
            for name, arguments, line in (
                ("where_is", {}, "thing must be a text of 1 to 200 characters, got none"),
                ("where_is", {"thing": "x" * 201}, "thing must be a text"),
                ("where_is", {"room": "x"}, "arguments of prompt where_is must be thing"),
                ("cook", {}, "prompt must be one of tidy_up, where_is, got 'cook'"),
            ):
                with pytest.raises(mcp.MCPError, match=line):
                    await client.get_prompt(name, arguments)

    anyio.run(ask)


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
    kept = SceneGraphMemory.open(path, aliases=names)
    service = MemoryService(kept, Finder(Bayesian()), accept_jump=True)
    caller = Caller(service)
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
    assert SceneGraphMemory.load(home).last_seen("scissors").by == "robot"
