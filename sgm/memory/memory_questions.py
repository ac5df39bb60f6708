"""The part of a memory that is asked: what a name means, and what is known of what is asked for.

Questions leave the memory as it is: they get a copy of what they may change.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from typing import Protocol

import numpy as np

from sgm.arrays.grouped import join_groups
from sgm.arrays.table import clone
from sgm.layout.furniture import Furniture
from sgm.memory.clock import MOST_AHEAD, Clock, check_ahead, count_steps
from sgm.memory.look import average_coverage
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.memory_state import MemoryState
from sgm.memory.queries import Queries
from sgm.memory.seen_places import Looks, list_places, sort_places, sum_negative
from sgm.memory.sighting import SeenAt
from sgm.memory.thing import ROBOT_CONFIDENCE, Said, Statement
from sgm.names.name import Name
from sgm.names.name_matching import Similarity
from sgm.names.phrase import strip_question
from sgm.names.resolution import Resolution
from sgm.names.sentence import Sentence
from sgm.names.words import read_words
from sgm.schema import NEVER, NUM_RELATIONS

_ANYWHERE = -2  # as a place
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
        meant: for each name that was asked for, which of the K things it means.
        rows: the objects' rows in `current.objects`, -1 for what it does not know, (K,).
        edges: rows of the edges that lead from them in `current.edges`, ascending, (n,).
        said: the last statement about each, None where there was none, or a look has shown it
            since, K of them.
        statements: all that was said of each and is kept, the oldest first, K of them.
        descriptions: of all objects of `current`, (O,).
        looks: what the looks say about each of the K.
        num_instances: most things of each description that were seen at once, 1 or more, (K,).
        was_seen: which of them were seen before the looks of this time step, bool (K,).
        carried: probability that the robot carries each of them, (K,).
        relation: how they lie at each place, by number in `RELATIONS`, (F,): as one of them last
            lay there; where none was ever seen, as the prior has it.
        sightings: every place where one of them was ever seen, the latest first.
        furniture_ids, furniture_names: F each.
        open_costs: of opening each to look into it, None where there is nothing to open; F each.
        clock: of the memory; None if it has none.
    """

    batch: MemoryBatch
    origin: object
    queries: Queries
    current: MemoryBatch
    meant: tuple[tuple[int, ...], ...]
    rows: np.ndarray
    edges: np.ndarray
    said: tuple[Statement | None, ...]
    statements: tuple[tuple[Statement, ...], ...]
    descriptions: tuple[str, ...]
    looks: Looks
    num_instances: np.ndarray
    was_seen: np.ndarray
    carried: np.ndarray
    relation: np.ndarray
    sightings: tuple[SeenAt, ...]
    furniture_ids: tuple[int, ...]
    furniture_names: tuple[str, ...]
    open_costs: tuple[float | None, ...]
    clock: Clock | None = None

    def take(self, number: int) -> Asked:
        """Return what was asked for by one of the names alone: beliefs of it are the same.

        How it lies at each place, and where it was ever seen, stays that of all.
        """
        things = self.meant[number]
        chosen = list(things)
        is_kept = np.isin(self.current.edges["object"][self.edges], self.rows[chosen])
        return replace(
            self,
            queries=self.queries.take(np.array(chosen)),
            meant=(tuple(range(len(chosen))),),
            rows=self.rows[chosen],
            edges=self.edges[is_kept],
            said=tuple(self.said[thing] for thing in things),
            statements=tuple(self.statements[thing] for thing in things),
            looks=self.looks.take(chosen, [False] * len(chosen)),
            num_instances=self.num_instances[chosen],
            was_seen=self.was_seen[chosen],
            carried=self.carried[chosen],
        )


