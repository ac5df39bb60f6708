"""Counts from BEHAVIOR: what 1,016 household activities put where, and 51 scenes' furniture."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator
from pathlib import Path

from sgm.files import read_file, read_json
from simulator.priors.types import load_names, load_types
from tools.priors.counts import PlaceKey, PlacementCounts
from tools.priors.packages import find_package_data

HOME_SCENES = re.compile(r"(Beechwood|Benevolence|Ihlen|Merom|Pomaria|Rs|Wainscott|house|gates)_")
RELATIONS = ("ontop", "inside")

Expression = str | list["Expression"]


def count_behavior(folder: Path | None = None, *, skip_bad: bool = False) -> PlacementCounts:
    """Count in how many activities an object lies on or in a furniture type.

    A fact of the initial state or of the goal counts once per activity and room; facts under `not`
    do not count. The relation is the usual one of the furniture (a shelf's objects are onTop).
    Scenes that are homes give the share of rooms with the furniture.

    Args:
        folder: the `bddl` package's folder; None finds the installed package.
        skip_bad: note activities that cannot be parsed and go on.

    Raises:
        ModuleNotFoundError: if `folder` is None and the package is missing.
        ValueError: on a malformed activity, unless `skip_bad`.
    """
    folder = find_package_data("bddl", "") if folder is None else Path(folder)
    counts = PlacementCounts("behavior", skips_bad=skip_bad)
    for path in sorted((folder / "activity_definitions").glob("*/*.bddl")):
        where = f"{path.parent.name}/{path.name}"
        try:
            places = find_places(read_file(path).decode("utf-8"), counts)
        except ValueError as error:
            counts.report(
                f"activity must be a balanced definition, got {error} in {where}", "Mend it"
            )
            continue
        counts.num_units += 1
        for place in places:
            counts.placements[place] += 1
    _count_scenes(folder / "generated_data", counts)
    return counts


def parse_expression(text: str) -> Expression:
    """Parse an s-expression to nested lists.

    Raises:
        ValueError: if the parentheses do not match.
    """
    stack: list[list[Expression]] = [[]]
    for token in re.findall(r"[()]|[^\s()]+", re.sub(r";[^\n]*", "", text)):
        if token == "(":
            stack.append([])
        elif token != ")":
            stack[-1].append(token)
        elif len(stack) > 1:
            last = stack.pop()
            stack[-1].append(last)
        else:
            raise ValueError("one ')' too many")
    if len(stack) > 1 or len(stack[0]) != 1:
        raise ValueError(f"{len(stack) - 1} '(' left open")
    return stack[0][0]


def find_places(text: str, counts: PlacementCounts) -> set[PlaceKey]:
    """Distinct (room, furniture, object, relation) of one activity, in our names."""
    names = load_names("behavior")
    facts = list(walk_facts(parse_expression(text)))
    rooms: dict[str, set[str]] = {}
    for fact in facts:
        if fact[0] == "inroom" and len(fact) == 3:
            room = names.find_room(fact[2])
            if room is None:
                counts.outside["rooms"][fact[2]] += 1
            else:
                for key in (fact[1], find_synset(fact[1])):
                    rooms.setdefault(key, set()).add(room)
    places: set[PlaceKey] = set()
    for fact in facts:
        if fact[0] not in RELATIONS or len(fact) != 3:
            continue
        item, parent = fact[1:]
        parent_rooms = rooms.get(parent) or rooms.get(find_synset(parent), set())
        if not parent_rooms:
            continue  # lies in another object, or outside the four rooms
        furniture = names.find_furniture(find_synset(parent))
        label = names.find_object(find_synset(item))
        if furniture is None:
            counts.outside["furniture"][find_synset(parent)] += 1
        elif label is None:
            counts.outside["objects"][find_synset(item)] += 1
        else:
            relation = load_types().furniture[furniture].relation
            places.update((room, furniture, label, relation) for room in parent_rooms)
    return places


def walk_facts(expression: Expression) -> Iterator[list[str]]:
    """Yield the flat facts of an expression; what stands under `not` is left out."""
    if isinstance(expression, str) or not expression or expression[0] == "not":
        return
    if all(isinstance(part, str) for part in expression):
        yield [str(part) for part in expression]
        return
    for part in expression:
        yield from walk_facts(part)


def find_synset(term: str) -> str:
    """`mug.n.04_1`, `mug.n.04_*` and `?mug.n.04` are all of synset `mug.n.04`."""
    return re.sub(r"_(\d+|\*)$", "", term).removeprefix("?")


def _count_scenes(folder: Path, counts: PlacementCounts) -> None:
    """Rooms of home scenes, and which of them hold each furniture type."""
    names = load_names("behavior")
    with (folder / "category_mapping.csv").open(encoding="utf-8", newline="") as file:
        synsets = {entry["category"]: entry["synset"] for entry in csv.DictReader(file)}
    inventory = read_json(folder / "combined_room_object_list.json")
    for scene, rooms in sorted(inventory["scenes"].items()):
        if not HOME_SCENES.match(scene):
            continue
        for instance, models in sorted(rooms.items()):
            room = names.find_room(re.sub(r"_\d+$", "", instance))
            if room is None:
                continue
            counts.num_rooms[room] += 1
            categories = {model.rpartition("-")[0] for model in models}
            held = {_find_scene_furniture(category, synsets) for category in categories}
            for furniture in sorted(held - {None, ""}, key=str):
                counts.furniture[room, str(furniture)] += 1


def _find_scene_furniture(category: str, synsets: dict[str, str]) -> str | None:
    names = load_names("behavior")
    if "bottom_cabinet" in category:  # same synset as a top cabinet, but not one
        return None
    return names.find_furniture(category) or names.find_furniture(synsets.get(category, ""))
