"""The part of a memory that is asked: what a name means, and what is known of what is asked for.

Questions leave the memory as it is: they get a copy of what they may change.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Protocol

import numpy as np

from sgm.arrays.grouped import join_groups
from sgm.memory.clock import Clock, count_steps
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.memory_state import MemoryState
from sgm.memory.queries import Queries
from sgm.memory.seen_places import Looks, list_places, sum_negative
from sgm.memory.sighting import SeenAt
from sgm.memory.thing import ROBOT_CONFIDENCE, Statement
from sgm.names.name import Name
from sgm.names.name_matching import Similarity
from sgm.names.resolution import Resolution
from sgm.names.words import read_words, strip_question
from sgm.schema import NEVER, NUM_RELATIONS

_NOTHING_SAID = -2  # as a place
_SAME_NAME = ("exact", "same words")  # how a thing is meant that no other name comes before


class Scorer(Protocol):
    """What scores the places of what is asked for: any `sgm.policies.policy.Policy`."""

    def scores(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        """Score every furniture node for every query, (Q, F); -inf without an opinion."""


@dataclass(frozen=True, slots=True)
class Asked:
    """K objects that are asked for, and all that a memory of F furniture nodes says of them.

    Both memories are the asker's own for questions, and share what was observed with other
    questions of the same state: what is done to the memory later does not reach them. They are to
    be read; who wants to change them takes a `copy`.

    Attributes:
        batch: the memory as it was before the looks of this time step, which policies are asked of.
        origin: stands for the state that `batch` is a copy of: the same object for all questions
            that ask of that state.
        queries: the objects asked for in it, (K,).
        current: the memory as it is now.
        question: for each name that was asked for, which of the K things it means, the first of
            several with ids, (n,).
        rows: the objects' rows in `current.objects`, -1 for what it does not know, (K,).
        edges: rows of the edges that lead from them in `current.edges`, ascending, (n,).
        said: the last statement about each, None where there was none, or a look has shown it
            since, K of them.
        statements: all that was said of each and is kept, the oldest first, K of them.
        descriptions: of all objects of `current`, (O,).
        looks: what the looks say about each of the K.
        num_instances: most things of each description that were seen at once, 1 or more, (K,).
        sightings: every place where one of them was ever seen, the latest first.
        furniture_ids, furniture_names: F each.
        open_costs: of opening each to look into it, None where there is nothing to open; F each.
        clock: of the memory; None if it has none.
    """

    batch: MemoryBatch
    origin: object
    queries: Queries
    current: MemoryBatch
    question: np.ndarray
    rows: np.ndarray
    edges: np.ndarray
    said: tuple[Statement | None, ...]
    statements: tuple[tuple[Statement, ...], ...]
    descriptions: tuple[str, ...]
    looks: Looks
    num_instances: np.ndarray
    sightings: tuple[SeenAt, ...]
    furniture_ids: tuple[int, ...]
    furniture_names: tuple[str, ...]
    open_costs: tuple[float | None, ...]
    clock: Clock | None = None

    @property
    def last_seen(self) -> SeenAt | None:
        """Where and when one of them was last seen; None if that never was."""
        return next(iter(self.sightings), None)

    @property
    def was_seen(self) -> np.ndarray:
        """Which of them were seen before the looks of this time step, bool (K,)."""
        return self.batch.objects["num_observed"][self.queries.object] > 0

    @property
    def carried(self) -> np.ndarray:
        """Probability that the robot carries each of them, (K,)."""
        is_carried = np.append(self.current.objects["carried_since"], NEVER)[self.rows] >= 0
        if not is_carried.any():
            return np.zeros(len(is_carried))
        sure = [0.0 if said is None else said.confidence for said in self.said]
        return np.where(is_carried, np.where(np.array(sure) > 0, sure, ROBOT_CONFIDENCE), 0.0)

    def choose_relation(self) -> np.ndarray:
        """Return how the objects lie at each place, by number in `RELATIONS`, (F,).

        As one of them last lay there; where none was ever seen, as the prior has it.
        """
        prior = self.queries.prior.sum(axis=0)  # (F, 2)
        relation = NUM_RELATIONS - 1 - prior[:, ::-1].argmax(axis=1)  # the last of equal ones
        edges = self.current.edges
        own = self.edges[edges["num_true"][self.edges] > 0]
        own = own[np.argsort(edges["last_true"][own], kind="stable")]
        relation[edges["furniture"][own]] = edges["relation"][own]
        return relation


class MemoryQuestions:
    """Questions; `SceneGraphMemory` says what each call does, takes and raises."""

    def __init__(self, state: MemoryState) -> None:
        """Begin with the state that all parts share."""
        self._state = state

    def resolve(
        self,
        description: str,
        similarity: Similarity | None = None,
        among: Sequence[str] | None = None,
    ) -> Resolution:
        """Say which of the things that were seen a question means."""
        return self._state.resolve(description, similarity, among)

    def resolve_exact(self, name: str, among: Sequence[str] | None = None) -> Resolution:
        """Say which of the things that were seen is exactly of a name, or has that id."""
        return self._state.resolve_exact(name, among)

    def find_furniture(self, name: str) -> tuple[int, ...]:
        """Return the ids of the furniture that a name means, such as "the fridge"."""
        with self._state.lock:
            furniture = dict(self._state.layout.furniture)
        names = [node.description for node in furniture.values()]
        matches = self._state.resolve(name, among=names).matches
        return tuple(number for number, node in furniture.items() if node.description in matches)

    def find_places(
        self, name: str, resolution: Resolution | None = None
    ) -> tuple[str, tuple[int, ...]]:
        """Return the furniture that a question is about, if it is about furniture or a room."""
        if resolution is None or resolution.how not in _SAME_NAME:
            resolution = self._state.resolve(name)
        if resolution.how in _SAME_NAME:
            return "thing", ()
        asked = Name.read(strip_question(name) or name)
        with self._state.lock:
            layout = self._state.layout.copy()
            found = self._state.called.find(asked)
        if not found and not resolution.matches:
            names = [node.description for node in layout.furniture.values()]
            likely = self._state.resolve(name, among=names)
            if likely.is_sure and not likely.says_less:
                found = [n for n, node in layout.furniture.items()
                         if node.description in likely.matches]  # fmt: skip
        if found:
            return "place", tuple(found)
        rooms = [n for n, room in layout.rooms.items() if Name.read(room.label).is_same(asked)]
        within = tuple(n for n, node in layout.furniture.items() if node.room in rooms)
        return ("room", within) if within and not resolution.matches else ("thing", ())

    def ask(
        self,
        descriptions: Sequence[str],
        before_looks: bool = True,
        at: datetime | int | None = None,
        question: str | None = None,
    ) -> Asked:
        """Ask for objects, and leave the memory as it is; safe beside a thread that observes."""
        with self._state.lock:
            state = self._state
            words = "" if question is None else state.things.read(question).words
            _check_furniture(state)
            later = 0 if at is None else count_steps(at, state.time, state.clock, "at")
            return _ask(state, descriptions, before_looks, later, words)

    def rank(self, policy: Scorer, description: str) -> list[tuple[int, float]]:
        """Order all furniture by how likely it holds an object, the best first."""
        asked = self.ask([description], before_looks=False)
        scores = policy.scores(asked.batch, asked.queries)[0]
        order = np.argsort(-scores, kind="stable")
        return [(asked.furniture_ids[place], float(scores[place])) for place in order]

    def query(self, description: str) -> Queries:
        """Ask for an object; until the next `step` its hypothetical edges are in the graph."""
        read_words("description", description)
        with self._state.lock:
            _check_furniture(self._state)
            self._state.write("query", description=description)
            return self._state.query(description)


def _check_furniture(state: MemoryState) -> None:
    if not state.layout.furniture:
        raise ValueError(
            "memory must have furniture before a query, got none. Call add_furniture first."
        )


def _ask(
    state: MemoryState,
    descriptions: Sequence[str],
    before_looks: bool,
    later: int,
    question: str,
) -> Asked:
    """Ask for objects by names or ids, time steps later; see `SceneGraphMemory.ask`."""
    snapshot, before, places = state.get_snapshot(), state.before, state.furniture
    current = state.view(snapshot)
    current.time += later
    if before_looks and before is not None and not later:
        batch, origin = state.share(before.batch), before.origin
        num_known = before.batch.objects.num_rows
    else:
        batch, origin, num_known = state.share(snapshot), state.version, len(state.things)
        batch.time = current.time
    positions, known, names = _find_asked(state, descriptions)
    texts = state.things.descriptions
    is_known = (known >= 0) & (known < num_known)
    keys = np.where(is_known, known, num_known + np.arange(len(names)))
    if is_known.all():
        kinds = [batch.objects["label"][known], batch.objects["type"][known]]
    else:
        vocabulary = state.vocabulary.with_labels(batch.labels)
        kinds = list(np.array([vocabulary.find_type(name.text) for name in names]).T)
        batch.labels = vocabulary.labels
    queries = batch.ask(np.zeros(len(names), dtype=np.int64), keys, *kinds)
    at_once = np.append(current.objects["num_at_once"], 0)
    said = [state.get_said(row) if row >= 0 else None for row in known.tolist()]
    last_said = [None if own is None else own.last for own in said]
    num_objects = current.objects.num_rows  # from what it does not know, no edges lead
    asked = np.where(known >= 0, known, num_objects)
    found = join_groups(asked, current.edges["object"], num_objects + 1)
    edges = found[1] if len(known) == 1 else np.unique(found[1])  # one may be asked for twice
    sightings: list[SeenAt] = []
    for row, own in zip(known.tolist(), said, strict=True):
        if own is not None:
            sightings += list_places(current, row, own, places.ids, edges)
    if len(known) > 1:
        sightings.sort(key=lambda seen: -seen.time)
    return Asked(
        batch=batch,
        origin=origin,
        queries=queries,
        current=current,
        question=positions,
        rows=known,
        edges=edges,
        said=tuple(last_said),
        statements=tuple(() if own is None else own.statements for own in said),
        descriptions=texts,
        looks=_list_looks(
            state,
            places.position,
            batch,
            current,
            queries,
            known,
            found,
            names,
            last_said,
            question,
        ),
        num_instances=np.maximum(at_once[known], 1),
        sightings=tuple(sightings),
        furniture_ids=places.ids,
        furniture_names=places.names,
        open_costs=places.open_costs,
        clock=state.clock,
    )


def _find_asked(
    state: MemoryState, names: Sequence[str]
) -> tuple[np.ndarray, np.ndarray, list[Name]]:
    """Find the objects that names and ids mean; of things with ids, a name means all.

    Returns:
        Where among the K things that of each name is, the first of several, (n,); the row of each
        thing, -1 for a new one, (K,), and its name, K of them.
    """
    rows: list[int] = []
    firsts, read, things = [], [], state.things
    for text in names:
        asked, new = [], []
        for row in state.find_rows(text):
            if row in rows and (things[row].id or len(state.list_members(row)) > 1):
                asked.append(row)  # by another of its names
            else:
                new.append(row)
        firsts.append(rows.index(asked[0]) if asked else len(rows))
        for row in new if new or asked else [-1]:
            rows.append(row)
            read.append(things.read(text if row < 0 else things[row].description))
    return np.array(firsts), np.array(rows), read


def _list_looks(
    state: MemoryState,
    position: Mapping[int, int],
    batch: MemoryBatch,
    current: MemoryBatch,
    queries: Queries,
    rows: np.ndarray,
    found: tuple[np.ndarray, np.ndarray],
    names: Sequence[Name],
    said: Sequence[Statement | None],
    question: str,
) -> Looks:
    """List what all looks say about K objects.

    They are `queries` in the memory before the looks of this step, and `rows` (K,) in the memory at
    the time that is asked about, -1 for what that does not know, with the edges `found` there.
    `position` is that of furniture by its id. `said` has the last statement about each that no look
    has shown since. Looks for the `question` count where it was not seen since, if they were of a
    later time step than the sighting.
    """
    now, step = current.time, state.step
    share = None  # how likely each is "in" and "onTop" of the furniture that it is at, (K, F, 2)
    if step.looks_by_relation or batch.history.look_relations is not None:
        share = batch.compute_relation_shares(queries)
    said_now = np.full(len(rows), _NOTHING_SAID)  # not where it was seen before that in this step
    for row, one in enumerate(said):
        if one is not None and one.time == now:
            said_now[row] = -1 if one.furniture is None else position[one.furniture]
    (thing, edge), edges = found, current.edges
    confidence = np.zeros((len(rows), len(position), NUM_RELATIONS))
    place, said_there = edges["furniture"][edge], said_now[thing]
    is_now = edges["last_true"][edge] == now
    is_now &= (said_there == _NOTHING_SAID) | (said_there == place)
    confidence[thing, place, edges["relation"][edge]] = edges["confidence"][edge] * is_now
    seen = confidence.max(axis=2)
    num_seen = (seen > 0).astype(np.int64)
    negative, sought, sought_ago = np.zeros((3, *seen.shape))
    sought_ago[:] = np.inf
    last_seen = np.full(seen.shape, NEVER)
    if question and state.sought:
        np.maximum.at(last_seen, (thing, place), edges["last_true"][edge])
    counts_looks = state.before is not None and batch.time == now == state.time
    for number, (row, name) in enumerate(zip(rows.tolist(), names, strict=True)):
        members = state.list_members(row)
        if counts_looks:
            for member in members:
                for furniture, num_here in step.counts.get(member, {}).items():
                    here = number, position[furniture]
                    num_seen[here] = max(num_seen[here], num_here) if seen[here] else 0
            own = None if share is None else share[number]
            sums = []
            for member in members:
                sums.append(sum_negative(step, member, name, own, position))
            least = sums[0]
            if len(sums) > 1:  # where no name of it was seen
                places = set.intersection(*map(set, sums))
                least = {place: min(count[place] for count in sums) for place in places}
            negative[number, [position[place] for place in least]] += [*least.values()]
        if not state.sought:
            continue
        words = {name.words, *(state.things.list_words(members) if row >= 0 else ())}
        for (other, furniture), (count, time) in state.sought.items():
            here = number, position[furniture]
            if other not in words and (other != question or time <= last_seen[here]):
                continue
            if time == now:
                negative[here] += count
            else:
                sought[here] = count
                sought_ago[here] = now - time
    return Looks(negative, sought, sought_ago, seen, num_seen)
