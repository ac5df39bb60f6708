"""Serves the page to this machine alone; every value of a request is checked before it is used."""

from __future__ import annotations

import json
import sys
import webbrowser
from collections.abc import Callable, Iterable, Mapping, Sequence
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Thread
from typing import Any

from nep.view.answers import Desk
from nep.view.document import make_document, make_policy
from nep.view.page_state import Judges, Stage
from sgm.files import parse_json
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.messages import shorten, shorten_text
from sgm.schema import MAX_TIME
from sgm.serve.argument_rules import TEXT, make_choice_rule, make_whole_rule
from sgm.serve.guard import Guard, Refused
from simulator.story.past_memory import StillMemory

MOST_BYTES = 10_000  # of a request; the page sends a hundred

_NUMBER = make_whole_rule(0, MAX_TIME)

# What each call of the page takes, and what does it.
_STEP = ("step",)
CALLS: Mapping[str, tuple[tuple[str, ...], Callable[..., Any]]] = {
    "watch": ((), Desk.watch),
    "names": (("since",), Desk.list_names),
    "plan": (_STEP, Desk.tell_plan),
    "state": (_STEP, Desk.tell_state),
    "changes": (_STEP, Desk.tell_changes),
    "answer": (("step", "words", "judge"), Desk.answer),
    "trace": (("words", "judge"), Desk.trace),
    "furniture": (("step", "furniture"), Desk.tell_furniture),
}
HOST = "127.0.0.1"
DEFAULT_PORT = 8050
_MOST_PAGES = 50  # beside each other on one machine
_REQUEST_SECONDS = 30.0  # in which a request has to arrive
_PLAIN = "text/plain; charset=utf-8"
_HEADERS = (
    ("X-Content-Type-Options", "nosniff"),
    ("Cross-Origin-Resource-Policy", "same-origin"),
    ("Cache-Control", "no-store"),
)


def read_request(content: bytes, desk: Desk) -> tuple[str, dict[str, Any]]:
    """Return the call of a request and its arguments by name: a JSON object of all of them alone.

    Raises:
        ValueError: if a value breaks its rule.
    """
    if len(content) > MOST_BYTES:
        raise _refuse("request", f"have at most {MOST_BYTES} bytes", len(content))
    try:
        body = parse_json(content)
    except ValueError as error:
        raise ValueError(
            f"request must be JSON, got {shorten_text(str(error))}. Reload the page."
        ) from None
    if not isinstance(body, dict):
        raise _refuse("request", "be an object", body)
    call = body.get("call")
    if not isinstance(call, str) or call not in CALLS:
        raise _refuse("call", f"be one of {', '.join(CALLS)}", call)
    names = CALLS[call][0]
    if body.keys() != {"call", *names}:
        raise _refuse(f"arguments of {call}", f"be {', '.join(names) or 'none'}", sorted(body))
    rules = {"words": TEXT, "judge": make_choice_rule(*desk.judges.names)}
    for name in names:
        rule = rules.get(name, _NUMBER)
        body[name] = rule.convert(name, given := body[name])
        if body[name] is None:
            raise _refuse(name, rule.must, given)
    return call, {name: body[name] for name in names}


def _refuse(noun: str, rule: str, value: object) -> ValueError:
    got = shorten_text(shorten(value).encode("utf-8", "backslashreplace").decode())
    return ValueError(f"{noun} must {rule}, got {got}. Reload the page.")


def show(
    memory: SceneGraphMemory | Callable[[], SceneGraphMemory],
    title: str = "robot",
    port: int = DEFAULT_PORT,
    opens_browser: bool = True,
    doors: Iterable[Sequence[float]] = (),
) -> str:
    """Open a page on the memory of a running program; it follows what the memory learns.

    The page is served by a thread of the program and ends with it.

    Example:
        >>> show(memory)
        'http://127.0.0.1:8050/'

    Args:
        memory: the memory that the program goes on to change, or a function that returns it.
        title: of the page.
        port: of this machine; the next free one is taken.
        opens_browser: whether to open the page in the browser.
        doors: x, y of the doors between rooms in metres; the way of a search leads through them.

    Returns:
        The address of the page.

    Raises:
        ValueError: if a door is no two numbers.
        OSError: if no port is free.
    """
    get = memory if callable(memory) else lambda: memory

    def get_state() -> tuple[int, ...]:
        batch = get().batch
        looks = int(batch.furniture_num_observed.sum())
        return (id(batch), batch.time, looks, batch.num_furniture, batch.edges.num_rows)

    stage = Stage(lambda: StillMemory(get().copy(), title), get_state, doors)
    server = PageServer(Desk(stage, Judges()), port)
    Thread(target=server.serve_forever, daemon=True).start()
    if opens_browser:
        webbrowser.open(server.address)
    return server.address


