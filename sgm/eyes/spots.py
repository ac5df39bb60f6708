"""Where things were seen to lie, and whether a ray has gone through that spot since."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sgm.camera.camera_view import CameraView
from sgm.camera.rays import IN_SIGHT, Bodies, trace_rays
from sgm.eyes.tracks import Track
from sgm.names.words import read_name
from sgm.schema import IS_BORNE, PlaceCode

_VOTES = 2  # frames that must show that a ray went through
_STANDS = 0.03  # metres above a surface at which a thing still stands on it
_SAME_SPOT = 0.15  # metres within which a thing of the same name is taken for the same one
_OVERLAP = 0.5  # of half of both sizes: bodies side by side are all of that apart
_MOST_OVERLAP = 0.05  # metres: thin things, as books, stand closer than they are wide


@dataclass(slots=True, eq=False)
class Spot:
    """Where one thing was seen last.

    Attributes:
        name: of the thing.
        place, volume: numbers in the scene.
        center: in the map, (3,).
        radius, height: of the thing, metres.
        sd: standard deviation of the center, metres.
        num_through: frames of this visit in which a ray went through the spot.
        num_in_front: frames in which something was in front of it.
    """

    name: str
    place: int
    volume: int
    center: np.ndarray
    radius: float
    height: float
    sd: float
    num_through: int = 0
    num_in_front: int = 0

    @property
    def was_in_view(self) -> bool:
        """Whether the frames of this visit show that the spot was not hidden.

        One ray through it, or a few among many that ended before it, are errors of the pose.
        """
        return self.num_through >= _VOTES and 4 * self.num_through >= self.num_in_front


class Spots:
    """Where things were seen at all places.

    A spot is kept until its thing is seen at that place again.
    """

    def __init__(self) -> None:
        self._spots: list[Spot] = []

    def note_rays(self, view: CameraView, places: set[int], through_margin: float) -> None:
        """Count rays through the spots at places that a frame shows."""
        spots = [spot for spot in self._spots if spot.place in places]
        if not spots:
            return
        radius, height, sd = np.array([(spot.radius, spot.height, spot.sd) for spot in spots]).T
        bodies = Bodies(
            center=np.array([spot.center for spot in spots]),
            radius=radius,
            height=height,
            sd=sd,
            volume=np.array([spot.volume for spot in spots]),
        )
        traced = trace_rays(view, bodies, through_margin)
        for spot, through, front in zip(spots, traced.is_through, traced.is_in_front, strict=True):
            spot.num_through += bool(through)
            spot.num_in_front += bool(front)

    def find_hidden(self, place: int, seen: list[Track], certain: list[Track]) -> tuple[str, ...]:
        """Return the names of things of a place that a visit did not show, and hidden all the time.

        A thing is not hidden where rays went through its spot, or where a thing of another name was
        seen at the very spot: two bodies are not at one place, so that it has left, or was called
        by a wrong name before.
        """
        names = {read_name(track.name) for track in seen}
        hidden = [
            spot.name
            for spot in self._spots
            if spot.place == place
            and read_name(spot.name) not in names
            and not _was_in_view(spot, certain)
        ]
        return tuple(dict.fromkeys(hidden))

    def renew(self, place: int, top: float, seen: list[Track], certain: list[Track]) -> None:
        """End a visit: of what was seen at a place, what is certain has spots from now on.

        `top` is the height of the place's upper side, in metres.
        """
        kept = []
        names = {read_name(track.name) for track in seen}
        for spot in self._spots:
            if spot.place != place:
                kept.append(spot)
                continue
            is_seen = read_name(spot.name) in names
            if not is_seen or not (_was_in_view(spot, certain) or _is_near(spot, certain)):
                kept.append(spot)  # of two mugs one may be seen, and the other hidden
            spot.num_through = spot.num_in_front = 0
        for track in certain:
            center = track.center.copy()
            # It stands on the upper side, if not on another thing.
            if IS_BORNE[PlaceCode.relation(track.volume)]:
                low = top + track.height / 2
                if center[2] < low + _STANDS + 2 * track.sd:
                    center[2] = low
            size = track.radius, track.height, track.center_sd
            kept.append(Spot(track.name, place, track.volume, center, *size))
        self._spots = kept

    def renumber(self, places: list[int]) -> None:
        """Go on in another scene, with its number for each place so far, -1 for none."""
        self._spots = [spot for spot in self._spots if places[spot.place] >= 0]
        for spot in self._spots:
            spot.place = places[spot.place]
            spot.volume = PlaceCode.of(spot.place, PlaceCode.relation(spot.volume))


def _was_in_view(spot: Spot, certain: list[Track]) -> bool:
    """Tell whether the frames of this visit show that a spot was not hidden."""
    return spot.was_in_view or _is_taken(spot, certain)


def _is_near(spot: Spot, tracks: list[Track]) -> bool:
    """Tell whether something of that name was seen at the spot, or so near that it was moved."""
    name = read_name(spot.name)
    return any(
        read_name(track.name) == name
        and float(np.linalg.norm(track.center - spot.center)) <= _SAME_SPOT + 2 * spot.sd
        for track in tracks
    )


def _is_taken(spot: Spot, tracks: list[Track]) -> bool:
    """Tell whether a thing of another name was seen at the spot, so near that both would overlap.

    What stands beside, on or below another thing has its middle elsewhere. They must overlap
    wherever in the uncertainty of both they are. One frame is too little, as for rays.
    """
    name = read_name(spot.name)
    for track in tracks:
        offset = np.abs(track.center - spot.center)
        both = spot.radius + track.radius
        doubt = IN_SIGHT * math.hypot(spot.sd, track.center_sd)
        reach = min(_OVERLAP * both, _MOST_OVERLAP, both - doubt)
        if (
            read_name(track.name) != name
            and len(track.frames) >= _VOTES
            and math.hypot(offset[0], offset[1]) <= reach
            and offset[2] <= _OVERLAP * (spot.height + track.height) / 2
        ):
            return True
    return False
