"""Equations between `$$` as MathML, which browsers draw without a script."""

from __future__ import annotations

import re

from latex2mathml.converter import convert

EQUATION = re.compile(r"^\$\$\n(.+?)\n\$\$$", re.MULTILINE | re.DOTALL)


def replace_equations(markdown: str) -> str:
    """Replace each block of LaTeX between lines of `$$`."""
    return EQUATION.sub(lambda match: convert(match[1], display="block"), markdown)
