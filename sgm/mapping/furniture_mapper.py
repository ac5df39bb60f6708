"""A map that draws itself: furniture that a detector names gets a place with extents."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from sgm.camera.camera_view import CameraView
from sgm.camera.detection import Detection
from sgm.camera.scene import NOWHERE
from sgm.layout.areas import Areas
from sgm.layout.box import Box
from sgm.layout.footprints import compute_overlap, get_area
from sgm.mapping.data_association import REACH, DataAssociation
from sgm.mapping.furniture_labels import FurnitureLabels
from sgm.mapping.furniture_points import measure_furniture
from sgm.mapping.landmark import Landmark, draw_landmarks
from sgm.mapping.landmark_merging import LandmarkMerging
from sgm.mapping.map_changes import MapChanges
from sgm.mapping.map_rules import MapRules
from sgm.mapping.map_spots import MapSpots
from sgm.mapping.moved_furniture import follow_boxes
from sgm.memory.scene_graph_memory import SceneGraphMemory

_LEAST_POINTS = 5  # of a detection
_MOST_SKETCHES = 500
_MOST_SEEN = 100  # detections of furniture, and of things, that are read of a frame
# Of so many latest detections of furniture, those at its place, for a pose to be believed again.
_DOUBTED, _SURE_AGAIN = 8, 5
_GROWN = 0.5  # share of a footprint that lies in the one which is drawn for it now
_SEEN_SURELY = 3.0  # metres: furniture that is in view from so near by should be detected
_INSIDE = 0.05  # metres below the upper side, and from all others, of what lies inside


class FurnitureMapper:
    """Finds furniture in frames, and adds it to a memory: `LookBuilder(discover=...)`.

    Detections whose label is of furniture are fused over frames and visits (`FurnitureCells`). One
    that was seen in `least_frames` frames from places that are `least_apart` is believed: it is
    furniture of the memory with a box, which is drawn anew as more is seen. Two that overlap are
    one. What is seen on no known furniture lies on a spot, a place of its own by the furniture that
    is near; it goes over to furniture that is found there later.

    Whether furniture has doors, or an inside, is unknown until `LookBuilder.set_open` is called,
    or until things are seen inside. Furniture that the memory had before is left as it is; so is
    that whose size others have changed since. Where others move it, as `memory.transform` moves
    all, what was seen of it moves along.

    Attributes:
        memory: that gets the furniture.
        labels: which names are of furniture.
        rules: when furniture is believed.
    """

    def __init__(
        self,
        memory: SceneGraphMemory,
        *,
        areas: Areas | None = None,
        labels: FurnitureLabels | None = None,
        rules: MapRules | None = None,
        ground: float = 0.0,
    ) -> None:
        """Begin with the furniture that the memory has.

        Args:
            memory: with rooms and furniture, or empty.
            areas: rooms as polygons; None for one room "home".
            labels: what furniture may be called; None for those of the household.
            rules: when furniture is believed; None for the defaults.
            ground: height of the floor in the map, metres.
        """
        self.memory = memory
        self.labels = FurnitureLabels() if labels is None else labels
        self.rules = MapRules() if rules is None else rules
        self._ground = ground
        self._landmarks: list[Landmark] = []
        self._num_landmarks = 0  # so far
        self._by_id: dict[int, Landmark] = {}
        self._drawn: dict[int, Box] = {}  # as this has left them in the memory
        self._changes = MapChanges(memory, Areas() if areas is None else areas)
        self._counts = self._changes.counts
        self._spots = MapSpots(self._changes, ground)
        self._joins = LandmarkMerging(self.labels, self.rules, ground)
        # Since a jump: when it was, and whether the latest detections of furniture were where it
        # stands.
        self._jumped = -math.inf
        self._doubt: deque[bool] | None = None

    @property
    def counts(self) -> dict[str, int]:
        """How often the map was changed in which way."""
        return dict(self._counts)

    @property
    def merged(self) -> Mapping[int, int]:
        """Ids of furniture and spots that are gone, with those that they are part of."""
        return self._changes.merged

    @property
    def gone(self) -> Container[int]:
        """Ids of furniture and spots that are gone, and part of nothing."""
        return self._changes.gone

    def is_found(self, furniture: int) -> bool:
        """Tell whether furniture of the memory was found by this."""
        return furniture in self._by_id

    def see(
        self,
        time: float,
        view: CameraView,
        detections: Sequence[Detection],
        known: Sequence[int | None],
        others: Sequence[Detection] = (),
    ) -> bool:
        """Take in the detections of furniture of one frame, and return whether its pose is right.

        After a jump of the pose it is not believed until furniture is seen where it stands, or the
        time of `MapRules.longest_doubt` is over.

        Args:
            time: of the frame, seconds.
            view: the frame.
            detections: whose label is of furniture.
            known: furniture of the memory that each of them is of; None for none.
            others: detections of things in the same frame: what they show is not furniture.
        """
        self._follow()
        if not self._is_steady(time, known):
            return False
        if len(detections) > _MOST_SEEN:
            self._counts["detections of furniture beyond what is read"] += (
                len(detections) - _MOST_SEEN
            )
        detections, known = detections[:_MOST_SEEN], known[:_MOST_SEEN]
        shown = measure_furniture(view, detections, others[:_MOST_SEEN], self._ground)
        labels = [self.labels.find_label(detection.name) for detection in detections]
        matches = DataAssociation(self._landmarks, self.labels, view)
        wanted = [
            number
            for number, furniture in enumerate(known)
            if furniture is None and labels[number] is not None and shown[number][1].any()
        ]
        matches.prepare(detections, labels, shown, wanted)
        taken: set[int] = set()  # numbers of landmarks
        due: list[Landmark] = []  # to be drawn
        for number, (detection, furniture) in enumerate(zip(detections, known, strict=True)):
            landmark = None if furniture is None else self._by_id.get(furniture)
            if furniture is not None and landmark is None:
                continue  # furniture of the map, which is left as it is
            label, (points, is_within) = labels[number], shown[number]
            if label is None:
                continue
            if is_within.sum() < _LEAST_POINTS:
                self._counts["detections of furniture that show too little"] += 1
                continue
            if landmark is None or landmark.number in taken:
                if landmark is not None:  # it was seen twice
                    matches.prepare(detections, labels, shown, [number])
                landmark = matches.find(number, taken)
            if landmark is None:
                landmark = self._begin_landmark()
            if landmark is None:
                continue
            landmark.beside.update(taken)
            taken.add(landmark.number)
            if landmark.num_frames < self.rules.most_frames:
                pose = view.pose
                landmark.add(label, pose.position, pose.position_sd, points, is_within)
                if detection.box is not None:
                    landmark.silhouettes.add(view, detection.box)
                if landmark.is_due:
                    due.append(landmark)
        draw_landmarks(due, self._ground)
        self._note_shown(view, taken)
        return True

    def _is_steady(self, time: float, known: Sequence[int | None]) -> bool:
        """Tell whether the pose of a frame is believed, which shows furniture that is `known`."""
        if self._doubt is not None:
            self._doubt.extend(furniture is not None for furniture in known)
            is_over = time - self._jumped >= self.rules.longest_doubt
            if sum(self._doubt) < _SURE_AGAIN and not is_over:
                return False
            self._doubt = None
        return True

    def _begin_landmark(self) -> Landmark | None:
        """Return a new landmark; None if there are as many as are kept."""
        if len(self._landmarks) >= _MOST_SKETCHES:
            self._counts["furniture beyond what is kept"] += 1
            return None
        landmark = Landmark(self._num_landmarks)
        self._num_landmarks += 1
        self._landmarks.append(landmark)
        return landmark

    def _note_shown(self, view: CameraView, taken: Container[int]) -> None:
        """Count for furniture that was found whether a frame shows it, and whether it was seen."""
        drawn = [
            (landmark, landmark.box)
            for landmark in self._by_id.values()
            if landmark.box is not None
        ]
        if not drawn or not view.has_depth:
            return
        center = np.array([box.center for _, box in drawn])
        front = np.array([math.hypot(*box.size[:2]) / 2 for _, box in drawn])
        behind = view.measure_behind(center, np.full(len(drawn), NOWHERE))
        is_shown = behind > -front - REACH
        is_shown &= np.linalg.norm(center - view.pose.position, axis=1) < _SEEN_SURELY
        for number in np.flatnonzero(is_shown).tolist():
            landmark, _ = drawn[number]
            if landmark.num_shown >= 2 * self.rules.least_shown:  # the latest ones count more
                landmark.num_shown, landmark.num_named = (
                    landmark.num_shown / 2,
                    landmark.num_named / 2,
                )
            landmark.num_shown += 1
            landmark.num_named += landmark.number in taken

    def note_jump(self, time: float) -> None:
        """Note that the pose has jumped: where the camera is now in the map is not known."""
        self._jumped = time
        self._counts["jumps of the pose"] += 1
        if self._by_id:
            self._doubt = deque(maxlen=_DOUBTED)
        self._landmarks = [
            landmark for landmark in self._landmarks if landmark.furniture is not None
        ]

    def settle(self) -> bool:
        """Add what is believed to the memory, and draw anew; return whether the map changed."""
        self._follow()
        draw_landmarks(self._landmarks, self._ground)
        self._landmarks = [landmark for landmark in self._landmarks if landmark.box is not None]
        num_merged = len(self.merged)
        self._landmarks = self._joins.join(self._landmarks, self._merge)
        has_changed = len(self.merged) > num_merged
        has_changed |= self._spots.remove_left()
        has_changed |= self._leave_out()
        for landmark in self._landmarks:
            if landmark.furniture is None and self._is_believed(landmark):
                self._add(landmark)
                has_changed = True
            elif landmark.furniture is not None:
                has_changed |= self._update(landmark)
        boxes = self.memory.boxes
        self._drawn = {number: boxes[number] for number in self._by_id if number in boxes}
        return has_changed

    def _follow(self) -> None:
        """Take over where furniture was moved by others, as `memory.transform` moves all."""
        for number in follow_boxes(self._by_id, self._landmarks, self._drawn, self.memory.boxes):
            self._landmarks.remove(self._by_id.pop(number))

    def _leave_out(self) -> bool:
        """Take furniture from the map that is a part of another one, or not there, any more."""
        gone = []
        for number, landmark in list(self._by_id.items()):
            if landmark.box is None or number not in self.memory.layout.furniture:
                continue
            whole = [
                other
                for other, other_landmark in self._by_id.items()
                if self._joins.is_part_of(landmark, other_landmark)
                and 2 * landmark.num_frames <= other_landmark.num_frames
            ]
            if whole:
                self._merge(whole[0], number)
                gone.append(landmark)
            elif (
                landmark.num_shown >= self.rules.least_shown
                and landmark.num_named < self.rules.least_named * landmark.num_shown
            ):
                del self._by_id[number]
                self._spots.make_of(number)
                gone.append(landmark)
        self._landmarks = [landmark for landmark in self._landmarks if landmark not in gone]
        return bool(gone)

    def _is_believed(self, landmark: Landmark) -> bool:
        if landmark.box is None or landmark.num_frames < self.rules.least_frames:
            return False
        if landmark.likeness < self.rules.least_likeness:
            return False
        if any(self._joins.is_part_of(landmark, other) for other in self._by_id.values()):
            return False
        return float(np.linalg.norm(landmark.high - landmark.low)) >= self.rules.least_apart

    def _add(self, landmark: Landmark) -> None:
        """Add believed furniture to the memory, with what was seen at spots that it stands at."""
        assert landmark.box is not None
        for number, furniture in self.memory.layout.furniture.items():
            if furniture.box is None or number in self._by_id or number in self._spots.ids:
                continue
            both, _ = compute_overlap(furniture.box, landmark.box)
            if both > self.rules.least_overlap * min(
                get_area(furniture.box), get_area(landmark.box)
            ):
                return  # it is on the map already, as people have drawn it
        label, box = landmark.label, landmark.box
        taken = {furniture.description for furniture in self.memory.layout.furniture.values()}
        numbered = (f"{label} {number}" for number in range(2, len(taken) + 3))
        name = next(name for name in (label, *numbered) if name not in taken)
        room = self._changes.find_room(box.center)
        landmark.furniture = self.memory.add_furniture(label, room, name, box=box)
        self._by_id[landmark.furniture] = landmark
        self._counts["furniture found"] += 1
        self._spots.take(landmark.furniture, box)

    def _update(self, landmark: Landmark) -> bool:
        """Draw furniture of the memory anew, if it differs by enough; return whether it did."""
        furniture, new = landmark.furniture, landmark.box
        known = self.memory.layout.furniture.get(furniture) if furniture is not None else None
        if known is None or known.box is None or new is None or furniture is None:
            return False
        new = replace(new, interior=known.box.interior)
        moved = math.dist(new.center, known.box.center)
        change = max(moved, *(abs(a - b) for a, b in zip(new.size, known.box.size, strict=True)))
        if change < self.rules.least_change and known.label == landmark.label:
            return False
        if moved > self.rules.most_change + max(known.box.size[:2]) / 2:
            both, _ = compute_overlap(known.box, new)
            if both <= _GROWN * get_area(known.box):  # else what was drawn is a part of it
                self._counts["furniture that jumped"] += 1
                return False
        if known.label != landmark.label:
            self.memory.name_furniture(furniture, landmark.label)
        if change >= self.rules.least_change:
            self.memory.move_furniture(furniture, box=new)
        self._counts["furniture drawn anew"] += 1
        self._spots.take(furniture, new)
        return True

    def _merge(self, furniture: int, other: int) -> None:
        self._changes.merge(furniture, other)
        self._by_id.pop(other, None)

    def find_spot(self, center: np.ndarray, bottom: float, eye: np.ndarray) -> int:
        """Return the spot at which a thing lies, which is added if there is none.

        Args:
            center: of the thing in the map, (3,).
            bottom: height of its lower side.
            eye: of the camera that saw it, (3,).
        """
        return self._spots.find(center, bottom, eye)

    def list_around(self, point: np.ndarray) -> list[int]:
        """Return the furniture that was found, and whose box a point (3,) lies in."""
        boxes = self.memory.boxes
        return [
            number
            for number in self._by_id
            if number in boxes and boxes[number].holds(point[None], _INSIDE).all()
        ]

    def tell_interior(self, furniture: int, interior: str) -> None:
        """Note what furniture that was found has inside: "none", "open" or "door".

        Raises:
            KeyError: if there is no such furniture.
            ValueError: if the interior is none of these.
        """
        self.memory.layout.check_furniture(furniture)
        box = self.memory.layout.furniture[furniture].box
        if box is not None and box.interior != interior:
            self.memory.move_furniture(furniture, box=replace(box, interior=interior))

    def note_inside(self, furniture: int, centers: Iterable[np.ndarray]) -> bool:
        """Note things that were seen inside furniture; return whether it has an inside since."""
        known = self.memory.layout.furniture.get(furniture)
        if known is None or known.box is None or known.box.interior != "none":
            return False
        if furniture not in self._by_id:
            return False
        if not any(known.box.holds(center[None], _INSIDE).all() for center in centers):
            return False
        self.tell_interior(furniture, "open")
        return True
