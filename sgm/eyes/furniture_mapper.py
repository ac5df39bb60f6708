"""A map that draws itself: furniture that a detector names gets a place with extents."""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Container, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from sgm.checks import check_at_least, check_shares
from sgm.eyes.camera_view import CameraView
from sgm.eyes.detection import Detection
from sgm.eyes.furniture_labels import FurnitureLabels
from sgm.eyes.furniture_points import measure_furniture
from sgm.eyes.moved_furniture import follow_boxes
from sgm.eyes.sketch import Sketch, compute_overlap, count_beside, get_area
from sgm.eyes.sketch_matches import REACH, SketchMatches
from sgm.layout.areas import Areas
from sgm.layout.box import FLOOR_THICKNESS, Box
from sgm.memory.scene_graph_memory import SceneGraphMemory

_LEAST_POINTS = 5  # of a detection
_MOST_SKETCHES = 500
_MOST_SEEN = 100  # detections of furniture, and of things, that are read of a frame
# Of so many latest detections of furniture, those at its place, for a pose to be believed again.
_DOUBTED, _SURE_AGAIN = 8, 5
_GROWN = 0.5  # share of a footprint that lies in the one which is drawn for it now
_BESIDE = 0.2  # metres between furniture and what may be a part of it
# Furniture that was in view in so many of the latest frames, and seen in less than that share of
# them, is not there. Frames count from so near by, in metres, that it should have been seen.
_LEAST_SHOWN, _MOST_SHOWN, _LEAST_NAMED, _SEEN_SURELY = 30, 60, 0.1, 3.0
_INSIDE = 0.05  # metres below the upper side, and from all others, of what lies inside
_SPOT = "spot"
_SPOT_SIDE = 0.5  # metres of a new spot
_WIDEST_SPOT = 1.2
_SPOT_REACH = 0.6  # metres from the middle of a spot at which a thing is at it, or widens it
_NEAR = 1.5  # metres at which furniture is named as what a spot is by


