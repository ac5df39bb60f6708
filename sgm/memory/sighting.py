"""What was detected, and where it was seen: input and answers of a scene graph memory."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from numbers import Real
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from sgm.arrays.read_numbers import read_numbers
from sgm.checks import is_number
from sgm.messages import shorten
from sgm.names.name import Name
from sgm.names.words import MAX_LENGTH, read_words
from sgm.schema import MOST_METRES, RELATION_TABLE, RELATIONS, USUAL_RELATION

SPELLINGS = {
    **{name: name for name in RELATIONS},
    **{
        words: name
        for name, relation in RELATION_TABLE.items()
        for words in (relation.preposition, relation.adverb)
    },
}
_BY_LETTERS = {
    "": USUAL_RELATION,
    **{name.casefold().replace(" ", ""): relation for name, relation in SPELLINGS.items()},
}
MOST_NUMBERS = 4096  # of an embedding
MOST_PICTURE = 500  # characters of the path or id of a picture
Point: TypeAlias = tuple[float, float, float]  # x, y, z in the map, metres


def read_relation(relation: str | None) -> str:
    """Return a relation, however it is written ("IN", "on top"); raises ValueError if not."""
    known = None
    if isinstance(relation, str):
        known = _BY_LETTERS.get(relation.casefold().replace(" ", "").replace("_", ""))
    if known is None:
        raise ValueError(
            f"relation must be one of {', '.join(RELATIONS)}, got {shorten(relation)}. Choose one "
            f"of these; empty means {USUAL_RELATION}."
        )
    return known


def read_id(value: Any) -> str:
    """Return the id of a thing as text, of a short text or a number; others raise ValueError."""
    is_number = isinstance(value, (int, np.integer)) and not isinstance(value, bool)
    text = str(value) if is_number else value
    if not isinstance(text, str) or not text.isprintable() or not 0 < len(text) <= MAX_LENGTH:
        raise ValueError(
            f"id must be a text of 1 to {MAX_LENGTH} characters or a whole number, got "
            f"{shorten(value)}. Give the id that your tracker gives."
        )
    return text


def read_embedding(values: Any) -> tuple[float, ...]:
    """Return an embedding as numbers, empty without one; raises ValueError for what is none."""
    try:
        array = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        array = np.zeros((1, 1))
    is_row = array.ndim == 1 and len(array) <= MOST_NUMBERS and bool(np.isfinite(array).all())
    if not is_row or (len(array) and not array.any()):
        raise ValueError(
            f"embedding must be a row of at most {MOST_NUMBERS} finite numbers, not all 0, got "
            f"{shorten(values)}. Give one vector for each sighting."
        )
    return tuple(array.tolist())


def read_point(value: Any, thing: str) -> Point:
    """Return the position of something; raises ValueError for what is none in any home."""
    x, y, z = read_numbers(f"position of {thing}", value, (3,)).tolist()
    if max(abs(x), abs(y), abs(z)) > MOST_METRES:
        raise ValueError(
            f"position of {thing} must lie within {MOST_METRES:g} m, got {shorten(value)}. Give "
            "metres in the frame of the map."
        )
    return x, y, z


def read_sd(value: Any, thing: str) -> float | None:
    """Return the standard deviation of a position; raises ValueError for what is none."""
    if value is None:
        return None
    if not is_number(value) or not 0 <= value <= MOST_METRES:
        raise ValueError(
            f"position_sd of {thing} must be a number of metres, 0 or more, got {shorten(value)}. "
            "Give a standard deviation, or leave it out."
        )
    return float(value)


def read_picture(value: Any) -> str | None:
    """Return the path or id of a picture; raises ValueError for what is no short text."""
    if value is None:
        return None
    if not isinstance(value, str) or not value.isprintable() or not 0 < len(value) <= MOST_PICTURE:
        raise ValueError(
            f"picture must be a path or an id, a text of 1 to {MOST_PICTURE} characters, got "
            f"{shorten(value)}. Give where the picture is, and keep it yourself."
        )
    return value


@dataclass(frozen=True, slots=True)
class Sighting:
    """An object that was detected on a furniture node.

    Attributes:
        description: what it is, such as "large red mug"; its words alone distinguish objects.
        relation: such as "in" or "onTop" the furniture, spelled as `read_relation` reads it.
        confidence: probability that it is right. Below one half it counts as if the object had
            not been seen, the more so the lower it is.
        owner: whose it is, where the detector or the robot knows. It becomes a part of the
            description, by which objects are distinguished: "phone" of "dad" is "dad's phone".
        id: of a tracker or of re-identification: things of one description and two ids are two.
            A thing of a known id is that one, whatever it is called. None where words alone tell
            things apart.
        embedding: how it looks, of whatever gives vectors, (D,); kept beside the thing
            (`SceneGraphMemory.find_nearest`). Empty without one.
        position: where its middle is, x, y, z in the frame of the map, metres; None if unknown.
        position_sd: standard deviation of that, metres; None if unknown.
        picture: path or id of a picture that shows it; None without one. The text alone is kept,
            and answers give it back.
        name: the description as it was read.
    """

    description: str
    relation: str = USUAL_RELATION
    confidence: float = 1.0
    owner: str | None = None
    id: str | None = None
    embedding: tuple[float, ...] = ()
    position: Point | None = None
    position_sd: float | None = None
    picture: str | None = None
    name: Name = field(init=False, repr=False, compare=False)

    if TYPE_CHECKING:  # what it takes is more than what it holds

        def __init__(
            self,
            description: str,
            relation: str = USUAL_RELATION,
            confidence: float = 1.0,
            owner: str | None = None,
            id: str | int | None = None,
            embedding: Sequence[float] | np.ndarray = (),
            position: Sequence[float] | np.ndarray | None = None,
            position_sd: float | None = None,
            picture: str | None = None,
        ) -> None: ...

    def __post_init__(self) -> None:
        """Raise ValueError for what is no name, relation, confidence, id, position or the like."""
        words = read_words("description", self.description)
        if self.owner is not None and not words.startswith(f"{read_words('owner', self.owner)}'s "):
            object.__setattr__(self, "description", f"{self.owner}'s {self.description}")
        object.__setattr__(self, "name", Name.read(self.description))
        object.__setattr__(self, "relation", read_relation(self.relation))
        if not isinstance(self.confidence, Real) or not 0 <= self.confidence <= 1:
            raise ValueError(
                f"confidence must lie in [0, 1], got {shorten(self.confidence)} for "
                f"{shorten(self.description)}. Give a probability."
            )
        object.__setattr__(self, "confidence", float(self.confidence))  # of any kind of number
        if self.id is not None:
            object.__setattr__(self, "id", read_id(self.id))
        object.__setattr__(self, "embedding", read_embedding(self.embedding))
        if self.position is not None or self.position_sd is not None:
            thing = shorten(self.description)
            object.__setattr__(self, "position", read_point(self.position, thing))
            object.__setattr__(self, "position_sd", read_sd(self.position_sd, thing))
        read_picture(self.picture)

    def to_row(self) -> list[Any]:
        """Return JSON values, the arguments with which the same sighting is made."""
        arguments: list[Any] = [self.description, self.relation, self.confidence]
        has_position, has_picture = self.position is not None, self.picture is not None
        if self.id is not None or self.embedding or has_position or has_picture:
            arguments += [None, self.id, list(self.embedding)]
        if has_position or has_picture:
            point = None if self.position is None else list(self.position)
            arguments += [point, self.position_sd]
        if has_picture:
            arguments.append(self.picture)
        return arguments


@dataclass(frozen=True, slots=True)
class SeenAt:
    """A place where an object was seen.

    Attributes:
        time: time step of the last sighting there.
        steps_ago: time steps since.
        furniture: furniture id; None if it was removed from the memory since.
        relation: such as "in" or "onTop" the furniture; None with the furniture.
        is_there: whether the last look at this furniture found it, and no look has shown it at
            another place since (one of several may be at each).
        times_seen: looks at this furniture that found it.
        times_looked: looks at this furniture since it was first seen or looked for there.
        by: who said so, "robot" for what it did itself; empty for what a look has shown.
        position: where its middle was seen last there, x, y, z in the map, metres; None if that is
            unknown, or it is not there any more.
        position_sd: standard deviation of that, metres; None if it is unknown.
        usual_position: where it usually lies there, by all sightings with a position; None without
            any.
        picture: path or id of the picture of the latest sighting there that had one; None without.
    """

    time: int
    steps_ago: int
    furniture: int | None
    relation: str | None
    is_there: bool
    times_seen: int
    times_looked: int
    by: str = ""
    position: Point | None = None
    position_sd: float | None = None
    usual_position: Point | None = None
    picture: str | None = None
