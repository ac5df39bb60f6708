"""Public names of a package that are loaded when they are first used."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Mapping
from typing import Any

from sgm.messages import shorten


def load_lazily(package: str, modules: Mapping[str, str]) -> Callable[[str], Any]:
    """Make the `__getattr__` of a package: `import sgm` loads no more than is asked for.

    `modules` says where each public name is.
    """

    def load(name: str) -> Any:
        if name not in modules:
            raise AttributeError(f"module {shorten(package)} has no attribute {shorten(name)}")
        value = getattr(importlib.import_module(modules[name]), name)
        setattr(sys.modules[package], name, value)
        return value

    return load