@dataclass(frozen=True, slots=True)
class MapRules:
    """When furniture is believed, and how the map may change.

    Attributes:
        least_frames: in which furniture must have been detected.
        least_apart: metres between the places of the camera from which it must have been seen.
        least_change: metres by which a side or the middle of a box changes before it is drawn anew.
        most_change: metres that the middle of furniture moves at once, after which it is rather the
            pose that jumped.
        most_frames: after which furniture is drawn well enough.
        least_overlap: share of the smaller footprint that is in both, of detections of one label
            that are of one piece of furniture.
        least_likeness: overlap of detections with how the box looks, on average.
        settle: seconds between two changes of the map; visits end with each.
    """

    least_frames: int = 5
    least_apart: float = 0.3
    least_change: float = 0.04
    most_change: float = 0.4
    most_frames: int = 400
    least_overlap: float = 0.4
    least_likeness: float = 0.4
    settle: float = 10.0

    def __post_init__(self) -> None:
        """Raise ValueError for a number that is out of range."""
        check_at_least(1, least_frames=self.least_frames, most_frames=self.most_frames)
        check_at_least(
            0, least_apart=self.least_apart, least_change=self.least_change,
            most_change=self.most_change, settle=self.settle,
        )  # fmt: skip
        check_shares(least_overlap=self.least_overlap, least_likeness=self.least_likeness)


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
        merged: ids of furniture and spots that are gone, with those that they are part of.
        gone: ids of those that are gone and part of nothing.
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
        self._areas = Areas() if areas is None else areas
        self.rules = MapRules() if rules is None else rules
        self._ground = ground
        self._sketches: list[Sketch] = []
        self._num_sketches = 0  # so far
        self._by_id: dict[int, Sketch] = {}
        self._drawn: dict[int, Box] = {}  # as this has left them in the memory
        self._spots: set[int] = set()
        self._left: set[int] = set()  # of them, those that furniture has left
        self._counts: Counter[str] = Counter()
        self.merged: dict[int, int] = {}
        self.gone: set[int] = set()
        # Since a jump: whether the latest detections of furniture were where it stands.
        self._doubt: deque[bool] | None = None

    @property
    def counts(self) -> dict[str, int]:
        """How often the map was changed in which way."""
        return dict(self._counts)

    def is_found(self, furniture: int) -> bool:
        """Tell whether furniture of the memory was found by this."""
        return furniture in self._by_id

    def see(
        self,
        view: CameraView,
        detections: Sequence[Detection],
        known: Sequence[int | None],
        others: Sequence[Detection] = (),
    ) -> bool:
        """Take in the detections of furniture of one frame, and return whether its pose is right.

        After a jump of the pose it is not believed until furniture is seen where it stands.

        Args:
            view: the frame.
            detections: whose label is of furniture.
            known: furniture of the memory that each of them is of; None for none.
            others: detections of things in the same frame: what they show is not furniture.
        """
        self._follow()
        if self._doubt is not None:
            self._doubt.extend(one is not None for one in known)
            if sum(self._doubt) < _SURE_AGAIN:
                return False
            self._doubt = None
        if len(detections) > _MOST_SEEN:
            self._counts["detections of furniture beyond what is read"] += (
                len(detections) - _MOST_SEEN
            )
        detections, known = detections[:_MOST_SEEN], known[:_MOST_SEEN]
        shown = measure_furniture(view, detections, others[:_MOST_SEEN], self._ground)
        labels = [self.labels.find_label(one.name) for one in detections]
        matches = SketchMatches(self._sketches, self.labels, view)
        wanted = [
            row
            for row, furniture in enumerate(known)
            if furniture is None and labels[row] is not None and shown[row][1].any()
        ]
        matches.prepare(detections, labels, shown, wanted)
        taken: set[int] = set()  # numbers of sketches
        for row, (detection, furniture) in enumerate(zip(detections, known, strict=True)):
            sketch = None if furniture is None else self._by_id.get(furniture)
            if furniture is not None and sketch is None:
                continue  # furniture of the map, which is left as it is
            label, (points, is_within) = labels[row], shown[row]
            if label is None or is_within.sum() < _LEAST_POINTS:
                continue
            if sketch is None or sketch.number in taken:
                if sketch is not None:  # it was seen twice
                    matches.prepare(detections, labels, shown, [row])
                sketch = matches.find(row, taken)
            if sketch is None:
                if len(self._sketches) >= _MOST_SKETCHES:
                    self._counts["furniture beyond what is kept"] += 1
                    continue
                sketch = Sketch(self._num_sketches)
                self._num_sketches += 1
                self._sketches.append(sketch)
            sketch.beside.update(taken)
            taken.add(sketch.number)
            if sketch.num_frames < self.rules.most_frames:
                pose = view.pose
                sketch.add(label, pose.position, pose.position_sd, points, is_within)
                if detection.box is not None:
                    sketch.silhouettes.add(view, detection.box)
                if sketch.num_frames >= 2 * max(sketch.num_drawn, 1) or not sketch.num_drawn:
                    sketch.draw(self._ground)
        self._note_shown(view, taken)
        return True

    def _note_shown(self, view: CameraView, taken: Container[int]) -> None:
        """Count for furniture that was found whether a frame shows it, and whether it was seen."""
        drawn = [(one, one.box) for one in self._by_id.values() if one.box is not None]
        if not drawn or not view.has_depth:
            return
        center = np.array([box.center for _, box in drawn])
        front = np.array([math.hypot(*box.size[:2]) / 2 for _, box in drawn])
        behind = view.measure_behind(center, np.zeros(len(drawn), dtype=np.int64))
        is_shown = behind > -front - REACH
        is_shown &= np.linalg.norm(center - view.pose.position, axis=1) < _SEEN_SURELY
        for row in np.flatnonzero(is_shown).tolist():
            sketch, _ = drawn[row]
            if sketch.num_shown >= _MOST_SHOWN:
                sketch.num_shown, sketch.num_named = sketch.num_shown / 2, sketch.num_named / 2
            sketch.num_shown += 1
            sketch.num_named += sketch.number in taken

    def note_jump(self) -> None:
        """Note that the pose has jumped: where the camera is now in the map is not known."""
        self._counts["jumps of the pose"] += 1
        if self._by_id:
            self._doubt = deque(maxlen=_DOUBTED)
        self._sketches = [one for one in self._sketches if one.furniture is not None]

    def settle(self) -> bool:
        """Add what is believed to the memory, and draw anew; return whether the map changed."""
        self._follow()
        for sketch in self._sketches:
            sketch.draw(self._ground)
        self._sketches = [one for one in self._sketches if one.box is not None]
        has_changed = self._join_sketches()
        has_changed |= self._remove_left()
        has_changed |= self._leave_out()
        for sketch in self._sketches:
            if sketch.furniture is None and self._is_believed(sketch):
                self._add(sketch)
                has_changed = True
            elif sketch.furniture is not None:
                has_changed |= self._update(sketch)
        boxes = self.memory.boxes
        self._drawn = {number: boxes[number] for number in self._by_id if number in boxes}
        return has_changed

    def _follow(self) -> None:
        """Take over where furniture was moved by others, as `memory.transform` moves all."""
        for number in follow_boxes(self._by_id, self._sketches, self._drawn, self.memory.boxes):
            self._sketches.remove(self._by_id.pop(number))

    def _leave_out(self) -> bool:
        """Take furniture from the map that is a part of another one, or not there, any more."""
        gone = []
        for number, sketch in list(self._by_id.items()):
            if sketch.box is None or number not in self.memory.layout.furniture:
                continue
            whole = [
                other
                for other, one in self._by_id.items()
                if self._is_part_of(sketch, one) and 2 * sketch.num_frames <= one.num_frames
            ]
            if whole:
                self._merge(whole[0], number)
                gone.append(sketch)
            elif (
                sketch.num_shown >= _LEAST_SHOWN
                and sketch.num_named < _LEAST_NAMED * sketch.num_shown
            ):
                self._make_spot(number)
                gone.append(sketch)
        self._sketches = [one for one in self._sketches if one not in gone]
        return bool(gone)

    def _make_spot(self, furniture: int) -> None:
        """Take furniture from the map that is not there: what was seen there lies on a spot."""
        box = self.memory.layout.furniture[furniture].box
        del self._by_id[furniture]
        assert box is not None
        self._counts["furniture gone"] += 1
        self._spots.add(furniture)
        self._left.add(furniture)
        self.memory.name_furniture(furniture, _SPOT, self._name_spot(box, is_low=False))

    def _remove_left(self) -> bool:
        """Remove spots that furniture has left, where nothing lies; return whether there was one.

        What was seen there since is in the memory by now.
        """
        ids = self.memory.furniture_ids
        self._left &= self._spots & {*ids}
        if not self._left:
            return False
        edges = self.memory.batch.edges
        occupied = {ids[index] for index in edges["furniture"][edges["is_true"]].tolist()}
        empty = self._left - occupied
        for spot in empty:
            self._spots.discard(spot)
            self.memory.remove_furniture(spot)
        self.gone |= empty
        return bool(empty)

    def _is_believed(self, sketch: Sketch) -> bool:
        if sketch.box is None or sketch.num_frames < self.rules.least_frames:
            return False
        if sketch.likeness < self.rules.least_likeness:
            return False
        if any(self._is_part_of(sketch, other) for other in self._by_id.values()):
            return False
        return float(np.linalg.norm(sketch.high - sketch.low)) >= self.rules.least_apart

    def _is_part_of(self, sketch: Sketch, other: Sketch) -> bool:
        """Tell whether a sketch may be a part of other furniture of its label that is near it.

        So it is while the other one was seen in at least as many frames, and seldom in the same
        ones: of two that stand side by side a camera shows both.
        """
        if sketch.box is None or other.box is None or other is sketch:
            return False
        if sketch.num_frames > other.num_frames or not self.labels.are_same(
            sketch.label, other.label
        ):
            return False
        corners = np.column_stack([sketch.box.corners, np.zeros(len(sketch.box.corners))])
        corners[:, 2] = other.box.center[2]
        is_near = other.box.contains(corners, _BESIDE).any()
        return bool(is_near) and count_beside(sketch, other) < self.rules.least_frames

    def _join_sketches(self) -> bool:
        """Make one of sketches that overlap; return whether furniture of the memory is gone."""
        has_changed = False
        least = self.rules.least_likeness
        ordered = sorted(
            self._sketches,
            key=lambda one: (one.furniture is None, one.likeness < least, -one.num_frames),
        )
        kept: list[Sketch] = []
        for sketch in ordered:
            into = next((one for one in kept if self._are_one(one, sketch)), None)
            if into is None:
                kept.append(sketch)
                continue
            if sketch.furniture is not None and into.furniture is not None:
                self._merge(into.furniture, sketch.furniture)
                has_changed = True
            is_other = not self.labels.are_same(into.label, sketch.label)
            if is_other and sketch.furniture is None and sketch.likeness < least:
                continue  # what it shows is the other one, and it does not look like it
            into.join(sketch)
            into.draw(self._ground)
        self._sketches = kept
        return has_changed

    def _are_one(self, sketch: Sketch, other: Sketch) -> bool:
        """Tell whether two sketches are of one piece of furniture."""
        if sketch.box is None or other.box is None:
            return False
        both, whole = compute_overlap(sketch.box, other.box)
        smaller = min(get_area(sketch.box), get_area(other.box))
        if self.labels.are_same(sketch.label, other.label):
            if both > 0.5 * whole:
                return True  # where one stands no other can
            num_beside = count_beside(sketch, other)
            if 4 * num_beside > min(sketch.num_frames, other.num_frames):
                return False  # they were seen at once
            return both > self.rules.least_overlap * smaller
        is_seldom = 4 * other.num_frames < sketch.num_frames  # a name that was wrong
        return both > 0.5 * whole or (is_seldom and both > 0.6 * smaller)

    def _add(self, sketch: Sketch) -> None:
        """Add believed furniture to the memory, with what was seen at spots that it stands at."""
        assert sketch.box is not None
        for number, row in self.memory.layout.furniture.items():
            if row.box is None or number in self._by_id or number in self._spots:
                continue
            both, _ = compute_overlap(row.box, sketch.box)
            if both > self.rules.least_overlap * min(get_area(row.box), get_area(sketch.box)):
                return  # it is on the map already, as people have drawn it
        label, box = sketch.label, sketch.box
        number = sum(row.label == label for row in self.memory.layout.furniture.values()) + 1
        name = label if number == 1 else f"{label} {number}"
        room = self._find_room(box.center)
        sketch.furniture = self.memory.add_furniture(label, room, name, box=box)
        self._by_id[sketch.furniture] = sketch
        self._counts["furniture found"] += 1
        self._take_spots(sketch.furniture, box)

    def _update(self, sketch: Sketch) -> bool:
        """Draw furniture of the memory anew, if it differs by enough; return whether it did."""
        furniture, new = sketch.furniture, sketch.box
        row = self.memory.layout.furniture.get(furniture) if furniture is not None else None
        if row is None or row.box is None or new is None or furniture is None:
            return False
        new = replace(new, interior=row.box.interior)
        moved = math.dist(new.center, row.box.center)
        both, _ = compute_overlap(row.box, new)
        change = max(moved, *(abs(a - b) for a, b in zip(new.size, row.box.size, strict=True)))
        if change < self.rules.least_change and row.label == sketch.label:
            return False
        has_grown = both > _GROWN * get_area(row.box)  # what was drawn is a part of it
        if moved > self.rules.most_change + max(row.box.size[:2]) / 2 and not has_grown:
            self._counts["furniture that jumped"] += 1
            return False
        if row.label != sketch.label:
            self.memory.name_furniture(furniture, sketch.label)
        if change >= self.rules.least_change:
            self.memory.move_furniture(furniture, box=new)
        self._counts["furniture drawn anew"] += 1
        self._take_spots(furniture, new)
        return True

    def _merge(self, furniture: int, other: int) -> None:
        self.memory.merge_furniture(furniture, other)
        self._by_id.pop(other, None)
        self._spots.discard(other)
        self.merged[other] = furniture
        self._counts["furniture merged"] += 1

    def _find_room(self, at: Sequence[float]) -> int:
        """Return the id of the room at a position, which is added if the memory has none."""
        name = self._areas.find(at)
        for number, room in self.memory.layout.rooms.items():
            if str(room) == name:
                return number
        return self.memory.add_room(name)

    # Spots.

    def find_spot(self, center: np.ndarray, bottom: float) -> int:
        """Return the spot at which a thing lies, which is added if there is none.

        Args:
            center: of the thing in the map, (3,).
            bottom: height of its lower side.
        """
        is_low = bottom < self._ground + 0.15
        top = self._ground if is_low else bottom
        layout = self.memory.layout
        for number in self._spots:
            box = layout.furniture[number].box
            assert box is not None
            if abs(box.top - top) < 0.1 and math.dist(box.center[:2], center[:2]) < _SPOT_REACH:
                size = [
                    min(max(side, 2 * abs(float(at) - mid) + 0.2), _WIDEST_SPOT)
                    for side, at, mid in zip(box.size[:2], center, box.center, strict=False)
                ]
                wider = replace(box, size=(size[0], size[1], box.size[2]))
                self.memory.move_furniture(number, box=wider)
                return number
        x, y = center[:2].tolist()
        thick = FLOOR_THICKNESS if is_low else 0.04
        box = Box((x, y, top - thick / 2), (_SPOT_SIDE, _SPOT_SIDE, thick))
        name = self._name_spot(box, is_low)
        spot = self.memory.add_furniture("floor" if is_low else _SPOT, self._find_room((x, y)),
                                         name, box=box)  # fmt: skip
        self._spots.add(spot)
        self._counts["spots"] += 1
        return spot

    def _name_spot(self, box: Box, is_low: bool) -> str:
        """Return what people call a spot: by the furniture that is nearest."""
        near = [
            (float(row.box.compute_distance(np.array(box.center))), row.description)
            for number, row in self.memory.layout.furniture.items()
            if row.box is not None and number not in self._spots
        ]
        away, name = min(near, default=(math.inf, ""))
        what = "floor" if is_low else _SPOT
        base = f"{what} by the {name}" if away < _NEAR else what
        taken = {row.description for row in self.memory.layout.furniture.values()}
        names = (base if number == 1 else f"{base} {number}" for number in range(1, len(taken) + 2))
        return next(name for name in names if name not in taken)

    def _take_spots(self, furniture: int, box: Box) -> None:
        """Let furniture have what was seen at spots that turn out to be it."""
        for spot in sorted(self._spots):
            own = self.memory.layout.furniture[spot].box
            assert own is not None
            is_at = box.bottom + 0.05 <= own.top <= box.top + 0.15
            flat = np.array([own.center[0], own.center[1], box.center[2]])
            if is_at and box.contains(flat, 0.1):
                self._merge(furniture, spot)

    def list_around(self, at: np.ndarray) -> list[int]:
        """Return the furniture that was found, and whose box a point (3,) lies in."""
        boxes = self.memory.boxes
        return [
            number
            for number in self._by_id
            if number in boxes and boxes[number].holds(at[None], _INSIDE).all()
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
        row = self.memory.layout.furniture.get(furniture)
        if row is None or row.box is None or row.box.interior != "none":
            return False
        if furniture not in self._by_id:
            return False
        if not any(row.box.holds(at[None], _INSIDE).all() for at in centers):
            return False
        self.tell_interior(furniture, "open")
        return True
