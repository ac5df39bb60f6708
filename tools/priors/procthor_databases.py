"""Counts from symbolic houses, sampled from the databases of ProcTHOR's house generator."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from sgm.checks import check_at_least
from simulator.priors.types import load_names, load_types
from tools.priors.counts import PlacementCounts
from tools.priors.packages import find_package_data
from tools.priors.procthor_assets import (
    AssetGroup,
    ProcthorAssets,
    RoomAssets,
    load_assets,
    place_members,
)
from tools.priors.procthor_rooms import (
    Draw,
    FreeFloor,
    Rectangle,
    choose_weighted,
    sample_room_sizes,
)
from tools.priors.procthor_rules import (
    HOUSE_BIAS_BETA,
    HOUSE_BIAS_LOW,
    HOUSE_BIAS_RANGE,
    MARGIN_FRONT,
    MARGIN_MIDDLE,
    MAX_COPIES,
    NUM_ATTEMPTS,
    NUM_DOORS,
    P_ALLOW_GROUP,
    P_GROUP,
    P_SKIP_WEIGHT_ONE,
    PADDING,
)

NUM_HOUSES = 30_000
SEED = 0


def count_procthor_databases(
    folder: Path | None = None,
    *,
    num_houses: int = NUM_HOUSES,
    seed: int = SEED,
) -> PlacementCounts:
    """Sample symbolic houses and count what stands and lies where.

    A symbolic house is what ProcTHOR's generator would draw, less meshes and physics. It has rooms
    with sizes, and up to seven pieces or groups of furniture that fit the free floor. Small objects
    are on them, one to three each, with probability p + parent's, object's and house's bias.

    Args:
        folder: the package's `databases` folder; None finds the installed package.
        num_houses: houses to sample.
        seed: of the one random stream; the same seed gives the same counts.

    Raises:
        ValueError: if `num_houses` is not positive.
        ModuleNotFoundError: if `folder` is None and the package is missing.

    Source: ProcTHOR (Deitke et al., 2022), generator rules; the code is ours.
    """
    check_at_least(1, num_houses=num_houses)
    assets = load_assets(find_package_data("procthor", "databases") if folder is None else folder)
    rng = np.random.default_rng(np.random.SeedSequence([0x70726F63, seed]))
    draw = _draw_uniforms(rng).__next__
    held: Counter[tuple[str, str]] = Counter()
    placed: Counter[tuple[str, str, str]] = Counter()
    counts = PlacementCounts("procthor", is_per_room=True)
    for _ in range(num_houses):
        chances = [chance for _, chance in NUM_ATTEMPTS]
        attempts = NUM_ATTEMPTS[choose_weighted(draw, chances)][0]
        bias = HOUSE_BIAS_LOW + HOUSE_BIAS_RANGE * float(rng.beta(*HOUSE_BIAS_BETA))
        for room, width, depth in sample_room_sizes(draw, lambda n: float(rng.beta(0.5 * n, 6.0))):
            counts.num_rooms[room] += 1
            furniture = _furnish(draw, assets, room, width, depth, attempts)
            held.update((room, asset_type) for asset_type in set(furniture))
            for parent, child in _spawn_objects(draw, rng, assets, room, furniture, bias):
                placed[room, parent, child] += 1
    counts.num_units = num_houses
    _translate(held, placed, counts)
    return counts


def _translate(
    held: Counter[tuple[str, str]],
    placed: Counter[tuple[str, str, str]],
    counts: PlacementCounts,
) -> None:
    """From ProcTHOR's names to ours; what has none is noted."""
    names = load_names("procthor")
    types = load_types()
    for (room, asset_type), count in sorted(held.items()):
        furniture = names.find_furniture(asset_type)
        if furniture is None:
            counts.outside["furniture"][asset_type] += count
        else:
            counts.furniture[room, furniture] += count
    for (room, asset_type, child), count in sorted(placed.items()):
        furniture, label = names.find_furniture(asset_type), names.find_object(child)
        if label is None:
            counts.outside["objects"][child] += count
        elif furniture is not None:
            relation = types.furniture[furniture].relation
            counts.placements[room, furniture, label, relation] += count


