"""Every option of a command that a page names is one that the command has."""

import importlib
import re

import pytest

from docs.make_commands import COMMANDS, list_helps
from tests.imports import ROOT

PAGES = [
    ROOT / "README.md",
    *sorted((ROOT / "docs").rglob("*.md")),
    *sorted(ROOT.glob("results/*.md")),
]
# In a line of a block, or between backticks, where it may go on in the next line.
COMMAND = re.compile(r"(?:`(?P<quoted>python -m [^`]*)`|^(?P<line>python -m .*)$)", re.MULTILINE)


def list_named() -> dict[str, set[tuple[str, str]]]:
    """Options by command, each with the page that names it."""
    named: dict[str, set[tuple[str, str]]] = {}
    for page in PAGES:
        for found in COMMAND.finditer(page.read_text("utf-8")):
            _, _, name, *words = (found["quoted"] or found["line"]).split()
            options = re.findall(r"(?<!\S)--([A-Za-z_][\w.-]*)", " ".join(words))
            named.setdefault(name, set()).update((option, page.name) for option in options)
    return {name: options for name, options in named.items() if name in COMMANDS}


def has_option(known: set[str], option: str) -> bool:
    """Whether a command has an option, or one whose value has fields of its own."""
    option = option.replace("-", "_")
    head, _, last = option.rpartition(".")
    positive = f"{head}.{last.removeprefix('no_')}".lstrip(".")
    parts = positive.split(".")
    return bool(
        {option, *(".".join(parts[:number]) for number in range(1, len(parts) + 1))} & known
    )


NAMED = list_named()


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMED)
def test_a_command_has_the_options_that_pages_name(name):
    main = importlib.import_module(COMMANDS[name]).main
    helps = "\n".join(written for _, written in list_helps(main))
    for form in (
        ("bag", "coco", "frigate", "hd_epic") if name == "simulator.trace" else ()
    ):  # with options of their own
        helps += "".join(written for _, written in list_helps(main, ("import", form)))
    known = set(re.findall(r"--([A-Za-z_][\w.]*)", helps)) | {"help", "config", "print_config"}
    assert [about for about in sorted(NAMED[name]) if not has_option(known, about[0])] == []
