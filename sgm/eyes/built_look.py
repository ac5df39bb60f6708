"""What the frames of a visit make: a look, and the sightings of a look."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sgm.camera.scene import Scene
from sgm.eyes.look_rules import LookRules
from sgm.eyes.spots import Spots
from sgm.eyes.tracks import Track
from sgm.eyes.visits import Visit
from sgm.layout.viewpoint import Viewpoint
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.schema import MOST_METRES, RELATIONS, PlaceCode

_SURE = 0.5  # confidence from which on a thing has a spot
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


def make_look(
    scene: Scene,
    rules: LookRules,
    visit: Visit,
    tracks: Sequence[Track],
    spots: Spots,
    *,
    ends: bool = False,
) -> BuiltLook | None:
    """Return the look of a visit that `ends`, or would end now; None for a glimpse.

    Where it ends, the spots of what was seen are renewed.
    """
    most = 1.0 if visit.has_depth else rules.most_blind
    coverage = visit.points.compute_coverage(scene, visit.place, most)
    confidence = [track.compute_confidence() for track in tracks]
    found = list(zip(tracks, confidence, strict=True))
    least = rules.least_confidence
    sure = [(track, sureness) for track, sureness in found if sureness >= least]
    certain = [track for track, sureness in sure if sureness >= _SURE]
    of_sure = [track for track, _ in sure]
    hidden = spots.find_hidden(visit.place, of_sure, certain)
    if ends:
        top = scene.boxes[visit.place].top
        spots.renew(visit.place, top, of_sure, certain)
    if not sure and max(coverage.values()) < rules.least_coverage:
        return None
    seen = tuple(make_sighting(track, sureness) for track, sureness in sure)
    for sighting in seen:  # what showed a thing showed something of the place
        coverage[sighting.relation] = max(coverage[sighting.relation], 1 / rules.num_points)
    return BuiltLook(
        furniture=scene.ids[visit.place],
        seen=seen,
        coverage=coverage,
        hidden=hidden,
        start=visit.start,
        end=visit.last,
        num_frames=visit.num_frames,
        viewpoint=visit.viewpoint,
    )


def make_sighting(track: Track, confidence: float) -> Sighting:
    """Return what a look says of a thing that its frames have shown."""
    position = sd = None
    if np.abs(track.center).max() <= MOST_METRES:  # nan is not
        x, y, z = np.round(track.center, _DIGITS).tolist()
        position, sd = (x, y, z), min(round(track.center_sd, _DIGITS), MOST_METRES)
    relation = RELATIONS[PlaceCode.relation(track.volume)]
    return Sighting(track.name, relation, confidence, position=position, position_sd=sd)
