"""The page as one document or file: markup, style, scripts and data; nothing from elsewhere."""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Mapping, Sequence
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import Any

from nep.view.answers import Desk
from sgm.files import write_whole

# In the order in which they use each other.
SCRIPTS = ("time", "source", "viewport", "labels", "map", "history", "panels", "page")
MOST_FRAMES = 60  # steps of a story
_MOST_FURNITURE = 200  # whose tables are kept


def make_document(data: Mapping[str, Any]) -> str:
    """Return the page, which begins with some data, JSON values.

    Its security policy names the style and the script by their checksums: nothing else runs, also
    where a name of a thing would bring it in.
    """
    # A "<" of a name could end the element that holds the data.
    text = json.dumps(data, separators=(",", ":")).replace("<", "\\u003c")
    body = _read("page.html")
    for name, value in (
        ("policy", escape(make_policy())),
        ("title", escape(str(data["title"]))),
        ("style", _read("page.css")),
        ("script", _read_script()),
        ("data", text),
    ):
        body = body.replace("{{" + name + "}}", value, 1)
    return body


def make_policy() -> str:
    """Return the content security policy of the page."""
    rules = {
        "default-src": "'none'",
        "script-src": _sum(_read_script()),
        "style-src": _sum(_read("page.css")),
        "connect-src": "'self'",
        "img-src": "data:",
        "base-uri": "'none'",
        "form-action": "'none'",
    }
    return "; ".join(f"{name} {value}" for name, value in rules.items())


def _read(name: str) -> str:
    return (files("nep.view") / "page" / name).read_text("utf-8")


def _read_script() -> str:
    return "".join(_read(f"{name}.js") for name in SCRIPTS)


def _sum(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"


def save_page(desk: Desk, asked: Sequence[str], path: Path) -> None:
    """Write the page to a file that any browser opens.

    It holds the answers of the first judge to what is asked, at up to `MOST_FRAMES` steps, those
    with statements and looks first; furniture is described as of the last step.

    Raises:
        ValueError: if something that is asked is no name.
        OSError: if the file cannot be written.
    """
    story, judge = desk.stage.story, desk.judges.names[0]
    frames: dict[int, Any] = {}
    plans: dict[int, Any] = {}
    for step in story.choose_steps(MOST_FRAMES):
        state = desk.tell_state(step)
        if state["plan"] not in plans:
            plans[state["plan"]] = desk.tell_plan(step)
        answers = {words: desk.answer(step, words, judge) for words in asked}
        frames[step] = {"state": state, "answers": answers, "changes": desk.tell_changes(step)}
    ids = story.memory_at(story.num_steps).furniture_ids[:_MOST_FURNITURE]
    content = {
        **desk.tell_page(next(iter(asked), "")),
        "judges": [judge],
        "isLive": False,
        "saved": {
            "asked": list(asked),
            "frames": frames,
            "plans": plans,
            "names": desk.list_names(),
            "traces": {words: desk.trace(words, judge) for words in asked},
            "furniture": {number: desk.tell_furniture(story.num_steps, number) for number in ids},
        },
    }
    write_whole(path, make_document(content).encode())
