"""A robot that looks around in one home, and what finders know of that home afterwards."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sgm.finder.finder import Finder
from sgm.memory.scene_graph_memory import SceneGraphMemory
from simulator.replay.record import record_run
from simulator.replay.replay import Replay
from simulator.tasks.metrics import compute_nll
from simulator.tasks.scores import compute_rank
from simulator.world.source import HomeSource

COLUMNS = ("accuracy", "nll", "looks")


@dataclass(frozen=True, slots=True)
class Asked:
    """A question to a robot's memory, before the looks of the time step.

    Attributes:
        memory: at that time; it is to be read, not changed.
        description: what is asked for.
        places: furniture ids where such a thing is.
    """

    memory: SceneGraphMemory
    description: str
    places: frozenset[int]


@dataclass(frozen=True, slots=True)
class Life:
    """What a robot saw in one home while it learnt, and afterwards.

    Attributes:
        run: looks at random places, whatever anybody answers, and the truth.
        num_learnt: time steps to learn from; questions are asked in the later ones.
        seed: of the questions.
    """

    run: Replay
    num_learnt: int
    seed: int

    @classmethod
    def record(
        cls, source: HomeSource, num_learnt: int, num_asked: int, *, home: int, seed: int
    ) -> Life:
        """Let a robot live in a home.

        Args:
            source: of the home; its rules say how often the robot looks.
            num_learnt: time steps to learn from.
            num_asked: time steps with questions, after these.
            home: number of the home.
            seed: of the home, of what the detector misses, and of the questions.

        Raises:
            ValueError: if there is no such home, or it was recorded for fewer steps.
        """
        run = record_run(source, num_learnt + num_asked, home=home, seed=seed, policy="random")
        return cls(run, num_learnt, seed)

    def write_log(self, path: Path) -> None:
        """Write the log of the looks to learn from."""
        self.run.write_log(path, self.num_learnt)

    def ask(self, per_step: int, asks_moved: float) -> Iterator[Asked]:
        """Yield the questions; only things at a place are asked for, seen before or not.

        Args:
            per_step: questions in each time step.
            asks_moved: share of them that are about what moved in the step, if anything did; half
                of them in the tasks.
        """
        truth, rng = self.run.truth, np.random.default_rng(self.seed)
        assert truth is not None, "a run has a truth"
        for step in range(self.num_learnt + 1, self.run.num_steps + 1):
            memory = self.run.memory_at(step - 1).copy()
            memory.step()
            at, before = truth.furniture[step], truth.furniture[step - 1]
            there = np.flatnonzero(at >= 0)
            moved = there[at[there] != before[there]]
            for _ in range(per_step):
                slots = moved if len(moved) and rng.random() < asks_moved else there
                if not len(slots):
                    continue
                code = truth.code[step, rng.choice(slots)]
                ids = memory.furniture_ids
                places = at[there[truth.code[step, there] == code]]
                yield Asked(
                    memory, truth.descriptions[code], frozenset(ids[place] for place in places)
                )


def measure(finder: Finder, questions: list[Asked]) -> dict[str, float]:
    """Ask a finder, and return `COLUMNS`.

    Returns:
        "accuracy": share of right first guesses. "nll": mean negative log likelihood of the place,
        in nats. "looks": mean number of looks until it is found, in the order of the answer, with
        a detector that misses nothing. Places of equal probability are looked at in any order:
        both are means over all orders.
    """
    right, likelihood, looks = [], [], []
    for asked in questions:
        ranking = finder.rank(asked.memory, asked.description)
        probability = np.array([place.probability for place in ranking])
        is_true = np.array([place.furniture in asked.places for place in ranking])
        best = probability[is_true].max()
        is_tied, num_better = probability == best, (probability > best).sum()
        right.append(0.0 if num_better else is_true[is_tied].mean())
        likelihood.append(best)
        rank = compute_rank(probability[None], is_true[None], np.ones((1, len(is_true)), bool))
        looks.append(rank[0])
    return {
        "accuracy": float(np.mean(right)),
        "nll": compute_nll(np.array(likelihood)),
        "looks": float(np.mean(looks)),
    }
