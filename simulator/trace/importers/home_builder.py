"""Puts together a home that another program describes, and remembers what did not fit."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Collection
from dataclasses import replace

from sgm.layout.box import Box
from sgm.layout.furniture import Furniture, Room
from sgm.layout.layout import Layout
from sgm.mapping.furniture_labels import FurnitureLabels
from sgm.memory.sighting import Point
from sgm.names.words import read_words
from sgm.schema import RELATIONS
from simulator.priors.types import load_types
from simulator.trace.events import Event
from simulator.trace.layout import number_names
from simulator.trace.trace import Trace

_MOST_TOLD = 20  # names of what was left out for one reason


class HomeBuilder:
    """Collects rooms, furniture and objects; what shares a label is numbered.

    Attributes:
        num_nested: objects that lay in or on another object and were put on its furniture.
        left_out: names of what could not be placed, by reason.
        taken_for: what each number of a label was taken for, and how many nodes have it.
    """

    def __init__(self, furniture_labels: Collection[str] = ()) -> None:
        """Start with an empty home; some labels are furniture besides those of the type table."""
        self._own = {read_words("furniture label", label) for label in furniture_labels}
        self._household = FurnitureLabels()
        self._rooms: list[str] = []
        self._furniture: list[Furniture] = []  # without names
        # Label, description, place, relation, position in the map.
        self._objects: list[tuple[str, str, int, int, Point | None]] = []
        self.num_nested = 0
        self.left_out: dict[str, list[str]] = defaultdict(list)
        self.taken_for: Counter[tuple[int, str]] = Counter()

    def is_furniture(self, label: str) -> bool:
        """Whether a label is that of furniture."""
        words = read_words("label", label)
        return words in self._own or words in load_types().furniture

    def find_furniture(self, name: str) -> str | None:
        """Return the label of furniture of a name, by the household's names, too; None for things.

        A "refrigerator" is a "fridge".
        """
        return name if self.is_furniture(name) else self._household.find_label(name)

    def get_relation(self, label: str) -> str:
        """Return how things usually lie at furniture of a label; "" where that is not known."""
        known = load_types().furniture.get(read_words("label", label))
        return "" if known is None else known.relation

    def get_label(self, furniture: int) -> str:
        """Return what furniture is, by its index from `add_furniture`."""
        return self._furniture[furniture].label

    def add_room(self, label: str) -> int:
        """Add a room and return its index."""
        self._rooms.append(read_words("room label", label))
        return len(self._rooms) - 1

    def add_furniture(
        self,
        label: str,
        room: int,
        description: str | None = None,
        position: tuple[float, float] | None = None,
        box: Box | None = None,
        open_cost: float | None = None,
    ) -> int:
        """Add furniture, as in `Furniture`, to a room from `add_room`, and return its index."""
        words = read_words("furniture label", label)
        piece = Furniture(
            words, room, description or words, position=position, box=box, open_cost=open_cost
        )
        self._furniture.append(piece)
        return len(self._furniture) - 1

    def add_object(
        self,
        label: str,
        furniture: int,
        is_inside: bool = False,
        is_nested: bool = False,
        description: str | None = None,
        relation: str | None = None,
        position: Point | None = None,
    ) -> None:
        """Put an object in or on furniture.

        Args:
            label: what it is.
            furniture: index from `add_furniture`.
            is_inside: whether it is in furniture that the type table does not know; known
                furniture has its usual relation.
            is_nested: whether it lay in or on another object.
            description: what it is called; None for the label.
            relation: such as "in" or "onTop", where it is known; None to go by the furniture.
            position: where in the map its middle is, metres; None where that is unknown.
        """
        usual = self.get_relation(self._furniture[furniture].label)
        number = RELATIONS.index(relation or usual or RELATIONS[0 if is_inside else 1])
        words = read_words("object label", label)
        self._objects.append((words, description or words, furniture, number, position))
        self.num_nested += is_nested

    def leave_out(self, reason: str, name: str) -> None:
        """Note what could not be placed."""
        self.left_out[reason].append(name)

    def build(self, name: str) -> Trace:
        """Return the home as a trace with everything at time 0.

        Raises:
            ValueError: if it has no room or no furniture. A home without objects is a map, which a
                robot starts with.
        """
        for noun, rows in (("room", self._rooms), ("furniture", self._furniture)):
            if not rows:
                raise ValueError(
                    f"home must have a {noun} that can be placed, got none in {name}. "
                    + self.summarise().replace("\n", "; ")
                )
        rooms = number_names(self._rooms)
        furniture = number_names([piece.label for piece in self._furniture])
        objects = number_names([label for label, *_ in self._objects])
        layout = Layout.of(
            map(Room, self._rooms, rooms),
            (
                replace(piece, name=unique)
                for unique, piece in zip(furniture, self._furniture, strict=True)
            ),
        )
        events = tuple(
            Event(0.0, unique, description, furniture, relation, position)
            for unique, (_, description, furniture, relation, position) in zip(
                objects, self._objects, strict=True
            )
        )
        return Trace(name, layout, events)

    def summarise(self) -> str:
        """Say what was placed and what was not, a line each."""
        lines = [
            f"placed: {len(self._rooms)} rooms, {len(self._furniture)} furniture nodes, "
            f"{len(self._objects)} objects, {self.num_nested} of them taken out of other objects"
        ]
        if self.taken_for:
            numbers = ", ".join(
                f"{number} {name} x {count} "
                f"({'object' if self.find_furniture(name) is None else 'furniture'})"
                for (number, name), count in sorted(self.taken_for.items())
            )
            lines.append(f"labels taken for: {numbers}")
        for reason, names in self.left_out.items():
            counted = Counter(names).most_common()
            counts = ", ".join(
                name if number == 1 else f"{name} x {number}"
                for name, number in counted[:_MOST_TOLD]
            )
            if len(counted) > _MOST_TOLD:
                counts += f" and {len(counted) - _MOST_TOLD} others"
            lines.append(f"not placed, {reason}: {counts}")
        return "\n".join(lines)
