"""From frames of a camera to looks."""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from sgm.camera.camera_view import CameraView
from sgm.camera.depth_image import DepthImage
from sgm.camera.detection import Detection
from sgm.camera.pinhole import Intrinsics, Pose
from sgm.camera.scene import NOWHERE, Scene
from sgm.checks import is_finite, read_all, read_optional
from sgm.eyes.built_look import BuiltLook, make_look
from sgm.eyes.known_furniture import KnownFurniture
from sgm.eyes.look_rules import Gate, LookRules
from sgm.eyes.loose_things import settle_things
from sgm.eyes.placing import THROUGH, OnDetection, Placing, Unassigned
from sgm.eyes.spots import Spots
from sgm.eyes.tracks import Tracks
from sgm.eyes.visits import Visit, Visits
from sgm.layout.box import Box
from sgm.layout.furniture import Furniture
from sgm.mapping.furniture_labels import FurnitureLabels
from sgm.mapping.furniture_mapper import FurnitureMapper
from sgm.messages import shorten
from sgm.schema import PlaceCode

MOST_DETECTIONS = 1000  # of a frame; detectors give 300 at most
_JUMP = 1.0  # metres from one frame to the next that no robot goes
_LEAST_FRAMES = 3  # that show a thing at no known place, before it gets one
_MOST_VIEWS = 1000  # of the latest frames
_MAKE_MAPPER = "Write FurnitureMapper(memory)."


