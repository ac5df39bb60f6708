"""A robot in a recorded home, while things are moved there, and what finders say meanwhile."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import timedelta
from functools import partial
from typing import Any, ClassVar

import numpy as np

from nep.games.game import Game
from nep.players.contestants import Checkpoint
from nep.robot.finder import ObjectFinder
from sgm.finder.finder import Finder
from sgm.memory.clock import Clock
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.policies import Adaptive, Bayesian, LastSeenUnlessAbsentPrior
from simulator.trace.events import GONE
from simulator.trace.trace import Trace

NUM_BINS = 10  # of probabilities, all as wide
POOLS = {
    "seen": "anything that it has seen",
    "in use": "what was moved within ten minutes",
    "marked": "the same, with `in_use=True`",
    "moved": "of both, what had moved since it was seen",
}
_IN_USE = 600.0  # seconds
_LEAST = 1e-6  # of a probability
_NUM_FIRST = 3  # places of a ranking among which the right one is looked for


@dataclass(frozen=True, slots=True)
class MinuteQuestion:
    """A question at some minute; the memory is to be read before time goes on.

    Attributes:
        memory: what the robot knows.
        description: what is asked for; it was seen before.
        places: furniture ids where such a thing is, one at least.
        pools: which of `POOLS` it belongs to.
    """

    memory: SceneGraphMemory
    description: str
    places: frozenset[int]
    pools: tuple[str, ...]


@dataclass(frozen=True)
class KitchenGame(Game):
    """A recorded home in which a robot looks around and finders are asked.

    Attributes:
        trace: the home.
        step_seconds: length of a step.
        looks: at random places in each step.
        miss_rate: share of what is there that a look does not show.
        rest_minutes: where nothing is moved for longer, the robot rests until it is.
        seeds: of looks, misses and questions; the home is lived in once for each.
    """

    trace: Trace
    step_seconds: float
    looks: int
    miss_rate: float
    rest_minutes: float
    seeds: tuple[int, ...]

    plays_together: ClassVar[bool] = True
    scored_by: ClassVar[tuple[str, ...]] = ("tools.kitchens.robot",)

    def describe(self) -> dict[str, Any]:
        """Return everything that scores depend on but the player, as JSON values."""
        return {
            "trace": self.trace.checksum,
            "step_seconds": self.step_seconds,
            "looks": self.looks,
            "miss_rate": self.miss_rate,
            "rest_minutes": self.rest_minutes,
            "seeds": list(self.seeds),
        }

    def tell(self) -> dict[str, Any]:
        """Return title, unit and what is played."""
        title = f"{self.trace.name}, asked by the minute"
        return {"title": title, "units": [self.trace.name], "asks": "robot"}

    def list_players(self, checkpoints: Sequence[Checkpoint]) -> dict[str, Callable[[], Finder]]:
        """List what makes each finder: rules, and networks."""
        players: dict[str, Callable[[], Finder]] = {
            "bayesian": lambda: Finder(Bayesian()),
            "last_seen_prior": lambda: Finder(LastSeenUnlessAbsentPrior()),
            "adaptive": lambda: Finder(Adaptive()),
        }
        for point in checkpoints:
            players[point.name] = partial(ObjectFinder.load, point.path)
        return players

    def play(self, players: Mapping[str, Callable[[], Finder]]) -> dict[str, Any]:
        """Let a robot live there once for each seed, and ask all finders the same."""
        finders = {name: make() for name, make in players.items()}
        scores = {name: {pool: make_sums() for pool in POOLS} for name in finders}
        for seed in self.seeds:
            for question in self.ask(seed):
                for name, finder in finders.items():
                    add_answer(scores[name], finder, question)
        return scores

    def list_times(self) -> list[float]:
        """List when the robot is there, in seconds: in steps from the first move of a session.

        A session ends where nothing is moved for longer than `rest_minutes`.
        """
        events = np.array(sorted({event.time_s for event in self.trace.events}))
        rests = np.flatnonzero(np.diff(events) > 60 * self.rest_minutes)
        starts, ends = np.append(0, rests + 1), np.append(rests, len(events) - 1)
        times: list[float] = []
        for start, end in zip(events[starts], events[ends], strict=True):
            times += np.arange(start + self.step_seconds, end, self.step_seconds).tolist()
        return times

    def ask(self, seed: int) -> Iterator[MinuteQuestion]:
        """Let a robot live there, and yield two questions a step: of all, and of what is in use.

        Both are about things that are there and that it has seen by their description. A memory is
        that of the step after its looks.
        """
        trace, rng = self.trace, np.random.default_rng(seed)
        memory, furniture = _make_memory(trace, self.step_seconds)
        descriptions = {event.object: event.description for event in trace.events}
        events = list(trace.events)
        place_of: dict[str, int] = {}
        moved: dict[str, float] = {}
        last_seen: dict[str, int] = {}  # by description
        done = 0
        for time in self.list_times():
            while done < len(events) and events[done].time_s <= time:
                event = events[done]
                place_of[event.object], moved[event.object] = event.furniture, event.time_s
                done += 1
            _pass_time(memory, trace, time, self.step_seconds)
            for place in rng.permutation(len(furniture))[: self.looks].tolist():
                present = [thing for thing, where in place_of.items() if where == place]
                seen = {descriptions[thing] for thing in present if rng.random() >= self.miss_rate}
                sightings = [Sighting(name) for name in sorted(seen)]
                memory.observe(furniture[place], seen=sightings)
                last_seen |= dict.fromkeys(seen, place)
            known = [
                thing
                for thing, where in place_of.items()
                if where != GONE and descriptions[thing] in last_seen
            ]
            in_use = [thing for thing in known if time - moved[thing] < _IN_USE]
            for pools, things in ((("seen",), known), (("in use", "marked"), in_use)):
                if not things:
                    continue
                name = descriptions[things[int(rng.integers(len(things)))]]
                places = {
                    where
                    for thing, where in place_of.items()
                    if where != GONE and descriptions[thing] == name
                }
                has_moved = last_seen[name] not in places
                yield MinuteQuestion(
                    memory,
                    name,
                    frozenset(furniture[place] for place in places),
                    (*pools, "moved") if has_moved else pools,
                )


def _make_memory(trace: Trace, step_seconds: float) -> tuple[SceneGraphMemory, list[int]]:
    """Return an empty memory of the layout, and the id of each furniture node."""
    clock = None if trace.start is None else Clock(trace.start, step_seconds)
    memory = SceneGraphMemory(clock=clock)
    rooms = [memory.add_room(label) for label in trace.layout.room_labels]
    furniture = [
        memory.add_furniture(node.label, room=rooms[node.room], description=node.name)
        for node in trace.layout.furniture.values()
    ]
    return memory, furniture


def _pass_time(memory: SceneGraphMemory, trace: Trace, time: float, step_seconds: float) -> None:
    if trace.start is not None:
        memory.step_to(trace.start + timedelta(seconds=time), accept_jump=True)
        return
    num_steps = int(time // step_seconds) - memory.time
    if num_steps > 0:
        memory.step(num_steps)


def make_sums() -> dict[str, Any]:
    """Return sums over no question; "bins" of confidences: number, sum, right, (3, NUM_BINS)."""
    names = ("number", "first", "among_first", "nll", "confidence")
    return {**dict.fromkeys(names, 0.0), "bins": np.zeros((3, NUM_BINS)).tolist()}


def add_answer(
    sums: Mapping[str, dict[str, Any]], finder: Finder, question: MinuteQuestion
) -> None:
    """Ask a finder, and add what it says to the sums of the question's pools."""
    for pool in question.pools:
        ranking = finder.rank(question.memory, question.description, in_use=pool == "marked")
        places = ranking.places
        right = sum(place.probability for place in places if place.furniture in question.places)
        is_right = [place.furniture in question.places for place in places[:_NUM_FIRST]]
        confidence = places[0].probability
        number = min(int(confidence * NUM_BINS), NUM_BINS - 1)
        pool_sums = sums[pool]
        pool_sums["number"] += 1
        pool_sums["first"] += is_right[0]
        pool_sums["among_first"] += any(is_right)
        pool_sums["nll"] -= float(np.log(max(right, _LEAST)))
        pool_sums["confidence"] += confidence
        for counts, value in zip(pool_sums["bins"], (1, confidence, is_right[0]), strict=True):
            counts[number] += value


def compute_calibration_error(bins: Sequence[Sequence[float]]) -> float:
    """Return by how much confidence differs from how often it was right, nan of nothing."""
    number, confidence, right = np.array(bins)
    total = number.sum()
    return float(np.abs(confidence - right).sum() / total) if total else float("nan")
