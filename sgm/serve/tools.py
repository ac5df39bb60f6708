"""Tools, resources and prompts of MCP, over HTTP beside other routes, or over standard streams."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import AbstractAsyncContextManager, contextmanager
from importlib.metadata import version
from typing import Any

import mcp.types as types
from mcp import MCPError
from mcp.server.lowlevel import Server
from mcp.server.stdio import stdio_server
from mcp.server.streamable_http_manager import StreamableHTTPSessionManager
from starlette.types import Receive, Scope, Send

from sgm.finder.answers import to_json
from sgm.messages import shorten_text
from sgm.serve.caller import Caller
from sgm.serve.guard import MOST_BYTES, MOST_LINE, Refused
from sgm.serve.prompts import PROMPTS
from sgm.serve.resources import RESOURCES, read_resource
from sgm.serve.tool_list import TOOLS, find_call

INSTRUCTIONS = (
    "A memory of what was seen in a home. Ask where_is before you search. For a sentence of the "
    "user as it was said, call ask. When a status is "
    "ambiguous, ask the user what `ask` says, and call again with one of the candidates. When it "
    "is unknown, try a candidate or another name, or look through list_things. After every look "
    "at a place call observe with everything that was seen there. A call that writes is made once "
    "if it is sent again with the same key, any text."
)
_REFUSALS = (KeyError, ValueError, TypeError, OSError, Refused)
_JSON = "application/json"


class MCPTools:
    """A server of MCP whose tools make the declared calls, with resources and prompts.

    A tool answers with the JSON of the call, as text and as structured content. What HTTP refuses
    with a status is here the same line, marked as an error. Arguments may be of a near type, as
    language models send them (`coerce`).
    """

    def __init__(self, caller: Caller) -> None:
        """Offer the calls that a client makes."""
        self._caller = caller
        self._server: Any = Server(
            "scene-graph-memory",
            version=version("scene-graph-memory-core"),
            instructions=INSTRUCTIONS,
            on_list_tools=_list_tools,
            on_call_tool=self._call_tool,
            on_list_resources=_list_resources,
            on_list_resource_templates=_list_resource_templates,
            on_read_resource=self._read_resource,
            on_list_prompts=_list_prompts,
            on_get_prompt=_get_prompt,
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

    async def _call_tool(self, context: Any, parameters: Any) -> types.CallToolResult:
        try:
            call, given = find_call(parameters.name, parameters.arguments or {})
            arguments = call.read(given, is_coerced=True)
            answer = to_json(await self._caller.call(call, arguments))
        except _REFUSALS as error:
            content = types.TextContent(type="text", text=_write_line(error))
            return types.CallToolResult(content=[content], is_error=True)
        text = json.dumps(answer, ensure_ascii=False, separators=(",", ":"))
        content = types.TextContent(type="text", text=text)
        return types.CallToolResult(content=[content], structured_content=answer)

    async def _read_resource(self, context: Any, parameters: Any) -> types.ReadResourceResult:
        with _refuse():
            text = await read_resource(self._caller, parameters.uri)
        contents = types.TextResourceContents(uri=parameters.uri, mime_type=_JSON, text=text)
        return types.ReadResourceResult(contents=[contents])


async def _list_tools(context: Any, parameters: Any) -> types.ListToolsResult:
    return types.ListToolsResult(
        tools=[
            types.Tool(
                name=tool.name,
                description=tool.about,
                input_schema=dict(tool.schema),
                annotations=types.ToolAnnotations(
                    read_only_hint=not tool.is_write, open_world_hint=False
                ),
            )
            for tool in TOOLS
        ]
    )


async def _list_resources(context: Any, parameters: Any) -> types.ListResourcesResult:
    return types.ListResourcesResult(
        resources=[
            types.Resource(uri=address, name=name, description=about, mime_type=_JSON)
            for address, (name, about) in RESOURCES.items()
            if "{" not in address
        ]
    )


async def _list_resource_templates(
    context: Any, parameters: Any
) -> types.ListResourceTemplatesResult:
    return types.ListResourceTemplatesResult(
        resource_templates=[
            types.ResourceTemplate(
                uri_template=address, name=name, description=about, mime_type=_JSON
            )
            for address, (name, about) in RESOURCES.items()
            if "{" in address
        ]
    )


async def _list_prompts(context: Any, parameters: Any) -> types.ListPromptsResult:
    return types.ListPromptsResult(
        prompts=[
            types.Prompt(
                name=prompt.name,
                description=prompt.about,
                arguments=[
                    types.PromptArgument(
                        name=prompt.argument,
                        description=prompt.about_argument,
                        required=prompt.default is None,
                    )
                ],
            )
            for prompt in PROMPTS.values()
        ]
    )


async def _get_prompt(context: Any, parameters: Any) -> types.GetPromptResult:
    with _refuse():
        if parameters.name not in PROMPTS:
            raise ValueError(
                f"prompt must be one of {', '.join(PROMPTS)}, got "
                f"{shorten_text(parameters.name)!r}. List the prompts."
            )
        prompt = PROMPTS[parameters.name]
        text = prompt.write(parameters.arguments or {})
    message = types.PromptMessage(role="user", content=types.TextContent(type="text", text=text))
    return types.GetPromptResult(description=prompt.about, messages=[message])


@contextmanager
def _refuse() -> Iterator[None]:
    """Refuse with an error of the protocol what HTTP refuses with a status."""
    try:
        yield
    except _REFUSALS as error:
        raise MCPError(types.INVALID_PARAMS, _write_line(error)) from None


def _write_line(error: Exception) -> str:
    text = str(error.args[0] if isinstance(error, KeyError) else error)
    line = " ".join(shorten_text(text, MOST_LINE).split())
    return line.encode("utf-8", "backslashreplace").decode()
