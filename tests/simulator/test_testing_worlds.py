"""The public checks of homes, dynamics and sensing: what ships passes, what is broken is found."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from sgm.prior.prior_graph import PriorGraph
from simulator.testing import SmallHomes, check_dynamics, check_homes, check_sensing
from simulator.trace.record import record_homes
from simulator.trace.source import RecordedSource
from simulator.world.dynamics import DYNAMICS
from simulator.world.paper_dynamics import PaperDynamics, PaperLife
from simulator.world.sampled_homes import SampledHomes
from simulator.world.sensing import (
    SENSING,
    Confidences,
    ConstantMisses,
    MissesPerFurniture,
    MissesPerType,
    PartialViews,
)
from simulator.world.streams import Streams


def test_sampled_homes_pass():
    check_homes(SmallHomes().make)


def test_recorded_homes_pass():
    traces = record_homes(SmallHomes().make(Streams(3, "train", range(3))), 8)
    bare = [replace(trace, truth=None) for trace in traces]
    for recorded in (traces, bare):
        check_homes(RecordedSource.from_traces(recorded, PriorGraph.default()).make)


@pytest.mark.parametrize("name", DYNAMICS)
def test_dynamics_pass(name):
    check_dynamics(name)


@pytest.mark.parametrize("name", SENSING)
def test_sensing_passes(name):
    check_sensing(name)


@pytest.mark.parametrize(
    "sensing",
    [
        MissesPerType({"mug": 1.0, "book": 0.0}),
        MissesPerFurniture({"shelf": 0.9}),
        PartialViews(lowest=0.1),
        Confidences(lowest=0.0),
    ],
)
def test_sensing_with_numbers_passes(sensing):
    check_sensing(sensing)


class OutsideHomes(SampledHomes):
    def evolve(self):
        super().evolve()
        self.object_place[0, 0] = 2 * self.num_furniture


class SharedDraws(SampledHomes):
    """Draws as many numbers as the largest home needs."""

    def evolve(self):
        self.streams.rows("move who", self.num_slots)
        super().evolve()


class Unlabelled(SampledHomes):
    @property
    def labels(self):
        return super().labels[:40]


@pytest.mark.parametrize(
    ("broken", "message"),
    [
        (OutsideHomes, r"homes must have objects at their own furniture, got others in step 1"),
        (SharedDraws, r"homes must be the same whatever is beside them, got another 'object_"),
        (Unlabelled, r"homes must have object labels in labels"),
    ],
)
def test_broken_homes_are_found(broken, message):
    def make(streams):
        made = SmallHomes().make(streams)
        return broken(made.prior, made.configs, streams)

    with pytest.raises(AssertionError, match=message):
        check_homes(make)


class StuckLife(PaperLife):
    def step(self):
        self._homes.object_moved[self._members] = self._homes.is_present[self._members]


class HauntedLife(PaperLife):
    """Lets numbers of one home depend on the others."""

    def step(self):
        super().step()
        self._homes.object_place[self._members, 0] = len(self._members) % 4


@dataclass(frozen=True, slots=True)
class Stuck(PaperDynamics):
    @classmethod
    def start(cls, homes, members, rules):
        return StuckLife(homes, members)


@dataclass(frozen=True, slots=True)
class Haunted(PaperDynamics):
    @classmethod
    def start(cls, homes, members, rules):
        return HauntedLife(homes, members)


class NotAFrozenDataclass(PaperDynamics):
    def describe(self):
        return {}

    __hash__ = object.__hash__


@pytest.mark.parametrize(
    ("broken", "message"),
    [
        (Stuck(), r"object_moved must mark who is elsewhere than before"),
        (Haunted(), r"homes must be the same whatever is beside them"),
        (NotAFrozenDataclass(), r"fields must survive JSON"),
    ],
)
def test_broken_dynamics_are_found(broken, message):
    with pytest.raises(AssertionError, match=message):
        check_dynamics(broken)


@dataclass(frozen=True, slots=True)
class Boastful(Confidences):
    """Says twice as sure as it is."""

    def observe(self, homes, looking, furniture):
        seen = Confidences.observe(self, homes, looking, furniture)
        return replace(seen, seen_confidence=np.minimum(2 * seen.seen_confidence, 1))


@dataclass(frozen=True, slots=True)
class Modest(ConstantMisses):
    """Sees everything, and says that little was in view."""

    def observe(self, homes, looking, furniture):
        seen = ConstantMisses.observe(self, homes, looking, furniture)
        return replace(seen, coverage=np.full(len(looking), 0.5))


@dataclass(frozen=True, slots=True)
class Blank(ConstantMisses):
    def observe(self, homes, looking, furniture):
        seen = ConstantMisses.observe(self, homes, looking, furniture)
        return replace(seen, coverage=np.zeros(len(looking)))


@pytest.mark.parametrize(
    ("broken", "message"),
    [
        (Boastful(), r"detections must be right as often as they say"),
        (Modest(), r"looks must show no more than what is in view"),
        (Blank(), r"looks must have a coverage above 0"),
    ],
)
def test_broken_sensing_is_found(broken, message):
    with pytest.raises(AssertionError, match=message):
        check_sensing(broken)
