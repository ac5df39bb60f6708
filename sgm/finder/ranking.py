"""Where an object may be: places with their probabilities, and what speaks for and against each."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime

import numpy as np

from sgm.belief import Posterior
from sgm.memory.clock import Clock
from sgm.memory.memory_questions import Asked
from sgm.memory.sighting import Point, SeenAt
from sgm.memory.thing import ROBOT, Statement
from sgm.names.resolution import Resolution
from sgm.schema import IS_INSIDE, NEVER, RELATIONS

SIMILAR = 0.7  # cosine of the labels' text vectors: mug and cup .96, document and book .74
_MONTHS = (
    "January February March April May June July August September October November December"
).split()
_WHERE = {"is": "it is this place", "part": "it stands in this room"}
_NAMED = 2  # similar objects that are called by name


@dataclass(frozen=True, slots=True)
class Evidence:
    """What a memory holds about an object at one furniture node.

    Counts of the memory, not an account of what moved the network.

    Attributes:
        seen: its last sighting there; None if it was never seen there.
        times_absent: looks at this furniture that did not find it; of what was seen there, those
            since it was first seen or looked for there.
        similar: descriptions of other objects with a similar label that were seen there, the
            latest first.
        prior: share of this place in where such objects tend to be, 0 to 1.
        seen_on: date and time of that sighting; None without a clock.
        missed_on: date and time of the last look here, if it did not show it any more; None
            without a clock.
        now: date and time of the present step; None without a clock.
        times_sought: looks for it alone since that sighting that did not find it here.
        ended: what was said or done after that sighting, by which it is not here any more; None
            without such a statement.
        ended_ago: time steps since; 0 without a statement.
        ended_on: date and time of it; None without one, or without a clock.
        was_missed: whether a look here, after that sighting and statement, did not show it.
        is_in_view: whether a camera shows it here now (`sgm.ros.LiveMemory`).
    """

    seen: SeenAt | None
    times_absent: int
    similar: tuple[str, ...]
    prior: float
    seen_on: datetime | None = None
    missed_on: datetime | None = None
    now: datetime | None = None
    times_sought: int = 0
    ended: Statement | None = None
    ended_ago: int = 0
    ended_on: datetime | None = None
    was_missed: bool = False
    is_in_view: bool = False

    def __str__(self) -> str:
        """Say it in one line."""
        parts = []
        if self.seen is not None:
            parts.append(self._tell_seen(self.seen))
        elif self.times_absent:
            parts.append(f"not seen here in {_count(self.times_absent, 'look')}")
        if self.similar:
            names = ", ".join(self.similar[:_NAMED])
            more = len(self.similar) - _NAMED
            parts.append(f"similar objects: {names}" + (f" and {more} more" if more > 0 else ""))
        if self.prior > 0:
            parts.append(f"prior {self.prior:.0%}")
        return "; ".join(parts) or "no evidence"

    def _tell_seen(self, seen: SeenAt) -> str:
        """Say when it was last seen here, or said to be, what ended that, and who missed it."""
        who = "seen here"
        if self.seen is not None and self.seen.position is not None:
            who = f"at {tell_point(self.seen.position)}, {who}"
        if seen.by:
            who = "put here by the robot" if seen.by == ROBOT else f"{seen.by} said so"
        if self.is_in_view:
            where = "" if seen.position is None else f" at {tell_point(seen.position)}"
            return f"in view now{where}"
        is_new = not seen.by and seen.steps_ago == 0
        told = f"{who} {self._tell_ago(seen.steps_ago, None if is_new else self.seen_on)}"
        if seen.is_there and self.times_sought:
            return f"{told}; not found here in {_count(self.times_sought, 'look')} for it since"
        if seen.is_there:
            return told
        if self.ended is not None:
            told += f"; {_tell_end(self.ended)} {self._tell_ago(self.ended_ago, self.ended_on)}"
            if not self.was_missed:
                return told
        elif is_new:
            return told + (", not in the latest look" if self.was_missed else ", then gone")
        if self.missed_on is not None and self.now is not None:
            return f"{told}; not there {tell_time(self.missed_on, self.now)}"
        return told + (", then gone" if self.ended is None else "; not there in a look since")

    def _tell_ago(self, steps_ago: int, time: datetime | None) -> str:
        if time is not None and self.now is not None:
            return tell_time(time, self.now)
        return f"{_count(steps_ago, 'step')} ago" if steps_ago else "in this step"


@dataclass(frozen=True, slots=True)
class Place:
    """A place where an object may be.

    Attributes:
        furniture: id of the furniture node.
        name: for people, "white fridge in kitchen".
        relation: such as "in" or "onTop" it, the likelier one; "is" where the place itself was
            asked for, "part" where it stands in a room that was.
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
    def position(self) -> Point | None:
        """Where it was seen last there, x, y, z in the map, metres; None if it is not known.

        Nor is it where the last look at this place did not find it.
        """
        return None if self.evidence.seen is None else self.evidence.seen.position

    @property
    def picture(self) -> str | None:
        """Path or id of the latest picture that shows it there; None without one."""
        return None if self.evidence.seen is None else self.evidence.seen.picture

    @property
    def why(self) -> str:
        """The evidence in one line: seen here, similar objects, prior."""
        return _WHERE.get(self.relation) or str(self.evidence)

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
        asked_for: "thing"; or "place" or "room" where the name is of furniture or of a room: the
            places are that furniture, or what stands in the room, each with probability 1.
        num_known: how many things of that name there are at least: those that differ, each
            as often as it was seen at once; 0 if none was ever seen.
    """

    description: str
    places: tuple[Place, ...]
    elsewhere: float
    last_seen: SeenAt | None
    resolution: Resolution
    with_robot: float = 0.0
    asked_for: str = "thing"
    num_known: int = 0

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


def rank_place(
    description: str, resolution: Resolution, names: Mapping[int, str], asked_for: str
) -> Ranking:
    """Return the ranking of a question for places themselves, which are by id in `names`."""
    nothing = Evidence(None, 0, (), 0.0)
    places = tuple(
        Place(number, name, "is" if asked_for == "place" else "part", 1.0, nothing)
        for number, name in names.items()
    )
    return Ranking(description, places, 0.0, None, resolution, asked_for=asked_for)


def _tell_end(said: Statement) -> str:
    """Say by which statement a thing was at a place no longer."""
    if said.by == ROBOT and said.kind != "moved":
        return (
            "the robot picked it up" if said.kind == "picked_up" else "the robot put it elsewhere"
        )
    return f"{'the robot' if said.by == ROBOT else said.by} said it was moved"


def tell_point(point: Point) -> str:
    """Say a point in the map, to the centimetre: "1.9, 3.1, 0.95"."""
    return ", ".join(f"{round(value, 2) + 0.0:g}" for value in point)


def tell_time(time: datetime, now: datetime) -> str:
    """Say a time as people do: "at 9:10", "yesterday at 21:40", "on 3 November at 8:00"."""
    hour = f"at {time.hour}:{time.minute:02}"
    days = (now.date() - time.date()).days
    if days == 0:
        return hour
    if days == 1:
        return f"yesterday {hour}"
    if days == -1:
        return f"tomorrow {hour}"
    year = f" {time.year}" if time.year != now.year else ""
    return f"on {time.day} {_MONTHS[time.month - 1]}{year} {hour}"


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def order_places(asked: Asked, probability: np.ndarray) -> np.ndarray:
    """Return the places, the likeliest first, and of equal ones that of the latest sighting, (F,).

    `probability` is that of each place, (F,).
    """
    latest = np.full(len(probability), len(asked.sightings))
    for number, seen in reversed([*enumerate(asked.sightings)]):
        if seen.furniture is not None:
            latest[asked.furniture_ids.index(seen.furniture)] = number
    order: np.ndarray = np.lexsort((latest, -probability))
    return order


def count_known(asked: Asked) -> int:
    """Count the things that are meant and were seen, each as often as it was seen at once."""
    known = asked.rows >= 0
    was_seen = asked.current.objects["num_observed"][asked.rows[known]] > 0
    return int(asked.num_instances[known][was_seen].sum())


def describe_places(
    asked: Asked, posterior: Posterior, cosines: np.ndarray | None, furniture: Sequence[int]
) -> tuple[Place, ...]:
    """Say what is believed of some furniture nodes, and why; arguments as in `gather_evidence`."""
    relations = asked.relation.tolist()
    probability, detection = posterior.places.tolist(), posterior.detection.tolist()
    return tuple(
        Place(
            furniture=asked.furniture_ids[place],
            name=asked.furniture_names[place],
            relation=RELATIONS[relations[place]],
            probability=probability[place],
            evidence=evidence,
            detection=detection[place],
            open_cost=asked.open_costs[place] if IS_INSIDE[relations[place]] else None,
        )
        for place, evidence in zip(
            furniture, gather_evidence(asked, cosines, furniture), strict=True
        )
    )


def gather_evidence(
    asked: Asked, cosines: np.ndarray | None, furniture: Sequence[int]
) -> list[Evidence]:
    """Gather what a memory holds about what was asked for, at some furniture nodes.

    Args:
        asked: what `memory.ask` gave.
        cosines: of the text vectors of every pair of labels of `asked.batch`, (L, L); None to
            leave similar objects out.
        furniture: positions in `asked.furniture_ids`, (n,).

    Returns:
        One entry per furniture node, n of them.
    """
    edges, ids = asked.current.edges, asked.furniture_ids
    seen_at: dict[int | None, SeenAt] = {}
    for sighting in asked.sightings:  # the latest first
        seen_at.setdefault(sighting.furniture, sighting)
    asked_edges = asked.edges
    num_observed, num_true = np.zeros((2, len(ids)), dtype=np.int64)
    np.maximum.at(num_observed, edges["furniture"][asked_edges], edges["num_observed"][asked_edges])
    np.add.at(num_true, edges["furniture"][asked_edges], edges["num_true"][asked_edges])
    # What was never seen at a place was missed by every look at it, and by every search for it.
    negative, sought = np.ceil(asked.looks.negative), asked.looks.sought.sum(axis=2)
    num_sought = np.ceil(asked.looks.negative + sought).max(axis=0).tolist()
    lone = asked.batch.find_lone_looks(asked.queries.object)
    alone = np.ceil(sought) + (0 if lone is None else lone.num_looks)
    num_missed = asked.batch.furniture["num_observed"][0] + (negative + alone).max(axis=0)
    absent = np.where(num_true > 0, np.maximum(num_observed - num_true, 0), num_missed)
    num_absent = absent.tolist()
    similar = _list_similar(asked, cosines)
    prior = asked.queries.prior.mean(axis=0).sum(axis=1).tolist()  # F of them
    found = []
    now = asked.current.time
    now_on = _get_date(asked.clock, now)
    for place in furniture:
        seen = seen_at.get(ids[place])
        ended, missed, was_missed = None, NEVER, False
        if seen is not None and not seen.is_there:
            place_edges = asked_edges[edges["furniture"][asked_edges] == place]
            ended, missed, was_missed = _find_end(asked, place_edges, seen)
        clock = None if seen is None else asked.clock
        found.append(
            Evidence(
                seen=seen,
                times_absent=int(num_absent[place]),
                similar=tuple(similar.get(place, ())),
                prior=prior[place],
                seen_on=None if seen is None else _get_date(clock, seen.time),
                missed_on=_get_date(clock, missed),
                now=None if seen is None else now_on,
                times_sought=0 if seen is None else int(num_sought[place]),
                ended=ended,
                ended_ago=0 if ended is None else now - ended.time,
                ended_on=None if ended is None else _get_date(clock, ended.time),
                was_missed=was_missed,
            )
        )
    return found


def _get_date(clock: Clock | None, time: int) -> datetime | None:
    return None if clock is None or time == NEVER else clock.get_date(time)


def _find_end(asked: Asked, edges: np.ndarray, seen: SeenAt) -> tuple[Statement | None, int, bool]:
    """Return by what a thing that was seen at a place is not there any more.

    `edges` are rows of those of what is asked for at that place, (n,), and `seen` is the last
    sighting there, which something has ended.

    Returns:
        The last statement that ended it; None without one. The time step of the last look here
        since, or from which on it is false, `NEVER` without one. Whether that was a look.
    """
    table = asked.current.edges
    ended = edges[(table["last_true"][edges] == seen.time) & ~table["is_true"][edges]]
    place, thing = int(table["furniture"][ended[0]]), int(table["object"][ended[0]])
    last_look = int(asked.current.furniture_last_observed[0, place])
    number = asked.rows.tolist().index(thing)
    for said in reversed(asked.statements[number]):
        if said.time >= seen.time and seen.furniture in said.was_at:
            is_later = last_look > said.time
            return said, last_look if is_later else NEVER, is_later
    changed = int(table["last_changed"][ended].max())
    return None, max(last_look, changed), last_look >= changed


def _list_similar(asked: Asked, cosines: np.ndarray | None) -> dict[int, dict[str, None]]:
    """List other objects with a similar label by furniture, each once, the latest first."""
    similar: dict[int, dict[str, None]] = {}
    if cosines is None:
        return similar
    edges = asked.current.edges
    label = asked.current.objects["label"]
    own_label = asked.batch.objects["label"][asked.queries.object[0]]
    # Labels that came up in this very step have no vector yet.
    is_known = label < len(cosines)
    is_similar = is_known & (cosines[np.where(is_known, label, 0), own_label] >= SIMILAR)
    is_similar[asked.rows[asked.rows >= 0]] = False
    alike = np.flatnonzero(is_similar[edges["object"]] & (edges["num_true"] > 0))
    alike = alike[np.argsort(-edges["last_true"][alike], kind="stable")]
    for place, other in zip(
        edges["furniture"][alike].tolist(), edges["object"][alike].tolist(), strict=True
    ):
        similar.setdefault(place, {})[asked.descriptions[other]] = None
    return similar
