"""What a browser may send: one rule for every value, checked before anything is done with it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Final, Literal

from pydantic import BaseModel, Field, TypeAdapter, ValidationError
from typing_extensions import TypedDict

from nep.view.answers import SEARCH, TRUTH, Desk
from sgm.files import parse_json
from sgm.messages import shorten, shorten_text
from simulator.replay.story import Story

NOBODY: Final = "nobody"  # for the second map, no policy at all
MOST_BYTES = 1_000_000  # of a request; a click sends a few hundred

_Text = Annotated[str, Field(strict=True)]  # what is no name is said where it is asked for
_Count = Annotated[int, Field(strict=True, ge=0, le=2**53)]  # the integers that JSON can hold
_Number = Annotated[float, Field(strict=True, ge=-1e300, le=1e300)]
_Flag = Annotated[bool, Field(strict=True)]
_View = tuple[_Number, _Number, _Number, _Number]  # left, right, bottom, top
_Owner = tuple[Literal["furniture"], _Count] | tuple[Literal["object"], _Text]


class _Zoom(BaseModel):
    left: _Number = Field(0.0, alias="xaxis.range[0]")
    right: _Number = Field(0.0, alias="xaxis.range[1]")
    bottom: _Number = Field(0.0, alias="yaxis.range[0]")
    top: _Number = Field(0.0, alias="yaxis.range[1]")


class _Point(TypedDict, total=False):
    customdata: _Owner | None


class _Click(TypedDict):
    points: Annotated[list[_Point], Field(min_length=1)]


def list_options(story: Story) -> list[str]:
    """Return what may be drawn besides the answer."""
    return [SEARCH] if story.truth is None else [SEARCH, TRUTH]


def list_rules(desk: Desk) -> dict[str, Any]:
    """Return what each value must be, by "id.property" of its part of the page.

    Args:
        desk: whose judges, and whose parts of the map, the page offers.
    """
    names: Any = Literal[tuple(desk.judges.names)]
    options = list_options(desk.stage.story)
    option: Any = Literal[tuple(options)]
    clicks = ("ask.n_clicks", "words.n_submit", "play.n_clicks", "tick.n_intervals")
    return {
        **dict.fromkeys((*clicks, "watch.n_intervals"), _Count | None),
        **dict.fromkeys(("step.value", "step.max", "version.data"), _Count),
        "words.value": _Text | None,
        "asked.data": _Text,
        "object.data": _Text | None,
        "selected.data": _Count | None,
        "tick.disabled": _Flag,
        "judge-a.value": names,
        "judge-b.value": names | Literal[NOBODY],
        "options.value": Annotated[list[option], Field(max_length=len(options))],
        **dict.fromkeys(("view-a.data", "view-b.data"), _View | None),
        **dict.fromkeys(("map-a.relayoutData", "map-b.relayoutData"), _Zoom | None),
        **dict.fromkeys(("map-a.clickData", "map-b.clickData"), _Click | None),
    }


class Inputs:
    """Checks what a browser sends to the callbacks of a page."""

    def __init__(self, desk: Desk, callbacks: Mapping[str, Mapping[str, Any]]) -> None:
        """Make a check of each value.

        Args:
            desk: what the page offers.
            callbacks: `Dash.callback_map`, what each callback takes and gives.

        Raises:
            KeyError: if a callback takes a value without a rule.
        """
        rules = list_rules(desk)
        self._callbacks = callbacks
        self._rules: dict[str, TypeAdapter[Any]] = {
            key: TypeAdapter(rules[key])
            for callback in callbacks.values()
            for key in map(_get_key, [*callback["inputs"], *callback["state"]])
        }

    def check(self, content: bytes) -> None:
        """Check a request that asks for a callback.

        Args:
            content: of the request, JSON.

        Raises:
            ValueError: if it asks for no callback of the page, or a value breaks its rule.
        """
        try:
            body = parse_json(content)
        except ValueError as error:
            raise ValueError(
                f"request must be JSON, got {shorten_text(str(error))}. Reload the page."
            ) from None
        output = body.get("output") if isinstance(body, dict) else None
        callback = self._callbacks.get(output) if isinstance(output, str) else None
        if not isinstance(body, dict) or not isinstance(output, str) or callback is None:
            raise _refuse("output", "name a callback of the page", output)
        if body.get("outputs") not in _list_outputs(output):
            raise _refuse("outputs", f"be those of {output}", body.get("outputs"))
        inputs = list(map(_get_key, callback["inputs"]))
        changed = body.get("changedPropIds")
        if not isinstance(changed, list) or not all(key in inputs for key in changed):
            raise _refuse("changedPropIds", f"be some of {inputs}", changed)
        for part in ("inputs", "state"):
            rows, keys = body.get(part, []), list(map(_get_key, callback[part]))
            if not _are_rows(rows) or list(map(_get_key, rows)) != keys:
                raise _refuse(part, f"be {keys}", rows)
            for key, row in zip(keys, rows, strict=True):
                self._check_value(key, row.get("value"))

    def _check_value(self, key: str, value: object) -> None:
        try:
            self._rules[key].validate_python(value)
        except ValidationError as error:
            said = error.errors(include_url=False, include_context=False)[0]["msg"]
            raise _refuse(key, f"be what the page offers ({said})", value) from None


def _get_key(row: Mapping[str, Any]) -> str:
    return f"{row['id']}.{row['property']}"


def _are_rows(rows: object) -> bool:
    """Tell whether each value comes with the name of what has it."""
    return isinstance(rows, list) and all(
        isinstance(row, dict) and {"id", "property"} <= row.keys() for row in rows
    )


def _list_outputs(output: str) -> list[Any]:
    """Return what a browser may name as the outputs of a callback, "..a.b...c.d@mark.." or "a.b".

    An output of two callbacks has a mark, which some versions of the browser's part leave out.
    """
    is_many = output.startswith("..")
    names = output[2:-2].split("...") if is_many else [output]
    marked = [dict(zip(("id", "property"), name.rsplit(".", 1), strict=True)) for name in names]
    plain = [{**row, "property": row["property"].partition("@")[0]} for row in marked]
    return [marked, plain] if is_many else marked


def _refuse(what: str, rule: str, value: object) -> ValueError:
    return ValueError(f"{what} must {rule}, got {shorten(value)}. Reload the page.")
