"""The calls as tools of MCP, over HTTP beside the other routes, or over standard streams."""

from __future__ import annotations

import json
from contextlib import AbstractAsyncContextManager
from typing import Any

import mcp.types as types
from mcp.server.lowlevel import Server
from mcp.server.stdio import stdio_server
from mcp.server.streamable_http_manager import StreamableHTTPSessionManager

from sgm.finder.answers import to_json
from sgm.messages import shorten_text
from sgm.serve.caller import Caller
from sgm.serve.calls import BY_NAME, CALLS, VERSION
from sgm.serve.guard import MOST_BYTES, MOST_LINE, Receive, Refused, Scope, Send

INSTRUCTIONS = (
    "A memory of what was seen in a home. Ask where_is before you search. For a sentence of the "
    "user as it was said, call ask. When a status is "
    "ambiguous, ask the user what `ask` says, and call again with one of the candidates. When it "
    "is unknown, try a candidate or another name, or look through list_things. After every look "
    "at a place call observe with everything that was seen there."
)


class MCPTools:
    """A server of MCP whose tools are the declared calls.

    A tool answers with the JSON of the call, as text and as structured content. What HTTP refuses
    with a status is here the same line, marked as an error. Arguments may be of a near type, as
    language models send them (`coerce`).
    """

    def __init__(self, caller: Caller) -> None:
        """Offer the calls that a client makes."""
        self._caller = caller
        self._server: Any = Server(
            "scene-graph-memory",
            version=VERSION,
            instructions=INSTRUCTIONS,
            on_list_tools=self._list_tools,
            on_call_tool=self._call_tool,
        )
        # Without sessions: a search has its own number, and nothing else is kept between calls.
        self._sessions = StreamableHTTPSessionManager(
            self._server, json_response=True, stateless=True, max_request_body_size=MOST_BYTES
        )

    def run(self) -> AbstractAsyncContextManager[None]:
        """Be ready for HTTP until the end of the context."""
        return self._sessions.run()

    async def handle(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request."""
        await self._sessions.handle_request(scope, receive, send)

    async def run_stdio(self) -> None:
        """Answer over standard input and output until the input ends."""
        async with stdio_server() as (read, write):
            await self._server.run(read, write, self._server.create_initialization_options())

    async def _list_tools(self, context: Any, parameters: Any) -> types.ListToolsResult:
        return types.ListToolsResult(
            tools=[
                types.Tool(
                    name=call.name,
                    description=call.about,
                    input_schema=call.make_input_schema(),
                    output_schema=call.make_output_schema(),
                    annotations=types.ToolAnnotations(
                        read_only_hint=not call.is_write, open_world_hint=False
                    ),
                )
                for call in CALLS
            ]
        )

    async def _call_tool(self, context: Any, parameters: Any) -> types.CallToolResult:
        try:
            call = BY_NAME.get(parameters.name)
            if call is None:
                raise ValueError(
                    f"tool must be one of {', '.join(BY_NAME)}, got "
                    f"{shorten_text(parameters.name)!r}. List the tools."
                )
            arguments = call.read(parameters.arguments or {}, is_coerced=True)
            answer = to_json(await self._caller.call(call, arguments))
        except KeyError as error:
            return _refuse(str(error.args[0]))
        except (ValueError, TypeError, OSError, Refused) as error:
            return _refuse(str(error))
        text = json.dumps(answer, ensure_ascii=False, separators=(",", ":"))
        content = types.TextContent(type="text", text=text)
        return types.CallToolResult(content=[content], structured_content=answer)


def _refuse(line: str) -> types.CallToolResult:
    line = " ".join(shorten_text(line, MOST_LINE).split())
    line = line.encode("utf-8", "backslashreplace").decode()
    return types.CallToolResult(content=[types.TextContent(type="text", text=line)], is_error=True)
