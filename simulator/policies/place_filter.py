"""What Bayes filters over an object's place have in common: rules, beliefs, and their upkeep."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from sgm.arrays.grouped import sum_relations
from sgm.arrays.table import Table
from sgm.evidence.adaptive_filter import TASKS_ASK_MOVED
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Change, Queries
from sgm.policies.policy import Policy, mask_furniture
from sgm.prior.prior_graph import PriorGraph
from simulator.policies.filter_kernel import LAST, OTHERS, Rules, Subjects, follow
from simulator.policies.filter_looks import FilterLooks, fit_keys
from simulator.policies.inventory import Inventory
from simulator.world.rules import HomeRules

_ROWS_AT_ONCE = 8192  # beliefs that are carried on together: some 30 MB


class PlaceFilter(Policy):
    """Follows where the objects of a description can be, given every look so far.

    Two beliefs per description are followed: where the instance that was seen last is (a hidden
    Markov model, exact when there is one instance), and how many others to expect where (a
    Poisson density). Prediction: an object stays with 1 - move rate, else goes to another
    furniture node of its room in proportion to `moves`. Correction: an unseen object at a
    furniture node looked at keeps the share `miss_rate` there, and all of it out of view. That an
    object is asked for makes it likelier to have just moved (docs/design.md, ruling 9), and the
    filter knows that, too. Of sensing it knows the `detection_error` and what was in view.

    The belief about an object is brought up to date when it is asked for, from where it was when
    it was last asked for. Looks are kept in a log that is cut when it has grown too long
    (`FilterLooks.max_length`): then every belief is carried on to where the log is cut. No question
    and no step costs more in a long life than in a short one.

    Attributes:
        num_rows: rows of a belief, see `simulator.policies.filter_kernel`, K.
        num_basis: rows of `compute_basis`, B.
    """

    counts_looks = True
    num_rows: ClassVar[int] = 2
    num_basis: ClassVar[int] = 1

    def __init__(
        self,
        prior: PriorGraph,
        config: HomeRules | Sequence[HomeRules],
        asks_moved: float = TASKS_ASK_MOVED,
    ) -> None:
        """Keep what types the prior has, and the rules of all homes, or of each.

        `asks_moved` is the share of the queries that are about an object that has just moved.
        """
        self._prior = prior
        self._config = config
        self._asks_moved = asks_moved

    def reset(self, memory: MemoryBatch) -> None:
        """Forget all looks and work out the expected inventory of the new homes."""
        num_homes, config = memory.num_homes, self._config
        configs = [config] * num_homes if isinstance(config, HomeRules) else config
        self._configs = configs
        self._num_furniture = memory.home_num_furniture
        weights = self.read_weights(memory)
        self._inventory = Inventory(
            self._prior, configs, weights, self._num_furniture, self._asks_moved
        )
        self._miss_rate = np.array([config.detection_error for config in configs])
        # What objects stay in when they move, their room or home, (H, F).
        stays_in_room = np.array([not config.cross_room_moves for config in configs])
        self._room = np.where(stays_in_room[:, None], memory.furniture_room, 0).astype(np.int64)
        self._group = self._room  # what shares class noise, of a filter that learns of it
        self._log = FilterLooks(num_homes, len(self._prior.objects) + 1)
        self._kept = KeptBeliefs(self.num_rows, memory.num_furniture, self.num_basis)
        self._base: np.ndarray | None = None  # belief at the start of the log; None at t = 0
        self._num_based = 0  # objects in it; the subjects of `_list_unknown` come after them

    def observe(self, memory: MemoryBatch, change: Change) -> None:
        """Note one look per home: where, and which objects were seen."""
        self._cut_log(memory)
        seen = change.edges[change.is_seen]
        rows = memory.edges["object"][seen]
        keys = self._number_types(memory.objects["home"][rows], memory.objects["type"][rows])
        self._log.add_looks(memory.time, change.home, change.furniture, change.coverage, rows, keys)

    def scores(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        """Return the expected number of objects asked for at each furniture node, (Q, F)."""
        belief = self.follow(memory, queries)
        return mask_furniture(memory, queries, belief[LAST] + belief[OTHERS])

    def follow(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        """Return what is believed about the objects asked for, (K, Q, F).

        A belief goes on from where it was, unless what it was computed from has changed between
        two steps; then it is computed anew from the start of the log.
        """
        self._cut_log(memory)
        self._log.add_questions(memory.time, queries.object)
        subjects = Subjects(
            home=queries.home.astype(np.int64),
            object=queries.object.astype(np.int64),
            type=memory.objects["type"][queries.object],
            moves=self.read_moves(memory, queries),
        )
        rules = self.compute_rules(subjects)
        basis = self.compute_basis(memory, subjects)
        belief, since = self._resume(memory, subjects, rules, basis)
        self._log.fit(memory.objects.num_rows)
        self._advance(belief, since, memory.time, subjects, rules)
        self._kept.put(queries.object, belief, memory.time, self._log.num_rounds, basis)
        return belief

    def _resume(
        self, memory: MemoryBatch, subjects: Subjects, rules: Rules, basis: np.ndarray
    ) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray]]:
        """Return beliefs to go on from, and their times and rounds; bases go into `basis`."""
        rows = self._kept.find(subjects.object)
        entries = self._kept.take(rows)
        log = self._log
        knows_dropped = entries["num_rounds"] >= log.first_round  # all that is not in the log
        is_kept = (rows >= 0) & (entries["time"] >= log.start) & knows_dropped
        is_of_now = is_kept & (entries["time"] == memory.time)
        is_kept &= is_of_now | (entries["basis"] == basis).all(axis=(1, 2))
        basis[is_of_now] = entries["basis"][is_of_now]
        belief = np.ascontiguousarray(entries["belief"].swapaxes(0, 1))
        time = np.where(is_kept, entries["time"], log.start)
        num_rounds = np.where(is_kept, entries["num_rounds"], log.first_round)
        new = np.flatnonzero(~is_kept)
        if len(new):
            belief[:, new] = self.start(subjects.take(new), rules.take(new), basis[new])
        return belief, (time, num_rounds)

    def start(self, subjects: Subjects, rules: Rules, basis: np.ndarray) -> np.ndarray:
        """Return the belief at the start of the log, (K, Q, F); `basis` is from `compute_basis`."""
        if self._base is None:
            return np.stack([np.zeros(rules.initial.shape), rules.initial])
        unknown = self._num_based + self._number_types(subjects.home, subjects.type)
        is_known = (subjects.object >= 0) & (subjects.object < self._num_based)
        return self._base.take(np.where(is_known, subjects.object, unknown), axis=1)

    def compute_basis(self, memory: MemoryBatch, subjects: Subjects) -> np.ndarray:
        """Return all that beliefs depend on besides looks and questions, (Q, B, F)."""
        return subjects.moves[:, None].copy()

    def _advance(
        self,
        belief: np.ndarray,
        since: tuple[np.ndarray, np.ndarray],
        now: int,
        subjects: Subjects,
        rules: Rules,
    ) -> None:
        """Carry beliefs on to a time, in place, with the looks and questions until then."""
        home, types, log = subjects.home, subjects.type, self._log
        type_add_rate = rules.add_rate / self._inventory.sameness[np.maximum(types, 0)]
        follow(
            belief,
            since,
            now,
            (home, subjects.object, self._number_types(home, types)),
            rules,
            type_add_rate,
            (self._room[home], self._group[home], self._num_furniture[home]),
            (log.round_time, log.first_round),
            (
                log.looks.arrays,
                log.sightings.arrays,
                log.type_sightings.arrays,
                log.questions.arrays,
            ),
        )

    @abstractmethod
    def read_moves(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        """Return the weight of each furniture node when an object asked for moves, (Q, F)."""

    @abstractmethod
    def read_type_moves(
        self, memory: MemoryBatch, home: np.ndarray, types: np.ndarray
    ) -> np.ndarray:
        """Return the same for objects of types that are not known yet, -1 for none, (n, F)."""

    def read_weights(self, memory: MemoryBatch) -> np.ndarray:
        """Return the placement weights that the initial objects were drawn with, (H, O, F)."""
        return sum_relations(memory.place_prior.weights)

    def compute_rules(self, subjects: Subjects) -> Rules:
        """Return what is taken for the dynamics of each subject."""
        home, types = subjects.home, np.maximum(subjects.type, 0)
        sameness = self._inventory.sameness[types]
        initial = self._inventory.expected[home, types] * sameness[:, None]
        move, asked, remove, add = self._inventory.compute_rates(home, types)
        return Rules(
            moves=subjects.moves,
            initial=initial,
            move_rate=move,
            asked_move_rate=asked,
            remove_rate=remove,
            add_rate=add,
            miss_rate=self._miss_rate[home],
        )

    def _number_types(self, home: np.ndarray, types: np.ndarray) -> np.ndarray:
        """Number pairs of home and type, unknown types last, (n,)."""
        num_types = len(self._prior.objects)
        return home * (num_types + 1) + np.where(types >= 0, types, num_types)

    def _cut_log(self, memory: MemoryBatch) -> None:
        """Carry all beliefs on to where the log is cut, if it has grown too long."""
        cutoff = self._log.find_cutoff(memory.time)
        if cutoff is None:
            return
        num_objects = memory.objects.num_rows
        self._log.fit(num_objects)
        total = num_objects + memory.num_homes * (len(self._prior.objects) + 1)
        base = np.empty((self.num_rows, total, memory.num_furniture))
        for first in range(0, total, _ROWS_AT_ONCE):
            rows = np.arange(first, min(first + _ROWS_AT_ONCE, total))
            base[:, rows] = self._compute_base(memory, rows, cutoff)
        self._base, self._num_based = base, num_objects
        self._log.drop(cutoff)

    def _compute_base(self, memory: MemoryBatch, rows: np.ndarray, cutoff: int) -> np.ndarray:
        """Return what is believed at a cutoff of objects, then of `_number_types`, by row (n,)."""
        num_objects = memory.objects.num_rows
        objects = rows[rows < num_objects]
        home, types = memory.objects["home"][objects], memory.objects["type"][objects]
        queries = Queries(home, objects, memory.place_prior.rows(home, types))
        num_types = len(self._prior.objects)
        more_homes, more_types = np.divmod(rows[rows >= num_objects] - num_objects, num_types + 1)
        more_types = np.where(more_types < num_types, more_types, -1)
        moves = (
            self.read_moves(memory, queries),
            self.read_type_moves(memory, more_homes, more_types),
        )
        subjects = Subjects(
            home=np.concatenate([home, more_homes]).astype(np.int64),
            object=np.concatenate([objects, np.full(len(more_homes), -1)]),
            type=np.concatenate([types, more_types]),
            moves=np.concatenate(moves),
        )
        rules = self.compute_rules(subjects)
        belief = self.start(subjects, rules, self.compute_basis(memory, subjects))
        log = self._log
        since = np.full(len(rows), log.start), np.full(len(rows), log.first_round)
        self._advance(belief, since, cutoff, subjects, rules)
        return belief


class KeptBeliefs:
    """One belief per object that was asked for, each as of its own time.

    Entries have `belief`, (K, F), `time` and `num_rounds`, up to which it knows what happened, and
    `basis`, what it was computed from, (B, F).
    """

    def __init__(self, num_rows: int, num_furniture: int, num_basis: int) -> None:
        """Start without beliefs; K, F and B."""
        entry = np.dtype(
            [
                ("belief", np.float64, (num_rows, num_furniture)),
                ("time", np.int64),
                ("num_rounds", np.int64),
                ("basis", np.float64, (num_basis, num_furniture)),
            ]
        )
        self._entries = Table({"entry": entry})
        self._row_of_object = np.full(64, -1)

    def find(self, objects: np.ndarray) -> np.ndarray:
        """Return the row of each object (n,), -1 without a belief."""
        self._fit(objects)
        return self._row_of_object[objects]

    def take(self, rows: np.ndarray) -> np.ndarray:
        """Return a copy of entries (n,); zeros for row -1."""
        entries = self._entries["entry"]
        taken = np.zeros(len(rows), dtype=entries.dtype)
        taken[rows >= 0] = entries[rows[rows >= 0]]
        return taken

    def put(
        self, objects: np.ndarray, belief: np.ndarray, time: int, num_rounds: int, basis: np.ndarray
    ) -> None:
        """Keep what is believed about objects (n,); `belief` (K, n, F), `basis` (n, B, F)."""
        self._fit(objects)
        new = np.unique(objects[self._row_of_object[objects] < 0])
        self._row_of_object[new] = self._entries.append(len(new))
        rows = self._row_of_object[objects]
        entries = self._entries["entry"]
        entries["belief"][rows] = belief.swapaxes(0, 1)
        entries["time"][rows] = time
        entries["num_rounds"][rows] = num_rounds
        entries["basis"][rows] = basis

    def _fit(self, objects: np.ndarray) -> None:
        num_objects = int(objects.max(initial=-1)) + 1
        self._row_of_object = fit_keys(self._row_of_object, num_objects)
