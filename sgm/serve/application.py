"""The HTTP side: a Starlette application whose routes are the declared calls."""

from __future__ import annotations

import asyncio
import json
import time
from collections import Counter
from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager, suppress
from difflib import get_close_matches
from functools import partial
from importlib import import_module
from threading import Lock
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qsl

from starlette.applications import Starlette
from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect, Request
from starlette.responses import HTMLResponse, JSONResponse, Response, StreamingResponse
from starlette.routing import Route
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from sgm.files import parse_json
from sgm.messages import shorten_text, tell_error
from sgm.serve.caller import Caller
from sgm.serve.calls import BY_NAME, CALLS, VERSION, Call
from sgm.serve.documents import make_openapi, make_page
from sgm.serve.feed import Feed
from sgm.serve.guard import BODY_SECONDS, MOST_BYTES, MOST_LINE, Guard, Refused

if TYPE_CHECKING:  # mcp takes as long to import as all else
    from sgm.serve.tools import MCPTools

# Upper bounds of the times that are counted, in seconds.
BOUNDS = (0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0)
_JSON = "application/json"
_KEY_HEADER = "idempotency-key"  # as other services call the key of a write
# A page that was read, by mistake or not, can do nothing and is shown nowhere else.
_HEADERS = [
    (b"x-content-type-options", b"nosniff"),
    (b"cross-origin-resource-policy", b"same-origin"),
    (b"content-security-policy", b"default-src 'none'; style-src 'unsafe-inline'"),
    (b"cache-control", b"no-store"),
]


