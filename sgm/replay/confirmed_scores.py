"""Scores of a detector, fitted from looks of a robot that later looks confirmed."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sgm.memory.memory_event import read_events
from sgm.memory.score_calibration import FEWEST_SCORES, ScoreCalibration
from sgm.names.words import read_words
from sgm.replay.replay import replay

_NEXT_STEPS = 12  # by when a later look must come: after that, a thing may have moved
_MOST_CERTAIN = 0.2  # of the scores, the highest: taken for right
_ROUNDS = 30


def fit_from_log(path: str | Path) -> ScoreCalibration:
    """Fit the scores of a detector from the file of a memory, without labels.

    Every detection is judged by the next look of a later step at the same furniture: it confirms
    it, or does not show the thing. A right detection is not always confirmed, for a detector
    misses things and things move: how often is taken from the highest fifth of the scores, which
    count as right. A wrong one counts as never confirmed; where a detector errs in the same way
    again and again, label detections and use `ScoreCalibration.fit`.

    Args:
        path: of `SceneGraphMemory(path=...)`; its looks have the scores as they were given.

    Raises:
        ValueError: if it is no memory file, or fewer than `FEWEST_SCORES` detections with a score
            were looked at again.
        FileNotFoundError: if there is none.
    """
    scores, confirmed = _list_confirmed(path)
    if len(scores) < FEWEST_SCORES:
        raise ValueError(
            f"memory file must have at least {FEWEST_SCORES} scores that a later look at the same "
            f"place judges, got {len(scores)} in {path}. Look at places again, or label detections."
        )
    certain = scores >= np.quantile(scores, 1 - _MOST_CERTAIN)
    ceiling = min(max(float(confirmed[certain].mean()), 0.05), 0.999)
    fitted, right = ScoreCalibration(), np.where(confirmed, 1.0, 0.5)
    for _ in range(_ROUNDS):  # expectation and maximisation, Dempster, Laird and Rubin 1977
        fitted = ScoreCalibration.fit(scores, right)
        prior = np.array([fitted(score) for score in scores])
        unconfirmed = prior * (1 - ceiling) / (1 - prior * ceiling)
        right = np.where(confirmed, 1.0, unconfirmed)
    return fitted


def _list_confirmed(path: str | Path) -> tuple[np.ndarray, np.ndarray]:
    """Return the scores of detections and whether the next look confirmed each, (n,) both."""
    waiting: dict[int, tuple[int, dict[str, float]]] = {}  # by furniture: time, scores by name
    scores, confirmed = [], []
    for memory, line, furniture in replay(read_events(path)):
        if line.kind == "start":
            waiting.clear()
        if line.kind != "look" or line.values["coverage"] != 1:
            continue
        place, time = furniture[line.values["furniture"]], memory.time
        seen: dict[str, float] = {}
        for name, _, score, *about in line.values["seen"]:
            words = about[1] if about and about[1] else read_words("description", name)
            seen[words] = max(score, seen.get(words, 0.0))
        before, names = waiting.get(place, (time, {}))
        if before == time:  # looks of one step err alike
            waiting[place] = time, {**names, **seen}
            continue
        if time - before <= _NEXT_STEPS:
            for words, score in names.items():
                if 0 < score < 1:
                    scores.append(score)
                    confirmed.append(words in seen)
        waiting[place] = time, seen
    return np.array(scores, dtype=float), np.array(confirmed, dtype=bool)
