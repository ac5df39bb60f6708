"""Homes in lockstep: evolve, ask, answer, look, remember, score."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from simulator.memory.memory_batch import Change, MemoryBatch, Queries
from simulator.memory.place_prior import PlacePrior
from simulator.policies import Policy
from simulator.tasks.predict_location import choose_furniture, compute_answers, sample_query
from simulator.world.homes import Homes
from simulator.world.sensing import observe


@dataclass(frozen=True, slots=True)
class Step:
    """One step of Predict Object Location in H homes, before the look is folded in.

    Attributes:
        queries: one query per home.
        answers: furniture that holds an object asked for, bool (H, F).
        scores: what the policy said, (H, F).
        choice: the furniture chosen, (H,).
    """

    queries: Queries
    answers: np.ndarray
    scores: np.ndarray
    choice: np.ndarray

    @property
    def is_correct(self) -> np.ndarray:
        """Whether the chosen furniture holds an object asked for, bool (H,)."""
        return self.answers[np.arange(len(self.choice)), self.choice]


def make_memory(homes: Homes) -> MemoryBatch:
    """Make the empty memories of homes whose layouts are known."""
    labels = homes.labels
    index = {label: i for i, label in enumerate(labels)} | {"": -1}  # beyond a smaller home
    rooms, furniture = homes.room_labels.tolist(), homes.furniture_labels.tolist()
    return MemoryBatch(
        labels,
        np.array([[index[label] for label in row] for row in rooms]),
        np.array([[index[label] for label in row] for row in furniture]),
        homes.furniture_room,
        PlacePrior(homes.prior, rooms, furniture, homes.furniture_room),
        clock=homes.clock,
    )


class Rollout:
    """Predict Object Location, played by one policy in H homes at once.

    Attributes:
        homes: the true homes.
        memory: what the agent believes.
        policy: who answers.
        on_change: called with the memory rows that each look has changed.
    """

    def __init__(self, homes: Homes, policy: Policy) -> None:
        """Start at t = 0 with an empty memory."""
        self.homes = homes
        self.memory = make_memory(homes)
        self.policy = policy
        policy.reset(self.memory)
        index = {label: i for i, label in enumerate(self.memory.labels)}
        self._label_of_type = np.array([index[label] for label in homes.object_labels])
        types = np.arange(len(homes.object_labels))
        self._prior_type = np.where(types < len(homes.prior.objects), types, -1)
        self._homes = np.arange(homes.num_homes)
        self.on_change: Callable[[Change], None] = lambda change: None

    def run(self, num_steps: int) -> Iterator[Step]:
        """Play steps; each is yielded before its look enters the memory."""
        for _ in range(num_steps):
            codes, queries = self.ask()
            scores = self.policy.scores(self.memory, queries)
            choice = choose_furniture(scores, self.homes)
            yield Step(queries, compute_answers(self.homes, codes), scores, choice)
            self.look(choice)

    def ask(self) -> tuple[np.ndarray, Queries]:
        """Evolve every home by one step and ask its query: description codes (H,), queries."""
        self.evolve()
        return self.ask_for(self._homes, sample_query(self.homes))

    def evolve(self) -> None:
        """Let one time step pass in every home and in the memory."""
        self.homes.evolve()
        self.memory.step()

    def ask_for(self, homes: np.ndarray, slots: np.ndarray) -> tuple[np.ndarray, Queries]:
        """Ask for the objects in slots (Q,) of homes (Q,): description codes (Q,), queries."""
        codes = self.homes.object_code[homes, slots]
        return codes, self.query(homes, codes)

    def query(self, homes: np.ndarray, codes: np.ndarray) -> Queries:
        """Ask for description codes (Q,) in homes (Q,), whether such an object is there or not."""
        types = self.homes.object_descriptions.type_of_code[codes]
        return self.memory.query(homes, codes, self._label_of_type[types], self._prior_type[types])

    def look(self, furniture: np.ndarray) -> None:
        """Fold one look per home into the memory; a negative index means no look there, (H,)."""
        memory = self.memory
        seen = observe(self.homes, furniture)
        types = self.homes.object_descriptions.type_of_code[seen.seen_code]
        rows = memory.ensure_objects(
            seen.seen_home, seen.seen_code, self._label_of_type[types], self._prior_type[types]
        )
        change = memory.observe(seen.home, seen.furniture, rows, seen.seen_relation)
        self.policy.observe(memory, change)
        self.on_change(change)
