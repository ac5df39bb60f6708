"""Where an object may be: places with their probabilities, and what speaks for and against each."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime

import numpy as np

from sgm.belief import Posterior
from sgm.finder.days_seen import DaysSeen, count_days
from sgm.finder.evidence import Evidence
from sgm.memory.clock import Clock
from sgm.memory.memory_questions import Asked
from sgm.memory.sighting import Point, SeenAt
from sgm.memory.thing import Statement
from sgm.names.asking import make_asking
from sgm.names.resolution import Resolution
from sgm.names.sections import ENGLISH
from sgm.schema import IS_INSIDE, NEVER, RELATIONS

SIMILAR = 0.7  # cosine of the labels' text vectors: mug and cup .96, document and book .74
_WHERE = {"is": "is this place", "part": "in this room"}


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
        if self.relation in _WHERE:
            return make_asking(self.evidence.language).say(_WHERE[self.relation])
        return str(self.evidence)

    def __str__(self) -> str:
        """Say it in one line."""
        name = make_asking(self.evidence.language).translate(self.name)
        return f"{self.probability:4.0%}  {name}  ({self.why})"


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
        left_out: how many more places there are, less likely than these.
    """

    description: str
    places: tuple[Place, ...]
    elsewhere: float
    last_seen: SeenAt | None
    resolution: Resolution
    with_robot: float = 0.0
    asked_for: str = "thing"
    num_known: int = 0
    left_out: int = 0

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
        asking = make_asking(self.resolution.language)
        lines = [str(self.resolution), *(f"  {place}" for place in self.places)]
        lines.append(f"  {self.elsewhere:4.0%}  {asking.say('row elsewhere')}")
        if self.with_robot:
            lines.insert(1, f"  {self.with_robot:4.0%}  {asking.say('row with robot')}")
        return "\n".join(lines)


def rank_place(
    description: str,
    resolution: Resolution,
    names: Mapping[int, str],
    asked_for: str,
    k: int | None = None,
) -> Ranking:
    """Return the ranking of a question for places themselves, which are by id in `names`.

    It has the first k of them; None for all.
    """
    nothing = Evidence(None, 0, (), 0.0, language=resolution.language)
    places = tuple(
        Place(number, name, "is" if asked_for == "place" else "part", 1.0, nothing)
        for number, name in [*names.items()][:k]
    )
    left_out = len(names) - len(places)
    return Ranking(
        description, places, 0.0, None, resolution, asked_for=asked_for, left_out=left_out
    )


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


def count_present(asked: Asked, places: Collection[int] | None = None) -> int:
    """Count the things that are meant and are there by the last looks, at least.

    Those of one name count as often as they were seen at once. Where some of these are elsewhere,
    it is not known how many: then each place has one.

    Args:
        asked: what `memory.ask` gave.
        places: furniture ids that count; None for all.
    """
    edges, number = asked.current.edges, 0
    present = asked.edges[asked.current.find_present(asked.edges)]
    for thing, most in zip(asked.rows.tolist(), asked.num_instances.tolist(), strict=True):
        rows = present[edges["object"][present] == thing]
        ids = {asked.furniture_ids[place] for place in edges["furniture"][rows].tolist()}
        meant = ids if places is None else ids & set(places)
        number += max(most, len(meant)) if meant and meant == ids else len(meant)
    return number


def describe_places(
    asked: Asked,
    posterior: Posterior,
    cosines: np.ndarray | None,
    furniture: Sequence[int],
    language: str = ENGLISH,
    is_ahead: bool = False,
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
            furniture,
            gather_evidence(asked, cosines, furniture, language, is_ahead),
            strict=True,
        )
    )


def gather_evidence(
    asked: Asked,
    cosines: np.ndarray | None,
    furniture: Sequence[int],
    language: str = ENGLISH,
    is_ahead: bool = False,
) -> list[Evidence]:
    """Gather what a memory holds about what was asked for, at some furniture nodes.

    Args:
        asked: what `memory.ask` gave.
        cosines: of the text vectors of every pair of labels of `asked.batch`, (L, L); None to
            leave similar objects out.
        furniture: positions in `asked.furniture_ids`, (n,).
        language: of its sentences.
        is_ahead: whether a time to come is asked about.

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
    since = np.where(asked.looks.seen > 0, 0.0, sought)  # those were before it was seen
    num_sought = _count_sought(asked, np.ceil(asked.looks.negative + since))
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
    days = _list_days(asked, is_ahead, seen_at)
    for place in furniture:
        seen = seen_at.get(ids[place])
        ended, missed, was_missed, is_elsewhere = None, NEVER, False, False
        if seen is not None and not seen.is_there:
            place_edges = asked_edges[edges["furniture"][asked_edges] == place]
            if edges["is_true"][place_edges[edges["last_true"][place_edges] == seen.time]].all():
                is_elsewhere = True
            else:
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
                is_elsewhere=is_elsewhere,
                days=days.get(place),
                language=language,
            )
        )
    return found


def _list_days(
    asked: Asked, is_ahead: bool, seen_at: Mapping[int | None, SeenAt]
) -> dict[int, DaysSeen]:
    """List on how many days a single thing was seen at an hour, by place, where that is to be said.

    For the present that is where they speak against the last look: what is always where it was
    seen needs no other reason. `seen_at` is the last sighting at each place, by id.
    """
    if asked.clock is None or len(asked.rows) != 1 or not (is_ahead or len(seen_at) > 1):
        return {}
    (counts,) = count_days(asked)
    if is_ahead:
        return counts
    ids = asked.furniture_ids
    return {
        place: days
        for place, days in counts.items()
        if days.contradicts(is_there=ids[place] in seen_at and seen_at[ids[place]].is_there)
    }


def _count_sought(asked: Asked, num_missed: np.ndarray) -> list[float]:
    """Return how many looks missed what is at each place, of those that missed each thing (K, F).

    A look that showed one of several things missed the others, which are not there: that says
    nothing of what is.
    """
    if not num_missed.any():  # mostly
        return [0.0] * num_missed.shape[1]
    edges = asked.current.edges
    is_there = asked.edges[asked.current.find_present(asked.edges)]
    query, edge = np.nonzero(asked.rows[:, None] == edges["object"][is_there])
    is_held = np.zeros(num_missed.shape, dtype=bool)
    is_held[query, edges["furniture"][is_there[edge]]] = True
    least = np.where(is_held, num_missed, np.inf).min(axis=0)
    counts: list[float] = np.where(is_held.any(axis=0), least, num_missed.max(axis=0)).tolist()
    return counts


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
