"""A finder that learns its home: a few hundred numbers, from what its own looks have shown."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from sgm.files import MissingFileError, read_json, write_whole
from sgm.messages import shorten_text
from sgm.policies.policy import compute_probabilities

FORMAT = "scene graph memory: adaptation"
MIN_QUESTIONS = 30
_HELD_OUT = 0.3  # the latest share of the questions, which fitting does not see
# Standard deviations of the normal priors that hold each number near "no change".
_SPREAD_SHARPNESS = 0.3
_SPREAD_WEIGHT = 0.5
_SPREAD_BIAS = 0.7
_MOST = 1000.0  # that a number of a file may be; the priors hold fitted ones far below
_LEAST = 1e-4  # of a belief, in logarithms
_MOST_STEPS = 50  # of Newton's method; five are enough as a rule
_SMALL_GAIN = 1e-9  # of the loss, in nats


@dataclass(frozen=True, slots=True)
class AskedAgain:
    """A question about a thing that a look then showed.

    Attributes:
        values: logit and belief of each furniture node, by its id.
        furniture: id of the furniture where the look showed it.
        has_moved: as in `Questions`.
    """

    values: dict[int, tuple[float, float]]
    furniture: int
    has_moved: bool


@dataclass(frozen=True, slots=True)
class Questions:
    """What was asked of a memory just before a look showed it; one home, Q questions.

    Attributes:
        scores: logits of the network, -inf where there is no candidate, (Q, F).
        belief: of the adaptive filter, (Q, F).
        answer: index of the place where the look showed it, (Q,).
        has_moved: whether it had been seen before, and was not where the memory had it, (Q,).
        furniture: ids, (F,).
        asks_moved: share of such questions that are about what has moved.
    """

    scores: np.ndarray
    belief: np.ndarray
    answer: np.ndarray
    has_moved: np.ndarray
    furniture: tuple[int, ...]
    asks_moved: float = 0.0

    def __len__(self) -> int:
        """Q."""
        return len(self.answer)

    @property
    def weights(self) -> np.ndarray:
        """How much each counts, (Q,), 1 on average.

        Looks mostly show what has not moved. Where that is asked for less often, as in the tasks,
        what has moved makes up `asks_moved` of the weight.
        """
        share = self.has_moved.mean()
        if not 0 < share < self.asks_moved:
            return np.ones(len(self))
        wanted = self.asks_moved
        return np.where(self.has_moved, wanted / share, (1 - wanted) / (1 - share))

    @classmethod
    def join(cls, asked: Sequence[AskedAgain], asks_moved: float) -> Questions:
        """Join questions to a home whose furniture may have changed meanwhile."""
        furniture = tuple(sorted({number for one in asked for number in one.values}))
        index = {number: position for position, number in enumerate(furniture)}
        scores = np.full((len(asked), len(furniture)), -np.inf)
        belief = np.zeros(scores.shape)
        for row, one in enumerate(asked):
            columns = [index[number] for number in one.values]
            scores[row, columns], belief[row, columns] = np.transpose(list(one.values.values()))
        answer = np.array([index[one.furniture] for one in asked], dtype=np.int64)
        has_moved = np.array([one.has_moved for one in asked], dtype=bool)
        return cls(scores, belief, answer, has_moved, furniture, asks_moved)

    def split(self) -> tuple[Questions, Questions]:
        """Return the earlier questions, and the latest `_HELD_OUT` of them."""
        end = round(len(self) * (1 - _HELD_OUT))
        return self._take(slice(None, end)), self._take(slice(end, None))

    def _take(self, rows: slice) -> Questions:
        return Questions(
            self.scores[rows], self.belief[rows], self.answer[rows], self.has_moved[rows],
            self.furniture, self.asks_moved,
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class Adaptation:
    """How the logits of a network are changed in one home.

        logit' = sharpness logit + weight ln(belief) + bias of the place

    with the belief of the adaptive filter (`sgm.evidence.adaptive_filter`), which knows the
    home's own rates.

    Attributes:
        sharpness, weight: 1 and 0 for no change.
        bias: by furniture id; 0 for what is not named.
        num_questions: that it was fitted to.
        nll_before, nll_after: mean negative log likelihood in nats, of the latest
            `_HELD_OUT` of these, which a first fit did not see.
    """

    sharpness: float = 1.0
    weight: float = 0.0
    bias: dict[int, float] | None = None
    num_questions: int = 0
    nll_before: float = 0.0
    nll_after: float = 0.0

    @property
    def is_used(self) -> bool:
        """Whether it changes anything: one that made held-out looks worse does not."""
        return self.bias is not None

    def change(
        self, scores: np.ndarray, belief: np.ndarray, furniture: tuple[int, ...]
    ) -> np.ndarray:
        """Return changed logits, (Q, F)."""
        if self.bias is None:
            return scores
        bias = np.array([self.bias.get(number, 0.0) for number in furniture])
        return self.sharpness * scores + self.weight * np.log(belief + _LEAST) + bias

    def save(self, path: str | Path) -> None:
        """Write a JSON file, whole or not at all, such as "home.adapted.json"."""
        data = {"format": FORMAT, **asdict(self)}
        write_whole(Path(path), f"{json.dumps(data, indent=1)}\n".encode())

    @classmethod
    def load(cls, path: str | Path) -> Adaptation:
        """Read what `save` wrote.

        Raises:
            FileNotFoundError: if there is no such file; it is a `ValueError`, too.
            ValueError: if the file is another one or damaged; it is named.
            OSError: if it cannot be read.
        """
        try:
            return _read(read_json(path))
        except FileNotFoundError:
            raise MissingFileError(
                f"adaptation must be a file that exists, got none at {path}. Adapt first."
            ) from None
        except (AttributeError, KeyError, TypeError, ValueError, OverflowError) as error:
            raise ValueError(
                "adaptation must be a file that `Adaptation.save` wrote, got "
                f"{shorten_text(str(error))} in {path}. "
                "Adapt the finder again."
            ) from None


def fit_adaptation(questions: Questions) -> Adaptation:
    """Fit an adaptation by maximum a posteriori, and keep it if it makes held-out looks likelier.

    The latest 30 % of the questions, which are in the order of time, decide whether it is kept: if
    these are likelier with it, by more than the standard error of the mean difference. Then it is
    fitted to all of them.

    Raises:
        ValueError: if there are fewer than `MIN_QUESTIONS`.
    """
    if len(questions) < MIN_QUESTIONS:
        raise ValueError(
            f"log must show at least {MIN_QUESTIONS} things, got {len(questions)}. Look around "
            "for longer."
        )
    early, held_out = questions.split()
    unchanged, changed = (_list_nll(held_out, one) for one in (Adaptation(), _fit(early)))
    weights = held_out.weights / held_out.weights.sum()
    before, after = float(weights @ unchanged), float(weights @ changed)
    gains = unchanged - changed
    error = np.sqrt((weights**2 * (gains - weights @ gains) ** 2).sum())  # of the mean gain
    if not before - after > error:
        return Adaptation(num_questions=len(questions), nll_before=before, nll_after=before)
    num_questions = len(questions)
    return replace(_fit(questions), num_questions=num_questions, nll_before=before, nll_after=after)


def compute_nll(questions: Questions, adaptation: Adaptation) -> float:
    """Return the weighted mean negative log likelihood of the answers, in nats."""
    return float(np.average(_list_nll(questions, adaptation), weights=questions.weights))


def _list_nll(questions: Questions, adaptation: Adaptation) -> np.ndarray:
    """Return the negative log likelihood of every answer, (Q,)."""
    scores = adaptation.change(questions.scores, questions.belief, questions.furniture)
    probability = compute_probabilities(scores, "logits")
    right = probability[np.arange(len(questions)), questions.answer]
    return -np.log(np.maximum(right, 1e-9))


def compute_accuracy(questions: Questions) -> float:
    """Return the weighted share of right first guesses."""
    is_right = questions.scores.argmax(axis=1) == questions.answer
    return float(np.average(is_right, weights=questions.weights))


def _fit(questions: Questions) -> Adaptation:
    num_places = len(questions.furniture)
    is_place = np.isfinite(questions.scores)
    scores = np.where(is_place, questions.scores, 0)
    belief = np.log(questions.belief + _LEAST)
    rows, weights = np.arange(len(questions)), questions.weights
    spread = np.append([_SPREAD_SHARPNESS, _SPREAD_WEIGHT], np.full(num_places, _SPREAD_BIAS))
    middle = np.append([1.0, 0.0], np.zeros(num_places))

    def weigh(values: np.ndarray) -> tuple[float, np.ndarray]:
        """Return the loss, and the probability of each place, (Q, F)."""
        changed = values[0] * scores + values[1] * belief + values[2:]
        changed = np.where(is_place, changed, -np.inf)
        changed -= changed.max(axis=1, keepdims=True)
        share = np.exp(changed)
        share /= share.sum(axis=1, keepdims=True)
        right = np.maximum(share[rows, questions.answer], 1e-12)
        off = (values - middle) / spread
        return float(-(weights @ np.log(right)) + 0.5 * (off @ off)), share

    # Newton's method: the loss is convex, of a few hundred numbers at most.
    values = middle
    loss, share = weigh(values)
    for _ in range(_MOST_STEPS):
        slope, curvature = _differentiate(share, np.stack([scores, belief]), questions)
        slope += (values - middle) / spread**2
        step = np.linalg.solve(curvature + np.diag(spread**-2), slope)
        gain = float(slope @ step)  # twice what a parabola would gain
        if gain < _SMALL_GAIN:
            break
        length = 1.0
        while (found := weigh(values - length * step))[0] > loss - 0.1 * length * gain:
            length /= 2
            if length < 1e-6:
                break
        values, (loss, share) = values - length * step, found
    bias = dict(zip(questions.furniture, values[2:].tolist(), strict=True))
    return Adaptation(float(values[0]), float(values[1]), bias)


def _differentiate(
    share: np.ndarray, values: np.ndarray, questions: Questions
) -> tuple[np.ndarray, np.ndarray]:
    """Return slope (2 + F,) and curvature (2 + F, 2 + F) of the negative log likelihood.

    Shares are probabilities of the places, (Q, F), values what sharpness and weight multiply,
    (2, Q, F).
    """
    weighted = questions.weights[:, None] * share  # (Q, F)
    error = weighted.copy()
    error[np.arange(len(questions)), questions.answer] -= questions.weights
    slope = np.append((error * values).sum(axis=(1, 2)), error.sum(axis=0))
    centred = values - (share * values).sum(axis=2, keepdims=True)  # (2, Q, F)
    curvature = np.zeros((len(slope), len(slope)))
    curvature[:2, :2] = np.einsum("qf,aqf,bqf->ab", weighted, centred, centred)
    curvature[:2, 2:] = (weighted * centred).sum(axis=1)
    curvature[2:, :2] = curvature[:2, 2:].T
    curvature[2:, 2:] = np.diag(weighted.sum(axis=0)) - weighted.T @ share
    return slope, curvature


def _read(data: Any) -> Adaptation:
    if data.pop("format") != FORMAT:
        raise ValueError("another file")
    bias = data.pop("bias")
    numbers = {name: float(value) for name, value in data.items()}
    if bias is not None:
        bias = {int(number): float(value) for number, value in bias.items()}
    if not np.isfinite(list(numbers.values())).all():
        raise ValueError("a number that is not finite")
    used = [numbers["sharpness"], numbers["weight"], *(bias or {}).values()]
    if not (np.abs(used) <= _MOST).all():
        raise ValueError(f"a number beyond {_MOST:g}")
    return Adaptation(**numbers | {"bias": bias, "num_questions": int(numbers["num_questions"])})
