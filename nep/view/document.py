"""The page as one document: markup, style, scripts and data, and nothing from elsewhere."""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Mapping
from html import escape
from importlib.resources import files
from typing import Any

# In the order in which they use each other.
SCRIPTS = ("time", "source", "viewport", "labels", "map", "history", "panels", "page")
_FOLDER = "page"  # beside this file


def make_document(data: Mapping[str, Any]) -> str:
    """Return the page, which begins with some data, JSON values.

    Its security policy names the style and the script by their checksums: nothing else runs, also
    where a name of a thing would bring it in.
    """
    style = _read("page.css")
    script = "".join(_read(f"{name}.js") for name in SCRIPTS)
    # A "<" of a name could end the element that holds the data.
    text = json.dumps(data, separators=(",", ":")).replace("<", "\\u003c")
    body = _read("page.html")
    for name, value in (
        ("policy", escape(make_policy())), ("title", escape(str(data["title"]))),
        ("style", style), ("script", script), ("data", text),
    ):  # fmt: skip
        body = body.replace("{{" + name + "}}", value, 1)
    return body


def make_policy() -> str:
    """Return the content security policy of the page."""
    script = "".join(_read(f"{name}.js") for name in SCRIPTS)
    rules = {
        "default-src": "'none'",
        "script-src": _sum(script),
        "style-src": _sum(_read("page.css")),
        "connect-src": "'self'",
        "img-src": "data:",
        "base-uri": "'none'",
        "form-action": "'none'",
    }
    return "; ".join(f"{name} {value}" for name, value in rules.items())


def _read(name: str) -> str:
    return (files("nep.view") / _FOLDER / name).read_text("utf-8")


def _sum(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"
