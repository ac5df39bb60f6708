"""Which landmarks are of one piece of furniture, or of a part of another one."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable

from sgm.layout.footprints import compute_overlap, find_corner_near, get_area
from sgm.mapping.furniture_labels import FurnitureLabels
from sgm.mapping.landmark import Landmark, count_beside, draw_landmarks
from sgm.mapping.map_rules import MapRules

_JOINED = 1.25  # times the frames that a box was drawn of, after which it is drawn anew at once
_BESIDE = 0.2  # metres between furniture and what may be a part of it


class LandmarkMerging:
    """Compares landmarks: two that overlap are one.

    Two of one label are not one while they were seen at once: of two that stand side by side a
    camera shows both.
    """

    def __init__(self, labels: FurnitureLabels, rules: MapRules, ground: float) -> None:
        """Compare by labels and rules; `ground` is the height of the floor."""
        self._labels, self._rules, self._ground = labels, rules, ground

    def join(
        self, landmarks: Iterable[Landmark], on_merge: Callable[[int, int], None]
    ) -> list[Landmark]:
        """Make one of landmarks that overlap, and return those that are left.

        `on_merge` is given the id of furniture, and that of other furniture that is the same.
        """
        least = self._rules.least_likeness
        ordered = sorted(
            landmarks,
            key=lambda landmark: (
                landmark.furniture is None,
                landmark.likeness < least,
                -landmark.num_frames,
            ),
        )
        kept: list[Landmark] = []
        for landmark in ordered:
            into = next((other for other in kept if self._are_one(other, landmark)), None)
            if into is None:
                kept.append(landmark)
                continue
            if landmark.furniture is not None and into.furniture is not None:
                on_merge(into.furniture, landmark.furniture)
            is_other = not self._labels.are_same(into.label, landmark.label)
            if is_other and landmark.furniture is None and landmark.likeness < least:
                continue  # what it shows is the other one, and it does not look like it
            into.join(landmark)
            if into.num_frames > _JOINED * into.num_drawn:
                draw_landmarks([into], self._ground)
        draw_landmarks(kept, self._ground)
        return kept

    def is_part_of(self, landmark: Landmark, other: Landmark) -> bool:
        """Tell whether a landmark may be a part of other furniture of its label that is near it.

        So it is while the other one was seen in at least as many frames, and seldom in the same
        ones.
        """
        if landmark.box is None or other.box is None or other is landmark:
            return False
        apart = math.dist(landmark.box.center[:2], other.box.center[:2])
        if apart > landmark.box.flat_radius + other.box.flat_radius + _BESIDE:
            return False
        if landmark.num_frames > other.num_frames or not self._labels.are_same(
            landmark.label, other.label
        ):
            return False
        is_near = find_corner_near(landmark.box, other.box, _BESIDE)
        return is_near and count_beside(landmark, other) < self._rules.least_frames

    def _are_one(self, landmark: Landmark, other: Landmark) -> bool:
        """Tell whether two landmarks are of one piece of furniture."""
        if landmark.box is None or other.box is None:
            return False
        both, whole = compute_overlap(landmark.box, other.box)
        if not both:
            return False
        smaller = min(get_area(landmark.box), get_area(other.box))
        if self._labels.are_same(landmark.label, other.label):
            if both > 0.5 * whole:
                return True  # where one stands no other can
            num_beside = count_beside(landmark, other)
            if 4 * num_beside > min(landmark.num_frames, other.num_frames):
                return False  # they were seen at once
            return both > self._rules.least_overlap * smaller
        is_seldom = 4 * other.num_frames < landmark.num_frames  # a name that was wrong
        return both > 0.5 * whole or (is_seldom and both > 0.6 * smaller)
