"""The rules that a prior file must keep, each broken one reported with its row."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from sgm.files import VERSION
from sgm.messages import shorten
from sgm.schema import RELATIONS

MOST_DESCRIPTIONS = 100_000  # of a type: every combination of its adjectives is one
MOST_DESCRIPTIONS_OF_ALL = 1_000_000

Rule = tuple[Callable[[Any], bool], str]


def _is_weight(value: Any) -> bool:
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    return is_number and math.isfinite(value) and value >= 0


def _is_name(value: Any) -> bool:
    return isinstance(value, str) and bool(value.strip())


def _is_adjectives(value: Any) -> bool:
    return (
        isinstance(value, Sequence)
        and all(
            isinstance(words, Sequence) and not isinstance(words, str) and all(map(_is_name, words))
            for words in value
        )
        and (_count_descriptions(value) <= MOST_DESCRIPTIONS)
    )


def _count_descriptions(adjectives: Sequence[Sequence[str]]) -> int:
    return math.prod(1 + len(words) for words in adjectives)


NAME: Rule = (_is_name, "be a non-empty text")
NAME_OR_NONE: Rule = (lambda value: value is None or _is_name(value), "be a non-empty text or null")
WEIGHT: Rule = (_is_weight, "be a finite number >= 0")
PROBABILITY: Rule = (lambda value: _is_weight(value) and value <= 1, "be a number from 0 to 1")
COUNT: Rule = (
    lambda value: isinstance(value, int) and not isinstance(value, bool) and value >= 1,
    "be a whole number >= 1",
)
ADJECTIVES: Rule = (
    _is_adjectives,
    f"be a list of lists of words, which make at most {MOST_DESCRIPTIONS} combinations",
)
RELATION: Rule = (lambda value: value in RELATIONS, f"be one of {', '.join(RELATIONS)}")
WEIGHT_OR_NONE: Rule = (lambda value: value is None or _is_weight(value), "be null or >= 0")

FIELDS: dict[str, dict[str, Rule]] = {
    "furniture": {
        "label": NAME,
        "room": NAME,
        "prob": WEIGHT,
        "max_count": COUNT,
        "adjectives": ADJECTIVES,
    },
    "objects": {
        "label": NAME,
        "sample_prob": PROBABILITY,
        "max_count": COUNT,
        "move_freq": PROBABILITY,
        "add_remove_prob": PROBABILITY,
        "adjectives": ADJECTIVES,
    },
    "placements": {
        "room": NAME_OR_NONE,
        "furniture": NAME,
        "object": NAME,
        "relation": RELATION,
        "prob": WEIGHT,
        "count": WEIGHT_OR_NONE,
        "source": NAME_OR_NONE,
    },
}
OPTIONAL = {"placements": frozenset({"count", "source"})}
PARTS = frozenset({"version", "metadata", "rooms", *FIELDS})


def find_problems(data: Any) -> Iterator[str]:
    """Yield every broken rule of a prior, the parsed JSON of a file, as a sentence with its row."""
    if not isinstance(data, Mapping):
        yield f"prior must be a JSON object, got {type(data).__name__}. Start from a built file"
        return
    if data.get("version") != VERSION:
        yield f"version must be {VERSION}, got {shorten(data.get('version'))}. Rebuild the file"
    if not isinstance(data.get("metadata", {}), Mapping):
        yield "metadata must be a JSON object. Remove or mend it"
    for extra in sorted(set(data) - PARTS):
        yield f"prior must have known parts only, got {shorten(extra)}. Remove it"
    rooms = data.get("rooms")
    if not _is_list(rooms) or not rooms or not all(map(_is_name, rooms)):
        yield f"rooms must be a non-empty list of texts, got {_shorten(rooms)}. Name the rooms"
        return
    if len(set(rooms)) < len(rooms):
        yield f"rooms must be unique, got {shorten(rooms)}. Remove the repeated one"
    well_formed = True
    for part in FIELDS:
        if not _is_list(data.get(part)) or not data[part]:
            yield f"{part} must be a non-empty list, got {_shorten(data.get(part))}. Add rows"
            well_formed = False
            continue
        for problem in _find_row_problems(part, data[part]):
            yield problem
            well_formed = False
    if well_formed:
        for part in ("furniture", "objects"):
            number = sum(_count_descriptions(fields["adjectives"]) for fields in data[part])
            if number > MOST_DESCRIPTIONS_OF_ALL:
                yield (
                    f"{part} must have adjectives of at most {MOST_DESCRIPTIONS_OF_ALL} "
                    f"combinations, got {shorten(number)}. Name fewer"
                )
        yield from _find_link_problems(data)


def check_prior(data: Any, *, where: str = "") -> None:
    """Raise if a prior, the parsed JSON of a file, breaks a rule.

    Raises:
        ValueError: names the first bad row, the file `where`, and how many more there are.
    """
    problems = list(find_problems(data))
    if problems:
        more = f" ({len(problems) - 1} more)" if len(problems) > 1 else ""
        raise ValueError(
            f"{problems[0]}{f' in {where}' if where else ''}{more}. "
            "List all problems with `python -m simulator.priors check FILE`."
        )


def _is_list(value: Any) -> bool:
    return isinstance(value, (list, tuple))


def _shorten(value: Any) -> str:
    return shorten(value, 60)


def _find_row_problems(part: str, rows: Sequence[Any]) -> Iterator[str]:
    """Rules that look at one row alone."""
    fields = FIELDS[part]
    required = set(fields) - OPTIONAL.get(part, frozenset())
    if all(isinstance(row, Mapping) and row.keys() == fields.keys() for row in rows) and all(
        _holds_everywhere(rule, [row[field] for row in rows]) for field, rule in fields.items()
    ):
        return  # a thousand good rows in a few milliseconds; the loop below words the faults
    for index, row in enumerate(rows):
        name = f"{part}[{index}]"
        if not isinstance(row, Mapping):
            yield f"{name} must be a JSON object, got {_shorten(row)}. Write one field per column"
            continue
        for field in sorted(required - row.keys()):
            yield f"{name} must have the field {shorten(field)}, got {sorted(row)}. Add it"
        for field, value in row.items():
            if field not in fields:
                yield f"{name} must have known fields only, got {shorten(field)}. Remove it"
                continue
            holds, rule = fields[field]
            if not holds(value):
                yield f"{name}.{field} must {rule}, got {_shorten(value)}. Correct the row"


def _holds_everywhere(rule: Rule, values: list[Any]) -> bool:
    """Whether a rule holds for a whole column; equal values are tested once."""
    if bool in set(map(type, values)):
        return False  # True would hide behind an equal 1
    try:
        values = list(set(values))
    except TypeError:  # lists are not hashable
        pass
    return all(map(rule[0], values))


def _find_link_problems(data: Mapping[str, Any]) -> Iterator[str]:
    """Rules across rows: unknown names, repeated rows, unreachable types."""
    rooms = set(data["rooms"])
    nodes: dict[tuple[str, str], int] = {}
    for index, furniture in enumerate(data["furniture"]):
        node = (furniture["room"], furniture["label"])
        if furniture["room"] not in rooms:
            found = shorten(furniture["room"])
            yield f"furniture[{index}].room must be in rooms, got {found}. Add the room"
        if nodes.setdefault(node, index) != index:
            yield f"furniture[{index}] must be unique, got {node} again. Remove it"
    furnished = {furniture["room"] for furniture in data["furniture"] if furniture["prob"] > 0}
    for room in data["rooms"]:
        if room not in furnished:
            yield f"rooms must have furniture with prob > 0, got none for {shorten(room)}. Add some"
    objects: dict[str, int] = {}
    for index, object_type in enumerate(data["objects"]):
        label = object_type["label"]
        if objects.setdefault(label, index) != index:
            yield f"objects[{index}] must be unique, got {shorten(label)} again. Remove it"

    furniture_rooms: dict[str, list[str]] = {}
    for room, label in nodes:
        furniture_rooms.setdefault(label, []).append(room)
    seen: set[tuple[str, str, str, str]] = set()
    used_nodes: set[tuple[str, str]] = set()
    used_objects: set[str] = set()
    for index, placement in enumerate(data["placements"]):
        name, room, furniture = f"placements[{index}]", placement["room"], placement["furniture"]
        thing = placement["object"]
        if thing not in objects:
            yield f"{name}.object must be in objects, got {shorten(thing)}. Add the type"
        if room is not None and room not in rooms:
            yield f"{name}.room must be in rooms or null, got {shorten(room)}. Add the room"
            continue
        placement_rooms = furniture_rooms.get(furniture, []) if room is None else [room]
        if not placement_rooms or (placement_rooms[0], furniture) not in nodes:
            found = f"{shorten(furniture)} ({room})"
            yield f"{name}.furniture must be in furniture, got {found}. Add the type"
            continue
        for placement_room in placement_rooms:
            cell = (placement_room, furniture, thing, placement["relation"])
            if cell in seen:
                yield f"{name} must be unique, got {cell} again. Remove one of the two rows"
                break
            seen.add(cell)
            if placement["prob"] > 0:
                used_nodes.add((placement_room, furniture))
                used_objects.add(thing)
    for label, index in objects.items():
        if label not in used_objects:
            yield (
                f"objects[{index}] must have a placement with prob > 0, got none for "
                f"{shorten(label)}. Add one or remove the type"
            )
    for node, index in nodes.items():
        if node not in used_nodes:
            yield (
                f"furniture[{index}] must have a placement with prob > 0, got none for {node}. "
                "Add one or remove the type"
            )
