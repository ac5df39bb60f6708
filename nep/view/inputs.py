"""What a browser may ask: one rule for every value, checked before anything is done with it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from nep.view.answers import Desk
from sgm.files import parse_json
from sgm.memory.clock import MAX_TIME
from sgm.messages import shorten, shorten_text
from sgm.serve.rules import TEXT, make_choice_rule, make_whole_rule

MOST_BYTES = 10_000  # of a request; the page sends a hundred

_NUMBER = make_whole_rule(0, MAX_TIME)

# What each call of the page takes, and what does it.
_STEP = ("step",)
CALLS: Mapping[str, tuple[tuple[str, ...], Callable[..., Any]]] = {
    "watch": ((), Desk.watch),
    "names": (("since",), Desk.list_names),
    "plan": (_STEP, Desk.tell_plan),
    "state": (_STEP, Desk.tell_state),
    "changes": (_STEP, Desk.tell_changes),
    "answer": (("step", "words", "judge"), Desk.answer),
    "trace": (("words", "judge"), Desk.trace),
    "furniture": (("step", "furniture"), Desk.tell_furniture),
}


def read_request(content: bytes, desk: Desk) -> tuple[str, dict[str, Any]]:
    """Return the call of a request and its arguments by name: a JSON object of all of them alone.

    Raises:
        ValueError: if a value breaks its rule.
    """
    if len(content) > MOST_BYTES:
        raise _refuse("request", f"have at most {MOST_BYTES} bytes", len(content))
    try:
        body = parse_json(content)
    except ValueError as error:
        raise ValueError(
            f"request must be JSON, got {shorten_text(str(error))}. Reload the page."
        ) from None
    if not isinstance(body, dict):
        raise _refuse("request", "be an object", body)
    call = body.get("call")
    if not isinstance(call, str) or call not in CALLS:
        raise _refuse("call", f"be one of {', '.join(CALLS)}", call)
    names = CALLS[call][0]
    if body.keys() != {"call", *names}:
        raise _refuse(f"arguments of {call}", f"be {', '.join(names) or 'none'}", sorted(body))
    return call, {name: _read(name, body[name], desk) for name in names}


def _read(name: str, value: Any, desk: Desk) -> Any:
    rules = {"words": TEXT, "judge": make_choice_rule(*desk.judges.names)}
    rule = rules.get(name, _NUMBER)
    if rule.convert(name, value) is None:
        raise _refuse(name, rule.must, value)
    return value


def _refuse(what: str, rule: str, value: object) -> ValueError:
    got = shorten_text(shorten(value).encode("utf-8", "backslashreplace").decode())
    return ValueError(f"{what} must {rule}, got {got}. Reload the page.")