def _draw_uniforms(rng: np.random.Generator) -> Iterator[float]:
    while True:
        yield from rng.random(1 << 16).tolist()


def _furnish(
    draw: Draw, assets: ProcthorAssets, room: str, width: float, depth: float, attempts: int
) -> list[str]:
    """Types that stand in one room, one entry per instance."""
    kinds = assets.rooms[room]
    floor = FreeFloor(width, depth)
    for _ in range(NUM_DOORS[room]):
        floor.cut_door(draw)
    chooser = _Chooser(draw, kinds, assets.is_multiple)
    tried: set[Rectangle] = set()
    for _ in range(attempts):
        rectangle = floor.sample_rectangle(draw, tried)
        if rectangle is None:
            break
        anchor = floor.sample_anchor(draw, rectangle)
        size = chooser.place(rectangle, anchor)
        if size is None:
            tried.add(rectangle)
            continue
        tried = set()
        floor.subtract(_find_footprint(draw, rectangle, anchor, size))
    return chooser.placed


class _Chooser:
    """What one room may still hold, and what it holds."""

    def __init__(self, draw: Draw, kinds: RoomAssets, is_multiple: frozenset[str]) -> None:
        self.draw = draw
        self.kinds = kinds
        self.is_multiple = is_multiple
        self.is_open = np.ones(len(kinds.types), dtype=bool)
        self.groups = [
            group for group in kinds.groups if draw() < P_ALLOW_GROUP.get(group.name, 1.0)
        ]
        order = sorted((draw(), asset_type) for asset_type in kinds.priority)
        self.priority = [asset_type for _, asset_type in order]
        self.placed: list[str] = []

    def place(self, rectangle: Rectangle, anchor: str) -> tuple[float, float] | None:
        """Choose what to place in a rectangle.

        Returns:
            the size along x and z with the space kept free, or None if nothing fits.
        """
        spare_width, spare_depth, turns = _find_spare(anchor)
        x_free = rectangle.x1 - rectangle.x0
        z_free = rectangle.z1 - rectangle.z0
        anchor_row = {0: 2, 2: 1, 4: 0}[len(anchor)]
        kinds = self.kinds
        width, depth = kinds.width + spare_width, kinds.depth + spare_depth
        straight = (width < x_free) & (depth < z_free)
        turned = (depth < x_free) & (width < z_free)
        fits = straight | turned if len(turns) == 2 else (turned if turns[0] else straight)
        is_open = (
            self.is_open & kinds.anchors[anchor_row] & np.logical_or.reduceat(fits, kinds.starts)
        )
        groups = [
            group
            for group in self.groups
            if group.anchors[anchor_row]
            and _fit_turns(group.max_size, spare_width, spare_depth, x_free, z_free, turns)
        ]
        choice = self._choose(is_open, groups)
        if choice is None:
            return None
        if isinstance(choice, AssetGroup):
            size = self._take_group(choice)
            turn_options = _fit_turns(
                choice.max_size, spare_width, spare_depth, x_free, z_free, turns
            )
        else:
            size = self._take_asset(choice, fits)
            turn_options = _fit_turns(size, spare_width, spare_depth, x_free, z_free, turns)
        is_turned = turn_options[int(self.draw() * len(turn_options))]
        full = (size[0] + spare_width, size[1] + spare_depth)
        return (full[1], full[0]) if is_turned else full

    def _choose(self, is_open: np.ndarray, groups: list[AssetGroup]) -> AssetGroup | int | None:
        """A group, the index of a type, or None."""
        draw, types = self.draw, self.kinds.types
        for asset_type in self.priority:
            with_kind = [group for group in groups if asset_type in group.types]
            alone = types.index(asset_type) if asset_type in types else None
            if with_kind and (alone is None or draw() <= P_GROUP):
                return with_kind[int(draw() * len(with_kind))]
            if alone is not None and is_open[alone]:
                return alone
        if groups and draw() <= P_GROUP:
            return groups[int(draw() * len(groups))]
        if draw() <= P_SKIP_WEIGHT_ONE:
            is_open = is_open & self.kinds.is_certain
        options = np.flatnonzero(is_open)
        return int(options[int(draw() * len(options))]) if len(options) else None

    def _take_asset(self, index: int, fits: np.ndarray) -> tuple[float, float]:
        kinds = self.kinds
        stop = kinds.starts[index + 1] if index + 1 < len(kinds.starts) else len(fits)
        options = np.flatnonzero(fits[kinds.starts[index] : stop]) + kinds.starts[index]
        asset = int(options[int(self.draw() * len(options))])
        self._note(kinds.types[index])
        return float(kinds.width[asset]), float(kinds.depth[asset])

    def _take_group(self, group: AssetGroup) -> tuple[float, float]:
        choices: dict[str, tuple[str, float, float]] = {}
        members = []
        for name, _, _, options in group.members:
            if name not in choices:
                choices[name] = options[int(self.draw() * len(options))]
            members.append(choices[name][0])
        if not group.allow_duplicates:
            self.groups.remove(group)
        for asset_type in members:
            self._note(asset_type)
        return place_members(group, choices)

    def _note(self, asset_type: str) -> None:
        """Note one placed type; close it if a room holds only one."""
        self.placed.append(asset_type)
        if asset_type in self.priority:
            self.priority.remove(asset_type)
        if asset_type not in self.is_multiple:
            self.groups = [group for group in self.groups if asset_type not in group.types]
            if asset_type in self.kinds.types:
                self.is_open[self.kinds.types.index(asset_type)] = False