@dataclass(frozen=True, slots=True)
class _AskedThings:
    """K things that are asked for, as a memory of F furniture nodes knows them.

    Attributes:
        memory: the memory, at the time that is asked about.
        position: of furniture in it, by id.
        rows: of the things in it, -1 for what it does not know, (K,).
        names: K of them.
        members: rows of all nodes that were merged as each, K of them.
        said: the last statement about each that no look has shown since, K of them.
        thing, edge: which of the K each of their edges is of, and its row, (n,) each.
    """

    memory: MemoryBatch
    position: Mapping[int, int]
    rows: np.ndarray
    names: Sequence[Name]
    members: Sequence[Sequence[int]]
    said: Sequence[Statement | None]
    thing: np.ndarray
    edge: np.ndarray


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

    @property
    def language(self) -> str:
        """Code of the language in which is asked and answered."""
        return self._state.language

    def read_sentence(self, question: str, speaker: str = "") -> Sentence:
        """Read what a sentence asks for."""
        return self._state.read_sentence(question, speaker)

    def resolve_exact(self, name: str, among: Sequence[str] | None = None) -> Resolution:
        """Say which of the things that were seen is exactly of a name, or has that id."""
        return self._state.resolve_exact(name, among)

    def find_furniture(self, name: str) -> tuple[int, ...]:
        """Return the ids of the furniture that a name means, such as "the fridge"."""
        with self._state.lock:
            furniture = dict(self._state.layout.furniture)
        return self._find_likely(name, furniture)[1]

    def _find_likely(
        self, name: str, furniture: Mapping[int, Furniture]
    ) -> tuple[Resolution, tuple[int, ...]]:
        """Say what a name means among furniture, and return the ids of it."""
        names = [node.description for node in furniture.values()]
        resolution = self._state.resolve(name, among=names)
        return resolution, tuple(
            number for number, node in furniture.items() if node.description in resolution.matches
        )

    def find_places(
        self, name: str, resolution: Resolution | None = None
    ) -> tuple[str, tuple[int, ...]]:
        """Return the furniture that a question is about, if it is about furniture or a room."""
        if resolution is None or resolution.how not in _SAME_NAME:
            resolution = self._state.resolve(name)
        if resolution.how in _SAME_NAME:
            return "thing", ()
        asked = Name.read(strip_question(name, self._state.language) or name)
        with self._state.lock:
            layout = self._state.layout.copy()
            found = tuple(self._state.called.find(asked))
        if not found and not resolution.matches:
            resolved, likely = self._find_likely(name, layout.furniture)
            if resolved.is_sure and not resolved.says_less:
                found = likely
        if found:
            return "place", found
        rooms = [n for n, room in layout.rooms.items() if Name.read(room.label).is_same(asked)]
        within = tuple(n for n, node in layout.furniture.items() if node.room in rooms)
        return ("room", within) if within and not resolution.matches else ("thing", ())

    def ask(
        self,
        descriptions: Sequence[str],
        before_looks: bool = True,
        at: datetime | int | None = None,
        question: str | None = None,
        miss_rate: float | None = None,
    ) -> Asked:
        """Ask for objects, and leave the memory as it is; safe beside a thread that observes."""
        with self._state.lock:
            state = self._state
            _check_furniture(state)
            later = 0
            if at is not None:
                now, clock = state.time, state.clock
                later = count_steps(at, now, clock, "at")
                remedy = "Ask about a time in the next year."
                check_ahead(later, now, clock, "at", MOST_AHEAD, remedy)
            shared = _share(state, before_looks, later)
            return _ask(state, shared, descriptions, question, miss_rate)

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
            "memory must have furniture before a query, got none. Add places first: by hand "
            "(add_furniture, add_place of a server), by a map, or by frames of a camera."
        )


def _share(
    state: MemoryState, before_looks: bool, later: int
) -> tuple[MemoryBatch, MemoryBatch, object]:
    """Return what questions read, some time steps `later`; what was merged is one.

    Returns:
        The memory as it is now. The memory of which policies are asked, if it is to be that
        `before_looks` of this step, and what stands for its state: see `Asked`.
    """
    shared = snapshot = state.get_snapshot()  # takes over a new layout
    before, origin = state.before, state.version
    if before_looks and before is not None and not later:
        shared, origin = before.batch, before.origin
    batch = shared.fuse() if state.has_merged else shared.share()
    current = state.fuse(snapshot) if state.has_merged else clone(snapshot)
    current.time += later
    batch.time += later
    return current, batch, origin


