"""The memory of one home, for use with or without the simulator."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from simulator.memory.memory_batch import MemoryBatch, Queries
from simulator.memory.place_prior import PlacePrior
from simulator.prior_graph import PriorGraph

if TYPE_CHECKING:  # policies read memories; the memory only names their type
    from simulator.policies.policy import Policy

RELATIONS = ("in", "onTop")


@dataclass(frozen=True, slots=True)
class Sighting:
    """An object that was detected on a furniture node.

    Attributes:
        description: what it is, such as "large red mug"; objects are told apart by it alone.
        relation: "in" or "onTop" the furniture.
    """

    description: str
    relation: str = "onTop"

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            ValueError: if the description is empty or the relation unknown.
        """
        _check_text("description", self.description)
        if self.relation not in RELATIONS:
            raise ValueError(
                f"relation must be one of {', '.join(RELATIONS)}, got {self.relation!r} for "
                f"{self.description!r}. Choose one of these."
            )


class SceneGraphMemory:
    """One graph that holds everything ever observed in a home.

    Object nodes are told apart by description, so one node can have several true edges. Looking
    at furniture updates every remembered edge of it: seen -> true, not seen -> false.

    Example:
        >>> memory = SceneGraphMemory()
        >>> kitchen = memory.add_room("kitchen")
        >>> fridge = memory.add_furniture("fridge", room=kitchen)
        >>> memory.observe(fridge, seen=[Sighting("milk", relation="in")])
        >>> memory.step()
        >>> query = memory.query("milk")

    Attributes:
        batch: the memory as a `MemoryBatch` of one home, which policies read.

    Source: paper section 4.2, appendix B; rulings 12 and 13.
    """

    def __init__(self, prior: PriorGraph | None = None) -> None:
        """Start with an empty home.

        Args:
            prior: where things tend to be; None for the shipped default.
        """
        self._prior = prior if prior is not None else PriorGraph.default()
        self._object_types = {row.label: i for i, row in enumerate(self._prior.objects)}
        self._label_index: dict[str, int] = {}
        self._rooms: list[str] = []
        self._furniture: list[tuple[str, int, str]] = []  # label, room, description
        self._keys: dict[str, int] = {}
        for label in ("house", "floor"):
            self._intern(label)
        empty = np.zeros((1, 0), dtype=np.int32)
        self.batch = MemoryBatch(
            list(self._label_index), empty, empty, empty, self._make_place_prior()
        )

    @property
    def time(self) -> int:
        """Steps since the start."""
        return self.batch.time

    @property
    def num_furniture(self) -> int:
        """Number of furniture nodes, F."""
        return len(self._furniture)

    def add_room(self, label: str) -> int:
        """Add a room such as "kitchen" and return its id.

        Raises:
            ValueError: if the label is empty.
        """
        _check_text("room label", label)
        self._intern(label)
        self._rooms.append(label)
        self._update_layout()
        return len(self._rooms) - 1

    def add_furniture(self, label: str, room: int, description: str | None = None) -> int:
        """Add a furniture node and return its id.

        Args:
            label: what it is, such as "fridge".
            room: id from `add_room`.
            description: for people, such as "white fridge"; the label if left out.

        Raises:
            KeyError: if `room` is not a room of this memory.
            ValueError: if the label is empty.
        """
        _check_text("furniture label", label)
        if not 0 <= room < len(self._rooms):
            raise KeyError(
                f"room must be an id from add_room, got {room}; there are {len(self._rooms)} "
                "rooms. Add the room first."
            )
        self._intern(label)
        self._furniture.append((label, room, description or label))
        self._update_layout()
        return len(self._furniture) - 1

    def describe(self, furniture: int) -> str:
        """Return the description and room of a furniture node.

        Raises:
            KeyError: if `furniture` is not a furniture node of this memory.
        """
        self._check_furniture(furniture)
        _, room, description = self._furniture[furniture]
        return f"{description} in {self._rooms[room]}"

    def observe(self, furniture: int, seen: Sequence[Sighting]) -> None:
        """Fold one look at a furniture node into the memory.

        Every remembered edge of `furniture` is updated: seen ones become true, the others false.

        Args:
            furniture: id from `add_furniture`.
            seen: what was detected there; detection may have missed objects.

        Raises:
            KeyError: if `furniture` is not a furniture node of this memory.

        Source: paper section 4.2, appendix B. Differs: negative evidence is counted (released
        code does not).
        """
        self._check_furniture(furniture)
        rows = [self._find_object(sighting.description) for sighting in seen]
        self.batch.observe(
            np.zeros(1, dtype=np.int64),
            np.array([furniture]),
            np.array(rows, dtype=np.int64),
            np.array([RELATIONS.index(sighting.relation) for sighting in seen], dtype=np.int64),
        )

    def step(self) -> None:
        """Let one time step pass."""
        self.batch.step()

    def query(self, description: str) -> Queries:
        """Ask for an object; until the next `step` its hypothetical edges are in the graph.

        Args:
            description: what to look for, whether it was seen before or not.

        Returns:
            One query, for `Policy.scores(memory.batch, query)`, which gives (1, F).

        Raises:
            ValueError: if the description is empty, or there is no furniture yet.
        """
        _check_text("description", description)
        if not self._furniture:
            raise ValueError(
                "memory must have furniture before a query, got none. Call add_furniture first."
            )
        label = self._find_label(description)
        return self.batch.query(
            np.zeros(1, dtype=np.int64),
            np.array([self._keys.setdefault(description, len(self._keys))]),
            np.array([self._intern(label)]),
            np.array([self._object_types.get(label, -1)]),
        )

    def rank(self, policy: Policy, description: str) -> list[tuple[int, float]]:
        """Order all furniture by how likely it holds an object, the best first.

        Args:
            policy: who judges, for example `simulator.policies.heuristics.Bayesian()`.
            description: what to look for.

        Returns:
            (furniture id, score) for every furniture node; -inf where there is no opinion.
        """
        query = self.query(description)
        scores = policy.scores(self.batch, query)[0]
        order = np.argsort(-scores, kind="stable")
        return [(int(furniture), float(scores[furniture])) for furniture in order]

    def _find_object(self, description: str) -> int:
        """Return the object node of a description, adding it if it is new."""
        label = self._find_label(description)
        rows = self.batch.ensure_objects(
            np.zeros(1, dtype=np.int64),
            np.array([self._keys.setdefault(description, len(self._keys))]),
            np.array([self._intern(label)]),
            np.array([self._object_types.get(label, -1)]),
        )
        return int(rows[0])

    def _find_label(self, description: str) -> str:
        """Return the longest known type that a description ends with, else its last word."""
        words = description.split()
        for start in range(len(words)):
            label = " ".join(words[start:])
            if label in self._object_types:
                return label
        return words[-1]

    def _intern(self, label: str) -> int:
        index = self._label_index.setdefault(label, len(self._label_index))
        if hasattr(self, "batch"):
            self.batch.labels = list(self._label_index)
        return index

    def _make_place_prior(self) -> PlacePrior:
        return PlacePrior(
            self._prior,
            [self._rooms],
            [[label for label, _, _ in self._furniture]],
            np.array([[room for _, room, _ in self._furniture]], dtype=np.int64),
        )

    def _update_layout(self) -> None:
        self.batch.set_layout(
            np.array([[self._label_index[room] for room in self._rooms]], dtype=np.int32),
            np.array(
                [[self._label_index[label] for label, _, _ in self._furniture]], dtype=np.int32
            ),
            np.array([[room for _, room, _ in self._furniture]], dtype=np.int32),
            self._make_place_prior(),
        )

    def _check_furniture(self, furniture: int) -> None:
        if not 0 <= furniture < len(self._furniture):
            raise KeyError(
                f"furniture must be an id from add_furniture, got {furniture}; there are "
                f"{len(self._furniture)} furniture nodes. Add it first."
            )


def _check_text(what: str, text: str) -> None:
    if not isinstance(text, str) or not text.strip():
        raise ValueError(f"{what} must be a non-empty text, got {text!r}. Name it in words.")
