"""Every block of every page runs as it stands there, twice, in the folder of a reader."""

import gc
import json
import re
import shutil
import socket
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import pytest
import yaml

from tests.docs.reader import (
    AS_IT_STANDS,
    CHECKS,
    FILES,
    NOT_RUN,
    PRINTS_OTHER,
    PROGRAM_ENDS,
    SHORTER,
    SHOWS,
    SMALLER,
    SMALLER_TEXT,
)
from tests.guides import ROOT, SHELL, Block, Shell, drop_lines, list_blocks
from tests.imports import find_imports

PAGES = [
    *("README.md", "CONTRIBUTING.md", "ros/README.md", "notebooks/README.md"),
    "benchmarks/README.md",
    *(str(path.relative_to(ROOT)) for path in sorted((ROOT / "docs").rglob("*.md"))),
]
BLOCKS = {page: list_blocks((ROOT / page).read_text("utf-8")) for page in PAGES}
PACKAGES = ("sgm", "simulator", "datamodules", "nep", "tools")
LANGUAGES = {"python", SHELL, "text", "json", "yaml", "toml", "csv", "sql", "diff", "javascript"}
RESEARCH = {"simulator", "datamodules", "nep", "tools", "torch", "matplotlib"}
# What comes with an extra: with which.
EXTRAS = {
    "sgm.serve": {"serve"},
    "mcp": {"serve"},
    "sgm.export": {"mcap"},
    "gymnasium": {"gym", "rl", "igridson"},
    "simulator.gym": {"gym", "rl", "igridson"},
    "simulator.igridson": {"igridson"},
    "sb3_contrib": {"rl"},
    "optuna": {"sweep"},
    "torch_geometric": {"events"},
}
RUN = {"python", SHELL, "javascript", "diff"}


def list_left_out(page: str) -> tuple[str, ...]:
    return tuple(start for start, _ in NOT_RUN.get(page, ()))


class Reader:
    """Follows a page: writes its files, runs its code, holds what is printed to the page."""

    def __init__(self, page: str, folder: Path, shell: Shell, capsys) -> None:
        self.page, self.folder, self.shell, self.capsys = page, folder, shell, capsys
        self.names: dict = {}
        self.printed = ""

    def follow(self, *, is_first: bool) -> None:
        self.names = {"__name__": self.page}
        for block in BLOCKS[self.page]:
            text = block.text
            if block.saved:
                path = self.folder / block.saved
                path.parent.mkdir(parents=True, exist_ok=True)
                for long, short in SMALLER_TEXT.get(self.page, {}).items():
                    text = text.replace(long, short)
                path.write_text(text, "utf-8")
            if block.language == "diff":
                if is_first:
                    apply_diff(self.folder, text)
            elif block.language in RUN and (block.printed is not None or not block.saved):
                printed = self.run(block)
                has_text = block.language == "python" or block.printed is not None
                if is_first and has_text and self.page not in PRINTS_OTHER:
                    assert printed == (block.printed or ""), f"{self.page}:{block.line}"
                self.printed += printed
            elif not block.saved:
                parse(block)

    def run(self, block: Block) -> str:
        left_out = list_left_out(self.page)
        script = drop_lines(block.text, left_out)
        if block.language == SHELL:
            if self.page in PROGRAM_ENDS:
                self.names = {"__name__": self.page}
                gc.collect()
            if re.search(r"^sqlite3 ", script, re.MULTILINE) and shutil.which("sqlite3") is None:
                pytest.skip("sqlite3 is not installed")
            return self.shell.run(script)
        if block.language == "javascript":
            if shutil.which("node") is None:
                pytest.skip("node is not installed")
            return self.shell.run(script, ("node",))
        for long, short in SMALLER_TEXT.get(self.page, {}).items():
            script = script.replace(long, short)
        name = f"{self.page}:{block.line}"
        exec(compile(self.shell.put_port(script), name, "exec"), self.names)  # our own text
        plt.close("all")
        return self.capsys.readouterr().out


def parse(block: Block) -> None:
    """Read what is neither run nor saved."""
    if block.language == "json":
        json.loads(block.text if block.text.lstrip()[0] in "{[" else f"{{{block.text}}}")
    elif block.language == "yaml":
        yaml.safe_load(block.text)


