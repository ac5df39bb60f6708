"""Bayes filters over an object's place: PriorFilter over the prior, Ceiling over the true T."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass, fields
from typing import ClassVar, TypeVar

import numpy as np

from simulator.memory.memory_batch import Change, MemoryBatch, Queries
from simulator.policies.policy import Policy
from simulator.priors.prior_graph import PriorGraph
from simulator.world.config import HomeConfig
from simulator.world.descriptions import DescriptionTable
from simulator.world.homes import NUM_RELATIONS, Homes
from simulator.world.source import TRUE_PLACE_WEIGHTS, TRUE_TRANSITIONS

FilterT = TypeVar("FilterT", bound="PriorFilter")


@dataclass(frozen=True, slots=True)
class Rules:
    """What the filter takes for the dynamics of each queried object.

    Attributes:
        moves: weight of each furniture node when the object moves, sums to one, (Q, F).
        initial: expected number of such objects at each furniture node at t = 0, (Q, F).
        move_rate: probability that one moves in a step, (Q,).
        asked_move_rate: the same, given that the object is asked for in that step, (Q,).
        remove_rate: probability that one leaves in a step, (Q,).
        add_rate: expected number that appear in a step, (Q,).
    """

    moves: np.ndarray
    initial: np.ndarray
    move_rate: np.ndarray
    asked_move_rate: np.ndarray
    remove_rate: np.ndarray
    add_rate: np.ndarray


@dataclass(slots=True)
class Belief:
    """What a filter believes about each queried object.

    Attributes:
        last: probability that the instance that was seen last is at each furniture node, (Q, F).
        others: expected number of other instances at each furniture node, (Q, F).
    """

    last: np.ndarray
    others: np.ndarray

    def take(self, rows: np.ndarray) -> Belief:
        """Return a copy of rows (n,)."""
        return type(self)(*(getattr(self, field.name)[rows] for field in fields(self)))


@dataclass(frozen=True, slots=True)
class Flow:
    """Where objects that move go.

    Attributes:
        moves: weight of each furniture node, sums to one, (Q, F).
        leave: total weight that can be moved to from each furniture node, (Q, F).
    """

    moves: np.ndarray
    leave: np.ndarray


@dataclass(frozen=True, slots=True)
class Look:
    """One look in each of some homes.

    Attributes:
        time: when.
        furniture: where each home looked, or -1, (H,).
        is_seen: objects that were seen, by row of `MemoryBatch.objects` at that time, bool.
        is_type_seen: types that were seen, unknown ones last, bool (H, O + 1).
    """

    time: int
    furniture: np.ndarray
    is_seen: np.ndarray
    is_type_seen: np.ndarray


@dataclass(frozen=True, slots=True)
class _Trail:
    """What was believed at the last question: its time, looks known, objects (Q,) and belief."""

    time: int
    num_looks: int
    objects: np.ndarray
    belief: Belief


class PlaceFilter(Policy):
    """Follows where the objects of a description can be, given every look so far.

    Two beliefs per description are followed: where the instance that was seen last is (a hidden
    Markov model, exact when there is one instance), and how many others to expect where (a
    Poisson density). Prediction: an object stays with 1 - move rate, else goes to another
    furniture node of its room in proportion to `moves`. Correction: an unseen object at a
    furniture node looked at keeps the share `detection_error` there. That an object is asked
    for makes it likelier to have just moved (docs/design.md, ruling 9), and the filter knows
    that, too.

    Attributes:
        learns: whether looks change where objects go, so that `make_flows` is asked again.
    """

    learns: ClassVar[bool] = False

    def __init__(self, prior: PriorGraph, config: HomeConfig, asks_moved: float = 0.5) -> None:
        """Keep the rules.

        Args:
            prior: for type metadata.
            config: the rules of the homes.
            asks_moved: share of the queries that are about an object that has just moved.
        """
        self._config = config
        self._asks_moved = asks_moved
        self._move_freq = np.array([row.move_freq for row in prior.objects])
        self._add_remove = np.array([row.add_remove_prob for row in prior.objects])
        self._sample_prob = np.array([row.sample_prob for row in prior.objects])
        table = DescriptionTable(
            [r.label for r in prior.objects], [r.adjectives for r in prior.objects]
        )
        self._sameness = table.compute_sameness()
        self._looks: list[Look] = []
        self._asked: dict[int, np.ndarray] = {}
        self._trail: _Trail | None = None

    def reset(self, memory: MemoryBatch) -> None:
        """Forget all looks and work out the expected inventory of the new homes."""
        self._looks = []
        self._asked = {}
        self._trail = None
        self._expected = self._compute_expected_objects(memory)  # (H, O, F)
        self._kappa = self._solve_move_race()  # (H,)

    def observe(self, memory: MemoryBatch, change: Change) -> None:
        """Log one look per home: where, and which objects were seen."""
        looked = np.full(memory.num_homes, -1)
        looked[change.home] = change.furniture
        seen = change.edges[memory.edges["is_true"][change.edges]]
        rows = memory.edges["object"][seen]
        is_seen = np.zeros(len(memory.objects), dtype=bool)
        is_seen[rows] = True
        is_type_seen = np.zeros((memory.num_homes, len(self._move_freq) + 1), dtype=bool)
        is_type_seen[memory.objects["home"][rows], memory.objects["type"][rows]] = True
        self._looks.append(Look(memory.time, looked, is_seen, is_type_seen))

    def scores(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        """Return the expected number of objects asked for at each furniture node, (Q, F)."""
        belief = self.follow(memory, queries)
        return belief.last + belief.others

    def follow(self, memory: MemoryBatch, queries: Queries) -> Belief:
        """Play the looks so far again for the objects asked for, (Q, F).

        From the start; where the same objects, or some of them, were asked for just before in the
        same step, in a search that goes on, only the looks since then.
        """
        self._mark_asked(memory, queries)
        rules = self.compute_rules(memory, queries)
        room = memory.furniture_room[queries.home]  # (Q, F)
        if self._config.cross_room_moves:
            room = np.zeros_like(room)  # objects move within the home as else within a room
        belief, first_time, num_looks = self._resume(memory, queries, rules)
        flows = self.make_flows(rules, belief, room)
        looks = iter([*self._looks[num_looks:], None])
        look = next(looks)
        for time in range(first_time, memory.time + 1):
            if time > first_time:
                asked = _lookup(self._asked[time], queries.object) if time in self._asked else False
                rate = np.where(asked, rules.asked_move_rate, rules.move_rate)
                self.predict(belief, rules, rate, flows, room)
            if look is not None and look.time == time:
                while look is not None and look.time == time:
                    self.correct(belief, memory, queries, look)
                    look = next(looks)
                if self.learns:
                    flows = self.make_flows(rules, belief, room)
        self._trail = _Trail(memory.time, len(self._looks), queries.object, belief)
        return belief

    def _mark_asked(self, memory: MemoryBatch, queries: Queries) -> None:
        is_asked = np.zeros(len(memory.objects), dtype=bool)
        is_asked[queries.object] = True
        earlier = self._asked.get(memory.time, is_asked[:0])
        is_asked[: len(earlier)] |= earlier
        self._asked[memory.time] = is_asked

    def _resume(
        self, memory: MemoryBatch, queries: Queries, rules: Rules
    ) -> tuple[Belief, int, int]:
        """Return a belief, the time that it is of, and how many looks it knows."""
        trail = self._trail
        if trail is not None and trail.time == memory.time:
            row_of_object = np.full(len(memory.objects), -1)
            row_of_object[trail.objects] = np.arange(len(trail.objects))
            rows = row_of_object[queries.object]
            if (rows >= 0).all():
                return trail.belief.take(rows), trail.time, trail.num_looks
        return self.start(memory, queries, rules), 0, 0

    def start(self, memory: MemoryBatch, queries: Queries, rules: Rules) -> Belief:
        """Return the belief at t = 0, before any look."""
        return Belief(np.zeros(rules.initial.shape), rules.initial.copy())

    def make_flows(self, rules: Rules, belief: Belief, room: np.ndarray) -> tuple[Flow, ...]:
        """Return where objects go that move: the queried ones first; `room` as for `predict`."""
        return (self.make_flow(rules.moves, np.ones(len(rules.moves)), room),)

    def predict(
        self, belief: Belief, rules: Rules, rate: np.ndarray, flows: tuple[Flow, ...],
        room: np.ndarray,
    ) -> None:  # fmt: skip
        """Let one step pass, in place.

        Args:
            belief: what is believed.
            rules: what is taken for the dynamics.
            rate: probability that each queried object moves in this step, (Q,).
            flows: from `make_flows`.
            room: number of what objects stay in when they move, their room or home, (Q, F).
        """
        none = np.zeros(len(rate))
        belief.last = self.spread(belief.last, flows[0], rules, rate, none, room)
        belief.others = self.spread(belief.others, flows[0], rules, rate, rules.add_rate, room)

    def correct(self, belief: Belief, memory: MemoryBatch, queries: Queries, look: Look) -> None:
        """Fold one look per home into the belief, in place."""
        from simulator.compiled.filters import correct_places  # loads numba

        at = look.furniture[queries.home]
        is_seen = find_seen(look, queries)
        correct_places(belief.last, belief.others, at, is_seen, self._config.detection_error)

    @abstractmethod
    def compute_rules(self, memory: MemoryBatch, queries: Queries) -> Rules:
        """Return what is taken for the dynamics of each queried object."""

    def make_flow(self, weight: np.ndarray, scale: np.ndarray, room: np.ndarray) -> Flow:
        """Return where objects go that move with weights (Q, F) times a scale (Q,)."""
        from simulator.compiled.filters import make_flow  # loads numba

        return Flow(*make_flow(weight, scale, room))

    def spread(
        self, density: np.ndarray, flow: Flow, rules: Rules, rate: np.ndarray, coming: np.ndarray,
        room: np.ndarray,
    ) -> np.ndarray:  # fmt: skip
        """Let the objects of a density move, leave and come for one step, (Q, F) -> (Q, F).

        `rate` is how likely each moves, `coming` how many are expected to come, (Q,) each.
        """
        from simulator.compiled.filters import spread  # loads numba

        kept = 1 - rules.remove_rate
        return spread(density, flow.moves, flow.leave, kept, rate, coming, room)

    def _compute_expected_objects(self, memory: MemoryBatch) -> np.ndarray:
        """Return the expected objects per type and furniture node at t = 0, (H, O, F)."""
        weights = self._read_weights(memory) * self._sample_prob[:, None]
        total = weights.sum(axis=1, keepdims=True)
        share = np.divide(weights, total, out=np.zeros_like(weights), where=total > 0)
        return share * self._config.objects_per_furniture

    def _read_weights(self, memory: MemoryBatch) -> np.ndarray:
        """Return the placement weights that the initial objects were drawn with, (H, O, F)."""
        return memory.place_prior.weights.sum(axis=3)

    def _solve_move_race(self) -> np.ndarray:
        """Solve sum(1 - exp(-kappa w)) = moves per step for kappa, (H,).

        An object of weight w then moves with 1 - exp(-kappa w): drawing without replacement in
        proportion to w is a race of exponential clocks with rates w.
        """
        count = self._expected.sum(axis=2)  # (H, O)
        target = self._config.move_share * count.sum(axis=1)
        low, high = np.zeros(len(count)), np.full(len(count), 1e3)
        for _ in range(60):
            kappa = (low + high) / 2
            moves = (count * -np.expm1(-kappa[:, None] * self._move_freq)).sum(axis=1)
            low, high = np.where(moves < target, kappa, low), np.where(moves < target, high, kappa)
        return high

    def _compute_rates(
        self, home: np.ndarray, types: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return the move, asked-move, remove and add rates of object types, (Q,) each."""
        count = self._expected.sum(axis=2)
        weight = self._move_freq[types]
        move = -np.expm1(-self._kappa[home] * weight)
        num_moves = self._config.move_share * count.sum(axis=1)[home]
        total_weight = np.maximum((count * self._move_freq).sum(axis=1), 1e-12)[home]
        by_weight = (1 - self._asks_moved) * weight / total_weight
        if_moved = move * (self._asks_moved / np.maximum(num_moves, 1e-12) + by_weight)
        asked = if_moved / np.maximum(if_moved + (1 - move) * by_weight, 1e-12)
        if not self._config.dynamic_nodes:
            return move, asked, np.zeros_like(move), np.zeros_like(move)
        # The bounds on the object count keep removals and additions equal in the long run.
        leaving = (count * self._add_remove).sum(axis=1)
        coming = ((count > 0) * self._add_remove).sum(axis=1)
        both = np.minimum(leaving, coming)
        rate = self._add_remove[types]
        remove = rate * (both / np.maximum(leaving, 1e-12))[home]
        add = rate * (both / np.maximum(coming, 1e-12))[home] * self._sameness[types]
        return move, asked, remove, add


