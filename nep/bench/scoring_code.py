"""Checksums of code: whether scores would be computed otherwise by now."""

from __future__ import annotations

import ast
import hashlib
from collections.abc import Sequence
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path


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
    """Return the syntax tree of code as text, without docstrings."""
    tree = ast.parse(source)
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list) and body and isinstance(body[0], ast.Expr):
            if isinstance(body[0].value, ast.Constant):
                del body[0]
    return ast.dump(tree)
