"""What the frames of a visit make: a look, and the sightings of a look."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sgm.eyes.tracks import Track
from sgm.layout.viewpoint import Viewpoint
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.schema import MOST_METRES, RELATIONS, PlaceCode

_DIGITS = 3  # of positions: millimetres


@dataclass(frozen=True, slots=True)
class BuiltLook:
    """One visit to a place: many frames, and one look.

    Attributes:
        furniture: its id.
        seen: what was seen there, and where in the map.
        coverage: share in view of what lies there, by relation.
        hidden: names of things that were seen there before, and whose spots were out of view now:
            that they were not seen says nothing.
        start, end: seconds of the first and the last frame.
        num_frames: frames in which it was in view.
        viewpoint: of the frame that showed most of it; None if it is unknown.
    """

    furniture: int
    seen: tuple[Sighting, ...]
    coverage: dict[str, float]
    hidden: tuple[str, ...]
    start: float
    end: float
    num_frames: int
    viewpoint: Viewpoint | None = None

    def tell(self, memory: SceneGraphMemory) -> None:
        """Fold the look into a memory."""
        memory.observe(self.furniture, self.seen, self.coverage, self.hidden, self.viewpoint)


def make_sighting(track: Track, confidence: float) -> Sighting:
    """Return what a look says of a thing that its frames have shown."""
    position = sd = None
    if np.abs(track.center).max() <= MOST_METRES:  # nan is not
        x, y, z = np.round(track.center, _DIGITS).tolist()
        position, sd = (x, y, z), min(round(track.center_sd, _DIGITS), MOST_METRES)
    relation = RELATIONS[PlaceCode.relation(track.volume)]
    return Sighting(track.name, relation, confidence, position=position, position_sd=sd)
