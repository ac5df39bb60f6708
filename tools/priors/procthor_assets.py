"""ProcTHOR's generator databases as arrays: what may stand in which room, and how large it is."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sgm.files import read_json
from tools.priors.procthor_rules import (
    CHILD_BIAS,
    PARENT_BIAS,
    PARENT_BIAS_DEFAULT,
    PRIORITY,
    ROOM_COLUMNS,
)

ANCHORS = ("inCorner", "onEdge", "inMiddle")


@dataclass(frozen=True, slots=True)
class AssetGroup:
    """A group of assets placed together, such as a table with chairs.

    Attributes:
        name: name of the group.
        max_size: largest width and depth, for the size filter.
        anchors: whether it may stand in a corner, at an edge, in the middle.
        allow_duplicates: whether a room may hold it twice.
        types: types that any of its members may have.
        members: per member its name (equal names take the same asset), the index of its parent in
            `members` or -1, its position data, and its (type, width, depth) options.
    """

    name: str
    max_size: tuple[float, float]
    anchors: tuple[bool, ...]
    allow_duplicates: bool
    types: frozenset[str]
    members: tuple[tuple[str, int, Any, tuple[tuple[str, float, float], ...]], ...]


@dataclass(frozen=True, slots=True)
class RoomAssets:
    """What one kind of room may hold. T types, A assets sorted by type.

    Attributes:
        types: (T,) names.
        starts: (T,) first asset of each type.
        width: (A,) metres.
        depth: (A,) metres.
        anchors: (3, T) whether the type may stand in a corner, at an edge, in the middle.
        is_certain: (T,) room weight 2 rather than 1.
        groups: asset groups for this room.
        priority: types to place first.
        spawn: per receptacle type its child types, (C,) spawn probabilities without the house's
            bias, and (C,) the probability of one more copy.
    """

    types: tuple[str, ...]
    starts: NDArray[np.int64]
    width: NDArray[np.float64]
    depth: NDArray[np.float64]
    anchors: NDArray[np.bool_]
    is_certain: NDArray[np.bool_]
    groups: tuple[AssetGroup, ...]
    priority: tuple[str, ...]
    spawn: dict[str, tuple[tuple[str, ...], NDArray[np.float64], tuple[float, ...]]]


@dataclass(frozen=True, slots=True)
class ProcthorAssets:
    """Assets of all rooms.

    Attributes:
        rooms: by our room name.
        is_multiple: types that a room may hold more than once.
    """

    rooms: dict[str, RoomAssets]
    is_multiple: frozenset[str]


def load_assets(folder: Path) -> ProcthorAssets:
    """Read the databases of the `procthor` package.

    Args:
        folder: the package's `databases` folder.

    Raises:
        OSError, KeyError: if files or fields are missing (another version of the package).
    """
    assets = _read(folder / "asset-database.json")
    annotations = _read(folder / "placement-annotations.json")
    receptacles = _read(folder / "receptacles.json")
    sizes = {
        asset_type: [
            (float(asset["boundingBox"]["x"]), float(asset["boundingBox"]["z"]))
            for asset in rows
            if asset["split"] in ("train", None)
        ]
        for asset_type, rows in assets.items()
    }
    by_id = {
        asset["assetId"]: (
            asset_type,
            float(asset["boundingBox"]["x"]),
            float(asset["boundingBox"]["z"]),
            asset["split"],
        )
        for asset_type, rows in assets.items()
        for asset in rows
    }
    groups = [(_read(path), path.stem) for path in sorted((folder / "asset_groups").glob("*.json"))]
    rooms = {}
    for room, (column, group_column) in ROOM_COLUMNS.items():
        weights = annotations[column]
        types = sorted(
            asset_type
            for asset_type in annotations["onFloor"]
            if weights.get(asset_type)
            and annotations["onFloor"][asset_type]
            and sizes.get(asset_type)
        )
        lengths = [len(sizes[asset_type]) for asset_type in types]
        flat = np.array(
            [size for asset_type in types for size in sizes[asset_type]], dtype=np.float64
        )
        rooms[room] = RoomAssets(
            types=tuple(types),
            starts=np.concatenate([[0], np.cumsum(lengths)[:-1]]).astype(np.int64),
            width=flat[:, 0].copy(),
            depth=flat[:, 1].copy(),
            anchors=np.array(
                [
                    [bool(annotations[name].get(asset_type)) for asset_type in types]
                    for name in ANCHORS
                ]
            ),
            is_certain=np.array([weights[asset_type] == 2 for asset_type in types]),
            groups=tuple(
                _make_group(name, data, by_id)
                for data, name in groups
                if data["groupProperties"]["roomWeights"][group_column] > 0
            ),
            priority=PRIORITY[room],
            spawn={
                parent: _make_spawn(parent, children, weights)
                for parent, children in receptacles.items()
            },
        )
    multiple = annotations["multiplePerRoom"]
    return ProcthorAssets(
        rooms, frozenset(asset_type for asset_type in multiple if multiple[asset_type])
    )


def place_members(
    group: AssetGroup, choices: dict[str, tuple[str, float, float]]
) -> tuple[float, float]:
    """Width and depth of a group whose members take the chosen assets.

    A member's `position` is relative to an anchor of its parent's outline: anchors number the nine
    points of a 3 x 3 grid row by row, alignments say which side of the member meets the anchor.
    """
    outlines: list[tuple[float, float, float, float]] = []  # centre x, centre z, width, depth
    for name, parent, position, _ in group.members:
        _, width, depth = choices[name]
        x, z = 0.0, 0.0
        if position["turned"]:
            width, depth = depth, width
        if parent >= 0:
            parent_x, parent_z, parent_width, parent_depth = outlines[parent]
            column, row = position["anchor"] % 3 - 1, position["anchor"] // 3 - 1
            x = parent_x + position["x"] + column * parent_width / 2
            z = parent_z + position["z"] + row * parent_depth / 2
            x += (position["x_alignment"] - 1) * width / 2
            z += (position["z_alignment"] - 1) * depth / 2
        outlines.append((x, z, width, depth))
    left = min(x - width / 2 for x, _, width, _ in outlines)
    right = max(x + width / 2 for x, _, width, _ in outlines)
    back = min(z - depth / 2 for _, z, _, depth in outlines)
    front = max(z + depth / 2 for _, z, _, depth in outlines)
    return right - left, front - back


def _read(path: Path) -> Any:
    return read_json(path, allow_nan=True)


def _make_spawn(
    parent: str, children: dict[str, Any], weights: dict[str, int]
) -> tuple[tuple[str, ...], NDArray[np.float64], tuple[float, ...]]:
    kinds = tuple(asset_type for asset_type in sorted(children) if weights.get(asset_type))
    bias = PARENT_BIAS.get(parent, PARENT_BIAS_DEFAULT)
    spawn = [
        children[asset_type]["p"] + bias + CHILD_BIAS.get(asset_type, 0.0) for asset_type in kinds
    ]
    return kinds, np.array(spawn), tuple(float(children[asset_type]["p"]) for asset_type in kinds)


def _make_group(name: str, data: Any, by_id: dict[str, Any]) -> AssetGroup:
    order: list[tuple[str, int]] = []

    def walk(nodes: Any, parent: int) -> None:
        for node in nodes:
            order.append((str(node["instanceId"]), parent))
            walk(node.get("children", []), len(order) - 1)

    walk(data["treeData"], -1)
    members = []
    for instance, parent in order:
        member = data["assetMetadata"][instance]
        position = member["position"]
        options = tuple(
            by_id[asset][:3]
            for assets in member["assetIds"].values()
            for asset in assets
            if by_id[asset][3] in ("train", None)
        )
        place = {
            "x": position["x"] if parent >= 0 else 0.0,
            "z": position["z"] if parent >= 0 else 0.0,
            "anchor": position["relativeAnchorToParent"],
            "x_alignment": position["xAlignment"],
            "z_alignment": position["zAlignment"],
            "turned": member["rotation"] % 180 == 90,
        }
        members.append((member["name"], parent, place, options))
    properties = data["groupProperties"]
    group = AssetGroup(
        name=name,
        max_size=(0.0, 0.0),
        anchors=tuple(properties["location"][part] for part in ("corner", "edge", "middle")),
        allow_duplicates=properties["properties"]["allowDuplicates"],
        types=frozenset(asset_type for member in members for asset_type, _, _ in member[3]),
        members=tuple(members),
    )
    widest = {member[0]: max(member[3], key=lambda option: option[1]) for member in members}
    deepest = {member[0]: max(member[3], key=lambda option: option[2]) for member in members}
    size = (place_members(group, widest)[0], place_members(group, deepest)[1])
    return AssetGroup(
        group.name, size, group.anchors, group.allow_duplicates, group.types, group.members
    )
