"""Questions about things that go out, and what finders say of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np

from sgm.finder.finder import Finder
from sgm.memory.scene_graph_memory import SceneGraphMemory
from tools.bench.robot_life import RobotLife

_LEAST = 1e-6  # of a probability
_EVERY = 5  # steps between questions, which no day is a multiple of


@dataclass(frozen=True, slots=True)
class AwayQuestion:
    """A question to a robot's memory.

    Attributes:
        memory: at that time; it is to be read, not changed.
        description: what is asked for; it was seen before.
        places: furniture ids where such a thing is; none if all are out.
        goes_out: whether one of them is out at some time of the days that are asked about.
        weight: things of the home that it stands for.
    """

    memory: SceneGraphMemory
    description: str
    places: frozenset[int]
    goes_out: bool
    weight: float


def ask(life: RobotLife, most: int) -> Iterator[AwayQuestion]:
    """Yield questions of the steps that a robot did not learn from.

    Of everything that goes out and as many other things, at every fifth step, some at random.

    Args:
        life: what the robot saw.
        most: questions; fewer where things had not been seen yet.
    """
    run, num_learnt, num_steps = life.run, life.num_learnt, life.run.num_steps
    truth, rng = run.truth, np.random.default_rng(life.seed)
    assert truth is not None, "a run has a truth"
    codes = np.unique(truth.code[truth.furniture >= 0])
    later = slice(num_learnt + 1, num_steps + 1)
    is_there = {code: (truth.furniture >= 0) & (truth.code == code) for code in codes.tolist()}
    leaves = [code for code in codes.tolist() if not is_there[code].any(axis=1)[later].all()]
    stays = [code for code in codes.tolist() if code not in leaves]
    num_others = min(max(len(leaves), 1), len(stays))
    weight = {True: 1.0, False: len(stays) / max(num_others, 1)}
    asked = []
    for step in range(num_learnt + 1, num_steps + 1, _EVERY):
        others = rng.permutation(stays)[:num_others].tolist()
        asked += [(step, code) for code in (*leaves, *others)]
    chosen = np.sort(rng.permutation(len(asked))[:most])
    for step, pairs in groupby([asked[number] for number in chosen], key=lambda pair: pair[0]):
        memory = run.memory_at(step - 1).copy()
        memory.step()
        for _, code in pairs:
            name = truth.descriptions[code]
            if memory.last_seen(name) is None:
                continue
            furniture = truth.furniture[step, is_there[code][step]]
            places = frozenset(memory.furniture_ids[place] for place in furniture)
            goes_out = code in leaves
            yield AwayQuestion(memory, name, places, goes_out, weight[goes_out])


@dataclass(frozen=True, slots=True)
class Answers:
    """What a finder said of Q questions of one home.

    Attributes:
        said: probability of elsewhere, (Q,).
        right: probability of where it is, elsewhere or a place, (Q,).
        is_first: whether elsewhere is likelier than every place, (Q,).
        is_out: (Q,).
        goes_out: (Q,).
        weight: things that each stands for, (Q,).
    """

    said: np.ndarray
    right: np.ndarray
    is_first: np.ndarray
    is_out: np.ndarray
    goes_out: np.ndarray
    weight: np.ndarray

    @classmethod
    def gather(cls, finder: Finder, questions: Sequence[AwayQuestion]) -> Answers:
        """Ask a finder."""
        rows = []
        for question in questions:
            ranking = finder.rank(question.memory, question.description)
            probabilities = [
                place.probability for place in ranking if place.furniture in question.places
            ]
            right = max(probabilities) if question.places else ranking.elsewhere
            best = max((place.probability for place in ranking), default=0.0)
            rows.append((ranking.elsewhere, right, ranking.elsewhere > best))
        columns = np.array(rows, dtype=float).reshape(-1, 3).T
        return cls(
            columns[0],
            columns[1],
            columns[2].astype(bool),
            np.array([not question.places for question in questions], dtype=bool),
            np.array([question.goes_out for question in questions], dtype=bool),
            np.array([question.weight for question in questions]),
        )

    @property
    def nll(self) -> np.ndarray:
        """Negative log likelihood of where each is, in nats, (Q,)."""
        surprise: np.ndarray = -np.log(np.maximum(self.right, _LEAST))
        return surprise

    @property
    def elsewhere_nll(self) -> np.ndarray:
        """Negative log likelihood of whether each is elsewhere, in nats, (Q,)."""
        likelihood = np.where(self.is_out, self.said, 1 - self.said)
        surprise: np.ndarray = -np.log(np.maximum(likelihood, _LEAST))
        return surprise
