"""Prose as a reader meets it: paragraphs and sentences of pages, docstrings, comments, messages."""

from __future__ import annotations

import ast
import io
import re
import tokenize
from collections.abc import Iterator

# Words of a dialect, with what is said instead. Each is a pattern within word borders.
OUT = {
    r"in vain": "a negative look, which did not show it",
    r"believers?": "a policy or filter",
    r"heeds?|heeded": "uses, reads",
    r"today's|of before": "previous",
    r"nobody|somebody|anybody|everybody|whoever": "no user, the user, a policy that",
    r"who (?:goes|go) by|who knows?": "a policy that uses or is given",
    r"goes by": "uses, follows",
    r"worth": "gains, is better by",
    r"is told|are told|was told|were told|told of": "is given",
    r"people ask": "users ask",
}
IS_OUT = re.compile(rf"\b({'|'.join(OUT)})\b", re.IGNORECASE)
MOST_WORDS = 40  # in a sentence
MEAN_WORDS = 20
_FENCE = re.compile(r"^ *(```+).*?^ *\1[^\n]*$", re.MULTILINE | re.DOTALL)
_HIDDEN = re.compile(r"<!--.*?-->|^\$\$\n.*?\n\$\$$", re.MULTILINE | re.DOTALL)
_ITEM = re.compile(r"(?:[-*]|\d+\.)\s+")


def drop_code(page: str) -> str:
    """A page without blocks of code, comments and equations."""
    return _HIDDEN.sub("", _FENCE.sub("", page))


def list_paragraphs(page: str) -> list[str]:
    """Paragraphs and list items of a page, each in one line; without tables, headings, pictures."""
    found: list[str] = []
    lines: list[str] = []
    for line in [*drop_code(page).split("\n"), ""]:
        text = line.strip().lstrip("> ")
        item = _ITEM.match(text)
        if item or not text or text.startswith(("|", "#", "![")):
            found += [" ".join(lines)] if lines else []
            lines = []
        if text and not text.startswith(("|", "#", "![")):
            lines.append(text[item.end() :] if item else text)
    return found


def list_sentences(paragraph: str) -> list[str]:
    """Sentences of a paragraph; a piece of code counts as a word, and a link as its text."""
    text = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", paragraph)
    text = re.sub(r"``?[^`]+``?", "X", text).replace("*", "")
    text = re.sub(r"\b(e\.g|i\.e|cf|vs|etc)\.", r"\1", text)
    parts = re.split(r"(?<=[.!?])[\")\]]*\s+(?=[\"(A-Z\d.\[])", text)
    return [part.strip() for part in parts if part.strip()]


def count_words(sentence: str) -> int:
    """Words of a sentence."""
    return len(sentence.split())


def drop_formulas(sentence: str) -> str:
    """A sentence without numbers, signs and single letters, which formulas of docstrings have."""
    words = sentence.split()
    return " ".join(word for word in words if re.search(r"[A-Za-z]{2}|^[aAI]$|^X", word))


def list_docstrings(source: str) -> Iterator[tuple[int, str]]:
    """Line and text of each docstring of a module."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            text = ast.get_docstring(node)
            if text:
                yield getattr(node, "lineno", 1), text


def list_comments(source: str) -> Iterator[tuple[int, str]]:
    """Line and text of each comment; lines of one block are one comment."""
    last, lines = -1, []
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type != tokenize.COMMENT:
            continue
        is_trailing = not token.line.lstrip().startswith("#")  # it is about its own line
        if (token.start[0] != last + 1 or is_trailing) and lines:
            yield last, " ".join(lines)
            lines = []
        lines.append(token.string.lstrip("# "))
        last = token.start[0]
    if lines:
        yield last, " ".join(lines)


def list_messages(source: str) -> Iterator[tuple[int, str]]:
    """Line and text of what is raised, warned of, or said as help of an option."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call):
            given = node.exc.args
        elif isinstance(node, ast.Call):
            given = [keyword.value for keyword in node.keywords if keyword.arg == "help"]
        else:
            continue
        for value in given:
            text = _join_text(value)
            if " " in text:
                yield node.lineno, text


def list_docstring_sentences(docstring: str) -> list[str]:
    """Sentences of a docstring; entries of Args and the like are paragraphs of their own."""
    paragraphs: list[str] = []
    for block in re.split(r"\n\s*\n", docstring):
        lines = block.split("\n")
        if any(line.lstrip().startswith(">>>") for line in lines):
            continue
        entry: list[str] = []
        for line in lines:
            is_new = re.match(r"\s*(?:[\w, *]+(?: \([^)]*\))?:(?:\s|$)|[-*] )", line)
            if is_new and entry:
                paragraphs.append(" ".join(entry))
                entry = []
            entry.append(line.strip())
        paragraphs.append(" ".join(entry))
    return [sentence for text in paragraphs for sentence in list_thoughts(text)]


def list_thoughts(text: str) -> list[str]:
    """Sentences of a text of the code, in which a semicolon ends a thought as well."""
    parts = (part for sentence in list_sentences(text) for part in re.split(r";\s+", sentence))
    return [part for part in parts if part]


def _join_text(node: ast.expr) -> str:
    """The text of a string, with "x" for what is put in."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    if isinstance(node, ast.JoinedStr):
        return "".join(
            str(part.value) if isinstance(part, ast.Constant) else "x" for part in node.values
        )
    if isinstance(node, ast.BinOp):
        return _join_text(node.left) + _join_text(node.right)
    return ""
