"""What a network answers does not depend on the homes beside it, nor on threads."""

import numpy as np
import pytest
import torch

from datamodules.batch_builder import BatchBuilder
from datamodules.feature_config import FeatureConfig
from nep.paper.encoders import GCN, HAN, HEAT, HGT, MLP
from nep.paper.nep_module import NEPModule
from nep.players.policy import NEPPolicy
from sgm.policies.policy import Policy
from simulator.tasks.evaluation import play_task
from simulator.tasks.rollout import make_memory
from simulator.world.config import HomeConfig
from simulator.world.source import SampledSource
from simulator.world.streams import Streams

NUM_HOMES, NUM_STEPS = 4, 5
SOURCE = SampledSource(home=HomeConfig(furniture_per_room=4, objects_per_furniture=3))


class Heard(Policy):
    """Writes down what a network says, home by home."""

    score_kind = "logits"

    def __init__(self, network, first):
        self.network, self.first, self.said = network, first, {}

    def reset(self, memory):
        self.network.reset(memory)

    def observe(self, memory, change):
        self.network.observe(memory, change)

    def scores(self, memory, queries):
        scores = self.network.scores(memory, queries)
        for home, row in zip(queries.home.tolist(), scores.tolist(), strict=True):
            self.said.setdefault(self.first + home, []).append(row)
        return scores


def play(network, task, sizes):
    """Play in groups of homes: the scores of every home, and what it was told."""
    said, values, first = {}, [], 0
    for size in sizes:
        homes = SOURCE.make(Streams(3, "test", range(first, first + size)))
        heard = Heard(network.play_in(homes), first)
        values.append(play_task(lambda _, heard=heard: heard, homes, NUM_STEPS, task=task).values)
        said |= heard.said
        first += size
    return np.concatenate(values), said


def make(encoder):
    torch.manual_seed(0)
    module = NEPModule(encoder)
    return NEPPolicy(module, BatchBuilder(FeatureConfig(), module.num_hops))


NETWORKS = {
    "heat": lambda: NEPPolicy.load("heat"),
    "any_home": lambda: NEPPolicy.load("any_home"),
    "two hops": lambda: make(HEAT(heads=2, num_convolutions=2, residual=True)),
    "mlp": lambda: make(MLP()),
    "gcn": lambda: make(GCN()),
    "han": lambda: make(HAN()),
    "hgt": lambda: make(HGT()),
}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "task"),
    [
        *((name, "find_object") for name in NETWORKS),
        ("heat", "predict_location"),
        ("any_home", "relative_likelihood"),
    ],
)
def test_a_home_is_told_the_same_whoever_shares_the_batch(name, task):
    network = NETWORKS[name]()
    values, said = play(network, task, [NUM_HOMES])
    for sizes in ([1] * NUM_HOMES, [3, 1]):
        others, heard = play(network, task, sizes)
        assert np.array_equal(others, values)
        assert heard == said  # to the last bit


@pytest.mark.slow
def test_threads_change_nothing():
    network, before = NEPPolicy.load("heat"), torch.get_num_threads()
    found = []
    try:
        for threads in (1, 2, 4):
            torch.set_num_threads(threads)
            found.append(play(network, "find_object", [NUM_HOMES])[1])
    finally:
        torch.set_num_threads(before)
    assert found[0] == found[1] == found[2]


def test_places_that_nothing_tells_apart_are_tied():
    """Rounding noise must not choose between them: the task breaks ties at random."""
    _, said = play(NEPPolicy.load("heat"), "predict_location", [NUM_HOMES])
    rows = [np.array([score for score in row if np.isfinite(score)]) for row in said[0]]
    gaps = np.concatenate([np.diff(np.sort(row)) for row in rows])
    assert (gaps == 0).any()
    assert (gaps[gaps > 0] > 1e-6).all()


def test_a_network_plays_in_float64():
    network = NETWORKS["gcn"]()
    play(network, "predict_location", [1])
    assert next(network._take_predictor().parameters()).dtype == torch.float64


def test_the_weights_are_those_of_the_last_reset():
    """A training goes on between two evaluations, and its network stays as it is."""
    network = make(GCN())
    homes = SOURCE.make(Streams(3, "test", [0]))
    heard = Heard(network, 0)
    play_task(lambda _: heard, homes, 1)
    module = network._module
    assert module.training  # a policy leaves the mode alone
    with torch.no_grad():
        for parameter in module.parameters():
            parameter.mul_(2)
    again = Heard(network, 0)
    play_task(lambda _: again, SOURCE.make(Streams(3, "test", [0])), 1)
    assert again.said != heard.said
    assert all(parameter.dtype == torch.float32 for parameter in module.parameters())


@pytest.mark.parametrize("name", ["gcn", "hgt"])
def test_a_reset_takes_present_weights_and_makes_no_new_copy(name):
    """A robot resets with every question that follows a look."""
    network = NETWORKS[name]()
    memory = make_memory(SOURCE.make(Streams(3, "test", [0])))
    kept = network._take_predictor()
    before = [values.clone() for values in kept.parameters()]
    present = list(network._module.predictor.parameters())
    with torch.no_grad():
        for parameter in present:
            parameter.add_(1)
    assert network._take_predictor() is kept
    assert all(map(torch.equal, kept.parameters(), before))
    network.reset(memory)
    assert network._take_predictor() is kept
    for copied, parameter in zip(kept.parameters(), present, strict=True):
        assert torch.equal(copied, parameter.to(copied.dtype))
