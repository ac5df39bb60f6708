"""Informed: what an agent can know that knows all rules of homes, but not the home."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from sgm.arrays.grouped import sum_relations
from sgm.evidence.adaptive_filter import TASKS_ASK_MOVED
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Change, Queries
from sgm.policies.policy import Policy, mask_furniture
from sgm.prior.prior_graph import PriorGraph
from sgm.schema import NUM_RELATIONS
from simulator.policies.inventory import Inventory
from simulator.world.homes import Homes
from simulator.world.noise import compute_noisy_weights
from simulator.world.rules import HomeRules
from tools.claims.draws_kernel import correct_draws, spread_draws


@dataclass(slots=True)
class _Draws:
    """What a density follows in each of n draws of a home's weights, over S places.

    Attributes:
        density: expected objects, (..., n, S).
        moves: weight of each place when one moves, (n, S).
        leave: total of `moves` at the other places that it can move to, (n, S).
        log_likelihood: of the looks, (n,).
        time: up to when it knows what happened.
        num_looks: how many looks of the home it knows.
    """

    density: np.ndarray
    moves: np.ndarray
    leave: np.ndarray
    log_likelihood: np.ndarray
    time: int = 0
    num_looks: int = 0


@dataclass(slots=True)
class _Type:
    """What is known of an object type in a home.

    Attributes:
        places: furniture that the prior deems possible, (S,).
        number: of each furniture node among the places, -1 for none, (F,).
        room: of each place, (S,).
        stays_in: number of what objects at each place stay in when they move, (S,).
        class_weights: what class noise may have left, (C, S, 2).
        expected: objects of the type that this leads one to expect at t = 0, (C, S).
        unmet: objects of the type whose description was neither seen nor asked for; its
            log likelihood is that of all objects of the type, were none of them known.
        objects: what is followed of each known description, by row of `MemoryBatch.objects`.
    """

    places: np.ndarray
    number: np.ndarray
    room: np.ndarray
    stays_in: np.ndarray
    class_weights: np.ndarray
    expected: np.ndarray
    unmet: _Draws
    objects: dict[int, _Draws] = field(default_factory=dict)


class Informed(Policy):
    """Bayes filters over draws of what noise has made of the prior, weighed by their likelihood.

    C versions of class noise are drawn for an object type, and for each of its descriptions that
    was seen or asked for, and each version, K of instance noise: by the rules of the home, with
    the code that makes homes. In every draw the object is followed as `Ceiling` does with the true
    weights, and the probability of all looks is counted: of finding it, of not finding it, and of
    not finding others of its type. The answer is the mean over the draws of the description, each
    weighed by that of its own looks, and by that of the looks for all others of its type, given the
    class noise.

    Exact, for enough draws, where a description has a single instance; several, and objects that
    were never seen, are Poisson densities. The rules say how many to expect. It does not read the
    true homes.

    Attributes:
        effective_sizes: of every answer so far, how many equally weighed draws its C K draws are
            (effective sample size), 1 / sum of their squared weights.

    Source: paper appendix A, "Sampling noise"; docs/design.md, rulings 3-9.
    """

    counts_looks = True

    def __init__(
        self,
        prior: PriorGraph,
        config: HomeRules | Sequence[HomeRules],
        num_class_draws: int = 64,
        num_instance_draws: int = 16,
        seed: int = 0,
    ) -> None:
        """Keep the rules of all homes, or of each, and C and K."""
        self._prior = prior
        self._config = config
        self._num_draws = num_class_draws, num_instance_draws
        self._seed = seed
        whole = prior.weights.sum(axis=(1, 2), keepdims=True)
        weights = np.zeros(prior.weights.shape)
        self._weights = np.divide(prior.weights, whole, out=weights, where=whole > 0)  # (O, N, 2)
        self._node_room = np.array(
            [prior.rooms.index(furniture_type.room) for furniture_type in prior.furniture]
        )
        self._node = {
            (furniture_type.room, furniture_type.label): number
            for number, furniture_type in enumerate(prior.furniture)
        }
        self.effective_sizes: list[float] = []

    @classmethod
    def make(cls, homes: Homes) -> Informed:
        """Make the policy that knows the rules of the homes, not their state."""
        return cls(homes.prior, homes.configs)

    def reset(self, memory: MemoryBatch) -> None:
        """Forget all looks and work out the expected inventory of the new homes."""
        num_homes, config = memory.num_homes, self._config
        self._configs = [config] * num_homes if isinstance(config, HomeRules) else [*config]
        nodes = np.full(memory.furniture_label.shape, -1)
        for home, place in np.argwhere(memory.is_furniture):
            room = memory.room_label[home, memory.furniture_room[home, place]]
            label = memory.furniture_label[home, place]
            key = memory.labels[room], memory.labels[label]
            nodes[home, place] = self._node.get(key, -1)
        self._nodes = nodes  # of the prior, (H, F)
        known = np.where(nodes >= 0, sum_relations(self._weights)[:, nodes], 0)  # (O, H, F)
        self._inventory = Inventory(
            self._prior,
            self._configs,
            np.moveaxis(known, 0, 1),
            memory.home_num_furniture,
            TASKS_ASK_MOVED,
        )
        self._types: dict[tuple[int, int], _Type] = {}  # by home and type
        self._looks: list[list[tuple[int, int, float]]] = [[] for _ in range(num_homes)]
        self._sightings: dict[int, set[int]] = defaultdict(set)  # by object: numbers of looks
        self._questions: dict[int, set[int]] = defaultdict(set)  # by object: times

    def observe(self, memory: MemoryBatch, change: Change) -> None:
        """Note one look per home: where, and which objects were seen."""
        for home, place, coverage in zip(
            change.home.tolist(), change.furniture.tolist(), change.coverage.tolist(), strict=True
        ):
            self._looks[home].append((memory.time, place, coverage))
        for thing in set(memory.edges["object"][change.edges[change.is_seen]].tolist()):
            home = int(memory.objects["home"][thing])
            self._sightings[thing].add(len(self._looks[home]) - 1)
            self._meet(memory, home, thing)

    def scores(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        """Return the expected number of objects asked for at each furniture node, (Q, F)."""
        scores = np.zeros((len(queries.object), memory.num_furniture))
        asked = list(zip(queries.home.tolist(), queries.object.tolist(), strict=True))
        for home, thing in asked:
            self._questions[thing].add(memory.time)
            self._meet(memory, home, thing)
        for query, (home, thing) in enumerate(asked):
            object_type = self._types.get((home, int(memory.objects["type"][thing])))
            if object_type is not None and thing in object_type.objects:
                scores[query, object_type.places] = self._answer(memory, home, object_type, thing)
        return mask_furniture(memory, queries, scores)

    def _answer(self, memory: MemoryBatch, home: int, object_type: _Type, asked: int) -> np.ndarray:
        """Return the expected number of objects of a description at the type's places, (S,)."""
        rates = self._compute_rates(memory, home, asked)
        self._advance(memory, home, object_type, object_type.unmet, rates, None)
        num_class, num_instance = self._num_draws
        share = max(1 - len(object_type.objects) * rates["sameness"], 0.0)
        log_weight = share * object_type.unmet.log_likelihood  # (C,)
        for thing, draws in object_type.objects.items():
            self._advance(memory, home, object_type, draws, rates, thing)
            if thing != asked:
                each = draws.log_likelihood.reshape(num_class, num_instance)
                most = each.max(axis=1)
                log_weight = log_weight + most + np.log(np.exp(each - most[:, None]).mean(axis=1))
        draws = object_type.objects[asked]
        weight = draws.log_likelihood + np.repeat(log_weight, num_instance)
        weight = np.exp(weight - weight.max())
        weight /= weight.sum()
        self.effective_sizes.append(float(1 / (weight**2).sum()))
        return weight @ draws.density.sum(axis=0)

    def _meet(self, memory: MemoryBatch, home: int, thing: int) -> None:
        """Begin to follow a description that is new."""
        number = int(memory.objects["type"][thing])
        if number < 0:
            return
        if (home, number) not in self._types:
            self._types[home, number] = self._make_type(memory, home, number)
        object_type = self._types[home, number]
        if thing in object_type.objects or not len(object_type.places):
            return
        num_instance = self._num_draws[1]
        key = int(memory.objects["key"][thing])
        moves = self._draw_instance_noise(self._configs[home], object_type, key)  # (C K, S)
        others = np.repeat(object_type.expected, num_instance, axis=0)
        others = others * self._inventory.sameness[number]
        density = np.stack([np.zeros_like(others), others])  # the last one seen, and others
        object_type.objects[thing] = _start(density, moves, object_type.stays_in)

    def _make_type(self, memory: MemoryBatch, home: int, number: int) -> _Type:
        """Draw class noise of an object type, and what it leads one to expect in a home."""
        num_class, config, nodes = self._num_draws[0], self._configs[home], self._nodes[home]
        weights = self._weights[number].ravel()
        columns = np.flatnonzero(weights)
        rng = np.random.default_rng([self._seed, number])
        noisy = np.zeros((num_class, len(weights)))
        noisy[:, columns] = _draw_noise(
            np.tile(weights[columns], (num_class, 1)),
            columns,
            np.repeat(self._node_room, NUM_RELATIONS),
            config,
            rng,
        )
        of_nodes = noisy.reshape(num_class, -1, NUM_RELATIONS)
        possible = (nodes >= 0) & (self._weights[number][nodes].sum(axis=1) > 0)
        places = np.flatnonzero(possible)
        place_number = np.full(len(nodes), -1)
        place_number[places] = np.arange(len(places))
        room = memory.furniture_room[home, places]
        stays_in = np.where(config.cross_room_moves, 0, room)
        class_weights = of_nodes[:, nodes[places]]  # (C, S, 2)
        total = class_weights.sum(axis=2)  # (C, S)
        factor = total / self._weights[number][nodes[places]].sum(axis=1)
        expected = self._inventory.expected[home, number, places] * factor
        whole = total.sum(axis=1, keepdims=True)
        moves = np.divide(total, whole, out=np.zeros_like(total), where=whole > 0)
        unmet = _start(expected[None].copy(), moves, stays_in)
        return _Type(places, place_number, room, stays_in, class_weights, expected, unmet)

    def _draw_instance_noise(self, config: HomeRules, object_type: _Type, key: int) -> np.ndarray:
        """Draw K times what instance noise leaves of each draw of class noise, (C K, S)."""
        num_class, num_instance = self._num_draws
        weights = np.repeat(object_type.class_weights.reshape(num_class, -1), num_instance, axis=0)
        rng = np.random.default_rng([self._seed, key])
        places, room = np.arange(weights.shape[1]), np.repeat(object_type.room, NUM_RELATIONS)
        noisy = _draw_noise(weights, places, room, config, rng)
        return noisy.reshape(len(noisy), -1, NUM_RELATIONS).sum(axis=2)

    def _compute_rates(self, memory: MemoryBatch, home: int, thing: int) -> dict[str, float]:
        """Return the rates of an object's type by name."""
        number = memory.objects["type"][[thing]]
        rates = self._inventory.compute_rates(np.array([home]), number)
        found = (*rates, self._inventory.sameness[number])
        names = ("move", "asked", "remove", "add", "sameness")
        return {name: float(rate[0]) for name, rate in zip(names, found, strict=True)}

    def _advance(
        self,
        memory: MemoryBatch,
        home: int,
        object_type: _Type,
        draws: _Draws,
        rates: dict[str, float],
        thing: int | None,
    ) -> None:
        """Carry draws on to now; `thing` is the object they are about, None for `unmet`."""
        add = rates["add"] / (rates["sameness"] if thing is None else 1)
        while True:
            looks = self._looks[home]
            while draws.num_looks < len(looks) and looks[draws.num_looks][0] == draws.time:
                _, place, coverage = looks[draws.num_looks]
                place = object_type.number[place]
                if place >= 0:
                    found = coverage * (1 - self._configs[home].detection_error)
                    is_seen = thing is not None and draws.num_looks in self._sightings[thing]
                    correct_draws(draws.density, draws.log_likelihood, place, is_seen, 1 - found)
                draws.num_looks += 1
            if draws.time == memory.time:
                return
            draws.time += 1
            is_asked = thing is not None and draws.time in self._questions[thing]
            rate = rates["asked" if is_asked else "move"]
            kept = 1 - rates["remove"]
            spread_draws(
                draws.density, draws.moves, draws.leave, kept, rate, add, object_type.stays_in
            )


def _start(density: np.ndarray, moves: np.ndarray, stays_in: np.ndarray) -> _Draws:
    """Return draws at t = 0."""
    leave = moves @ (stays_in[:, None] == stays_in) - moves
    leave[leave < 1e-9] = 0
    return _Draws(density, moves, leave, np.zeros(len(moves)))


def _draw_noise(
    weights: np.ndarray,
    places: np.ndarray,
    room: np.ndarray,
    config: HomeRules,
    rng: np.random.Generator,
) -> np.ndarray:
    """Draw noise on weights (n, k) of ascending places (k,), as homes are made; `room` (P,)."""
    uniform = rng.random((*weights.shape, 2))
    draw, column = map(np.ascontiguousarray, np.nonzero(weights))
    noisy = np.zeros(weights.shape)
    noisy[draw, column] = compute_noisy_weights(
        weights[draw, column],
        draw,
        places[column],
        uniform[draw, column],
        np.zeros(len(weights), dtype=np.int64),
        room[None],
        np.array([len(room)]),
        zero_prob=np.array([float(config.noise_zero_prob)]),
        scale=np.array([float(config.noise_scale)]),
    )
    return noisy
