"""Settings that networks of earlier versions have, and nothing reads any more."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sgm.messages import shorten

# Shares of two filters in the answers: without them households are answered as well or better.
RETIRED = frozenset({"filter_share", "hours_share"})


def drop_retired(settings: Mapping[str, Any], where: str | Path, but: str = "") -> dict[str, Any]:
    """Return settings of a network without those that are ignored; warn of what they were.

    They are those of a config, checkpoint or exported folder `where`; the warning says, too, what
    else there is to know of them (`but`).
    """
    found = {name: settings[name] for name in sorted(RETIRED) if settings.get(name)}
    if found:
        values = " and ".join(f"{name} {shorten(value)}" for name, value in found.items())
        warnings.warn(
            f"{values} in {where} must be left out: answers have no share of these filters any "
            f"more, and the setting is ignored{but}. Export or write it again without.",
            stacklevel=3,
        )
    return {name: value for name, value in settings.items() if name not in RETIRED}
