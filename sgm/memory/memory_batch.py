"""The scene graph memories of many homes, as flat arrays."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from sgm.arrays.grouped import join_groups, mark_rows, share_relations
from sgm.arrays.table import clone, make_table
from sgm.layout.layout import LayoutArrays
from sgm.memory.home_history import HomeHistory
from sgm.memory.lone_looks import LoneLooks, note_lone_look
from sgm.memory.look_weights import LookWeights
from sgm.memory.merged_things import find_roots, fuse_edges, fuse_objects
from sgm.memory.queries import Change, Queries, propose_places
from sgm.memory.remembered import Remembered
from sgm.memory.seen_positions import join_positions
from sgm.schema import NEVER, NUM_RELATIONS, POSITIONS


class MemoryBatch(Remembered):
    """Scene graph memories of H homes, which looks update.

    One graph per home holds everything ever observed: nodes and edges with counters. A look at
    a furniture node updates every remembered edge of it: seen ones become true, the others
    false. An edge is remembered once it was observed, true or false: a hypothetical edge of the
    current query that is looked at and found false is remembered, too.

    A look that had only a part of the furniture in view is a part of a look for what it did not
    show. These parts are added up in `missed`; whenever their sum, since the edge was last true,
    passes 1/2, 3/2, 5/2, ..., one look without the object is counted, and the edge is false. Whole
    looks are counted one by one so. Likewise a sighting of confidence c: from c = 1/2 on it makes
    the edge true, below it is a part 1 - c of a look that did not show the object.

    Attributes, beside those of `Remembered`:
        history: what is counted of each home as a whole, where a policy asked for it.
        derived: what was computed of a memory whose content does not change, by what computed it,
            shared by all who `share` it; None of one that changes.

    Source: paper section 4.2, appendix B; docs/design.md, ruling 12. Differs: negative evidence
    is counted (the released code does not), so that what was not seen there counts, too.
    """

    def __init__(
        self,
        labels: Sequence[str],
        layout: LayoutArrays,
        threshold: float = 0.0,
        clock: np.ndarray | None = None,
    ) -> None:
        """Create empty memories of known layouts, with the text of each label index.

        A place gets a hypothetical edge where its prior weight is above `threshold`; `clock` is
        that of every home, (H, 2), None if the time is unknown.
        """
        super().__init__(labels, layout, clock)
        self.threshold = threshold
        self._history: HomeHistory | None = None
        self._row_of_key = np.full((self.num_homes, 64), -1, dtype=np.int32)
        self._pending: Queries | None = None
        self.derived: dict[object, Any] | None = None

    @property
    def history(self) -> HomeHistory:
        """What is counted of each home as a whole.

        Raises:
            ValueError: if no policy asked for it in time.
        """
        if self._history is None:
            raise ValueError(
                "history must be counted before it is read, got a memory that does not count it. "
                "Call `count_history` before the first look."
            )
        return self._history

    @property
    def counts_history(self) -> bool:
        """Whether `history` is counted."""
        return self._history is not None

    def count_history(self, so_far: HomeHistory | None = None) -> None:
        """Count `history`, too, from the first look on: a tenth more work a look.

        Policies that read it ask for it in `Policy.reset`. It goes on with counts `so_far`; without
        any, looks that were not counted raise ValueError.
        """
        if so_far is None and self._history is None:
            if self.furniture_num_observed.any():
                raise ValueError(
                    "history must be counted from the first look on, got a memory of "
                    f"{self.furniture_num_observed.sum()} looks. Call `count_history` earlier."
                )
            so_far = HomeHistory(*self.furniture_label.shape)
        self._history = self._history if so_far is None else so_far

    def copy(self) -> MemoryBatch:
        """Return the same memories without open questions, which can be changed alone."""
        copied = clone(self)
        copied.labels = list(self.labels)
        copied.furniture = self.furniture.copy()
        copied.objects, copied.edges = self.objects.copy(), self.edges.copy()
        copied.positions, copied.lone_looks = self.positions.copy(), self.lone_looks.copy()
        copied._history = None if self._history is None else self._history.copy()
        copied._row_of_key = self._row_of_key.copy()
        copied._pending = copied.derived = None
        return copied

    def share(self) -> MemoryBatch:
        """Return the same memories for questions, without open ones; cheap beside `copy`.

        What was observed is shared, and not to be written. Questions are asked of it alone.
        """
        if self.derived is None:
            self.derived = {}
        shared = clone(self)
        shared.labels = list(self.labels)
        shared.objects, shared.edges = self.objects.share(), self.edges.share()
        shared.positions, shared.lone_looks = self.positions.share(), self.lone_looks.share()
        shared._history = None if self._history is None else clone(self._history)
        shared._row_of_key = self._row_of_key.copy()
        shared._pending = None
        return shared

    def fuse(self) -> MemoryBatch:
        """Return a copy of the memory of one home in which nodes that are one thing are one.

        The merged nodes stay in it, without edges. See `sgm.memory.merged_things`.
        """
        fused = self.copy()
        roots = find_roots(fused.objects["same_as"])
        fuse_objects(fused.objects, roots)
        last = self.objects["last_furniture"], self.objects["last_observed"]
        fused.edges, groups = fuse_edges(fused.edges, roots)
        if fused._history is not None:
            fused._history.join_edges(groups)
        thing = self.edges["object"][self.edges["is_true"]]
        place = self.edges["furniture"][self.edges["is_true"]]
        is_held = np.zeros(len(roots), dtype=bool)  # at the place where it was seen last
        is_held[thing[last[0][thing] == place]] = True
        is_held &= last[1] == fused.objects["last_observed"][roots]
        fused.objects["last_furniture"][roots[is_held]] = last[0][is_held]
        fused.look_up_prior()
        fused.lone_looks["object"][:] = roots[fused.lone_looks["object"]]
        if fused.positions.num_rows:
            rows = dict(fused.positions)
            joined = join_positions({**rows, "object": roots[rows["object"]]})
            fused.positions = make_table(POSITIONS)
            fused.positions.append(len(joined["object"]), **joined)
        return fused

    def set_layout(self, layout: LayoutArrays) -> None:
        """Take over a layout that has grown; known furniture keeps its index and history."""
        num_added = layout.furniture_label.shape[1] - self.num_furniture
        if self._history is not None:
            self._history.add_furniture(num_added)
        self.furniture.append(num_added)
        self._take_layout(layout)
        self._pending = None
        self.look_up_prior()

    def step(self, num_steps: int = 1) -> None:
        """Let time steps pass; hypothetical edges end with them."""
        self.time += num_steps
        self._pending = None

    def ensure_objects(
        self, home: np.ndarray, key: np.ndarray, label: np.ndarray, object_type: np.ndarray
    ) -> np.ndarray:
        """Return the rows of object nodes (n,), adding those that are new.

        `key` is the number of the description, non-negative, `object_type` -1 for unknown ones.
        """
        num_keys = self._row_of_key.shape[1]
        if key.max(initial=0) >= num_keys:
            grow = max(int(key.max()) + 1 - num_keys, num_keys)
            self._row_of_key = np.pad(self._row_of_key, ((0, 0), (0, grow)), constant_values=-1)
        is_new = np.flatnonzero(self._row_of_key[home, key] < 0)
        if len(is_new):
            pairs = home[is_new].astype(np.int64) * self._row_of_key.shape[1] + key[is_new]
            is_new = is_new[np.unique(pairs, return_index=True)[1]]
            self._row_of_key[home[is_new], key[is_new]] = self.objects.append(
                len(is_new),
                home=home[is_new],
                key=key[is_new],
                label=label[is_new],
                type=object_type[is_new],
            )
        return self._row_of_key[home, key]

    def set_type(self, object_row: int, label: int, object_type: int) -> None:
        """Let an object be of another type; hypothetical edges end with the old one."""
        self.objects["label"][object_row], self.objects["type"][object_row] = label, object_type
        self._pending = None
        self.look_up_prior()

    def find_objects(self, home: np.ndarray, key: np.ndarray) -> np.ndarray:
        """Return the rows of object nodes that there are, (n,)."""
        return self._row_of_key[home, key]

    def query(
        self, home: np.ndarray, key: np.ndarray, label: np.ndarray, object_type: np.ndarray
    ) -> Queries:
        """Ask for objects by description; arguments as in `ensure_objects`, (Q,) each."""
        rows = self.ensure_objects(home, key, label, object_type)
        self._pending = Queries(home, rows, self.place_prior.rows(home, object_type))
        if self._history is not None:
            self._history.count("num_asked", home)
        return self._pending

    def ask(
        self, home: np.ndarray, key: np.ndarray, label: np.ndarray, object_type: np.ndarray
    ) -> Queries:
        """Ask for objects as `query` does, where memories are `share`d: nothing is counted."""
        rows = self.ensure_objects(home, key, label, object_type)
        prior = self.place_prior.rows(home, object_type)
        return Queries(home, rows, prior, more_asked=np.bincount(home)[home])

    def edges_of(self, queries: Queries) -> tuple[np.ndarray, np.ndarray]:
        """Return query numbers and rows of the remembered edges of query objects, (k,) each."""
        return join_groups(queries.object, self.edges["object"], self.objects.num_rows)

    def mark_places(self, queries: Queries) -> np.ndarray:
        """Mark the furniture that queries are about, bool (Q, F)."""
        is_place: np.ndarray = self.is_furniture[queries.home]
        return is_place if queries.left_out is None else is_place & ~queries.left_out

    def compute_relation_shares(self, queries: Queries) -> np.ndarray:
        """Return how likely each relation to furniture that things are at is, (Q, F, relations).

        As they were seen there last; by the prior where they never were, and alike where that knows
        nothing.
        """
        share = share_relations(queries.prior.astype(float))
        query, edge = self.edges_of(queries)
        is_seen = self.edges["num_true"][edge] > 0
        query, edge = query[is_seen], edge[is_seen]
        order = np.argsort(self.edges["last_true"][edge], kind="stable")
        query, edge = query[order], edge[order]
        place, relation = self.edges["furniture"][edge], self.edges["relation"][edge]
        share[query, place] = np.eye(NUM_RELATIONS)[relation]
        return share

    def find_present(self, edges: np.ndarray) -> np.ndarray:
        """Tell whether things are where edges (n,) lead, bool (n,); all that tells it asks this.

        The last look there showed it, and no other place has shown it since: of several things of
        one description, that are known at once, it may have been another one.
        """
        thing, objects = self.edges["object"][edges], self.objects
        is_last = objects["last_furniture"][thing] == self.edges["furniture"][edges]
        present: np.ndarray = is_last | (objects["num_at_once"][thing] > 1)
        return present & self.edges["is_true"][edges]

    def propose_places(self, queries: Queries) -> np.ndarray:
        """Mark the hypothetical edges of queries, bool (Q, F, relations)."""
        return propose_places(queries.prior, self.threshold, self.is_furniture[queries.home])

    def observe(
        self,
        home: np.ndarray,
        furniture: np.ndarray,
        seen_object: np.ndarray,
        seen_relation: np.ndarray,
        coverage: np.ndarray | None = None,
        confidence: np.ndarray | None = None,
        hidden: np.ndarray | None = None,
        *,
        is_look: bool = True,
        is_again: bool = False,
    ) -> Change:
        """Fold one look per home into the memories.

        Every remembered edge of the furniture looked at is updated: seen -> true, else false, as
        far as it was in view. A look that had less than half of the furniture in view is not
        counted as a look at it, and makes no hypothetical edge false. Where coverage is given by
        relation, edges are updated as far as their own relation was in view, and a look counts as
        one at the furniture by the mean that `LookWeights` says.

        Args:
            home: homes that looked, each once, (n,).
            furniture: the furniture index that each looked at, (n,).
            seen_object: rows of `objects` that were detected there, (m,).
            seen_relation: by number in `RELATIONS`, (m,).
            coverage: share of the furniture that was in view, in (0, 1], (n,), or shares by
                relation, in [0, 1], (n, relations); None for all of it.
            confidence: probability that each detection is right, in [0, 1], (m,); None for 1.
            hidden: rows of `objects` that were not seen because their spots were out of view, (k,):
                nothing is counted against them. None for none.
            is_look: whether `history`, which is of looks, counts it.
            is_again: whether a look of this time step had as much of each place in view. Then what
                is as that look found it is not counted once more: looks of one moment err alike.

        Returns:
            The rows that changed.

        Source: paper section 4.2, appendix B.
        """
        looked = np.full(self.num_homes, -1, dtype=np.int32)
        looked[home] = furniture
        edges = self.edges
        touched = at_place = np.flatnonzero(looked.take(edges["home"]) == edges["furniture"])
        of_touched = edges["object"][touched], edges["relation"][touched]
        weights = self.place_prior.weights
        look = LookWeights(self.objects, weights, home, furniture, coverage, hidden)
        if confidence is not None and (confidence < 1).any():
            seen_object, seen_relation = look.sort_out(seen_object, seen_relation, confidence)
        weight = look.weigh(*of_touched)
        num_objects = self.objects.num_rows
        is_seen_edge = np.zeros((num_objects, NUM_RELATIONS), dtype=bool)
        is_seen_object = np.zeros(num_objects, dtype=bool)
        is_seen_edge[seen_object, seen_relation] = is_seen_object[seen_object] = True
        is_seen = is_seen_edge[of_touched]
        sure = look.confidence  # (O, relations), None if all are sure
        edges["confidence"][touched[is_seen]] = 1.0 if sure is None else sure[of_touched][is_seen]
        is_new_true = is_seen_edge.copy()
        is_new_false = self._mark_looked_up(looked) & ~is_seen_edge
        is_new_true[of_touched] = is_new_false[of_touched] = False
        if is_again:
            is_new = self._leave_out_again(touched, is_seen, is_seen_object, is_new_true)
            touched, is_seen, weight = touched[is_new], is_seen[is_new], weight[is_new]
            of_touched = edges["object"][touched], edges["relation"][touched]
        again = touched[is_seen]
        if self._history is not None and is_look:
            asked = None if is_again else self._pending
            self._history.note_look(
                self, looked, look, of_touched, is_seen_object, again, asked, is_again=is_again
            )
        self._update_edges(touched, is_seen, weight)
        new_true, new_false = _find_marked(is_new_true), _find_marked(is_new_false)
        missed = look.weigh(*new_false)
        counts = missed >= 0.5
        missed, new_false = missed[counts], (new_false[0][counts], new_false[1][counts])
        added = self._add_edges(looked, new_true, new_false)
        true, false = added[: len(new_true[0])], added[len(new_true[0]) :]
        edges["confidence"][true] = 1.0 if sure is None else sure[new_true]
        edges["missed"][false] = edges["num_absent"][false] - 1 + missed
        shown = np.concatenate([again, true])
        if is_look and self._history is not None and self.clock is not None:
            gone = touched[~is_seen & look.counts(*of_touched)]
            if is_again:  # a later look may take it back
                gone = gone[edges["last_true"][gone] != self.time]
            self._note_hours((home, furniture), at_place, shown, gone)
        self._note_origin(shown)
        is_counted = look.is_counted[home] & (not is_again)
        self.furniture["num_observed"][home, furniture] += is_counted
        self.furniture["last_observed"][home[is_counted], furniture[is_counted]] = self.time
        self._update_objects(np.flatnonzero(is_seen_object), looked)
        if is_again:  # what this step has shown elsewhere meanwhile is back
            self.objects["last_furniture"][seen_object] = looked[self.objects["home"][seen_object]]
        has_changed = is_seen_object.copy()
        has_changed[edges["object"][added]] = True
        return Change(
            home,
            furniture,
            np.flatnonzero(has_changed),
            np.concatenate([touched, added]),
            np.concatenate([is_seen, np.arange(len(added)) < len(true)]),
            look.coverage[home],
        )

    def note_absent(
        self, objects: Sequence[int], furniture: int, coverage: float, *, is_again: bool = False
    ) -> None:
        """Fold in a look at a place for some objects of one home alone, which did not show them.

        It counts as a look for these: their remembered edges there, and their hypothetical ones,
        are updated as by `observe`. Nothing is said of others, so that the place counts no look.

        Args:
            objects: rows, the first of the one that the look is kept of (`lone_looks`).
            furniture: index of the place.
            coverage: share of it that was in view, in (0, 1].
            is_again: whether there was such a look in this time step, as in `observe`.
        """
        edges, is_whole = self.edges, coverage >= 0.5
        home = self.objects["home"][objects[0]]
        is_asked = mark_rows(np.array(objects), self.objects.num_rows)
        rows = np.flatnonzero(is_asked[edges["object"]] & (edges["furniture"] == furniture))
        if is_again:
            rows = rows[~self._was_so(rows, np.zeros(len(rows), dtype=bool))]
        if is_whole and self._pending is not None:
            pending = self._pending.object[is_asked[self._pending.object]]
            self.objects["num_sought"][
                pending[self.objects["last_furniture"][pending] == furniture]
            ] += 1
            looked = np.full(self.num_homes, -1, dtype=np.int32)
            looked[home] = furniture
            is_new = self._mark_looked_up(looked) & is_asked[:, None]
            is_new[edges["object"][rows], edges["relation"][rows]] = False
            none = (np.zeros(0, dtype=np.int64),) * 2
            added = self._add_edges(looked, none, _find_marked(is_new))
            edges["missed"][added] = edges["num_absent"][added] - 1 + coverage
        gone = rows[edges["num_true"][rows] > 0]
        if is_whole and self._history is not None and self.clock is not None:
            clock, is_seen = self.clock[edges["home"][gone]], np.zeros(len(gone), dtype=bool)
            self._history.note_hours(clock, self.time, gone, is_seen, edges.num_rows)
            at_place = np.flatnonzero((edges["furniture"] == furniture) & (edges["home"] == home))
            self._note_moment((np.array([home]), np.array([furniture])), at_place, (gone, is_seen))
        self._update_edges(rows, np.zeros(len(rows), dtype=bool), np.full(len(rows), coverage))
        note_lone_look(self.lone_looks, objects[0], furniture, self.time, coverage)

    def _note_moment(
        self,
        looked: tuple[np.ndarray, np.ndarray],
        at_place: np.ndarray,
        found: tuple[np.ndarray, np.ndarray],
    ) -> None:
        """Note a look at furniture of homes as a moment; arguments as of `Moments.note_look`."""
        assert self.clock is not None
        moments, edge_home = self.history.moments, self.edges["home"]
        moments.note_look(self.clock, self.time, looked, edge_home, at_place, found)

    def find_lone_looks(self, objects: np.ndarray) -> LoneLooks | None:
        """Return the looks for objects (Q,) alone that did not find them; None if there is none."""
        if not self.lone_looks.num_rows:
            return None
        return LoneLooks.of(self.lone_looks, objects, self.num_furniture)

    def note_place(self, object_row: int, furniture: int, relation: int, confidence: float) -> None:
        """Take over that an object is somewhere now, which no look has shown.

        It counts as a sighting of it alone, of at least the confidence `SURE`: nothing is said of
        others there, and `history` is as it was. The furniture counts no look.
        """
        self.objects["carried_since"][object_row] = NEVER
        self.observe(
            self.objects["home"][[object_row]],
            np.array([furniture]),
            np.array([object_row]),
            np.array([relation]),
            np.zeros(1),
            np.array([confidence]),
            is_look=False,
        )

    def note_left(self, edges: np.ndarray, confidence: float) -> None:
        """Take over that edges (n,) are true no longer, as of looks that miss the objects."""
        is_seen = np.zeros(len(edges), dtype=bool)
        self._update_edges(edges, is_seen, np.full(len(edges), confidence))

    def note_carried(self, object_row: int) -> None:
        """Take over that the robot has an object in its hand now; it is at no furniture."""
        objects = self.objects
        if objects["num_observed"][object_row] == 0:
            objects["first_observed"][object_row] = self.time
        objects["num_observed"][object_row] += 1
        objects["last_observed"][object_row] = objects["carried_since"][object_row] = self.time
        objects["last_furniture"][object_row] = NEVER

    def _leave_out_again(
        self,
        touched: np.ndarray,
        is_seen: np.ndarray,
        is_seen_object: np.ndarray,
        is_new_true: np.ndarray,
    ) -> np.ndarray:
        """Say which edges another look of this step tells anything of, bool (touched,).

        In `is_seen_object` (O,) what this step has shown already is left out.
        """
        self._take_back(touched[is_seen])
        is_new = ~self._was_so(touched, is_seen)
        is_seen_object &= self.objects["last_observed"] != self.time
        is_seen_object[self.edges["object"][touched[is_new & is_seen]]] = True
        is_seen_object[np.flatnonzero(is_new_true.any(axis=1))] = True
        return is_new

    def _note_hours(
        self,
        looked: tuple[np.ndarray, np.ndarray],
        at_place: np.ndarray,
        shown: np.ndarray,
        gone: np.ndarray,
    ) -> None:
        """Count by the clock what a look has shown, and what it found gone that was there once."""
        assert self.clock is not None
        edges = self.edges
        gone = gone[edges["num_true"][gone] > 0]
        rows = np.concatenate([shown, gone])
        is_true = np.arange(len(rows)) < len(shown)
        clock = self.clock[edges["home"][rows]]
        self.history.note_hours(clock, self.time, rows, is_true, edges.num_rows)
        self._note_moment(looked, at_place, (rows, is_true))

    def _take_back(self, rows: np.ndarray) -> None:
        """Undo the misses in this time step of edges that it had shown, and shows again, (n,)."""
        edges = self.edges
        rows = rows[~edges["is_true"][rows] & (edges["last_true"][rows] == self.time)]
        edges["num_observed"][rows] -= edges["num_absent"][rows]
        edges["num_changed"][rows] -= 1
        edges["num_absent"][rows] = edges["missed"][rows] = 0
        edges["is_true"][rows] = True

    def _was_so(self, rows: np.ndarray, is_seen: np.ndarray) -> np.ndarray:
        """Tell whether a look of this time step found edges as they are found again, (n,) each.

        What was seen in this step is not hidden: each look that misses it then says something new.
        """
        edges = self.edges
        was_so: np.ndarray = (edges["last_observed"][rows] == self.time) & (
            is_seen == edges["is_true"][rows]
        )
        return was_so & (is_seen | (edges["last_true"][rows] != self.time))

    def _update_edges(self, rows: np.ndarray, is_seen: np.ndarray, weight: np.ndarray) -> None:
        """Update edges that are true, or were looked at for some part of a look, (n,) each."""
        edges = self.edges
        before = edges["missed"][rows]
        after = (before + weight).astype(np.float32)
        edges["missed"][rows] = after * ~is_seen
        is_counted = is_seen | (np.floor(after + 0.5) > np.floor(before + 0.5))
        if not is_counted.all():
            rows, is_seen = rows[is_counted], is_seen[is_counted]
        was_true = edges["is_true"][rows]
        has_changed = was_true != is_seen
        edges["time_true"][rows] += was_true * (self.time - edges["last_observed"][rows])
        edges["num_observed"][rows] += 1
        edges["num_true"][rows] += is_seen
        edges["num_changed"][rows] += has_changed
        edges["last_observed"][rows] = self.time
        edges["last_changed"][rows[has_changed]] = self.time
        edges["last_true"][rows[is_seen]] = self.time
        edges["is_true"][rows] = is_seen
        edges["num_absent"][rows] = (edges["num_absent"][rows] + 1) * ~is_seen

    def _mark_looked_up(self, looked: np.ndarray) -> np.ndarray:
        """Mark hypothetical edges that were looked at, bool (O, relations)."""
        is_looked_up = np.zeros((self.objects.num_rows, NUM_RELATIONS), dtype=bool)
        if self._pending is None:
            return is_looked_up
        queries = self._pending
        place = looked[queries.home]
        proposed = self.propose_places(queries)
        proposed = proposed[np.arange(len(place)), place] & (place >= 0)[:, None]  # (Q, relations)
        query, relation = np.nonzero(proposed)
        is_looked_up[queries.object[query], relation] = True
        return is_looked_up

    def _add_edges(
        self,
        looked: np.ndarray,
        true: tuple[np.ndarray, ...],
        false: tuple[np.ndarray, ...],
    ) -> np.ndarray:
        """Add first-time edges to the furniture looked at, by object and relation, true ones first.

        Returns their rows.
        """
        rows, relation = np.concatenate([true[0], false[0]]), np.concatenate([true[1], false[1]])
        if not len(rows):
            return rows
        home = self.objects["home"][rows]
        is_true = np.arange(len(rows)) < len(true[0])
        return self.edges.append(
            len(rows),
            home=home,
            object=rows,
            furniture=looked[home],
            relation=relation,
            prior=self._get_prior(rows, looked[home], relation),
            num_observed=1,
            num_true=is_true,
            last_observed=self.time,
            last_true=np.where(is_true, self.time, NEVER),
            is_true=is_true,
            num_absent=np.where(is_true, 0, self.furniture_num_observed[home, looked[home]] + 1),
        )

    def _note_origin(self, edges: np.ndarray) -> None:
        """Keep from which furniture objects came that were found at others, for edges (n,)."""
        before = self.objects["last_furniture"][self.edges["object"][edges]]
        has_moved = (before != NEVER) & (before != self.edges["furniture"][edges])
        self.edges["came_from"][edges[has_moved]] = before[has_moved]

    def _update_objects(self, rows: np.ndarray, looked: np.ndarray) -> None:
        objects = self.objects
        place = looked[objects["home"][rows]]
        before = objects["last_furniture"][rows]
        objects["first_observed"][rows[objects["num_observed"][rows] == 0]] = self.time
        has_moved = rows[(before != NEVER) & (before != place)]
        objects["num_observed"][rows] += 1
        objects["last_observed"][rows] = self.time
        objects["num_moved"][has_moved] += 1
        objects["last_moved"][has_moved] = self.time
        objects["last_furniture"][rows] = place


def _find_marked(marks: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return objects and relations that are marked, bool (O, relations); quicker than `nonzero`."""
    return np.unravel_index(np.flatnonzero(marks), marks.shape)
