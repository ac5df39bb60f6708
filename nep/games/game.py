"""What a player is scored in, and checksums of the code that scores."""

from __future__ import annotations

import ast
import hashlib
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any, ClassVar


class Game(ABC):
    """Homes, what is asked in them, and how answers are scored.

    Attributes:
        scored_by: modules whose code decides a score; where it changes, scores are played again.
        plays_together: whether all players of a game are played in one go, since what they are
            asked about takes longer to make than they take to answer.
    """

    scored_by: ClassVar[tuple[str, ...]]
    plays_together: ClassVar[bool] = False

    @abstractmethod
    def describe(self) -> dict[str, Any]:
        """Return everything that scores depend on but the player and the code, as JSON values."""

    @abstractmethod
    def play(self, players: Mapping[str, Any]) -> dict[str, Any]:
        """Score players, by name, from what makes each of them; the scores are JSON values."""

    @abstractmethod
    def tell(self) -> dict[str, Any]:
        """Return what is kept beside the scores, so that a table needs no homes.

        Returns:
            "title": of its table. "units": the home or household that each score of a player is of.
        """


def checksum_code(modules: Sequence[str]) -> str:
    """Return the SHA-256 of what modules compute; comments, docstrings and layout do not matter."""
    return hashlib.sha256("\n".join(map(_read_code, modules)).encode()).hexdigest()


@lru_cache
def _read_code(module: str) -> str:
    spec = find_spec(module)
    assert spec is not None
    assert spec.origin is not None
    return strip_code(Path(spec.origin).read_text(encoding="utf-8"))


def strip_code(source: str) -> str:
    """Return the syntax tree of code as text, without docstrings; the same on every Python."""
    tree = ast.parse(source)
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list) and body and isinstance(body[0], ast.Expr):
            if isinstance(body[0].value, ast.Constant):
                del body[0]
        if isinstance(node, ast.JoinedStr):  # 3.12 puts empty text behind a format
            node.values = [part for part in node.values if getattr(part, "value", None) != ""]
    return _spell(tree)


def _spell(node: object) -> str:
    """Write a syntax tree without empty fields, of which later Pythons have more (`ast.dump`)."""
    if isinstance(node, ast.AST):
        fields = ((name, part) for name, part in ast.iter_fields(node) if part not in (None, []))
        parts = (f"{name}={_spell(part)}" for name, part in fields)
        return f"{type(node).__name__}({', '.join(parts)})"
    if isinstance(node, list):
        return f"[{', '.join(map(_spell, node))}]"
    return ascii(node)  # what can be printed is more in later ones
