"""Elsewhere than Linux: what Windows lacks has another branch, or is not used."""

import ast
import os
import socket
import subprocess
from pathlib import Path

import pytest

import sgm
from tests.imports import ROOT
from tests.sgm.serve.conftest import Client, open_service, run_server

PACKAGE = Path(sgm.__file__).parent  # of an installed wheel, too
MODULES = {str(file.relative_to(PACKAGE)): file for file in sorted(PACKAGE.rglob("*.py"))}
POSIX = {"fcntl", "grp", "posix", "pty", "pwd", "resource", "syslog", "termios", "tty"}
# What is used and is in Windows, too; add a name only after a look at "Availability" in its
# documentation. `getattr(os, "O_NONBLOCK", 0)` asks whether there is one.
EVERYWHERE = {
    "os": {
        "O_RDWR",
        "PathLike",
        "R_OK",
        "W_OK",
        "_exit",
        "access",
        "close",
        "cpu_count",
        "environ",
        "fstat",
        "fsync",
        "getpid",
        "listdir",
        "name",
        "open",
        "path",
        "sep",
        "stat",
        "stat_result",
        "strerror",
    },
    "signal": {"SIGINT", "SIGTERM", "SIG_IGN", "signal"},
    "socket": {"SOCK_STREAM", "SOL_SOCKET", "SO_REUSEADDR", "getaddrinfo", "socket"},
}
FILES = """
import os, sys
import filelock  # takes locks of the system in its own way in Windows
for name in sys.argv[1:]:
    sys.modules[name] = None  # what imports it from now on finds none
from sgm import SceneGraphMemory, Sighting
from sgm.files import fcntl
from sgm.serve.connections import MOST_CONNECTIONS, count_connections

assert fcntl is None
assert count_connections() == MOST_CONNECTIONS
home = SceneGraphMemory(path="home.sgm")
desk = home.add_furniture("desk", home.add_room("study"))
home.observe(desk, [Sighting("mug")])
home.save("home.sgm")
home.step()
home.observe(desk, [Sighting("pen")])
del home
open("home.sgm.part", "wb").close()  # left over: no one can say whether it is in use
home = SceneGraphMemory.open("home.sgm")
home.save("home.sgm")
home.close()
memory = SceneGraphMemory.load("home.sgm")
memory.save("copy.sgm")
memory.save("copy.sgm")
print(*memory.descriptions, *sorted(os.listdir()))
"""


def find_names(source: str) -> set[tuple[str, str]]:
    """Names of `os`, `signal` and `socket` that a module uses, as (module, name)."""
    return {
        (node.value.id, node.attr)
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.Attribute)
        and isinstance(node.value, ast.Name)
        and node.value.id in EVERYWHERE
    }


def find_bare_imports(source: str) -> set[str]:
    """Modules of POSIX that a module imports without a branch where there is none."""
    tree = ast.parse(source)
    covered = {
        id(node)
        for block in ast.walk(tree)
        if isinstance(block, ast.Try)
        and any(ast.unparse(one.type or block) == "ModuleNotFoundError" for one in block.handlers)
        for node in block.body
    }
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import) and id(node) not in covered:
            found |= {alias.name for alias in node.names} & POSIX
        elif isinstance(node, ast.ImportFrom) and node.module in {*POSIX, *EVERYWHERE}:
            found.add(node.module)  # names of a module are used by its name, so that they are found
    return found


@pytest.mark.slow
def test_what_is_used_is_there_in_windows_too():
    used = {name: find_names(file.read_text("utf-8")) for name, file in MODULES.items()}
    allowed = {(module, name) for module, names in EVERYWHERE.items() for name in names}
    assert {name: others for name, names in used.items() if (others := names - allowed)} == {}
    assert set().union(*used.values()) == allowed  # no name is allowed that is not used


@pytest.mark.slow
def test_modules_of_posix_are_imported_where_they_are():
    bare = {name: find_bare_imports(file.read_text("utf-8")) for name, file in MODULES.items()}
    assert {name: found for name, found in bare.items() if found} == {}


@pytest.mark.parametrize(
    "source", ["import fcntl", "from resource import getrlimit", "def f():\n    import pwd"]
)
def test_an_import_without_another_branch_is_found(source):
    assert find_bare_imports(source)
    assert (
        find_bare_imports("try:\n    import fcntl\nexcept ModuleNotFoundError:\n    pass") == set()
    )


@pytest.mark.slow
def test_files_are_kept_without_locks_of_open_files(tmp_path, python):
    """What was left under a temporary name stays, as no one can say whether it is in use."""
    done = subprocess.run(
        [python, "-c", FILES, "fcntl", "grp", "pwd", "resource", "termios"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    things, files = done.stdout.split()[:2], done.stdout.split()[2:]
    assert things == ["mug", "pen"]
    assert {*files} == {"copy.sgm", "home.sgm", "home.sgm.part"}
    assert [name for name in files if name.endswith(".part")] == ["home.sgm.part"]


def test_an_address_is_not_shared_where_another_server_could_take_it(monkeypatch):
    server = pytest.importorskip("sgm.serve.server", reason="uvicorn is not installed")
    monkeypatch.setattr(server, "IS_POSIX", False)
    with server.open_socket("127.0.0.1", 0) as listening:
        assert listening.getsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR) == 0


def test_connections_are_bounded_where_they_are_accepted_without_the_socket(tmp_path, monkeypatch):
    server = pytest.importorskip("sgm.serve.server", reason="uvicorn is not installed")
    monkeypatch.setattr(server, "IS_POSIX", False)
    monkeypatch.setattr(server, "count_connections", lambda: 2)
    monkeypatch.setattr(server.BoundedSocket, "accept", socket.socket.accept)
    _home, service = open_service(tmp_path / "home.sgm")
    with run_server(service, tools=False) as running:
        clients = [Client(running.port) for _ in range(3)]
        assert [one.send("GET", "/health").status for one in clients] == [200, 200, 503]
        clients[0].close()
        for one in clients:
            one.close()