class Metrics:
    """Counts requests by call and status, and how long they took, for Prometheus."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._requests: Counter[tuple[str, int]] = Counter()
        self._buckets: Counter[tuple[str, float]] = Counter()
        self._seconds: Counter[str] = Counter()
        self._counts: Counter[str] = Counter()

    def count(self, call: str, status: int, seconds: float) -> None:
        """Count a request to one of few calls, and the seconds until the end of its answer."""
        bound = next((bound for bound in BOUNDS if seconds <= bound), float("inf"))
        with self._lock:
            self._requests[call, status] += 1
            self._buckets[call, bound] += 1
            self._seconds[call] += seconds  # type: ignore[assignment]
            self._counts[call] += 1

    def write(self, gauges: Mapping[str, float]) -> str:
        """Return the text; `gauges` are values of now, by name."""
        lines = ["# TYPE sgm_requests_total counter"]
        with self._lock:
            for (call, status), number in sorted(self._requests.items()):
                lines.append(f'sgm_requests_total{{call="{call}",status="{status}"}} {number}')
            lines.append("# TYPE sgm_request_seconds histogram")
            for call in sorted(self._counts):
                total = 0
                for bound in (*BOUNDS, float("inf")):
                    total += self._buckets[call, bound]
                    name = "+Inf" if bound == float("inf") else f"{bound:g}"
                    lines.append(f'sgm_request_seconds_bucket{{call="{call}",le="{name}"}} {total}')
                lines.append(f'sgm_request_seconds_sum{{call="{call}"}} {self._seconds[call]:.6f}')
                lines.append(f'sgm_request_seconds_count{{call="{call}"}} {self._counts[call]}')
        values = {"sgm_process_cpu_seconds_total": time.process_time(), **gauges}
        for name, value in values.items():
            metric_type = "counter" if name.endswith("_total") else "gauge"
            lines += [f"# TYPE {name} {metric_type}", f"{name} {value:.10g}"]
        return "\n".join(lines) + "\n"


class Application:
    """Answers HTTP requests: /v1/CALL, /v1/feed, /mcp, /health, /metrics, /openapi.json, /.

    Every refusal is a status of 400 to 499 (or 503, 507: try again, disk full) and one line.
    """

    def __init__(
        self,
        caller: Caller,
        guard: Guard,
        *,
        has_tools: bool = False,
        snapshot_seconds: float = 300.0,
        body_seconds: float = BODY_SECONDS,
    ) -> None:
        """Answer requests, with `has_tools` those of /mcp; snapshots are written some time apart.

        The body of a request has to arrive in `body_seconds`.
        """
        self.caller = caller
        self.metrics = Metrics()
        self.feed: Feed | None = None
        self._guard = guard
        self._has_tools = has_tools
        self._tools: asyncio.Future[MCPTools] | None = None  # while it runs
        self._tools_asked = asyncio.Event()
        self._snapshot_seconds = snapshot_seconds
        self._body_seconds = body_seconds
        refused = (HTTPException, Refused, KeyError, ValueError, TypeError, OSError)
        self._routed = Starlette(
            routes=self._list_routes(),
            exception_handlers=dict.fromkeys(refused, _answer_error),
            lifespan=self._live,
        )
        self._routed.router.redirect_slashes = False

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request that the guard lets pass, or begin and end with the server."""
        if scope["type"] != "http":
            await self._routed(scope, receive, send)
            return
        begin, status = time.perf_counter(), 500

        async def note(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
                names = {name.lower() for name, _ in message["headers"]}  # a stream of MCP has one
                added = [header for header in _HEADERS if header[0] not in names]
                message["headers"] = [*message["headers"], *added]
            await send(message)

        path, headers = scope["path"], dict[str, str]()
        name = path.removeprefix(f"/{VERSION}/")
        try:
            client = (scope.get("client") or ("",))[0]
            for key, value in Headers(scope=scope).items():
                headers[key] = f"{headers[key]}, {value}" if key in headers else value
            self._guard.check(client, path, headers)
        except Refused as error:
            await _refuse(error)(scope, receive, note)
        else:
            await self._routed(scope, receive, note)
        finally:
            is_known = name in BY_NAME or name in ("feed", "/mcp", "/health")
            self.metrics.count(name if is_known else "other", status, time.perf_counter() - begin)

    def _list_routes(self) -> list[Route]:
        routes = [
            Route(
                f"/{VERSION}/{call.name}",
                partial(self._answer_call, call),
                methods=["POST"] if call.is_write else ["GET", "POST"],
            )
            for call in CALLS
        ]
        for path, endpoint in (
            ("/", HTMLResponse(make_page())),
            ("/health", self._answer_health),
            ("/metrics", self._answer_metrics),
            ("/openapi.json", JSONResponse(make_openapi())),
            (f"/{VERSION}/feed", self._answer_feed),
        ):
            routes.append(Route(path, endpoint, methods=["GET"]))
        for route in routes:
            assert route.methods is not None
            route.methods.discard("HEAD")  # which Starlette adds: a feed has no end
        if self._has_tools:
            tools = Route("/mcp", self._answer_tools)
            tools.methods = None  # any: MCP refuses others in its own form
            routes.append(tools)
        return routes

    @asynccontextmanager
    async def _live(self, _: Starlette) -> AsyncIterator[None]:
        self.feed = Feed(self.caller.service)
        keeping = asyncio.create_task(self.caller.keep(self._snapshot_seconds))
        offering = asyncio.create_task(self._offer_tools())
        starting = asyncio.create_task(self.caller.start_reader())
        yield
        self.feed.close()
        await starting
        await self.caller.close_reader()
        for task in (offering, keeping):
            task.cancel()
            with suppress(asyncio.CancelledError):
                await task

    async def _offer_tools(self) -> None:
        """Make the tools of MCP when the first client asks for them, until it is cancelled."""
        made = self._tools = asyncio.get_running_loop().create_future()
        await self._tools_asked.wait()
        try:
            module = await asyncio.to_thread(import_module, "sgm.serve.tools")
            tools = module.MCPTools(self.caller)
            async with tools.run():
                made.set_result(tools)
                await asyncio.Event().wait()
        except Exception as error:
            if made.done():
                raise
            made.set_exception(error)

    async def _answer_call(self, call: Call, request: Request) -> Response:
        if request.method == "GET":
            arguments = call.read(_read_query(request), is_query=True)
        else:
            arguments = call.read(await self._read_values(call, request))
        return Response(await self.caller.answer(call, arguments), media_type=_JSON)

    async def _answer_health(self, _: Request) -> Response:
        fault = self.caller.service.clock_fault
        return JSONResponse({"status": "ok", **({"clock_fault": fault} if fault else {})})

    async def _answer_metrics(self, _: Request) -> Response:
        text = self.metrics.write(self._list_gauges())
        return Response(text, media_type="text/plain; version=0.0.4; charset=utf-8")

    async def _answer_feed(self, _: Request) -> Response:
        """Tell what changes until the client or the server ends."""
        if self.feed is None or self.feed.is_full:
            raise Refused(503, "feed must have few listeners, got too many. Close some.")
        return StreamingResponse(self.feed.listen(), media_type="text/event-stream")

    async def _answer_tools(self, request: Request) -> ASGIApp:
        body = b"" if request.method == "GET" else await self._read_body(request)
        read: list[Message] = [{"type": "http.request", "body": body, "more_body": False}]
        assert self._tools is not None
        self._tools_asked.set()
        tools = await asyncio.shield(self._tools)

        async def give(receive: Receive) -> Message:
            return read.pop() if read else await receive()

        async def answer(scope: Scope, receive: Receive, send: Send) -> None:
            await tools.handle(scope, partial(give, receive), send)

        return answer

    def _list_gauges(self) -> dict[str, float]:
        memory, reader = self.caller.service.memory, self.caller.reader
        file = memory.parts.files.file
        return {
            "sgm_writes_total": self.caller.num_writes,
            "sgm_things": len(memory.descriptions),
            "sgm_places": memory.num_furniture,
            "sgm_time_step": memory.time,
            "sgm_feed_listeners": 0 if self.feed is None else self.feed.num_listeners,
            "sgm_file_bytes": 0 if file is None else file.num_bytes,
            "sgm_reader_cpu_seconds_total": 0 if reader is None else reader.processor_seconds,
        }

    async def _read_values(self, call: Call, request: Request) -> Any:
        """Read the JSON of a body, and the key that may stand in a header."""
        media_type = request.headers.get("content-type", "").partition(";")[0].strip().lower()
        if media_type != _JSON:
            got = shorten_text(media_type, 100)
            raise Refused(415, f"Content-Type must be {_JSON}, got {got!r}. Send JSON.")
        try:
            values = parse_json(await self._read_body(request))
        except ValueError as error:
            raise ValueError(
                f"body must be JSON, got {shorten_text(str(error))}. Send one object."
            ) from None
        key = request.headers.get(_KEY_HEADER)
        if key is not None and call.is_write and isinstance(values, Mapping):
            return {"key": key, **values}
        return values

    async def _read_body(self, request: Request) -> bytes:
        """Read the body of a request; raises `Refused` if it is too long, late or cut short."""
        told = request.headers.get("content-length", "0")
        if not told.isascii() or not told.isdigit():
            raise Refused(400, "Content-Length must be a number, got another value. Mend it.")
        too_long = Refused(413, f"body must have at most {MOST_BYTES} bytes, got more. Send less.")
        if len(told) > 12 or int(told) > MOST_BYTES:
            raise too_long

        async def read() -> bytes:
            body = bytearray()
            async for part in request.stream():
                body += part
                if len(body) > MOST_BYTES:
                    raise too_long
            return bytes(body)

        try:
            return await asyncio.wait_for(read(), self._body_seconds)
        except ClientDisconnect:
            raise Refused(400, "body must be whole, got a part of it. Send it again.") from None
        except asyncio.TimeoutError:
            # The rest of a body that is late is not waited for. That of one that is too long is
            # read and dropped, for HEAD_SECONDS at most: a reset would overtake the answer.
            raise Refused(
                408,
                f"body must arrive within {self._body_seconds:g} s, got a part of it. Try again.",
                {"connection": "close"},
            ) from None


def _read_query(request: Request) -> dict[str, str]:
    """Read the query, strictly: each name once, in UTF-8."""
    try:
        query = request.scope["query_string"].decode("ascii")
        pairs = parse_qsl(query, keep_blank_values=True, max_num_fields=20, errors="strict")
    except ValueError:
        raise ValueError(
            "query must be name=value pairs in UTF-8, 20 at most, got another one. See "
            "/openapi.json."
        ) from None
    if len(dict(pairs)) < len(pairs):
        raise ValueError("query must name an argument once, got one twice. Leave one out.")
    return dict(pairs)


async def _answer_error(request: Request, error: Exception) -> Response:
    """Answer what a route has raised."""
    if isinstance(error, HTTPException):
        error = _explain(request, error)
    if isinstance(error, Refused):
        return _refuse(error)
    line = tell_error(error)
    if isinstance(error, KeyError):
        return _refuse(Refused(404, line))
    if isinstance(error, OSError):
        if " must " not in line:
            line = f"disk must take the change, got {error}. Free some space, and send it again"
        return _refuse(Refused(507, line))
    return _refuse(Refused(400, str(error)))


def _explain(request: Request, error: HTTPException) -> Refused:
    """Say which path or method there is in the place of one that Starlette does not find."""
    path, method = request.scope["path"], request.method
    if error.status_code == 405:
        allowed = sorted((error.headers or {})["Allow"].split(", "))
        methods, name = " or ".join(allowed), path.removeprefix(f"/{VERSION}/")
        name = name if name in BY_NAME else path
        line = f"method of {name} must be {methods}, got {shorten_text(method, 20)}. Use {methods}."
        return Refused(405, line, {"allow": ", ".join(allowed)})
    line = f"path must be one that /openapi.json lists, got {shorten_text(path)!r}."
    near = get_close_matches(path.rpartition("/")[2], BY_NAME, 1)
    return Refused(
        404, f"{line} {f'Did you mean /{VERSION}/{near[0]}?' if near else 'Look there.'}"
    )


def _refuse(error: Refused) -> Response:
    line = " ".join(shorten_text(error.line, MOST_LINE).split())
    text = json.dumps({"error": line}, ensure_ascii=False).encode("utf-8", "backslashreplace")
    return Response(text, error.status, error.headers, _JSON)