def _ask(
    state: MemoryState,
    shared: tuple[MemoryBatch, MemoryBatch, object],
    descriptions: Sequence[str],
    question: str | None,
    miss_rate: float | None,
) -> Asked:
    """Ask for objects by names or ids, of what `_share` gave."""
    places = state.furniture
    current, batch, origin = shared
    meant, known, names = _find_asked(state, descriptions)
    words = "" if question is None else state.things.read(question).words
    texts = state.things.descriptions
    queries = replace(_put(state, batch, known, names), miss_rate=miss_rate)
    num_objects = current.objects.num_rows  # from what it does not know, no edges lead
    asked = np.where(known >= 0, known, num_objects)
    found = join_groups(asked, current.edges["object"], num_objects + 1)
    edges = found[1] if len(known) == 1 else np.unique(found[1])  # one may be asked for twice
    said: list[Said | None] = []
    sightings: list[tuple[SeenAt, int]] = []
    for thing in known.tolist():
        said_of = None if thing < 0 else state.get_said(thing)
        said.append(said_of)
        if said_of is not None:
            places_of = list_places(current, thing, said_of, places.ids, edges)
            sightings += state.number_looks(said_of.members, places_of)
    last_said, statements = _list_statements(said)
    members = [[-1] if said_of is None else said_of.members for said_of in said]
    things = _AskedThings(current, places.position, known, names, members, last_said, *found)
    num_at_once = np.append(current.objects["num_at_once"], 0)[known]
    return Asked(
        batch=batch,
        origin=origin,
        queries=queries,
        current=current,
        meant=meant,
        rows=known,
        edges=edges,
        said=last_said,
        statements=statements,
        descriptions=texts,
        looks=_list_looks(state, batch, queries, things, words),
        num_instances=np.maximum(num_at_once, 1),
        was_seen=batch.objects["num_observed"][queries.object] > 0,
        carried=_weigh_carried(things),
        relation=_choose_relation(current, queries, edges),
        sightings=tuple(sort_places(sightings)),
        furniture_ids=places.ids,
        furniture_names=places.names,
        open_costs=places.open_costs,
        clock=state.clock,
    )


def _put(
    state: MemoryState, batch: MemoryBatch, known: np.ndarray, names: Sequence[Name]
) -> Queries:
    """Ask a memory for K things by name, and by row where they are known, -1 for new ones."""
    num_known = batch.objects.num_rows
    is_known = (known >= 0) & (known < num_known)
    keys = np.where(is_known, known, num_known + np.arange(len(names)))
    if is_known.all():
        kinds = [batch.objects["label"][known], batch.objects["type"][known]]
    else:
        vocabulary = state.vocabulary.with_labels(batch.labels)
        kinds = list(np.array([vocabulary.find_type(name.text) for name in names]).T)
        batch.labels = vocabulary.labels
    return batch.ask(np.zeros(len(names), dtype=np.int64), keys, *kinds)


def _list_statements(
    said: Sequence[Said | None],
) -> tuple[tuple[Statement | None, ...], tuple[tuple[Statement, ...], ...]]:
    """Return the last statement about each thing that no look has shown since, and all of them."""
    last = tuple(None if said_of is None else said_of.last for said_of in said)
    return last, tuple(() if said_of is None else said_of.thing.statements for said_of in said)


def _weigh_carried(things: _AskedThings) -> np.ndarray:
    """Return `Asked.carried`."""
    is_carried = np.append(things.memory.objects["carried_since"], NEVER)[things.rows] >= 0
    if not is_carried.any():
        return np.zeros(len(is_carried))
    sure = [0.0 if statement is None else statement.confidence for statement in things.said]
    return np.where(is_carried, np.where(np.array(sure) > 0, sure, ROBOT_CONFIDENCE), 0.0)


