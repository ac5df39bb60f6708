"""Homes in lockstep, with the memory and the policy of an agent: evolve, ask, look, remember."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from sgm.evidence.adaptive_filter import TASKS_ASK_MOVED
from sgm.layout.layout import LayoutArrays
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Change, Queries
from sgm.policies.policy import Policy, mask_furniture
from sgm.prior.place_prior import PlacePrior
from sgm.schema import PlaceCode
from simulator.world.homes import Homes
from simulator.world.sensing import Observation, observe
from simulator.world.streams import sample_categorical


def sample_query(homes: Homes, asks_moved: float = TASKS_ASK_MOVED) -> np.ndarray:
    """Ask one question per home; return the object slot it is about, (H,).

    With probability `asks_moved`, one half in the tasks, uniform among the objects that moved in
    this step and are present, else with weight `move_freq` among all that are present.

    Source: appendix "Choice of query object"; docs/design.md, ruling 9.
    """
    uniform = homes.streams.rows("query", 2).take()
    weights = compute_query_weights(homes, homes.is_present, uniform[:, 0], asks_moved)
    return sample_categorical(weights, uniform[:, 1])


def compute_query_weights(
    homes: Homes, is_open: np.ndarray, uniform: np.ndarray, asks_moved: float = TASKS_ASK_MOVED
) -> np.ndarray:
    """Return the weights that an object to ask for is drawn with, (H, C), 0 but where `is_open`.

    Where `uniform` (H,) is below `asks_moved`, it is one that has moved, if any has.

    Source: docs/design.md, ruling 9.
    """
    moved = homes.object_moved & is_open
    weights = homes.move_freq.take(homes.object_type) * is_open
    is_fixed = ~weights.any(axis=1)  # nothing there ever moves
    weights[is_fixed] = is_open[is_fixed]
    ask_moved = (uniform < asks_moved) & moved.any(axis=1)
    weights[ask_moved] = moved[ask_moved]
    return weights


def compute_answers(homes: Homes, code: np.ndarray, home: np.ndarray | None = None) -> np.ndarray:
    """Mark the furniture that holds an object with the description asked for, bool (Q, F).

    Args:
        homes: the true homes.
        code: description codes, (Q,).
        home: of each, (Q,); None for one query per home, in order.

    Source: docs/design.md, ruling 10.
    """
    if home is None:
        home = np.arange(homes.num_homes)
    answers = np.zeros((len(code), homes.num_furniture), dtype=bool)
    is_asked = (homes.object_code[home] == code[:, None]) & homes.is_present[home]
    query, slot = np.divmod(np.flatnonzero(is_asked), homes.num_slots)
    answers[query, PlaceCode.furniture(homes.object_place[home[query], slot])] = True
    return answers


def make_memory(homes: Homes) -> MemoryBatch:
    """Make the empty memories of homes whose layouts are known."""
    labels = homes.labels
    index = {label: i for i, label in enumerate(labels)} | {"": -1}  # beyond a smaller home
    rooms, furniture = homes.room_labels.tolist(), homes.furniture_labels.tolist()
    place_prior = PlacePrior(
        homes.prior, rooms, furniture, homes.furniture_room, view=homes.view_prior
    )
    room_label, furniture_label = (
        np.array([[index[label] for label in labels] for labels in rows])
        for rows in (rooms, furniture)
    )
    layout = LayoutArrays(room_label, furniture_label, homes.furniture_room, place_prior)
    return MemoryBatch(labels, layout, clock=homes.clock)


class Rollout:
    """One policy and its memory in H homes at once; tasks say what is asked and looked at.

    Attributes:
        homes: the true homes.
        memory: what the agent believes.
        policy: who answers.
        asks_moved: share of what `ask` asks for that has moved in the step, if anything has.
        on_change: called with the memory rows that each look has changed.
        on_look: called with what each look has shown.
    """

    def __init__(self, homes: Homes, policy: Policy, asks_moved: float = TASKS_ASK_MOVED) -> None:
        """Start at t = 0 with an empty memory."""
        self.homes = homes
        self.asks_moved = asks_moved
        self.memory = make_memory(homes)
        self.policy = policy
        policy.reset(self.memory)
        index = {label: i for i, label in enumerate(self.memory.labels)}
        self._type_label = np.array(
            [[index[text] for text in labels] for labels in homes.type_labels]
        )
        self._homes = np.arange(homes.num_homes)
        looks = np.array([config.looks for config in homes.configs])
        self._on_patrol, self._looks_at_random = looks == "patrol", looks == "random"
        self._looks_per_step = np.array([config.looks_per_step for config in homes.configs])
        self._num_rounds = 0  # of looks on patrol
        self._num_evolved = 0
        self.on_change: Callable[[Change], None] = _ignore
        self.on_look: Callable[[Observation], None] = _ignore

    def ask(self) -> tuple[np.ndarray, Queries]:
        """Evolve every home by one step and ask its query: description codes (H,), queries."""
        self.evolve()
        return self.ask_for(self._homes, sample_query(self.homes, self.asks_moved))

    def evolve(self) -> None:
        """Let a time step pass in every home and in the memory, or as many as `Homes.pauses`."""
        pauses = self.homes.pauses
        num_steps = 1 if pauses is None else int(pauses[self._num_evolved % len(pauses)])
        self._num_evolved += 1
        self.homes.pass_steps(num_steps)
        self.memory.step(num_steps)

    def ask_for(self, homes: np.ndarray, slots: np.ndarray) -> tuple[np.ndarray, Queries]:
        """Ask for the objects in slots (Q,) of homes (Q,): description codes (Q,), queries."""
        codes = self.homes.object_code[homes, slots]
        return codes, self.query(homes, codes)

    def query(self, homes: np.ndarray, codes: np.ndarray) -> Queries:
        """Ask for description codes (Q,) in homes (Q,), whether such an object is there or not."""
        types = self.homes.object_descriptions.type_of_code[codes]
        labels = self._type_label[homes, types]
        return self.memory.query(homes, codes, labels, self.homes.prior_types[homes, types])

    def score(self, queries: Queries) -> np.ndarray:
        """Ask the policy, (Q, F); columns that are no furniture of the query's home are -inf."""
        return mask_furniture(self.memory, queries, self.policy.scores(self.memory, queries))

    def look_around(self, choice: np.ndarray) -> None:
        """Spend the looks of a step as the rules say; `choice` (H,) is the policy's."""
        num_furniture = self.homes.home_num_furniture
        for turn in range(self._looks_per_step.max()):
            has_look = turn < self._looks_per_step
            position = self._num_rounds * self._looks_per_step + turn
            furniture = np.where(self._on_patrol, position % num_furniture, choice)
            is_random = self._looks_at_random | (~self._on_patrol & (turn > 0))
            at_random = np.flatnonzero(is_random & has_look)
            if len(at_random):
                uniform = self.homes.streams.rows("looks", 1).take(at_random)[:, 0]
                furniture[at_random] = uniform * num_furniture[at_random]
            self.look(np.where(has_look, furniture, -1))
        self._num_rounds += 1

    def look(self, furniture: np.ndarray) -> Observation:
        """Fold one look per home into the memory; a negative index means no look there, (H,)."""
        memory = self.memory
        seen = observe(self.homes, furniture)
        types = self.homes.object_descriptions.type_of_code[seen.seen_code]
        rows = memory.ensure_objects(
            seen.seen_home,
            seen.seen_code,
            self._type_label[seen.seen_home, types],
            self.homes.prior_types[seen.seen_home, types],
        )
        change = memory.observe(
            seen.home, seen.furniture, rows, seen.seen_relation, seen.coverage, seen.seen_confidence
        )
        self.policy.observe(memory, change)
        self.on_change(change)
        self.on_look(seen)
        return seen


def _ignore(_: object) -> None:
    """Hear what happens; a function by name, so that a rollout can be pickled."""
