"""Puts together a home that another program describes, and remembers what did not fit."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Collection

from simulator.memory.sighting import RELATIONS
from simulator.memory.words import read_words
from simulator.priors.types import load_types
from simulator.trace.events import Event
from simulator.trace.layout import Furniture, Layout, Room
from simulator.trace.trace import Trace


class HomeBuilder:
    """Collects rooms, furniture and objects; what shares a label is numbered.

    Attributes:
        num_nested: objects that lay in or on another object and were put on its furniture.
        left_out: names of what could not be placed, by reason.
    """

    def __init__(self, furniture_labels: Collection[str] = ()) -> None:
        """Start with an empty home.

        Args:
            furniture_labels: labels that are furniture besides those of the type table.
        """
        self._own = {read_words("furniture label", label) for label in furniture_labels}
        self._rooms: list[str] = []
        self._furniture: list[tuple[str, int]] = []  # label, room
        self._objects: list[tuple[str, int, int]] = []  # label, furniture, relation
        self.num_nested = 0
        self.left_out: dict[str, list[str]] = defaultdict(list)

    def is_furniture(self, label: str) -> bool:
        """Whether a label is that of furniture."""
        words = read_words("label", label)
        return words in self._own or words in load_types().furniture

    def add_room(self, label: str) -> int:
        """Add a room and return its index."""
        self._rooms.append(read_words("room label", label))
        return len(self._rooms) - 1

    def add_furniture(self, label: str, room: int) -> int:
        """Add furniture to a room and return its index."""
        self._furniture.append((read_words("furniture label", label), room))
        return len(self._furniture) - 1

    def add_object(
        self, label: str, furniture: int, is_inside: bool = False, is_nested: bool = False
    ) -> None:
        """Put an object in or on furniture.

        Args:
            label: what it is.
            furniture: index from `add_furniture`.
            is_inside: whether it is in furniture that the type table does not know; known
                furniture has its usual relation.
            is_nested: whether it lay in or on another object.
        """
        known = load_types().furniture.get(self._furniture[furniture][0])
        relation = known.relation if known is not None else RELATIONS[0 if is_inside else 1]
        words = read_words("object label", label)
        self._objects.append((words, furniture, RELATIONS.index(relation)))
        self.num_nested += is_nested

    def leave_out(self, reason: str, name: str) -> None:
        """Note what could not be placed."""
        self.left_out[reason].append(name)

    def build(self, name: str) -> Trace:
        """Return the home as a trace with everything at time 0.

        Raises:
            ValueError: if it has no room, no furniture, or no object.
        """
        for what, rows in (
            ("room", self._rooms), ("furniture", self._furniture), ("object", self._objects),
        ):  # fmt: skip
            if not rows:
                raise ValueError(
                    f"home must have a {what} that can be placed, got none in {name}. "
                    f"{self.summarise()}"
                )
        rooms = _number(self._rooms)
        furniture = _number([label for label, _ in self._furniture])
        objects = _number([label for label, _, _ in self._objects])
        layout = Layout(
            tuple(Room(*pair) for pair in zip(rooms, self._rooms, strict=True)),
            tuple(
                Furniture(own, label, room, label)
                for own, (label, room) in zip(furniture, self._furniture, strict=True)
            ),
        )
        events = tuple(
            Event(0.0, own, label, place, relation)
            for own, (label, place, relation) in zip(objects, self._objects, strict=True)
        )
        return Trace(name, layout, events)

    def summarise(self) -> str:
        """Say what was placed and what was not, a line each."""
        lines = [
            f"placed: {len(self._rooms)} rooms, {len(self._furniture)} furniture nodes, "
            f"{len(self._objects)} objects, {self.num_nested} of them taken out of other objects"
        ]
        for reason, names in self.left_out.items():
            counts = ", ".join(
                name if count == 1 else f"{name} x {count}"
                for name, count in Counter(names).most_common()
            )
            lines.append(f"not placed, {reason}: {counts}")
        return "\n".join(lines)


def _number(labels: list[str]) -> list[str]:
    """Name things by their label, those that share one with a number."""
    total, count = Counter(labels), Counter[str]()
    names = []
    for label in labels:
        count[label] += 1
        names.append(label if total[label] == 1 else f"{label} {count[label]}")
    return names