def _choose_relation(memory: MemoryBatch, queries: Queries, edges: np.ndarray) -> np.ndarray:
    """Return `Asked.relation` of things whose edges these are in a memory, (n,)."""
    prior = queries.prior.sum(axis=0)  # (F, relations)
    relation = NUM_RELATIONS - 1 - prior[:, ::-1].argmax(axis=1)  # the last of equal ones
    table = memory.edges
    seen = edges[table["num_true"][edges] > 0]
    seen = seen[np.lexsort((table["is_true"][seen], table["last_true"][seen]))]
    relation[table["furniture"][seen]] = table["relation"][seen]
    return relation


def _find_asked(
    state: MemoryState, names: Sequence[str]
) -> tuple[tuple[tuple[int, ...], ...], np.ndarray, list[Name]]:
    """Find the objects that names and ids mean; of things with ids, a name means all.

    Returns:
        Which of the K things each name means; the row of each thing, -1 for a new one, (K,), and
        its name, K of them.
    """
    rows: list[int] = []
    meant, read, things = [], [], state.things
    for text in names:
        asked, new = [], []
        for object_row in state.find_rows(text):
            if object_row in rows and (
                things[object_row].id or len(state.list_members(object_row)) > 1
            ):
                asked.append(rows.index(object_row))  # by another of its names
            else:
                new.append(object_row)
        new = new if new or asked else [-1]
        meant.append((*asked, *range(len(rows), len(rows) + len(new))))
        for object_row in new:
            rows.append(object_row)
            read.append(things.read(text if object_row < 0 else things[object_row].description))
    return tuple(meant), np.array(rows), read


def _list_looks(
    state: MemoryState, batch: MemoryBatch, queries: Queries, things: _AskedThings, question: str
) -> Looks:
    """List what all looks say about K things.

    They are `queries` in the memory before the looks of this step, `batch`. Looks for the
    `question` count as looks for each thing, if they were of a later time step than its sighting.
    """
    now, seen = things.memory.time, _list_seen(state, things)
    num_seen, negative = (seen > 0).astype(np.int64), np.zeros(seen.shape)
    if state.before is not None and batch.time == now == state.time:
        _count_seen(state, things, num_seen)
        share = None  # of each relation to the furniture that it is at, (K, F, relations)
        if state.step.looks_by_relation or batch.history.look_relations is not None:
            share = batch.compute_relation_shares(queries)
        _sum_negative(state, things, share, negative)
        _sum_lone(state, things, question, negative)
    return Looks(negative, *_list_sought(state, batch, things, question), seen, num_seen)


def _list_seen(state: MemoryState, things: _AskedThings) -> np.ndarray:
    """Return how sure the looks of this step saw each thing at each place, 0 where not, (K, F).

    Of what was said in this step, and of a single thing, the last place counts alone.
    """
    now, position, edges = things.memory.time, things.position, things.memory.edges
    step = state.step
    last = np.full(len(things.rows), _ANYWHERE)
    is_shown = edges["is_true"][things.edge]  # or else missed since, which looks of the step say
    place = edges["furniture"][things.edge]
    for number, (object_row, members) in enumerate(zip(things.rows, things.members, strict=True)):
        if object_row >= 0 and things.memory.objects["num_at_once"][object_row] <= 1:
            shown = [step.last_shown[member] for member in members if member in step.last_shown]
            last[number] = things.memory.objects["last_furniture"][object_row]
            if shown:
                last[number] = position[max(shown)[1]]
        for member in members:
            left = step.left.get(member, ())
            shown_at = [
                position[found]
                for found in step.num_until_seen.get(member, ())
                if found not in left
            ]
            is_shown |= (things.thing == number) & np.isin(place, shown_at)
    is_now = (edges["last_true"][things.edge] == now) & is_shown
    is_now &= (last[things.thing] == _ANYWHERE) | (last[things.thing] == place)
    confidence = np.zeros((len(things.rows), len(position), NUM_RELATIONS))
    edge_index = (things.thing, place, edges["relation"][things.edge])
    confidence[edge_index] = edges["confidence"][things.edge] * is_now
    seen: np.ndarray = confidence.max(axis=2)
    return seen


