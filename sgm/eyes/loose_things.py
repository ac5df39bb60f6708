"""Where things lie that were seen at no place of the map: at what was found since, or on spots."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

import numpy as np

from sgm.camera.detection import Located
from sgm.camera.scene import NOWHERE, Scene
from sgm.eyes.placing import assign
from sgm.eyes.tracks import Track
from sgm.mapping.furniture_mapper import FurnitureMapper
from sgm.schema import ON_TOP, PlaceCode


def settle_things(
    mapper: FurnitureMapper,
    tracks: Sequence[Track],
    eyes: Sequence[np.ndarray],
    dilation: float,
) -> list[tuple[int, int]]:
    """Return furniture id and relation of the place of each thing, of spots that are added else.

    Things within furniture that was found show that it has an inside.

    Args:
        mapper: draws the map.
        tracks: the things.
        eyes: of the camera that saw each of them, (3,).
        dilation: metres.
    """
    volumes = _assign(mapper, tracks, dilation)
    inside: dict[int, list[np.ndarray]] = defaultdict(list)
    for track, (furniture, _) in zip(tracks, volumes, strict=True):
        if furniture == NOWHERE:
            for number in mapper.list_around(track.center):
                inside[number].append(track.center)
    if any([mapper.note_inside(number, centers) for number, centers in inside.items()]):
        volumes = _assign(mapper, tracks, dilation)
    for index, track in enumerate(tracks):
        if volumes[index][0] == NOWHERE:
            bottom = float(track.center[2]) - track.height / 2
            volumes[index] = mapper.find_spot(track.center, bottom, eyes[index]), ON_TOP
    return volumes


def _assign(
    mapper: FurnitureMapper, tracks: Sequence[Track], dilation: float
) -> list[tuple[int, int]]:
    """Return furniture id and relation of each thing, `NOWHERE` where it is at none."""
    if not tracks:
        return []
    scene = Scene(mapper.memory.layout.furniture, num_points=1)
    scene.is_open[:] = True  # what was seen inside was open then
    scene.num_free[:] = 1
    located = Located(
        (),
        np.array([track.center for track in tracks]),
        *(
            np.array([getattr(track, name) for track in tracks])
            for name in ("radius", "height", "sd", "center_sd")
        ),
    )
    found = assign(scene, located, dilation).tolist()
    return [
        (NOWHERE, ON_TOP)
        if volume == NOWHERE
        else (scene.ids[PlaceCode.furniture(volume)], PlaceCode.relation(volume))
        for volume in found
    ]