def _find_spare(anchor: str) -> tuple[float, float, tuple[bool, ...]]:
    """Space to add to width and depth, and which turns (by 90 degrees) the anchor allows."""
    if len(anchor) == 4:
        return PADDING, MARGIN_FRONT + PADDING, (False, True)
    if len(anchor) == 2:
        return 0.0, MARGIN_FRONT + PADDING, (anchor[0] == "x",)
    return 2 * MARGIN_MIDDLE, 2 * MARGIN_MIDDLE, (False, True)


def _fit_turns(
    size: tuple[float, float],
    spare_width: float,
    spare_depth: float,
    x_free: float,
    z_free: float,
    turns: tuple[bool, ...],
) -> list[bool]:
    """Which of the allowed turns fit."""
    width, depth = size[0] + spare_width, size[1] + spare_depth
    return [
        turn
        for turn in turns
        if (depth < x_free and width < z_free if turn else width < x_free and depth < z_free)
    ]


def _find_footprint(
    draw: Draw, rectangle: Rectangle, anchor: str, size: tuple[float, float]
) -> Rectangle:
    """Where in the rectangle something of this size goes."""
    x_size, z_size = size
    if "x-" in anchor:
        x0 = rectangle.x0
    elif "x+" in anchor:
        x0 = rectangle.x1 - x_size
    else:
        x0 = rectangle.x0 + draw() * (rectangle.x1 - rectangle.x0 - x_size)
    if "z-" in anchor:
        z0 = rectangle.z0
    elif "z+" in anchor:
        z0 = rectangle.z1 - z_size
    else:
        z0 = rectangle.z0 + draw() * (rectangle.z1 - rectangle.z0 - z_size)
    return Rectangle(x0, z0, x0 + x_size, z0 + z_size)


def _spawn_objects(
    draw: Draw,
    rng: np.random.Generator,
    assets: ProcthorAssets,
    room: str,
    furniture: list[str],
    bias: float,
) -> Iterator[tuple[str, str]]:
    """Yield (receptacle type, object type) of the small objects of one room."""
    kinds = assets.rooms[room]
    parents = [asset_type for asset_type in furniture if asset_type in kinds.spawn]
    chosen: list[tuple[float, str, str, float]] = []
    for parent in parents:
        children, spawn, again = kinds.spawn[parent]
        for index in np.flatnonzero(rng.random(len(children)) <= spawn + bias).tolist():
            chosen.append((draw(), parent, children[index], again[index]))
    chosen.sort()
    present = set(furniture)
    for _, parent, child, p_again in chosen:
        copies = 1
        while copies < MAX_COPIES and draw() <= p_again:
            copies += 1
        for _ in range(copies):
            if child in present and child not in assets.is_multiple:
                break
            present.add(child)
            yield parent, child
