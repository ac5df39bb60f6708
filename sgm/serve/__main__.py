"""Serves the memory of a home over HTTP and MCP: `python -m sgm.serve home.sgm`."""

from __future__ import annotations

import argparse
import asyncio
import os
import sys
import warnings
from datetime import datetime
from importlib.util import find_spec
from pathlib import Path

from sgm.finder.service import MemoryService
from sgm.memory.clock import Clock
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.messages import shorten, tell_error, tell_missing
from sgm.names.language import list_languages
from sgm.names.sections import ENGLISH
from sgm.serve.caller import DEFAULT_TIMEOUT, Caller
from sgm.serve.finders import make_finder, warm_up
from sgm.serve.guard import DEFAULT_RATE, LOCAL_NAMES, Guard, is_local
from sgm.serve.reader import Reader
from sgm.store.home_file import KEPT_BYTES

DEFAULT_PORT = 8600
TOKEN_VARIABLE = "SGM_TOKEN"
# In Windows no event loop reads the standard input, by which the second process is asked.
_PROCESSES = (1, 2) if os.name == "posix" else (1,)


def make_parser() -> argparse.ArgumentParser:
    """Return the options."""
    parser = argparse.ArgumentParser(
        prog="python -m sgm.serve",
        description="Serves the memory of a home over HTTP and MCP; docs/serve.md has the calls.",
        allow_abbrev=False,
    )
    add = parser.add_argument
    add("home", type=Path, help="memory file, such as home.sgm")
    add("--new", action="store_true", help="begin an empty home where there is none")
    add("--host", default="127.0.0.1", help="address; any but this machine's needs a token")
    add("--port", type=int, default=DEFAULT_PORT, help="0 for any that is free")
    add("--stdio", action="store_true", help="MCP over standard streams instead of HTTP")
    add("--allow_host", action="append", default=[], help="another name of this server")
    add("--token_file", type=Path, help=f"file of the token; or the variable {TOKEN_VARIABLE}")
    add("--finder", default="any_home", help="any_home, bayesian, adaptive, or an exported folder")
    add("--aliases", type=Path, help="CSV file of what things are called besides")
    add(
        "--language",
        choices=list_languages(),
        default=ENGLISH,
        help="in which is asked and answered",
    )
    add(
        "--ignore",
        nargs="+",
        default=[],
        metavar="NAME",
        help="names of what is no thing, such as person: observe leaves it out",
    )
    add("--step_seconds", type=float, default=600.0, help="of a clock, for a home without one")
    add("--accept_jump", action="store_true", help="the time is right, however long it was off")
    add(
        "--sync",
        choices=("answer", "second", "never"),
        default="second",
        help="when the disk has what was written: before it is answered, within a second, or "
        "when the system likes",
    )
    add("--snapshot_seconds", type=float, default=300.0, help="time between snapshots")
    add(
        "--keep_mb",
        type=float,
        default=KEPT_BYTES / 2**20,
        help="of events, from which on the oldest are removed",
    )
    add("--keep_days", type=float, help="after which events are removed; left out: by size alone")
    add(
        "--processes",
        type=int,
        choices=_PROCESSES,
        default=min(os.cpu_count() or 1, _PROCESSES[-1]),
        help="2: another one, which reads the file, answers what only reads",
    )
    add("--timeout", type=float, default=DEFAULT_TIMEOUT, help="seconds for a call")
    add("--rate", type=float, default=DEFAULT_RATE, help="requests of one address in a second")
    return parser


def main(argv: list[str] | None = None) -> int:
    """Run the command, and return its status."""
    options = make_parser().parse_args(argv)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("default")
            warnings.showwarning = _tell  # of a line that a crash cut off, of looks at every frame
            _run(options)
    except (OSError, ValueError, TypeError, KeyError, ModuleNotFoundError) as error:
        print(f"error: {tell_error(error)}", file=sys.stderr)
        return 2
    return 0


def _run(options: argparse.Namespace) -> None:
    for name in ("step_seconds", "snapshot_seconds", "timeout", "rate", "keep_mb", "keep_days"):
        if getattr(options, name) is not None and not 0 < getattr(options, name) < 1e9:
            raise ValueError(
                f"--{name} must be a number above 0, got {getattr(options, name):g}. Leave it out."
            )
    if not 0 <= options.port <= 65535:
        raise ValueError(f"--port must be 0 to 65535, got {options.port}. Leave it out.")
    for name in ("uvicorn", "mcp"):
        if find_spec(name) is None:
            raise ValueError(tell_missing(name, "serve a memory", extra="serve"))
    token = _read_token(options.token_file)
    guard = _make_guard(options, token)
    clock = Clock(datetime.now().replace(microsecond=0), options.step_seconds)
    finder = make_finder(options.finder)
    memory = _open(options, clock)
    service = MemoryService(memory, finder, accept_jump=options.accept_jump, ignore=options.ignore)
    reader = None if options.stdio or options.processes == 1 else _make_reader(options)
    caller = Caller(service, options.sync, options.timeout, reader)
    try:
        if options.stdio:
            from sgm.serve.standard_streams import answer_streams

            warm_up(finder, memory)
            asyncio.run(answer_streams(caller, options.snapshot_seconds))
            return
        from sgm.serve import server  # here, as tests of the options need no uvicorn

        application = server.Application(
            caller, guard, has_tools=True, snapshot_seconds=options.snapshot_seconds
        )
        listening = server.open_socket(options.host, options.port)
        host, port = listening.getsockname()[:2]
        where = f"[{host}]" if ":" in host else host
        said = f"serving {options.home} at http://{where}:{port}/"
        warm_up(finder, memory)
        server.serve(application, listening, lambda: print(said, flush=True))
    finally:
        caller.close()


def _open(options: argparse.Namespace, clock: Clock) -> SceneGraphMemory:
    memory = SceneGraphMemory.open(
        options.home,
        clock=clock,
        aliases=options.aliases,
        language=options.language,
        is_new=options.new,
    )
    file = memory.parts.files.file
    assert file is not None
    file.kept_bytes, file.kept_days = int(options.keep_mb * 2**20), options.keep_days
    return memory


def _make_reader(options: argparse.Namespace) -> Reader:
    arguments = ["--finder", options.finder, "--timeout", str(options.timeout)]
    arguments += ["--language", options.language]
    if options.aliases is not None:
        arguments += ["--aliases", str(options.aliases)]
    return Reader(arguments, _tell)


def _make_guard(options: argparse.Namespace, token: str | None) -> Guard:
    if is_local(options.host):
        names = {*LOCAL_NAMES, *options.allow_host}
    elif token is None:
        raise ValueError(
            f"--host must be this machine alone without a token, got {shorten(options.host)}. Give "
            f"--token_file, or set {TOKEN_VARIABLE}."
        )
    else:
        names = {*options.allow_host}
        if names:
            names |= {*LOCAL_NAMES, options.host}
    return Guard(names, token, options.rate)


def _read_token(path: Path | None) -> str | None:
    text = os.environ.get(TOKEN_VARIABLE) if path is None else path.read_text("utf-8").strip()
    if text is None:
        return None
    if not 16 <= len(text) <= 500 or not text.isascii() or not text.isprintable():
        raise ValueError(
            "token must be 16 to 500 printable characters of ASCII, got another one. Make one: "
            'python -c "import secrets; print(secrets.token_urlsafe())".'
        )
    return text


def _tell(message: Warning | str, *_: object, **__: object) -> None:
    print(f"warning: {message}", file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main())
