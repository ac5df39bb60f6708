"""What agents read beside tools: the home, a thing, the changes of today; and prompts."""

from __future__ import annotations

import json
from collections.abc import Mapping
from datetime import datetime
from typing import Any, Final
from urllib.parse import unquote

from sgm.finder.answers import to_json
from sgm.messages import shorten_text
from sgm.serve.caller import Caller
from sgm.serve.calls import BY_NAME

HOME: Final = "sgm://home"
TODAY: Final = "sgm://today"
_THING: Final = "sgm://thing/"
THING: Final = f"{_THING}{{name}}"
# Addresses, or a template of them, and what is read there.
RESOURCES: Final[Mapping[str, tuple[str, str]]] = {
    HOME: ("home", "Rooms and places of the home, and the things that are known, seen last first."),
    TODAY: ("today", "What is new, was moved, is gone or was picked up since midnight."),
    THING: ("thing", "Where a thing is, and what is known of it over time; its name or id."),
}
_MOST = 50  # rows of each list


async def read_resource(caller: Caller, address: str) -> str:
    """Return what is at an address, as JSON.

    Raises:
        ValueError: if nothing is.
        KeyError, OSError, Refused: as the calls do that it stands for.
    """

    async def ask(call: str, **values: Any) -> Any:
        declared = BY_NAME[call]
        return to_json(await caller.call(declared, declared.read(values)))

    if address == HOME:
        read = {
            "places": await ask("list_places", k=_MOST),
            "things": await ask("list_things", k=_MOST),
        }
    elif address == TODAY:
        memory = caller.service.memory
        since: int | str = 0
        if memory.clock is not None:
            now: datetime = memory.clock.get_time(memory.time)
            since = now.date().isoformat()
        read = await ask("changes", since=since, k=_MOST)
    elif address.startswith(_THING):
        thing = unquote(address.removeprefix(_THING))
        read = {
            "where_is": await ask("where_is", thing=thing),
            "history": await ask("history", thing=thing),
        }
    else:
        raise ValueError(
            f"resource must be one of {', '.join(RESOURCES)}, got {shorten_text(address)!r}. List "
            "the resources."
        )
    return json.dumps(read, ensure_ascii=False, separators=(",", ":"))