def _count_seen(state: MemoryState, things: _AskedThings, num_seen: np.ndarray) -> None:
    """Count how many of each thing the looks of this step saw, where they saw any, (K, F)."""
    for number, members in enumerate(things.members):
        for member in members:
            for furniture in state.step.num_until_seen.get(member, ()):
                thing_place = number, things.position[furniture]
                num_here = state.step.shown.get(furniture, {}).get(member, 0)
                if num_here and num_seen[thing_place]:
                    num_seen[thing_place] = max(num_seen[thing_place], num_here)


def _sum_negative(
    state: MemoryState, things: _AskedThings, share: np.ndarray | None, negative: np.ndarray
) -> None:
    """Sum the looks of this step that did not show each thing, by place, (K, F)."""
    position = things.position
    for number, (members, name) in enumerate(zip(things.members, things.names, strict=True)):
        thing_share = None if share is None else share[number]
        sums = [sum_negative(state.step, member, name, thing_share, position) for member in members]
        least = sums[0]
        if len(sums) > 1:  # where no name of it was seen
            places = set.intersection(*map(set, sums))
            least = {place: min(count[place] for count in sums) for place in places}
        negative[number, [position[place] for place in least]] += [*least.values()]


def _sum_lone(
    state: MemoryState, things: _AskedThings, question: str, negative: np.ndarray
) -> None:
    """Add the looks of this step for single things, or for what the question means, (K, F)."""
    step = state.step
    if not step.of_thing:
        return
    for number, members in enumerate(things.members):
        seen = [step.num_until_seen.get(member, {}) for member in members]
        for words in {question, *_list_words(state, things, number)}:
            for furniture, looks in step.of_thing.get(words, {}).items():
                since = max(until.get(furniture, 0) for until in seen)
                negative[number, things.position[furniture]] += sum(
                    average_coverage(step.looks[look].coverage) for look in looks if look >= since
                )


def _list_words(state: MemoryState, things: _AskedThings, number: int) -> set[str]:
    """Return the words by which a look may be for a thing: of its names, and ids."""
    known = state.things.list_words(things.members[number]) if things.rows[number] >= 0 else ()
    return {things.names[number].words, *known}


def _list_sought(
    state: MemoryState, batch: MemoryBatch, things: _AskedThings, question: str
) -> tuple[np.ndarray, np.ndarray]:
    """List looks for what no thing was called, for things of that name or what the question means.

    The latter count as far as they are later than the sighting of the thing at the place. Those of
    this step are left out where `batch` is the memory before its looks.

    Returns:
        How many at each place and time, and how many steps ago, infinite for none, (K, F, L) each.
    """
    now, edges, found = things.memory.time, things.memory.edges, []
    is_before = state.before is not None and batch.time == now == state.time
    sought = state.before.sought if state.before is not None and is_before else state.sought
    last_seen = np.full((len(things.rows), len(things.position)), NEVER)
    if sought:
        place = edges["furniture"][things.edge]
        np.maximum.at(last_seen, (things.thing, place), edges["last_true"][things.edge])
    for number in range(len(things.rows) if sought else 0):
        words = _list_words(state, things, number)
        for (other, furniture), looks in sought.items():
            place = things.position[furniture]
            since = NEVER if other in words else int(last_seen[number, place])
            if other in words or other == question:
                listed = (look for look in reversed(looks) if look[0] > since)
                found += [(number, place, last, *look) for last, look in enumerate(listed)]
    most = max((last + 1 for _, _, last, *_ in found), default=0)
    counts, ago = np.zeros((*last_seen.shape, most)), np.full((*last_seen.shape, most), np.inf)
    for number, place, last, time, count in found:
        counts[number, place, last], ago[number, place, last] = count, now - time
    return counts, ago
