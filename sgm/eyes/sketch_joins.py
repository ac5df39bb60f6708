"""Which sketches are of one piece of furniture, or of a part of another one."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable

from sgm.eyes.furniture_labels import FurnitureLabels
from sgm.eyes.map_rules import MapRules
from sgm.eyes.sketch import Sketch, count_beside, draw_sketches
from sgm.layout.footprints import compute_overlap, find_corner_near, get_area

_JOINED = 1.25  # times the frames that a box was drawn of, after which it is drawn anew at once
_BESIDE = 0.2  # metres between furniture and what may be a part of it


class SketchJoins:
    """Compares sketches: two that overlap are one.

    Two of one label are not one while they were seen at once: of two that stand side by side a
    camera shows both.
    """

    def __init__(self, labels: FurnitureLabels, rules: MapRules, ground: float) -> None:
        """Compare by labels and rules; `ground` is the height of the floor."""
        self._labels, self._rules, self._ground = labels, rules, ground

    def join(
        self, sketches: Iterable[Sketch], on_merge: Callable[[int, int], None]
    ) -> list[Sketch]:
        """Make one of sketches that overlap, and return those that are left.

        `on_merge` is given the id of furniture, and that of other furniture that is the same.
        """
        least = self._rules.least_likeness
        ordered = sorted(
            sketches,
            key=lambda sketch: (
                sketch.furniture is None,
                sketch.likeness < least,
                -sketch.num_frames,
            ),
        )
        kept: list[Sketch] = []
        for sketch in ordered:
            into = next((other for other in kept if self._are_one(other, sketch)), None)
            if into is None:
                kept.append(sketch)
                continue
            if sketch.furniture is not None and into.furniture is not None:
                on_merge(into.furniture, sketch.furniture)
            is_other = not self._labels.are_same(into.label, sketch.label)
            if is_other and sketch.furniture is None and sketch.likeness < least:
                continue  # what it shows is the other one, and it does not look like it
            into.join(sketch)
            if into.num_frames > _JOINED * into.num_drawn:
                draw_sketches([into], self._ground)
        draw_sketches(kept, self._ground)
        return kept

    def is_part_of(self, sketch: Sketch, other: Sketch) -> bool:
        """Tell whether a sketch may be a part of other furniture of its label that is near it.

        So it is while the other one was seen in at least as many frames, and seldom in the same
        ones.
        """
        if sketch.box is None or other.box is None or other is sketch:
            return False
        apart = math.dist(sketch.box.center[:2], other.box.center[:2])
        if apart > sketch.box.flat_radius + other.box.flat_radius + _BESIDE:
            return False
        if sketch.num_frames > other.num_frames or not self._labels.are_same(
            sketch.label, other.label
        ):
            return False
        is_near = find_corner_near(sketch.box, other.box, _BESIDE)
        return is_near and count_beside(sketch, other) < self._rules.least_frames

    def _are_one(self, sketch: Sketch, other: Sketch) -> bool:
        """Tell whether two sketches are of one piece of furniture."""
        if sketch.box is None or other.box is None:
            return False
        both, whole = compute_overlap(sketch.box, other.box)
        if not both:
            return False
        smaller = min(get_area(sketch.box), get_area(other.box))
        if self._labels.are_same(sketch.label, other.label):
            if both > 0.5 * whole:
                return True  # where one stands no other can
            num_beside = count_beside(sketch, other)
            if 4 * num_beside > min(sketch.num_frames, other.num_frames):
                return False  # they were seen at once
            return both > self._rules.least_overlap * smaller
        is_seldom = 4 * other.num_frames < sketch.num_frames  # a name that was wrong
        return both > 0.5 * whole or (is_seldom and both > 0.6 * smaller)
