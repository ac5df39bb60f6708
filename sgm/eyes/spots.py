"""Where things were seen to lie, and whether a ray has gone through that spot since."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sgm.eyes.camera_view import CameraView
from sgm.eyes.detection import compute_half_chord
from sgm.eyes.tracks import Track
from sgm.names.words import read_name
from sgm.schema import IS_BORNE, PlaceCode

_VOTES = 2  # frames that must show that a ray went through
_STANDS = 0.03  # metres above a surface at which a thing still stands on it
_SAME_SPOT = 0.15  # metres within which a thing of the same name is taken for the same one
_OVERLAP = 0.5  # of half of both sizes: bodies side by side are all of that apart
_MOST_OVERLAP = 0.05  # metres: thin things, as books, stand closer than they are wide
_LEAST_SIZE = 0.015  # metres: of what looks smaller all ways round, only a corner was seen
_IN_SIGHT = 3.0  # standard deviations by which a spot may be wrong: one in 400 is by more
# Where else a thing may be: to the left of its spot, and towards the camera. In shares of how far.
_APART = 0.25
_STEPS = np.arange(_APART, 1 + _APART, _APART)
_LEFT = np.concatenate(([0.0], -_STEPS, _STEPS, np.zeros_like(_STEPS)))
_TOWARDS = np.concatenate((np.zeros(1 + 2 * len(_STEPS)), _STEPS))
_SUPPORT = 0.015  # metres of what is behind a thing: less cannot be told from the thing itself


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
        _note_rays(view, [spot for spot in self._spots if spot.place in places], through_margin)

    def renew(
        self, place: int, top: float, seen: list[Track], certain: list[Track]
    ) -> tuple[str, ...]:
        """End a visit, and return the names of things that were not seen and hidden all the time.

        A thing is not hidden where rays went through its spot, or where a thing of another name was
        seen at the very spot: two bodies are not at one place, so that it has left, or was called
        by a wrong name before. `top` is the height of the place's upper side, in metres; of what
        was seen there, what is certain has spots from now on.
        """
        kept, hidden = [], []
        names = {read_name(track.name) for track in seen}
        for spot in self._spots:
            if spot.place != place:
                kept.append(spot)
                continue
            is_seen = read_name(spot.name) in names
            was_in_view = spot.was_in_view or _is_taken(spot, certain)
            if not is_seen and not was_in_view:
                hidden.append(spot.name)
            if not is_seen or not (was_in_view or _is_near(spot, certain)):
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
        return tuple(dict.fromkeys(hidden))

    def renumber(self, places: list[int]) -> None:
        """Go on in another scene, with its number for each place so far, -1 for none."""
        self._spots = [spot for spot in self._spots if places[spot.place] >= 0]
        for spot in self._spots:
            spot.place = places[spot.place]
            spot.volume = PlaceCode.of(spot.place, PlaceCode.relation(spot.volume))


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
        doubt = _IN_SIGHT * math.hypot(spot.sd, track.center_sd)
        reach = min(_OVERLAP * both, _MOST_OVERLAP, both - doubt)
        if (
            read_name(track.name) != name
            and len(track.frames) >= _VOTES
            and math.hypot(offset[0], offset[1]) <= reach
            and offset[2] <= _OVERLAP * (spot.height + track.height) / 2
        ):
            return True
    return False


def _note_rays(view: CameraView, spots: list[Spot], through_margin: float) -> None:
    """Count for each spot whether a ray of this frame went through it.

    A ray went through if it was measured to go on behind the thing (`_compute_least_behind`).

    A spot may be beside or before where it was measured, by the uncertainty of both poses and of
    its depth. Rays that a thing there would meet must have gone through as well. Of a thing that
    fits between them no ray tells, and none of one of which only a corner was seen: the rest lies
    beside its middle.
    """
    if not spots:
        return
    center = np.array([spot.center for spot in spots])
    radius, height = np.array([(spot.radius, spot.height) for spot in spots]).T
    volumes = np.array([spot.volume for spot in spots])
    ray = center - view.pose.position
    distance = np.linalg.norm(ray, axis=1)
    ray = ray / np.maximum(distance, 1e-9)[:, None]
    half = compute_half_chord(ray, radius, height)
    sd = np.hypot([spot.sd for spot in spots], view.pose.compute_sd(distance))
    far = np.maximum(_IN_SIGHT * sd - radius, 0)
    points = _list_aims(center, ray, height, far)  # (r, 3, n, 3)
    measured = view.measure_behind(points.reshape(-1, 3), np.tile(volumes, points[..., 0, 0].size))
    measured = measured.reshape(points.shape[:3])
    is_in_front = np.fmin.reduce(measured[0]) < -half - through_margin
    behind, middle, foot = measured.min(axis=0)  # nan if one of them is
    below = np.minimum(middle, foot)
    least = _compute_least_behind(ray, half, height, sd, through_margin)
    is_known = np.maximum(2 * radius, height) >= _LEAST_SIZE
    is_known &= _APART * far <= 2 * radius  # it does not fit between the rays
    is_through = is_known & (behind > least) & (below >= -half - through_margin)
    for spot, through, front in zip(spots, is_through, is_in_front, strict=True):
        spot.num_through += bool(through)
        spot.num_in_front += bool(front)


def _list_aims(
    center: np.ndarray, ray: np.ndarray, height: np.ndarray, far: np.ndarray
) -> np.ndarray:
    """Return the points of things whose rays are measured, wherever the things may be.

    The upper part is measured: behind it the bearing surface is farther away. Middle and foot must
    not be hidden: a thing that lies along the ray is lower than its box says.

    Args:
        center: of the things, (n, 3).
        ray: directions from the camera to them, (n, 3).
        height: of the things, metres, (n,).
        far: by which they may be elsewhere, metres, (n,).

    Returns:
        Upper part, middle and foot at each of r places, (r, 3, n, 3).
    """
    heights = np.outer((0.25, 0.0, -0.45), height)  # (3, n)
    points = center + heights[..., None] * np.array([0.0, 0.0, 1.0])
    ahead = ray * (1.0, 1.0, 0.0)
    ahead /= np.maximum(np.linalg.norm(ahead, axis=1), 1e-9)[:, None]
    left = np.cross((0.0, 0.0, 1.0), ahead)
    offsets = _LEFT[:, None, None] * left - _TOWARDS[:, None, None] * ahead  # (r, n, 3)
    return points + (far[:, None] * offsets)[:, None]


def _compute_least_behind(
    ray: np.ndarray, half: np.ndarray, height: np.ndarray, sd: np.ndarray, through_margin: float
) -> np.ndarray:
    """Return how far behind the middle of things a ray must go on to have gone through, (n,).

    That is behind the thing, by `through_margin` and the uncertainty of both poses, `sd`. Where
    what bears a thing is nearer behind it than that, it is half of the way from the front of the
    thing to it. Where that is less than the uncertainty, as behind a plate, it is enough that
    nothing was measured in front of it. All are in metres, `half` is of the thing along the ray.
    """
    # Where it lay on a surface, a ray through its upper part meets that 3/4 of its height deeper.
    expected = 0.75 * height / np.maximum(-ray[:, 2], 1e-3)
    is_flat = expected < half + through_margin + _SUPPORT
    is_flat |= expected + half < 4 * sd
    least = np.minimum(half + through_margin + 2 * sd, (expected - half) / 2)
    return np.where(is_flat, -half - through_margin + 2 * sd, least)
