"""What people said of things, and what the robot did with them: beside what looks showed."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from numbers import Real
from typing import Any

from sgm.memory.sighting import RELATIONS
from sgm.messages import shorten
from sgm.names.words import read_words

ROBOT = "robot"  # who says what the robot itself did
# How far a statement is believed where its confidence is not given: people err and mix things up,
# and a hand slips. Assumptions, until a home's own statements are compared with its looks.
PERSON_CONFIDENCE, ROBOT_CONFIDENCE = 0.9, 0.97
LEAST_CONFIDENCE = 0.5  # of less, the opposite would be likelier
STATEMENTS = ("moved", "picked_up", "put_down")
MOST_KEPT = 8  # statements of each thing; what older ones said has been overtaken


@dataclass(frozen=True, slots=True)
class Statement:
    """That a thing is somewhere since a time: a person put it there, or the robot has it.

    Attributes:
        time: time step.
        kind: "moved" as a person said, or what the robot did: "picked_up", "put_down".
        furniture: id of the place; None for with the robot.
        relation: "in" or "onTop" it; None with the robot.
        by: who says so; "robot" of its own actions.
        confidence: probability that it is right.
        was_at: ids of furniture where it was held to be before.
        num_observed: of the thing, once this counted as a sighting; nothing was seen of it since as
            long as it is the same.
    """

    time: int
    kind: str
    furniture: int | None
    relation: str | None
    by: str
    confidence: float
    was_at: tuple[int, ...] = ()
    num_observed: int = 0

    def leave_out(self, furniture: Collection[int]) -> Statement | None:
        """Return the statement in a home without some furniture; None if it was about that."""
        if self.furniture is not None and self.furniture in furniture:
            return None
        return replace(self, was_at=tuple(place for place in self.was_at if place not in furniture))

    def to_json(self) -> list[Any]:
        """Return JSON values, from which `from_json` makes the same statement."""
        return [
            self.time, self.kind, self.furniture, self.relation, self.by, self.confidence,
            list(self.was_at), self.num_observed,
        ]  # fmt: skip

    @classmethod
    def from_json(cls, data: Any, furniture: Collection[int], time: int) -> Statement:
        """Read JSON values of a memory with this furniture; raises TypeError or ValueError."""
        said, kind, place, relation, by, confidence, was_at, num_observed = data
        is_held = kind == "picked_up"
        if (
            not isinstance(said, int) or not 0 <= said <= time
            or kind not in STATEMENTS
            or (place is not None or relation is not None if is_held else place not in furniture)
            or (not is_held and relation not in RELATIONS)
            or not set(was_at) <= set(furniture) or not isinstance(num_observed, int)
        ):  # fmt: skip
            raise ValueError(f"no statement like {shorten(data)}")
        read_words("by", by)
        sure = read_confidence(confidence, by)
        return cls(said, kind, place, relation, by, sure, tuple(was_at), num_observed)


def read_confidence(confidence: float | None, by: str) -> float:
    """Return how far a statement is believed; None for the default of people or the robot.

    What is no probability, or says that the opposite is likelier, raises ValueError.
    """
    if confidence is None:
        return ROBOT_CONFIDENCE if by == ROBOT else PERSON_CONFIDENCE
    if not isinstance(confidence, Real) or not LEAST_CONFIDENCE <= confidence <= 1:
        raise ValueError(
            f"confidence of a statement must lie in [0.5, 1], got {shorten(confidence)} by "
            f"{shorten(by)}. Leave out a statement that is rather wrong than right."
        )
    return float(confidence)