class PageServer(ThreadingHTTPServer):
    """Answers this machine alone: the page, and what the page asks."""

    daemon_threads = True

    def __init__(self, desk: Desk, port: int = DEFAULT_PORT, asked: str = "") -> None:
        """Listen at the first free port from a number on.

        Raises:
            OSError: if no port is free.
        """
        self.desk = desk
        self.asked = asked
        self.guard = Guard()
        for number in range(port, port + _MOST_PAGES):
            try:
                super().__init__((HOST, number), _Handler)
                return
            except (OSError, OverflowError):
                continue
        raise OSError(
            f"port must be free on this machine, got none from {port} to {port + _MOST_PAGES - 1}. "
            "Choose another one with --port."
        )

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Be silent about browsers that leave before they are answered."""
        if not isinstance(sys.exc_info()[1], ConnectionError):
            super().handle_error(request, client_address)

    @property
    def address(self) -> str:
        """Where the page is."""
        return f"http://{HOST}:{self.server_address[1]}/"

    def respond(
        self, method: str, path: str, headers: Mapping[str, str], content: bytes, client: str = HOST
    ) -> tuple[int, str, bytes]:
        """Answer GET of the page, or POST of what it asks, at "/": status, type and content."""
        try:
            self.guard.check(client, path, headers)
            if path != "/" or method not in ("GET", "HEAD", "POST"):
                raise Refused(404, "request must be GET or POST of /, got another. Open /.")
            if method != "POST":
                page = make_document(self.desk.tell_page(self.asked))
                return 200, "text/html; charset=utf-8", page.encode()
            call, arguments = read_request(content, self.desk)
        except Refused as error:
            return error.status, _PLAIN, f"{error.line}\n".encode()
        except ValueError as error:
            return 400, _PLAIN, f"{error}\n".encode()
        if call == "watch":
            self.desk.stage.refresh()
        try:
            answer = CALLS[call][1](self.desk, **arguments)
        except ValueError as error:  # the story went on meanwhile, or the words are no name
            answer = {"problem": str(error)}
        return 200, "application/json", json.dumps(answer, separators=(",", ":")).encode()


class _Handler(BaseHTTPRequestHandler):
    """Reads requests and writes answers; nothing is logged."""

    server: PageServer
    protocol_version = "HTTP/1.1"
    server_version = sys_version = ""
    timeout = _REQUEST_SECONDS

    def do_GET(self) -> None:
        """Answer with the page."""
        self._answer(b"")

    do_HEAD = do_GET

    def do_POST(self) -> None:
        """Answer what the page asks."""
        size = self.headers.get("Content-Length", "")
        if not size.isdecimal() or len(size) > 9 or int(size) > MOST_BYTES:
            self.close_connection = True
            self._answer(b"", 413)
            return
        self._answer(self.rfile.read(int(size)))

    def _answer(self, content: bytes, refused: int | None = None) -> None:
        headers = {name.lower(): value for name, value in self.headers.items()}
        status, content_type, answer = self.server.respond(
            self.command, self.path.partition("?")[0], headers, content, self.client_address[0]
        )
        if refused is not None:
            line = f"request must have a length of at most {MOST_BYTES} bytes. Reload the page.\n"
            status, content_type, answer = refused, _PLAIN, line.encode()
        self.send_response(status)
        for name, value in (
            ("Content-Type", content_type),
            ("Content-Length", str(len(answer))),
            *_HEADERS,
            ("Content-Security-Policy", f"{make_policy()}; frame-ancestors 'none'"),
        ):
            self.send_header(name, value)
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(answer)

    def log_message(self, format: str, *args: object) -> None:
        """Log nothing: what is refused is answered."""