class PriorFilter(PlaceFilter):
    """The filter that takes the prior for the home's dynamics and knows the rules.

    It knows the move rate by type, that moves stay in the room, and the detection error.
    """

    @classmethod
    def make(cls: type[FilterT], homes: Homes) -> FilterT:
        """Make one that knows the rules of some homes."""
        return cls(homes.prior, homes.config)

    def compute_rules(self, memory: MemoryBatch, queries: Queries) -> Rules:
        """Return rules with the prior as dynamics."""
        types = memory.objects["type"][queries.object]
        moves = queries.prior.sum(axis=2).astype(float)
        is_unknown = (types < 0) | ~moves.any(axis=1)
        moves[is_unknown] = 1 / memory.num_furniture
        types = np.maximum(types, 0)
        initial = self._expected[queries.home, types] * self._sameness[types][:, None]
        initial = np.where(is_unknown[:, None], moves, initial)
        return Rules(moves, initial, *self._compute_rates(queries.home, types))


class Ceiling(PlaceFilter):
    """The filter over the home's true dynamics T: what an answer can be worth.

    Exact for a description with a single instance; with several, it approximates.

    Source: docs/design.md, ruling 20.
    """

    needs = frozenset((TRUE_TRANSITIONS, TRUE_PLACE_WEIGHTS))

    @classmethod
    def make(cls, homes: Homes) -> Ceiling:
        """Make one that reads some true homes."""
        return cls(homes)

    def __init__(self, homes: Homes, asks_moved: float = 0.5) -> None:
        """Keep the true homes."""
        super().__init__(homes.prior, homes.config, asks_moved)
        self._homes = homes

    def compute_rules(self, memory: MemoryBatch, queries: Queries) -> Rules:
        """Return rules with the description's own row of T and the home's class weights."""
        codes = memory.objects["key"][queries.object]
        types = memory.objects["type"][queries.object]
        rows = self._homes.transition_rows(queries.home, codes).astype(float)
        moves = rows.reshape(len(rows), -1, NUM_RELATIONS).sum(axis=2)
        initial = self._expected[queries.home, types] * self._sameness[types][:, None]
        return Rules(moves, initial, *self._compute_rates(queries.home, types))

    def _read_weights(self, memory: MemoryBatch) -> np.ndarray:
        weights = self._homes.get_place_weights()
        return weights.reshape(*weights.shape[:2], -1, NUM_RELATIONS).sum(axis=3)


def find_seen(look: Look, queries: Queries) -> np.ndarray:
    """Tell which of the objects asked for were seen in a look, bool (Q,)."""
    return _lookup(look.is_seen, queries.object)


def _lookup(flags: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Read flags of object rows; rows that were added later were not flagged."""
    return flags.take(rows, mode="clip") & (rows < len(flags))
