"""Messages of Foxglove's schemas as JSON values: scenes of boxes, spheres and texts, and poses.

Every scene is whole: it takes away all that its topic has shown. So a viewer that jumps to a time
needs no more than the last message of each topic.

Source: the schemas SceneUpdate, FrameTransform and PoseInFrame of Foxglove, in the JSON form of
protocol buffers.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, TypeAlias

from sgm.export.home_scene import (
    LAID_OUT,
    MEASURED,
    HomeScene,
    PlacedFurniture,
    PlacedThing,
)
from sgm.finder.ranking import Place, Ranking
from sgm.layout.box import Box
from sgm.memory.sighting import Point

Message: TypeAlias = dict[str, Any]
Colour: TypeAlias = tuple[float, float, float, float]  # red, green, blue and opacity, 0 to 1

MAP_FRAME = "map"
_WOOD: Colour = (0.65, 0.58, 0.5, 0.6)
_PALE: Colour = (0.6, 0.6, 0.6, 0.25)  # furniture without coordinates
_BLUE: Colour = (0.15, 0.45, 0.85, 1.0)
_PALE_BLUE: Colour = (0.15, 0.45, 0.85, 0.45)  # things of which the furniture alone is known
_INK: Colour = (0.1, 0.1, 0.1, 1.0)
# Metres of a thing, and of letters.
_THING, _THING_TEXT, _FURNITURE_TEXT, _ROOM_TEXT = 0.08, 0.08, 0.12, 0.25
_BESIDE = 0.03  # metres by which a belief is drawn around furniture
_LEAST_SHOWN = 0.005  # probability from which on a place is drawn
_LOW, _HIGH = (0.25, 0.35, 0.9), (1.0, 0.25, 0.0)  # red, green, blue of probabilities 0 and 1


def tell_furniture(scene: HomeScene, stamp: str) -> Message:
    """Return furniture as boxes with names, and the labels of rooms.

    A footprint that is no rectangle is drawn by its edges. `stamp` is a time in ISO 8601.
    """
    entities = [
        _make_entity(
            f"furniture {number}",
            stamp,
            {"furniture": number, "name": piece.name, "extents": piece.extents},
            **_draw_furniture(piece),
        )
        for number, piece in scene.furniture.items()
    ]
    for index, (label, point) in enumerate(scene.rooms):
        text = _write(label, point, _ROOM_TEXT)
        entities.append(_make_entity(f"room {index} {label}", stamp, {"room": label}, texts=[text]))
    return _make_scene(entities, stamp)


def tell_things(scene: HomeScene, stamp: str) -> Message:
    """Return things as spheres with names; pale ones lie anywhere on or in their furniture."""
    return _make_scene(
        [
            _make_entity(
                f"thing {index} {thing.name}",
                stamp,
                _tell_thing(thing, scene),
                **_draw_thing(thing),
            )
            for index, thing in enumerate(scene.things)
        ],
        stamp,
    )


def tell_belief(ranking: Ranking, scene: HomeScene, stamp: str) -> Message:
    """Return where one thing may be: boxes from blue (unlikely) to red (sure) with percentages."""
    entities = [
        _make_entity(
            f"place {place.furniture}",
            stamp,
            {
                "thing": ranking.description,
                "name": place.name,
                "probability": f"{place.probability:.4f}",
                "why": place.why,
            },
            **_draw_place(place, scene.furniture[place.furniture].box),
        )
        for place in _choose_places(ranking)
    ]
    left = {"elsewhere": ranking.elsewhere, "with the robot": ranking.with_robot}
    said = [f"{share:.0%} {where}" for where, share in left.items() if share >= _LEAST_SHOWN]
    if said and scene.furniture:
        boxes = [piece.box for piece in scene.furniture.values()]
        low = min(float(box.corners[:, 1].min()) for box in boxes)
        x = sum(box.center[0] for box in boxes) / len(boxes)
        text = _write(f"{ranking.description}: {', '.join(said)}", (x, low - 0.5, 0.5), _ROOM_TEXT)
        values = {where: f"{share:.4f}" for where, share in left.items()}
        entities.append(_make_entity("elsewhere", stamp, values, texts=[text]))
    return _make_scene(entities, stamp)


def tell_pose(point: tuple[float, float, float], yaw: float, stamp: str) -> Message:
    """Return a pose in the map, a `PoseInFrame`: x, y, z in metres, yaw in radians."""
    return {"timestamp": stamp, "frameId": MAP_FRAME, "pose": _make_pose(point, yaw)}


def tell_frame(child: str, point: tuple[float, float, float], yaw: float, stamp: str) -> Message:
    """Return where a frame of coordinates is in the map, a `FrameTransform`."""
    pose = _make_pose(point, yaw)
    return {
        "timestamp": stamp,
        "parentFrameId": MAP_FRAME,
        "childFrameId": child,
        "translation": pose["position"],
        "rotation": pose["orientation"],
    }


def _choose_places(ranking: Ranking) -> list[Place]:
    """Return the places that are likely enough to be drawn, each once."""
    return [place for place in ranking if place.probability >= _LEAST_SHOWN]


def _draw_furniture(piece: PlacedFurniture) -> dict[str, list[Message]]:
    box = piece.box
    colour = _PALE if piece.extents == LAID_OUT else _WOOD
    drawn = {"texts": [_write(piece.name, (*box.center[:2], box.top + 0.1), _FURNITURE_TEXT)]}
    if box.outline is None:
        return {**drawn, "cubes": [_draw_box(box, colour)]}
    corners = box.corners.tolist()
    return {**drawn, "lines": [_draw_loop(corners, height) for height in (box.bottom, box.top)]}


def _draw_loop(corners: Sequence[Sequence[float]], height: float) -> Message:
    return {
        "type": "LINE_LOOP",
        "pose": _make_pose((0.0, 0.0, 0.0), 0.0),
        "thickness": 0.03,
        "points": [_make_vector((x, y, height)) for x, y in corners],
        "color": _make_colour(_WOOD),
    }


def _draw_thing(thing: PlacedThing) -> dict[str, list[Message]]:
    x, y, z = thing.position
    return {
        "spheres": [
            {
                "pose": _make_pose(thing.position, 0.0),
                "size": _make_vector((_THING,) * 3),
                "color": _make_colour(_BLUE if thing.is_measured else _PALE_BLUE),
            }
        ],
        "texts": [_write(thing.name, (x, y, z + _THING), _THING_TEXT)],
    }


def _tell_thing(thing: PlacedThing, scene: HomeScene) -> dict[str, Any]:
    return {
        "thing": thing.name,
        "place": scene.furniture[thing.furniture].name,
        "relation": thing.relation,
        "last seen at step": thing.last_seen,
        "position": MEASURED if thing.is_measured else "anywhere there",
        **({} if thing.picture is None else {"picture": thing.picture}),
    }


def _draw_place(place: Place, box: Box) -> dict[str, list[Message]]:
    share = min(max(place.probability, 0.0), 1.0)
    red, green, blue = (low + share * (high - low) for low, high in zip(_LOW, _HIGH, strict=True))
    drawn = _draw_box(box, (red, green, blue, 0.15 + 0.6 * share), 2 * _BESIDE)
    above = (*box.center[:2], box.top + 0.3)
    return {"cubes": [drawn], "texts": [_write(f"{share:.0%}", above, _ROOM_TEXT)]}


def _make_scene(entities: Iterable[Message], stamp: str) -> Message:
    return {"deletions": [{"timestamp": stamp, "type": "ALL"}], "entities": list(entities)}


def _make_entity(
    name: str, stamp: str, about: Mapping[str, Any], **drawn: list[Message]
) -> Message:
    """Return an entity of a scene, which stays until it is replaced."""
    return {
        "timestamp": stamp,
        "frameId": MAP_FRAME,
        "id": name,
        "metadata": [{"key": key, "value": str(value)} for key, value in about.items()],
        **drawn,
    }


def _draw_box(box: Box, colour: Colour, larger: float = 0.0) -> Message:
    return {
        "pose": _make_pose(box.center, box.yaw),
        "size": _make_vector([side + larger for side in box.size]),
        "color": _make_colour(colour),
    }


def _write(text: str, point: Point, size: float) -> Message:
    return {
        "pose": _make_pose(point, 0.0),
        "billboard": True,
        "fontSize": size,
        "color": _make_colour(_INK),
        "text": text,
    }


def _make_pose(point: Sequence[float], yaw: float) -> Message:
    turn = {"x": 0.0, "y": 0.0, "z": math.sin(yaw / 2), "w": math.cos(yaw / 2)}
    return {"position": _make_vector(point), "orientation": turn}


def _make_vector(values: Sequence[float]) -> Message:
    return dict(zip("xyz", values, strict=True))


def _make_colour(colour: Colour) -> Message:
    return dict(zip("rgba", colour, strict=True))