def apply_diff(folder: Path, text: str) -> None:
    """Add the lines of a diff to a file; the others must be there, one after the other."""
    name, _, body = text.removeprefix("--- ").partition("\n")
    path = folder / name
    content = path.read_text("utf-8")
    for hunk in body.split("@@\n"):
        lines = hunk.splitlines()
        before = "".join(line[1:] + "\n" for line in lines if not line.startswith("+"))
        after = "".join(line[1:] + "\n" for line in lines if not line.startswith("-"))
        assert content.count(before) == 1, f"{name} must have these lines once:\n{before}"
        content = content.replace(before, after)
    path.write_text(content, "utf-8")


def find_port() -> int:
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return listener.getsockname()[1]


@pytest.fixture
def reader(tmp_path, monkeypatch, capsys, python):
    """Makes a reader of a page in an empty folder; recipes are in a copy of the packages."""
    shells = []

    def make(page: str) -> Reader:
        folder = tmp_path / "reader"
        folder.mkdir()
        if any(block.language == "diff" for block in BLOCKS[page]):
            for package in PACKAGES:  # with what Python and numba have compiled
                shutil.copytree(ROOT / package, folder / package)
        monkeypatch.chdir(folder)
        shells.append(Shell(folder, python, find_port()))
        if not page.startswith(AS_IT_STANDS):
            shells[-1].smaller = SMALLER
        for make_file in FILES.get(page, ()):
            make_file(folder, shells[-1])
        return Reader(page, folder, shells[-1], capsys)

    monkeypatch.setattr("webbrowser.open", lambda url: True)
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    with mpl.rc_context({"backend": "agg"}):
        yield make
    for shell in shells:
        shell.close()


def mark(page: str) -> tuple:
    """Pages of Python that a robot runs are quick; those with commands are slow."""
    text = (ROOT / page).read_text("utf-8")
    marks = [pytest.mark.slow] if any(b.language != "python" for b in BLOCKS[page]) else []
    return (*marks, *([pytest.mark.dgl] if "from dgl" in text else []))


@pytest.mark.parametrize(
    "page", [pytest.param(page, marks=mark(page)) for page in PAGES if BLOCKS[page]]
)
def test_every_block_of_a_page_runs_twice(page, reader):
    one = reader(page)
    for is_first in (True, False):
        one.follow(is_first=is_first)
        one.shell.close()
        if is_first:
            assert re.search(SHOWS.get(page, ""), one.printed), one.printed
            CHECKS.get(page, lambda folder: None)(one.folder)
            one.shell.smaller = one.shell.smaller or SHORTER


@pytest.mark.parametrize("page", PAGES)
def test_a_block_says_its_language(page):
    other = {"bibtex": "README.md", "cpp": "docs/serve.md"}
    for block in BLOCKS[page]:
        assert block.language in LANGUAGES or other.get(block.language) == page, block


def test_no_line_is_left_out_that_is_not_there():
    for page, lines in NOT_RUN.items():
        shown = "\n".join(b.text for b in BLOCKS[page] if b.language in RUN).splitlines()
        for start, why in lines:
            assert any(line.startswith(start) for line in shown), (page, start)
            path = re.match(r"tests/[\w/]+\.py", why)
            assert path is None or (ROOT / path[0]).is_file(), why


def list_modules(page: str) -> set[str]:
    """Modules that the code and the commands of a page import, by their dotted names."""
    named: set[str] = set()
    for block in BLOCKS[page]:
        if block.language == "python":
            named |= find_imports(block.text)
        elif block.language == SHELL:
            named |= set(re.findall(r"^python -m ([\w.]+)", block.text, re.MULTILINE))
    return named


@pytest.mark.parametrize("page", [page for page in PAGES if page.startswith("docs/")])
def test_a_page_says_what_has_to_be_installed(page):
    """The package `sgm` is what a robot has; all else is named on the page."""
    text = (ROOT / page).read_text("utf-8")
    modules = list_modules(page)
    if {module.partition(".")[0] for module in modules} & RESEARCH:
        assert re.search(r"research install|make install|pip install \./core '?\.", text)
    extras = {extra for found in re.findall(r"\[([\w,]+)\]'", text) for extra in found.split(",")}
    extras |= {"events"} if "research install" in text else set()
    for module, own in EXTRAS.items():
        if any(f"{name}.".startswith(f"{module}.") for name in modules):
            assert extras & own, (module, own)
