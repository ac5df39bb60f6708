"""What `reset(options=...)` of an environment may say."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from sgm.messages import shorten

NEW_HOME = "new_home"


def reads_new_home(options: Any, known: tuple[str, ...] = (NEW_HOME,)) -> bool:
    """Tell whether options ask for a new home.

    Raises:
        TypeError: if they are no mapping, or `new_home` is neither true nor false.
        ValueError: if there is one of another name.
    """
    if options is None:
        return False
    if not isinstance(options, Mapping):
        raise TypeError(
            f"options must be a mapping, got {shorten(options)}. Give {{'{NEW_HOME}': True}}."
        )
    for name in options:
        if name not in known:
            raise ValueError(
                f"options must be some of {', '.join(known)}, got {shorten(name)}. Leave it out."
            )
    wanted = options.get(NEW_HOME, False)
    if not isinstance(wanted, bool | np.bool_):
        raise TypeError(f"{NEW_HOME} must be True or False, got {shorten(wanted)}. Give one.")
    return bool(wanted)
