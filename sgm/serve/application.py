"""The HTTP side: an ASGI application whose routes are the declared calls."""

from __future__ import annotations

import asyncio
import json
import time
from collections import Counter
from collections.abc import Mapping, MutableMapping, Sequence
from contextlib import suppress
from difflib import get_close_matches
from importlib import import_module
from threading import Lock
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qsl

from sgm.files import parse_json
from sgm.messages import shorten_text
from sgm.serve.caller import Caller
from sgm.serve.calls import BY_NAME, VERSION, Call
from sgm.serve.documents import make_openapi, make_page
from sgm.serve.feed import Feed
from sgm.serve.guard import BODY_SECONDS, MOST_LINE, Guard, Receive, Refused, Scope, Send, read_body

if TYPE_CHECKING:  # mcp is an extra, and takes as long to import as all else
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


class LateTools:
    """The tools of MCP, which are loaded when the first client asks for them."""

    def __init__(self, caller: Caller) -> None:
        """Offer the calls of a caller."""
        self._caller = caller
        self._ended = asyncio.Event()
        self._running: asyncio.Task[None] | None = None
        self._made: asyncio.Future[MCPTools] = asyncio.get_running_loop().create_future()

    async def get(self) -> MCPTools:
        """Return the tools, ready to answer until `close`."""
        if self._running is None:
            self._running = asyncio.create_task(self._run())
        return await asyncio.shield(self._made)

    async def _run(self) -> None:
        try:
            module = await asyncio.to_thread(import_module, "sgm.serve.tools")
            tools = module.MCPTools(self._caller)
            async with tools.run():
                self._made.set_result(tools)
                await self._ended.wait()
        except Exception as error:
            if self._made.done():
                raise
            self._made.set_exception(error)

    async def close(self) -> None:
        """End what was begun."""
        self._ended.set()
        if self._running is not None:
            await self._running


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
        self._tools: LateTools | None = None  # while it runs
        self._snapshot_seconds = snapshot_seconds
        self._body_seconds = body_seconds
        self._openapi = json.dumps(make_openapi()).encode()
        self._page = make_page().encode()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, or begin and end with the server."""
        if scope["type"] == "lifespan":
            await self._live(receive, send)
        elif scope["type"] == "http":
            await self._answer(scope, receive, send)
        else:
            await send({"type": "websocket.close", "code": 1003})

    async def _live(self, receive: Receive, send: Send) -> None:
        await receive()
        self.feed = Feed(self.caller.service)
        if self._has_tools:
            self._tools = LateTools(self.caller)
        keeping = asyncio.create_task(self.caller.keep(self._snapshot_seconds))
        starting = asyncio.create_task(self.caller.start_reader())
        await send({"type": "lifespan.startup.complete"})
        await receive()
        self.feed.close()
        if self._tools is not None:
            await self._tools.close()
        await starting
        await self.caller.close_reader()
        keeping.cancel()
        with suppress(asyncio.CancelledError):
            await keeping
        await send({"type": "lifespan.shutdown.complete"})

    async def _answer(self, scope: Scope, receive: Receive, send: Send) -> None:
        begin, status, name = time.perf_counter(), 500, "other"

        async def count(message: MutableMapping[str, Any]) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
            await send(message)

        try:
            path: str = scope["path"]
            headers = _join_headers(scope["headers"])
            name = path.removeprefix(f"/{VERSION}/")
            if name not in BY_NAME and name not in ("feed", "/mcp", "/health"):
                name = "other"
            client = (scope.get("client") or ("",))[0]
            self._guard.check(client, path, headers)
            await self._route(scope, headers, receive, count)
        except Refused as error:
            await _send(count, error.status, _JSON, _write_error(error.line), error.headers)
        except KeyError as error:
            await _send(count, 404, _JSON, _write_error(str(error.args[0])))
        except (ValueError, TypeError) as error:
            await _send(count, 400, _JSON, _write_error(str(error)))
        except OSError as error:
            line = str(error.args[-1] if error.args else error)
            if " must " not in line:
                line = f"disk must take the change, got {error}. Free some space, and send it again"
            await _send(count, 507, _JSON, _write_error(line))
        finally:
            self.metrics.count(name, status, time.perf_counter() - begin)

    async def _route(
        self, scope: Scope, headers: Mapping[str, str], receive: Receive, send: Send
    ) -> None:
        path, method = scope["path"], scope["method"]
        call = BY_NAME.get(path.removeprefix(f"/{VERSION}/"))
        if call is not None and path.startswith(f"/{VERSION}/"):
            arguments = await self._read(call, scope, headers, receive)
            await _send(send, 200, _JSON, await self.caller.answer(call, arguments))
        elif path == "/mcp" and self._tools is not None:
            body = b"" if method == "GET" else await read_body(headers, receive, self._body_seconds)
            tools = await self._tools.get()
            await tools.handle(scope, _give(body, receive), send)
        elif path in ("/", "/health", "/metrics", "/openapi.json", f"/{VERSION}/feed"):
            if method != "GET":
                raise _refuse_method(path, method, ["GET"])
            await self._show(path, receive, send)
        else:
            line = f"path must be one that /openapi.json lists, got {shorten_text(path)!r}."
            near = get_close_matches(path.rpartition("/")[2], BY_NAME, 1)
            remedy = f"Did you mean /{VERSION}/{near[0]}?" if near else "Look there."
            raise Refused(404, f"{line} {remedy}")

    async def _show(self, path: str, receive: Receive, send: Send) -> None:
        if path == "/":
            await _send(send, 200, "text/html; charset=utf-8", self._page)
        elif path == "/health":
            fault = self.caller.service.clock_fault
            health = {"status": "ok", **({"clock_fault": fault} if fault else {})}
            await _send(send, 200, _JSON, json.dumps(health, separators=(",", ":")).encode())
        elif path == "/metrics":
            text = self.metrics.write(self._list_gauges())
            await _send(send, 200, "text/plain; version=0.0.4; charset=utf-8", text.encode())
        elif path == "/openapi.json":
            await _send(send, 200, _JSON, self._openapi)
        else:
            await self._tell(receive, send)

    async def _tell(self, receive: Receive, send: Send) -> None:
        """Tell what changes until the client or the server ends."""
        feed = self.feed
        if feed is None or feed.is_full:
            raise Refused(503, "feed must have few listeners, got too many. Close some.")
        head = [(b"content-type", b"text/event-stream; charset=utf-8"), *_HEADERS]
        await send({"type": "http.response.start", "status": 200, "headers": head})
        async for event in feed.listen(_wait_gone(receive)):
            await send({"type": "http.response.body", "body": event, "more_body": True})
        await send({"type": "http.response.body", "body": b"", "more_body": False})

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

    async def _read(
        self, call: Call, scope: Scope, headers: Mapping[str, str], receive: Receive
    ) -> dict[str, Any]:
        """Read the arguments of a call: JSON in the body, or, of what only reads, a query."""
        method = scope["method"]
        if method == "GET" and not call.is_write:
            try:
                query = scope["query_string"].decode("ascii")
                pairs = parse_qsl(query, keep_blank_values=True, max_num_fields=20, errors="strict")
            except ValueError:
                raise ValueError(
                    "query must be name=value pairs in UTF-8, 20 at most, got another one. See "
                    "/openapi.json."
                ) from None
            if len(dict(pairs)) < len(pairs):
                raise ValueError("query must name an argument once, got one twice. Leave one out.")
            return call.read(dict(pairs), is_query=True)
        if method != "POST":
            raise _refuse_method(call.name, method, ["POST"] if call.is_write else ["GET", "POST"])
        media_type = headers.get("content-type", "").partition(";")[0].strip().lower()
        if media_type != _JSON:
            raise Refused(
                415,
                f"Content-Type must be {_JSON}, got {shorten_text(media_type, 100)!r}. Send JSON.",
            )
        body = await read_body(headers, receive, self._body_seconds)
        try:
            values = parse_json(body)
        except ValueError as error:
            raise ValueError(
                f"body must be JSON, got {shorten_text(str(error))}. Send one object."
            ) from None
        key = headers.get(_KEY_HEADER)
        if key is not None and call.is_write and isinstance(values, Mapping):
            values = {"key": key, **values}
        return call.read(values)


def _refuse_method(name: str, method: str, allowed: Sequence[str]) -> Refused:
    methods = " or ".join(allowed)
    line = f"method of {name} must be {methods}, got {shorten_text(method, 20)}. Use {methods}."
    return Refused(405, line, [(b"allow", ", ".join(allowed).encode())])


async def _wait_gone(receive: Receive) -> None:
    """Return when the client has closed the connection."""
    while (await receive())["type"] != "http.disconnect":
        pass


def _give(body: bytes, receive: Receive) -> Receive:
    """Return a `receive` that gives a body that was read, then what follows."""
    given = [{"type": "http.request", "body": body, "more_body": False}]

    async def give() -> MutableMapping[str, Any]:
        return given.pop() if given else await receive()

    return give


def _join_headers(headers: Any) -> dict[str, str]:
    joined: dict[str, str] = {}
    for name, value in headers:
        key, text = name.decode("latin-1").lower(), value.decode("latin-1")
        joined[key] = f"{joined[key]}, {text}" if key in joined else text
    return joined


def _write_error(line: str) -> bytes:
    line = " ".join(shorten_text(line, MOST_LINE).split())
    text = json.dumps({"error": line}, ensure_ascii=False)
    return text.encode("utf-8", "backslashreplace")


async def _send(
    send: Send, status: int, media_type: str, body: bytes, more: Sequence[tuple[bytes, bytes]] = ()
) -> None:
    head = [(b"content-type", media_type.encode()), (b"content-length", b"%d" % len(body))]
    head += [*_HEADERS, *more]
    # A body that is late is not waited for. The rest of one that is too long is read and dropped,
    # for HEAD_SECONDS at most: a reset of the connection would overtake the answer.
    if status == 408:
        head.append((b"connection", b"close"))
    await send({"type": "http.response.start", "status": status, "headers": head})
    await send({"type": "http.response.body", "body": body})
