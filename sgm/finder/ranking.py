"""Where an object may be: a ranking of places with their probabilities."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from sgm.finder.reasons import Evidence
from sgm.memory.sighting import SeenAt
from sgm.names.name_matching import Resolution


@dataclass(frozen=True, slots=True)
class Place:
    """A place where an object may be.

    Attributes:
        furniture: id of the furniture node.
        name: for people, "white fridge in kitchen".
        relation: "in" or "onTop" it, the likelier one.
        probability: that it is at this furniture; of several things that were meant, that at least
            one of them is.
        evidence: what the memory holds for and against it.
        detection: probability that a look there now shows it, if it is there: 1 minus the miss rate
            of the detector, and less after each look of this time step that missed it.
        open_cost: of opening the furniture to look there; None where nothing is to be opened, or
            the thing would be on top.
    """

    furniture: int
    name: str
    relation: str
    probability: float
    evidence: Evidence
    detection: float = 1.0
    open_cost: float | None = None

    @property
    def last_seen(self) -> SeenAt | None:
        """The object's last sighting at this place; None if it was never seen there."""
        return self.evidence.seen

    @property
    def why(self) -> str:
        """The evidence in one line: seen here, similar objects, prior."""
        return str(self.evidence)

    def __str__(self) -> str:
        """Say it in one line."""
        return f"{self.probability:4.0%}  {self.name}  ({self.why})"


@dataclass(frozen=True, slots=True)
class Ranking:
    """The likeliest places of an object, the best first; it iterates over them.

    Attributes:
        description: what was asked for.
        places: as many as were asked for, or fewer.
        elsewhere: probability that it is at none of the places: at furniture that the memory does
            not know, or not in the home. For a single thing, the probabilities of all places, this
            and `with_robot` sum to one.
        last_seen: where and when it was last seen; None if it never was.
        resolution: what the question was taken for, and what else it may have meant.
        with_robot: probability that the robot carries it (`SceneGraphMemory.picked_up`).
    """

    description: str
    places: tuple[Place, ...]
    elsewhere: float
    last_seen: SeenAt | None
    resolution: Resolution
    with_robot: float = 0.0

    def __iter__(self) -> Iterator[Place]:
        """Iterate over the places, the best first."""
        return iter(self.places)

    def __len__(self) -> int:
        """Return the number of places."""
        return len(self.places)

    def __getitem__(self, rank: int) -> Place:
        """Return the place of a rank, 0 the best."""
        return self.places[rank]

    def __str__(self) -> str:
        """Say one place per line."""
        lines = [str(self.resolution), *(f"  {place}" for place in self.places)]
        lines.append(f"  {self.elsewhere:4.0%}  elsewhere")
        if self.with_robot:
            lines.insert(1, f"  {self.with_robot:4.0%}  with the robot")
        return "\n".join(lines)
