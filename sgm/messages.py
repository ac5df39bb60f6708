"""Values as error messages repeat them, missing packages, warnings that blame the caller."""

from __future__ import annotations

import os
import re
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Any

MAX_LENGTH = 200  # characters of a value in a message
_MAX_PARTS = 10_000  # of a list or the like, with the parts of its parts and their characters
_LISTS = (list, tuple, dict, set, frozenset)
_CORE_EXTRAS = ("serve", "mcap", "hub", "frame", "spark")  # of the package `sgm` itself
_FOLDER = f"{Path(__file__).parent}{os.sep}"  # of this package


def shorten(value: Any, length: int = MAX_LENGTH) -> str:
    """Write any value as Python would, cut to a length; never fails."""
    if isinstance(value, (str, bytes)):
        value = value[: length + 1]
    elif isinstance(value, int) and value.bit_length() > 3 * length:
        return f"a number of about {int(value.bit_length() * 0.30103)} digits"
    elif isinstance(value, _LISTS) and (len(value) > length or not _is_small(value)):
        return f"a {type(value).__name__} of {len(value)}"
    try:
        text = repr(value)
    except (ValueError, RecursionError, MemoryError):  # of thousands of digits, or levels
        text = f"a {type(value).__name__}"
    return text if len(text) <= length else f"{text[: length - 3]}..."


def _is_small(value: Any) -> bool:
    """Tell whether a list is written in little time, each part as often as it stands there."""
    num_parts, to_visit = 0, [value]
    while to_visit:
        part = to_visit.pop()
        if isinstance(part, _LISTS):
            to_visit += [*part, *part.values()] if isinstance(part, dict) else part
            num_parts += len(part)
        elif isinstance(part, (str, bytes, bytearray)):
            num_parts += len(part)
        if num_parts > _MAX_PARTS:
            return False
    return True


def shorten_text(text: str, length: int = MAX_LENGTH) -> str:
    """Cut what a message quotes of a text, a name or another message, without quotation marks."""
    return text if len(text) <= length else f"{text[: length - 3]}..."


def shorten_values(message: str) -> str:
    """Cut every value that a message quotes, and every word of it, to `MAX_LENGTH` characters."""
    message = re.sub(rf"('[^']{{{MAX_LENGTH}}})[^']+'", r"\1...'", message)
    return re.sub(rf"(\S{{{MAX_LENGTH}}})\S{{4,}}", r"\1...", message)


def tell_error(error: BaseException) -> str:
    """Return what an error says, in one line: of an OSError without its number."""
    return " ".join(str(error.args[-1] if error.args else error).split())


def warn_caller(message: str, category: type[Warning] = UserWarning) -> None:
    """Warn of a call of this package, at the line outside of it that made the call.

    Where there is none, as in a command of ours, the outermost line is blamed. What
    `warnings.warn(skip_file_prefixes=...)` does from Python 3.12 on.
    """
    frame = _find_caller(sys._getframe(1))
    warnings.warn_explicit(
        message,
        category,
        frame.f_code.co_filename,
        frame.f_lineno,
        module=frame.f_globals.get("__name__"),
        registry=frame.f_globals.setdefault("__warningregistry__", {}),
    )


def _find_caller(frame: FrameType) -> FrameType:
    """Return the first frame that is not of this package, from one of it outwards."""
    while frame.f_back is not None and not frame.f_back.f_code.co_filename.startswith("<frozen "):
        if not frame.f_code.co_filename.startswith(_FOLDER):
            return frame
        frame = frame.f_back
    return frame


def tell_missing(package: str, use: str, extra: str = "", install: str = "") -> str:
    """Say which package is missing, what it is needed for, and what installs it.

    Args:
        package: what is imported.
        use: what needs it, such as "read bags".
        extra: of this package, or of the one that holds all packages, that brings it.
        install: what pip is given where no extra brings it.
    """
    if extra:
        install = f"'./core[{extra}]'" if extra in _CORE_EXTRAS else f"./core '.[{extra}]'"
    return f"package {package} must be installed to {use}, got none. Run pip install {install}."


@contextmanager
def needed_to(use: str, extra: str = "", install: str = "") -> Iterator[None]:
    """Import packages that may not be installed; arguments are those of `tell_missing`.

    Raises:
        ModuleNotFoundError: if one is missing, with a message that says what installs it.
    """
    try:
        yield
    except ModuleNotFoundError as error:
        package = (error.name or "").partition(".")[0]
        message = tell_missing(package, use, extra, install)
        raise ModuleNotFoundError(message, name=error.name) from None
