"""What to expect at a place at a time: things that were seen there, and on how many such days."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from sgm.belief import Posterior
from sgm.finder.days_seen import DaysSeen, count_days
from sgm.memory.memory_questions import Asked
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.names.asking import make_asking


@dataclass(frozen=True, slots=True)
class ExpectedThing:
    """A thing that may be at a place.

    Attributes:
        thing: its id, or its description where it has none.
        probability: that it is there.
        days: on how many such days looks there at that hour showed it; None if there were none.
        language: of its sentences.
    """

    thing: str
    probability: float
    days: DaysSeen | None
    language: str

    @property
    def why(self) -> str:
        """What it rests on: "at this hour on 9 of 10 workdays"; empty if no look was then."""
        return "" if self.days is None else self.days.tell(self.language)

    def __str__(self) -> str:
        """Say it in one line."""
        name = make_asking(self.language).translate(self.thing)
        told = f"{name}: {self.probability:.0%}"
        return f"{told}, {self.why}" if self.days is not None else told


def list_expected(
    memory: SceneGraphMemory,
    furniture: int,
    ask: Callable[[Sequence[str]], tuple[Asked, Sequence[Posterior]]],
) -> list[ExpectedThing]:
    """List what was ever seen or said to be at a place, the likeliest first.

    Args:
        memory: what was seen so far.
        furniture: id of the place.
        ask: asks for things by ids or descriptions, and returns besides where each is.

    Raises:
        KeyError: if there is no such furniture.
    """
    memory.layout.check_furniture(furniture)
    named = memory.list_named(*dict.fromkeys(memory.descriptions))
    things = [
        name
        for name in (thing.id or thing.description for thing in named)
        if any(seen.furniture == furniture for seen in memory.places_of(name))
    ]
    if not things:
        return []
    asked, posteriors = ask(things)
    place, counts = asked.furniture_ids.index(furniture), count_days(asked)
    expected = [
        ExpectedThing(
            thing,
            float(posterior.places[place]),
            counts[meant[0]].get(place),
            memory.language,
        )
        for thing, posterior, meant in zip(things, posteriors, asked.meant, strict=True)
    ]
    return sorted(expected, key=lambda each: -each.probability)
