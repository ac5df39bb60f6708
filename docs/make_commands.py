"""Pages of the commands, from their parsers, with links to the pages that their help names."""

from __future__ import annotations

import contextlib
import importlib
import io
import os
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from unittest import mock

ROOT = Path(__file__).resolve().parents[1]
FOLDER = "reference/commands"
# What is run as `python -m NAME`, by the module that holds its `main`.
COMMANDS = {
    "sgm.serve": "sgm.serve.__main__",
    "sgm.export": "sgm.export.__main__",
    "simulator.collect": "simulator.collect.__main__",
    "simulator.compile": "simulator.compile",
    "simulator.trace": "simulator.trace.__main__",
    "simulator.priors": "simulator.priors.__main__",
    "simulator.test_sets": "simulator.test_sets.__main__",
    "simulator.igridson": "simulator.igridson.__main__",
    "simulator.box_world": "simulator.box_world.__main__",
    "nep.fit": "nep.fit",
    "nep.evaluate": "nep.evaluate",
    "nep.compare": "nep.compare",
    "nep.export": "nep.export",
    "nep.view": "nep.view.__main__",
    "nep.reproduce": "nep.reproduce.__main__",
    "nep.igridson": "nep.igridson",
    "tools.bench": "tools.bench.__main__",
    "tools.priors": "tools.priors.__main__",
    "tools.text_training": "tools.text_training.__main__",
    "tools.realism": "tools.realism.__main__",
    "tools.names": "tools.names.__main__",
    "tools.eyes": "tools.eyes.__main__",
    "tools.headlines": "tools.headlines",
    "tools.measure_design": "tools.measure_design",
    "tools.closures": "tools.closures",
}


def make_command_pages() -> dict[str, str]:
    """Return the text of each page by its path in the site."""
    return {f"{FOLDER}/{name}.md": make_page(name) for name in COMMANDS}


def make_page(name: str) -> str:
    """Return the page of a command: its help, and that of its subcommands."""
    main = importlib.import_module(COMMANDS[name]).main
    text = [f"# python -m {name}"]
    for words, written in list_helps(main):
        if words:
            text.append(f"## {' '.join(words)}")
        text.append(f"```text\n{written.rstrip()}\n```")
    pages = re.findall(r"\b(?:docs|results)/[\w/]+\.md\b", " ".join(text))
    pages = [page for page in dict.fromkeys(pages) if (ROOT / page).is_file()]
    links = [f"- [{read_title(page)}](../../{link_page(page)})" for page in pages]
    text += ["## Pages", "\n".join(links)] if links else []
    return "\n\n".join(text) + "\n"


def read_title(page: str) -> str:
    """Return the heading of a page of the repository."""
    return (ROOT / page).read_text("utf-8").partition("\n")[0].removeprefix("# ")


def link_page(page: str) -> str:
    """Return where a page is in the site."""
    return page.removeprefix("docs/")


def list_helps(
    main: Callable[[list[str]], object], words: tuple[str, ...] = ()
) -> Iterator[tuple[tuple[str, ...], str]]:
    """Yield the help of a command and of each of its subcommands."""
    out = io.StringIO()
    with (
        mock.patch.dict(os.environ, {"COLUMNS": "100", "TERM": "dumb", "NO_COLOR": "1"}),
        contextlib.redirect_stdout(out),
        contextlib.suppress(SystemExit),
    ):
        main([*words, "--help"])
    yield words, out.getvalue()
    if re.search(r"(COMMAND|SUITE) \.\.\.$", out.getvalue(), re.MULTILINE) and not words:
        for name in re.findall(r"^ {2,4}([a-z_-]+)(?:  .*)?$", out.getvalue(), re.MULTILINE):
            yield from list_helps(main, (name,))