class LookBuilder:
    """Turns poses, depth and detections into looks, many frames a second into one look a visit.

    What a frame does: bad frames are left out and counted (`Gate`). Points in the volumes of
    all relations to all furniture are projected, and those in view are united over the frames of a
    visit; their share is the coverage. Detections are assigned to the volume that they lie in, and
    joined over the frames to one sighting a thing. A visit ends when the place was out of view for
    `pause` seconds; then its look is ready.

    Example:
        >>> builder = LookBuilder({table: Box((2, 1, 0.4), (0.8, 1.4, 0.8))})
        >>> builder.frame(0.0, pose, intrinsics, detections, depth)
        >>> for look in builder.finish():
        ...     look.tell(memory)

    One thread at a time may call it.
    """

    def __init__(
        self,
        furniture: Mapping[int, Furniture | Box] | None = None,
        *,
        discover: FurnitureMapper | None = None,
        rules: LookRules | None = None,
        gate: Gate | None = None,
        ignore: Iterable[str] = (),
        labels: FurnitureLabels | None = None,
        on_look: Callable[[BuiltLook], None] | None = None,
        on_detection: OnDetection | None = None,
    ) -> None:
        """Begin without a frame.

        Args:
            furniture: by id, as `memory.layout.furniture` has it; floors of rooms, too
                (`Box.of_floor`). A box alone will do: then detections of the furniture itself are
                not known as such. None for what the memory of `discover` has.
            discover: adds furniture that is seen to a memory, and spots for all else, so that no
                map is needed; None to look at furniture that is known. Looks must be told to that
                memory.
            rules: what counts as in view, as seen and as one visit; None for the defaults.
            gate: which frames are good enough; None for the defaults.
            ignore: names of what is no thing, such as "person", "wall" and "ceiling".
            labels: what furniture may be called; None for those of `discover`, or of the household.
            on_look: is given every look when it is ready; None to keep them for `looks`.
            on_detection: is given every detection that counts, with the furniture and the relation
                that it was assigned to in its frame, both None for no known place.

        Raises:
            TypeError: if the furniture is none or left out, or `ignore` a text.
            ValueError: if a name to ignore is none.
        """
        self.gate = Gate() if gate is None else gate
        self._rules = LookRules() if rules is None else rules
        self._on_look = on_look
        self._ready: deque[BuiltLook] = deque()
        self._counts: Counter[str] = Counter()
        self._placing = Placing(self.gate, self._rules, ignore, self._counts, on_detection)
        self._mapper = read_optional("discover", discover, FurnitureMapper, _MAKE_MAPPER)
        if labels is None:
            labels = FurnitureLabels() if discover is None else discover.labels
        self._labels = labels
        if furniture is None and discover is not None:
            furniture = discover.memory.layout.furniture
        self._loose = Tracks()  # things at no known place, until the map is settled
        self._settled = math.inf
        self._before: tuple[float, Pose] | None = None
        self._time = -math.inf
        self._eye = np.zeros(3)  # where the camera was in the last good frame
        self._frame = 0
        self._views: deque[tuple[float, np.ndarray]] = deque(maxlen=_MOST_VIEWS)  # time, eye
        self._spots = Spots()
        self._begin(furniture)

    def _begin(self, furniture: Any) -> None:
        self._scene = Scene(furniture, self._rules.num_points, is_sure=self._mapper is None)
        self._known = KnownFurniture(self._labels, self._scene)
        self._visits, self._tracks = Visits(self._scene), Tracks()

    @property
    def counts(self) -> dict[str, int]:
        """How many frames and detections there were, and how many were left out for what."""
        return dict(self._counts)

    @property
    def unassigned(self) -> deque[Unassigned]:
        """The latest thousand detections that are at no known place."""
        return self._placing.unassigned

    def set_furniture(self, furniture: Mapping[int, Furniture | Box]) -> None:
        """Go on with other furniture: all visits end, and doors stay as they are.

        Raises:
            TypeError: if the furniture is none.
        """
        self._end(self._visits.take_ended())
        ids, was_open = self._scene.ids, self._scene.is_open
        self._begin(furniture)
        for number, is_open in zip(ids, was_open, strict=True):
            place = self._scene.index.get(number)
            if place is not None and self._scene.has_door[place]:
                self._scene.is_open[place] = is_open
        self._spots.renumber([self._scene.index.get(number, -1) for number in ids])

    def set_open(self, furniture: int, is_open: bool = True) -> None:
        """Note that a door was opened, or shut: a shut place is not looked into.

        Furniture that was discovered has a door from then on.

        Raises:
            KeyError: if there is no box of that id.
            ValueError: if it has no door.
        """
        if self._mapper is not None and self._mapper.is_found(furniture):
            place = self._scene.index.get(furniture)
            if place is not None and not self._scene.has_door[place]:
                self._mapper.tell_interior(furniture, "door")
                self.set_furniture(self._mapper.memory.layout.furniture)
        self._scene.set_open(furniture, is_open)

    def frame(
        self,
        time: float,
        pose: Pose | None,
        intrinsics: Intrinsics,
        detections: Iterable[Detection] = (),
        depth: np.ndarray | None = None,
        pose_time: float | None = None,
    ) -> bool:
        """Take one frame.

        Args:
            time: when the image was taken, seconds of any clock that goes forward.
            pose: of the camera in the map at that time; None if no transform was found.
            intrinsics: of the camera.
            detections: what was detected in the image.
            depth: z of every pixel in metres, or in millimetres as whole numbers, (height, width);
                0 and nan where nothing was measured; None without a depth camera.
            pose_time: when the pose was measured; None for `time`.

        Returns:
            Whether the frame was used; `counts` says what for if it was not.

        Raises:
            TypeError: if pose, intrinsics or detections are something else.
            ValueError: if the depth image has another size or unit, or there are more than
                `MOST_DETECTIONS`.
        """
        detections = _read_frame(pose, intrinsics, detections)
        image = None if depth is None else DepthImage(depth, intrinsics)
        self._counts["frames"] += 1
        fault = self._find_fault(time, pose, pose_time)
        if fault:
            self._counts[fault] += 1
            return False
        assert pose is not None
        self._frame += 1
        self._views.append((time, pose.position))
        reach = (self.gate.nearest, self.gate.farthest)
        view = CameraView(self._scene, pose, intrinsics, image, reach)
        sure = self._placing.select(detections)
        volumes = self._scene.list_volumes()
        known = self._visits.list_known(volumes)
        volumes, share = view.find_seen_points(volumes, self._rules.margin, known)
        if view.num_contradicted:
            self._counts["places that depth goes through"] += view.num_contradicted
        if view.is_contradicted:
            self._counts["depth through furniture"] += 1
            return False
        things, is_steady = self._find_things(time, view, sure)
        if not is_steady:
            self._counts["pose jumped"] += 1
            return False
        shown = self._visits.note_points(time, volumes, share, view)
        for detection, volume, measured in self._placing.place(self._scene, time, view, things):
            if volume != NOWHERE:
                self._tracks.add(detection, self._frame, volume, measured)
                shown.add(PlaceCode.furniture(volume))
            elif self._mapper is not None and np.isfinite(measured.center).all():
                self._loose.add(detection, self._frame, volume, measured)
        self._loose.note_view(view, self._frame, self._rules.through_margin)
        self._tracks.note_view(view, self._frame, self._rules.through_margin)
        self._spots.note_rays(view, shown, self._rules.through_margin)
        self._visits.note_frame(time, shown, view)
        return True

    def _find_things(
        self, time: float, view: CameraView, detections: list[Detection]
    ) -> tuple[list[Detection], bool]:
        """Return the detections that are not of furniture, and whether the pose is believed."""
        known = self._known.find(view, detections, self._rules.dilation)
        of_furniture = [furniture is not None for furniture in known]
        if self._mapper is not None:
            for number, detection in enumerate(detections):
                of_furniture[number] |= self._labels.find_label(detection.name) is not None
        things = [
            detection
            for detection, is_furniture in zip(detections, of_furniture, strict=True)
            if not is_furniture
        ]
        if len(things) < len(detections):
            self._counts["detections of furniture"] += len(detections) - len(things)
        if self._mapper is None:
            return things, True
        numbers = [
            number
            for number, is_furniture in enumerate(of_furniture)
            if is_furniture and _is_in_image(view, detections[number])
        ]
        num_outside = sum(of_furniture) - len(numbers)
        if num_outside:
            self._counts["detections outside the image"] += num_outside
        found = [detections[number] for number in numbers]
        return things, self._mapper.see(
            time, view, found, [known[number] for number in numbers], things
        )

    def looks(self) -> Iterator[BuiltLook]:
        """Take the looks that are ready, in order; without `on_look`."""
        while self._ready:
            look = self._follow_merge(self._ready.popleft())
            if look is not None:
                yield look

    def place_loose(self) -> None:
        """Give things that frames are sure of, and that are at no known place, a place now.

        That is a spot, which furniture that is found there takes over. Without this, they get one
        when the map is settled next. It is for those who ask what is in view meanwhile. Of what is
        out of view by now, the look is ready.
        """
        if self._loose.has_sure(self._rules.least_confidence, _LEAST_FRAMES):
            self._settle(is_over=False)
            self._settled = self._time
            self._end_over(self._time)

    def list_open(self) -> list[BuiltLook]:
        """Return the looks at places that are in view now, as if they ended here.

        They go on: `looks` has them when they have ended. Nothing changes.
        """
        since = self._time - self._rules.pause
        looks = (
            make_look(self._scene, self._rules, visit, self._tracks.find(visit.place), self._spots)
            for visit in self._visits.list_open(since)
        )
        followed = (self._follow_merge(look) for look in looks if look is not None)
        return [look for look in followed if look is not None]

    def end_before(self, time: float) -> None:
        """End all visits if the latest frame is older than a time: a camera may have been off."""
        if self._time < time:
            self._settle(is_over=True)
            self._end(self._visits.take_ended())

    def finish(self) -> Iterator[BuiltLook]:
        """End all visits, as when the robot stops, and take the looks that are ready.

        The next frame may be of any time, as after the robot's clock was set back.
        """
        self._settle(is_over=True)
        self._end(self._visits.take_ended())
        self._time, self._before = -math.inf, None
        self._settled = math.inf
        return self.looks()

    def _settle(self, *, is_over: bool) -> None:
        """Take over what the map has become, and give things at no known place one."""
        mapper = self._mapper
        if mapper is None:
            return
        tracks = self._loose.take_sure(
            self._rules.least_confidence, 1 if is_over else _LEAST_FRAMES, self._frame
        )
        if mapper.settle() or tracks:
            times, eyes = [], []
            for track in tracks:
                time, eye = self._get_view(track.frames[-1])
                times.append(time)
                eyes.append(eye)
            volumes = settle_things(mapper, tracks, eyes, self._rules.dilation)
            self.set_furniture(mapper.memory.layout.furniture)
            for track, time, (furniture, relation) in zip(tracks, times, volumes, strict=True):
                place = self._scene.index[furniture]
                self._tracks.take_over(track, PlaceCode.of(place, relation))
                self._visits.begin(place, time, self._eye)

    def _get_view(self, frame: int) -> tuple[float, np.ndarray]:
        """Return when a frame was taken, seconds, and where the camera was, (3,).

        Of one long ago, when and where the oldest kept one was.
        """
        row = len(self._views) - 1 - (self._frame - frame)
        return self._views[max(row, 0)]

    def _follow_merge(self, look: BuiltLook) -> BuiltLook | None:
        """Return a look at the furniture that its place has become a part of, a glimpse of it.

        None where the place is gone.
        """
        merged = {} if self._mapper is None else self._mapper.merged
        furniture = look.furniture
        while furniture in merged:
            furniture = merged[furniture]
        if self._mapper is not None and furniture in self._mapper.gone:
            return None
        if furniture == look.furniture:
            return look
        coverage = {
            relation: 1 / self._rules.num_points if share else 0.0
            for relation, share in look.coverage.items()
        }
        return replace(look, furniture=furniture, coverage=coverage, hidden=())

    def _find_fault(self, time: float, pose: Pose | None, pose_time: float | None) -> str:
        """Say why a frame is left out, "" if it is good, and end the visits that are over."""
        if not is_finite(time):
            return "time is no number"
        if time <= self._time:
            return "time went back" if time < self._time else "frame came twice"
        if self._mapper is not None and time - self._time > self._rules.pause:
            self._settle(is_over=True)  # before time passes: what was seen was seen then
            self._settled = time
        self._time = time
        self._end_over(time)
        age = 0.0
        if pose_time is not None:
            age = time - pose_time if is_finite(pose_time) else math.nan
        fault = self.gate.find_fault(time, pose, age, self._before)
        if self._mapper is not None:
            self._note_map_time(time, pose, fault)
        self._before = None if pose is None else (time, pose)
        return fault

    def _note_map_time(self, time: float, pose: Pose | None, fault: str) -> None:
        """Settle the map now and then, and tell it when the pose has jumped."""
        assert self._mapper is not None
        if pose is not None and self._before is not None and fault == "camera too fast":
            away = float(np.linalg.norm(pose.position - self._before[1].position))
            if away > _JUMP:
                self._settle(is_over=True)  # what was seen before is believed
                self._mapper.note_jump(time)
        if not fault and pose is not None:
            self._eye = pose.position
            self._settled = min(self._settled, time)
            if time - self._settled >= self._mapper.rules.settle:
                self._settle(is_over=False)
                self._settled = time

    def _end_over(self, time: float) -> None:
        """Make the looks of the visits that are over at a time."""
        self._end(self._visits.take_ended(time, self._rules.pause, self._rules.longest))

    def _end(self, visits: list[Visit]) -> None:
        """Make the looks of visits that are over, in the order in which they began."""
        for visit in sorted(visits, key=lambda visit: (visit.start, visit.place)):
            tracks = self._tracks.take(visit.place)
            num_bare = sum(len(track.frames) for track in tracks if track.is_bare)
            if num_bare:
                self._counts[THROUGH] += num_bare
            look = make_look(self._scene, self._rules, visit, tracks, self._spots, ends=True)
            if look is None:
                self._counts["glimpses"] += 1
                continue
            self._counts["looks"] += 1
            if self._on_look is None:
                self._ready.append(look)
                continue
            followed = self._follow_merge(look)
            if followed is not None:
                self._on_look(followed)


def _is_in_image(view: CameraView, detection: Detection) -> bool:
    """Tell whether a part of furniture is in the image."""
    points = detection.list_points()
    return points is None or bool(view.contains(points).any())


def _read_frame(
    pose: Pose | None, intrinsics: Intrinsics, detections: Iterable[Detection]
) -> list[Detection]:
    """Return the detections of a frame."""
    for name, value, kind in (("pose", pose, Pose), ("intrinsics", intrinsics, Intrinsics)):
        if not isinstance(value, kind) and not (value is None and name == "pose"):
            raise TypeError(
                f"{name} must be of {kind.__name__}, got {shorten(value)}. Make it with sgm.eyes."
            )
    hint = "Write [Detection('mug', 0.9, box=(left, top, right, bottom))], and [] for none."
    found = read_all("detections", detections, Detection, hint)
    if len(found) > MOST_DETECTIONS:
        raise ValueError(
            f"detections must be at most {MOST_DETECTIONS} in a frame, got {len(found)}. Hand on "
            "the surest, or a higher least score to the detector."
        )
    return found
