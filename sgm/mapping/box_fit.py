"""Boxes that explain best what a detector said in many frames."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from sgm.camera.camera_view import CameraView
from sgm.camera.silhouettes import Silhouettes, make_row
from sgm.layout.box import Box
from sgm.layout.turns import make_turn
from sgm.mapping.box_views import AXIS, IS_HIGH, SIGN, BoxViews

_STEPS = np.array([0.2, 0.1, 0.05, 0.025])  # metres by which sides are moved, coarse ones first
_ROUNDS = 3  # of all sides, at most, with each step
_LEAST_GAIN = 1e-3  # of the mean overlap
_LEAST_SIDE = 0.08  # metres
_TOGETHER = 16  # boxes that are fitted at once, so that their arrays stay in a processor's cache
_MOVES = np.arange(len(AXIS))


def compute_likeness(silhouettes: Sequence[Silhouettes], boxes: Sequence[Box]) -> np.ndarray:
    """Return the mean overlap of each of k boxes with what was seen of it, 0 to 1, (k,).

    1 where nothing was seen.
    """
    likeness = np.ones(len(boxes))
    for chosen in _split(silhouettes):
        views = _stack(
            [silhouettes[number] for number in chosen], [boxes[number] for number in chosen]
        )
        likeness[chosen] = views.score()
    return likeness


def fit_boxes(silhouettes: Sequence[Silhouettes], boxes: Sequence[Box], ground: float) -> list[Box]:
    """Return boxes with their sides moved so that each explains best what was seen of it.

    No side is moved below the floor, whose height is `ground`. The boxes are fitted at once: each
    goes through its sides with one step after the other, and takes the first move that gains.
    """
    fitted = [*boxes]
    for chosen in _split(silhouettes):
        views = _stack([silhouettes[index] for index in chosen], [boxes[index] for index in chosen])
        for number, low, high in _fit(views, ground):
            box = boxes[chosen[number]]
            middle = (low + high) / 2
            center = (*(make_turn(box.yaw) @ middle[:2]).tolist(), float(middle[2]))
            fitted[chosen[number]] = replace(box, center=center, size=tuple((high - low).tolist()))
    return fitted


def compute_overlaps(view: CameraView, boxes: Sequence[Box], seen: np.ndarray) -> np.ndarray:
    """Return the overlap of each of k boxes with a box in pixels (k, 4) of a frame, (k,)."""
    return BoxViews(make_row(view, seen)[:, None], np.ones(len(boxes)), boxes).score()


def _split(silhouettes: Sequence[Silhouettes]) -> Iterator[list[int]]:
    """Yield the numbers of those that have something, not too many at once."""
    numbers = [number for number, seen in enumerate(silhouettes) if len(seen)]
    for begin in range(0, len(numbers), _TOGETHER):
        yield numbers[begin : begin + _TOGETHER]


def _stack(silhouettes: Sequence[Silhouettes], boxes: Sequence[Box]) -> BoxViews:
    num_seen = np.array([len(seen) for seen in silhouettes])
    frames = np.zeros((len(boxes), num_seen.max(), 20))
    for of_box, seen in zip(frames, silhouettes, strict=True):
        seen.fill(of_box)
    return BoxViews(frames, num_seen, boxes)


def _fit(views: BoxViews, ground: float) -> Iterator[tuple[int, np.ndarray, np.ndarray]]:
    """Yield the number of each box as it is fitted, and its low and its high corner, (3,) each."""
    lowest = np.minimum(ground, views.low[:, 2]) - 1e-9
    # Of each box: its number, the step, how often all sides were tried with it, the next move, and
    # whether a side was moved in this round.
    number = np.arange(len(views.low))
    step, tried, begin = np.zeros((3, len(number)), dtype=np.int64)
    has_moved = np.zeros(len(number), dtype=bool)
    while len(number):
        length = _STEPS[step]
        scores = views.score_moves(length)  # (13, k)
        shift = SIGN[:, None] * length  # (12, k)
        side = views.high - views.low  # (k, 3)
        narrower = side[:, AXIS].T + np.where(IS_HIGH[:, None], shift, -shift)
        is_good = (narrower >= _LEAST_SIDE) & (scores[:-1] > scores[-1] + _LEAST_GAIN)
        is_low = (AXIS == 2) & (IS_HIGH == 0)
        is_good[is_low] &= (views.low[:, 2] + shift[is_low]) >= lowest
        # Where no side gains from the next one on, those before it are tried once more.
        is_over = ~(is_good & (_MOVES[:, None] >= begin)).any(axis=0)
        is_again = is_over & has_moved & (tried < _ROUNDS - 1)
        tried[is_again] += 1
        begin[is_again], has_moved[is_again] = 0, False
        is_good &= _MOVES[:, None] >= begin
        moved = np.flatnonzero(is_good.any(axis=0))
        first = is_good.argmax(axis=0)[moved]
        views.move(moved, AXIS[first], IS_HIGH[first], shift[first, moved])
        begin[moved], has_moved[moved] = first // 2 * 2 + 2, True  # with the next side
        is_round = begin >= len(_MOVES)
        tried[is_round] += 1
        begin[is_round], has_moved[is_round] = 0, False
        is_next = ~is_good.any(axis=0) | (tried >= _ROUNDS)
        step[is_next] += 1
        begin[is_next], tried[is_next], has_moved[is_next] = 0, 0, False
        is_done = step >= len(_STEPS)
        if is_done.any():
            for row in np.flatnonzero(is_done).tolist():
                yield int(number[row]), views.low[row], views.high[row]
            kept = ~is_done
            views.keep(kept)
            number, step, tried, lowest = number[kept], step[kept], tried[kept], lowest[kept]
            begin, has_moved = begin[kept], has_moved[kept]
