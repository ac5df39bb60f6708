"""One thing over many frames: which detections are of it, and how sure they are together."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, field

import numpy as np

from sgm.camera.camera_view import CameraView
from sgm.camera.detection import Detection, Measured
from sgm.camera.relief import Relief, measure_relief
from sgm.names.words import read_name
from sgm.schema import PlaceCode

_SAME_THING = 0.15  # metres from one frame to the next; things are smaller, and do not run
_SAME_SPOT = 0.10  # metres within which two names are of one thing, if never said at once
_IN_SIGHT = 2.0  # standard deviations added to both
# How often a detector finds what is in view, and what is not there. Frames of one visit repeat each
# other's mistakes: together they say no more than five that do not.
_FOUND, _FALSE = 0.6, 0.1
_MOST_FRAMES = 5.0
_MOST_LOGIT = 6.0  # a probability of .9975
_MOST_AGE = 300  # frames
_WELL_PLACED = 0.3  # metres: a thing whose depth is less certain gets no place by it
_LEAST_SD = 0.01  # metres, of any measurement, beside the pose
# A center that stays the same to a millimetre over frames was not measured in them.
_UNMOVED = 0.001
_LEAST_MEASURED, _MOST_MEASURED = 3, 20  # frames of a visit in which its relief is measured
_THINNEST = 0.015  # metres: depth does not tell what is thinner from what it lies on
_RELIEF_SD = 0.002  # metres, of the relief that a frame measures, beside the noise of its pixels
_BARE = 0.25  # of its height: what rises less above what is around it is not there


@dataclass(slots=True, eq=False)
class Track:
    """Detections that are of one thing.

    Attributes:
        key: words of its name, or the detector's number for it.
        center: mean of where it was measured, by the weights, in the map, (3,).
        radius, height: means of how large it is, likewise, metres.
        sd: mean of the standard deviations of its middle by the pose, metres.
        names: how often it was called what.
        votes: how often it was assigned to each volume.
        volume: where it was most often.
        frames: numbers of the frames in which it was seen.
        sum_logit: of the scores.
        num_in_view: frames in which its spot was in view.
        weight: sum of the inverse variances of its depth.
        given: center and size that all its detections name, (2, 3); None if they differ, or one
            names none.
        relief: how far above what is around it the depth at it is, of frames that name no other
            center.
    """

    key: object
    center: np.ndarray
    radius: float
    height: float
    sd: float
    names: Counter[str] = field(default_factory=Counter)
    votes: dict[int, int] = field(default_factory=dict)
    volume: int = -1
    frames: list[int] = field(default_factory=list)
    sum_logit: float = 0.0
    num_in_view: int = 0
    weight: float = 0.0
    given: np.ndarray | None = None
    relief: Relief = field(default_factory=Relief)

    @property
    def is_bare(self) -> bool:
        """Whether depth shows what bears it where a map, and no frame, says that it lies.

        As flat as a plate, one frame cannot tell; together, they can.
        """
        if self.given is None or self.relief.num_frames < _LEAST_MEASURED:
            return False
        return self.relief.height + 2 * self.relief.sd < _BARE * float(self.given[1, 2])

    @property
    def name(self) -> str:
        """What it was called most often."""
        return self.names.most_common(1)[0][0]

    def compute_confidence(self) -> float:
        """Return the probability that it is there and called so, from all frames together.

        One frame alone gives its score. Further frames in which its spot was in view speak for or
        against it by the odds of a detector that finds .6 of what is there and .1 of what is not.
        What is bare is not there.
        """
        if self.is_bare:
            return 0.0
        num_seen = len(self.frames)
        num_frames = max(self.num_in_view, num_seen)
        gain = math.log(_FOUND / _FALSE)
        loss = math.log((1 - _FOUND) / (1 - _FALSE))
        votes = num_seen * gain + (num_frames - num_seen) * loss
        logit = self.sum_logit / num_seen + votes * min(1.0, _MOST_FRAMES / num_frames) - gain
        return 1 / (1 + math.exp(-min(max(logit, -_MOST_LOGIT), _MOST_LOGIT)))

    @property
    def center_sd(self) -> float:
        """Standard deviation of the center, metres.

        Errors of the pose last for a visit. Those of the depth average out over its frames.
        """
        return math.hypot(self.sd, self.depth_sd)

    @property
    def depth_sd(self) -> float:
        """Standard deviation of the center by that of the depth in all frames, metres."""
        return 1 / math.sqrt(self.weight)

    def add(self, detection: Detection, frame: int, volume: int, measured: Measured) -> None:
        """Note one more detection, and take its measurement into the means."""
        self._note_given(detection)
        self.names[detection.name] += 1
        self.votes[volume] = self.votes.get(volume, 0) + 1
        self.volume = max(self.votes, key=self.votes.__getitem__)
        self.frames.append(frame)
        score = min(max(detection.score, 1e-9), 1 - 1e-9)
        logit = math.log(score / (1 - score))
        self.sum_logit += min(max(logit, -_MOST_LOGIT), _MOST_LOGIT)

        weight = 1 / (measured.depth_sd**2 + _LEAST_SD**2)
        self.weight += weight
        share = weight / self.weight
        self.center = self.center + share * (measured.center - self.center)
        self.radius += share * (measured.radius - self.radius)
        self.height += share * (measured.height - self.height)
        self.sd += (measured.sd - self.sd) / len(self.frames)

    def is_sure(self, least_confidence: float, least_frames: int) -> bool:
        """Tell whether enough frames are sure of it, and of where it is."""
        return (
            len(self.frames) >= least_frames
            and self.depth_sd <= _WELL_PLACED
            and self.compute_confidence() >= least_confidence
        )

    def _note_given(self, detection: Detection) -> None:
        """Note whether a detection says the same as those before it."""
        if detection.center is None or detection.size is None:
            self.given = None
            return
        given = np.array([detection.center, detection.size])
        if not self.frames:
            self.given = given
        elif self.given is not None and np.abs(given - self.given).max() > _UNMOVED:
            self.given = None


class Tracks:
    """The things that are being seen."""

    def __init__(self) -> None:
        self._tracks: list[Track] = []
        self._frame = -1
        self._of_key: dict[object, list[Track]] = {}  # before the frame
        self._candidates: dict[object, _Candidates] = {}  # of the frame

    def note_view(self, view: CameraView, frame: int, margin: float) -> None:
        """Count the frame for all things whose spot it shows, or that were seen in it."""
        if not self._tracks:
            return
        center = np.array([track.center for track in self._tracks])
        volumes = np.array([track.volume for track in self._tracks])
        behind = view.measure_behind(center, volumes)
        sizes = np.array([max(track.radius, track.height / 2) for track in self._tracks])
        is_in_view = behind > -sizes - margin  # its own surface is before its middle
        for track, shown in zip(self._tracks, is_in_view, strict=True):
            track.num_in_view += bool(shown or track.frames[-1] == frame)
        self._note_relief(view, frame)

    def _note_relief(self, view: CameraView, frame: int) -> None:
        """Measure the relief of what this frame and those before it name at one center."""
        tracks = [
            track
            for track in self._tracks
            if track.given is not None
            and track.frames[-1] == frame
            and len(track.frames) > 1
            and track.given[1, 2] >= _THINNEST
            and track.relief.num_frames < _MOST_MEASURED
        ]
        if not tracks or not view.has_depth:
            return
        given = np.array([track.given for track in tracks])  # (n, 2, 3)
        heights, sds = measure_relief(view, given[:, 0], given[:, 1])
        for track, height, sd in zip(tracks, heights.tolist(), sds.tolist(), strict=True):
            if not math.isnan(height):
                track.relief.add(height, math.hypot(sd, _RELIEF_SD))

    def add(self, detection: Detection, frame: int, volume: int, measured: Measured) -> None:
        """Add a detection to the thing that it is of, or begin a new one.

        It is of the same thing if the detector gives it the same number; without a number, if it
        has the same name and is near, each thing once a frame.
        """
        key: object = read_name(detection.name)
        if detection.track is not None:
            key = ("track", detection.track)
        if frame != self._frame:
            self._begin(frame)
        if key not in self._candidates:
            self._candidates[key] = _Candidates(self._of_key.get(key, []))
        sd = None if detection.track is not None else measured.sd
        track = self._candidates[key].take(measured.center, sd)
        if track is None:
            track = Track(key, measured.center, measured.radius, measured.height, measured.sd)
            self._tracks.append(track)
        track.add(detection, frame, volume, measured)

    def _begin(self, frame: int) -> None:
        """Group what was seen before by its key."""
        self._frame, self._of_key, self._candidates = frame, {}, {}
        for track in self._tracks:
            self._of_key.setdefault(track.key, []).append(track)

    def take_over(self, track: Track, volume: int) -> None:
        """Take in a thing that was followed elsewhere, and lies in a volume now."""
        track.votes, track.volume = {volume: len(track.frames)}, volume
        self._tracks.append(track)

    def take_sure(self, least_confidence: float, least_frames: int, frame: int) -> list[Track]:
        """Take out what enough frames are sure of, where it is, too; forget what was long ago.

        `frame` is the number of the present one.
        """
        found, kept = [], []
        for track in self._tracks:
            if track.is_sure(least_confidence, least_frames):
                found.append(track)
            elif frame - track.frames[-1] < _MOST_AGE:
                kept.append(track)
        self._tracks = kept
        return found

    def has_sure(self, least_confidence: float, least_frames: int) -> bool:
        """Tell whether `take_sure` would take something out."""
        return any(track.is_sure(least_confidence, least_frames) for track in self._tracks)

    def take(self, place: int) -> list[Track]:
        """Take out the things at a place, as `find` returns them."""
        found = self.find(place)
        self._tracks = [
            track for track in self._tracks if PlaceCode.furniture(track.volume) != place
        ]
        return found

    def find(self, place: int) -> list[Track]:
        """Return the things at a place; of two names for one thing the more frequent is kept."""
        tracks = [track for track in self._tracks if PlaceCode.furniture(track.volume) == place]
        tracks.sort(key=lambda track: (track.is_bare, -len(track.frames)))
        center = np.array([track.center for track in tracks]).reshape(-1, 3)
        sd = np.array([track.sd for track in tracks])
        kept: list[int] = []
        for row, track in enumerate(tracks):
            away = np.linalg.norm(center[kept] - center[row], axis=1)
            is_near = away <= _SAME_SPOT + _IN_SIGHT * np.hypot(sd[kept], sd[row])
            near = [tracks[kept[column]] for column in np.flatnonzero(is_near)]
            if not any(set(track.frames).isdisjoint(other.frames) for other in near):
                kept.append(row)
        return [tracks[row] for row in kept]


class _Candidates:
    """Tracks of one key that were not seen in the present frame, each to be taken once."""

    def __init__(self, tracks: list[Track]) -> None:
        self._tracks = tracks
        self._center = np.array([track.center for track in tracks]).reshape(-1, 3)
        self._sd = np.array([track.sd for track in tracks])
        self._is_free = np.ones(len(tracks), bool)

    def take(self, center: np.ndarray, sd: float | None) -> Track | None:
        """Take the nearest one, if it is in reach; without `sd`, the first one."""
        if not self._is_free.any():
            return None
        if sd is None:
            row = int(self._is_free.argmax())
        else:
            away = np.linalg.norm(self._center - center, axis=1)
            row = int(np.where(self._is_free, away, np.inf).argmin())
            if not away[row] <= _SAME_THING + _IN_SIGHT * math.hypot(sd, self._sd[row]):
                return None
        self._is_free[row] = False
        return self._tracks[row]
