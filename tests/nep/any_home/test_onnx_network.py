"""Networks as ONNX: torch's answers, in any batch and order, without torch."""

from dataclasses import asdict

import numpy as np
import pytest
import torch

from datamodules.batch_builder import BatchBuilder
from datamodules.feature_config import FeatureConfig
from nep.any_home.any_home_module import AnyHomeModule
from nep.any_home.onnx_export import is_exportable
from nep.paper.encoders import HEAT
from nep.paper.nep_module import NEPModule
from nep.players.checkpoints import TrainedModel, save_exported
from nep.players.contestants import load_player
from nep.players.policy import NEPPolicy
from sgm.network.network import INPUTS, ONNX, Network
from sgm.network.policy import NetworkPolicy
from sgm.network.shipped import PRETRAINED
from sgm.policies.policy import Policy, compute_probabilities
from simulator.tasks.evaluation import play_task
from simulator.testing import check_policy
from simulator.world.config import HomeConfig
from simulator.world.mixture.paper_homes import PaperSizesSource
from simulator.world.source import SampledSource
from simulator.world.streams import Streams

FEATURES = FeatureConfig(temporal=False, semantic=False, candidates="all", evidence=True)
SMALL = SampledSource(home=HomeConfig(furniture_per_room=4, objects_per_furniture=3))
DECIMALS = 6


def make_model(features=FEATURES, **sizes) -> TrainedModel:
    """A network with weights, means and variances drawn at random."""
    torch.manual_seed(0)
    module = AnyHomeModule(**sizes).eval()
    for name, buffer in module.predictor.named_buffers():
        if name.endswith("running_mean"):
            buffer.normal_()
        if name.endswith("running_var"):
            buffer.uniform_(0.5, 2)
    return TrainedModel(module, BatchBuilder(features, module.num_hops))


class Both(Policy):
    """Asks two networks the same questions, follows the first and keeps what both say."""

    score_kind = "logits"

    def __init__(self, one, other):
        self.players, self.said = (one, other), []

    def reset(self, memory):
        for player in self.players:
            player.reset(memory)

    def observe(self, memory, change):
        for player in self.players:
            player.observe(memory, change)

    def scores(self, memory, queries):
        self.said.append([player.ask_anew(memory, queries) for player in self.players])
        return self.said[-1][0][:, :-1]


def check_equal(one, other, source, num_homes=4, num_steps=5, task="predict_location"):
    """Both say the same of every question of a task: probabilities to 1e-6, the same best place."""
    both = Both(one, other)
    play_task(
        lambda _: both, source.make(Streams(3, "test", range(num_homes))), num_steps, task=task
    )
    for scores in both.said:
        assert np.array_equal(*map(np.isfinite, scores))
        probabilities = [compute_probabilities(own, "logits") for own in scores]
        np.testing.assert_allclose(*probabilities, rtol=0, atol=1e-6)
        best = [own == own.max(axis=1, keepdims=True) for own in scores]
        assert np.array_equal(*best)
    assert sum(len(scores[0]) for scores in both.said) >= num_homes * num_steps


@pytest.mark.slow
@pytest.mark.parametrize("task", ["predict_location", "find_object"])
@pytest.mark.parametrize("source", [SMALL, PaperSizesSource()], ids=["alike", "of many sizes"])
def test_the_shipped_network_answers_as_in_torch(source, task):
    check_equal(NEPPolicy.load("any_home"), load_player("any_home"), source, task=task)


@pytest.mark.parametrize(
    ("sizes", "features"),
    [
        ({"num_rounds": 1, "members": 2}, FEATURES),
        ({"num_rounds": 3, "members": 1}, FEATURES),
        (
            {"members": 1},
            FeatureConfig(
                temporal=False,
                semantic=False,
                prior=False,
                candidates="all",
                evidence=True,
                evidence_without=("hours", "hour", "others"),
            ),
        ),
    ],
    ids=["ensemble", "single", "without some features"],
)
def test_networks_of_every_shape_answer_as_in_torch(sizes, features, tmp_path):
    model = make_model(features, units=16, **sizes)
    save_exported(tmp_path, model, {})
    check_equal(NEPPolicy(model.module, model.builder), NetworkPolicy.load(tmp_path), SMALL)


def test_a_network_reads_which_questions_they_are(tmp_path):
    model = make_model(units=16, num_rounds=1, members=1)
    save_exported(tmp_path, model, {})
    alone = NetworkPolicy.load(tmp_path)
    for policy in (NEPPolicy(model.module, model.builder), alone):
        check_equal(policy.for_questions(0.0), alone.for_questions(0.0), SMALL, num_steps=3)
    both = Both(alone.for_questions(0.0), alone)
    play_task(lambda _: both, SMALL.make(Streams(3, "test", range(4))), 3)
    assert not np.array_equal(*both.said[0])


def test_what_reads_more_than_a_robot_has_is_not_exported(tmp_path):
    (tmp_path / ONNX).write_bytes(b"of another network")
    model = make_model(FeatureConfig(**{**asdict(FEATURES), "candidates": "prior"}), units=8)
    assert not is_exportable(model.module, model.builder.config)
    save_exported(tmp_path, model, {})
    assert not (tmp_path / ONNX).exists()
    assert isinstance(load_player(tmp_path), NEPPolicy)


def test_the_papers_network_is_not_exported():
    assert not is_exportable(NEPModule(HEAT()), FeatureConfig())


# The laws of the network as it ships, on evidence of random numbers.


@pytest.fixture(scope="module")
def network() -> Network:
    return Network.load(PRETRAINED / "any_home")


def sample_questions(num_questions, num_places, seed=0):
    """Questions to homes of 1 to `num_places` places."""
    rng = np.random.default_rng(seed)
    shape = {"questions": num_questions, "places": num_places}
    place, question, _, _ = (
        rng.normal(size=[shape.get(axis, axis) for axis in axes]).astype(np.float32)
        for axes in INPUTS.values()
    )
    edge = np.stack([rng.random(place.shape[:2]), rng.integers(0, 2, place.shape[:2])], axis=2)
    is_place = np.arange(num_places) < rng.integers(1, num_places + 1, (num_questions, 1))
    return place, question[:, 0], edge.astype(np.float32), is_place


def answer(network, questions):
    """Logits as a policy rounds them, -inf where there is no place; the last of elsewhere."""
    is_answer = np.pad(questions[3], ((0, 0), (0, 1)), constant_values=True)
    return np.where(is_answer, network.compute_logits(*questions).round(DECIMALS), -np.inf)


@pytest.mark.slow
@pytest.mark.parametrize("num_places", [1, 7, 32, 60])
def test_a_question_is_answered_alike_whoever_shares_the_batch(network, num_places):
    questions = sample_questions(333, num_places)
    together = answer(network, questions)
    for size in (1, 2, 3, 5, 8, 13, 31, 32, 33, 64, 100, 200):
        for first in (0, 7, 40):
            rows = slice(first, first + size)
            alone = answer(network, [part[rows] for part in questions])
            assert np.array_equal(alone, together[rows])


def test_threads_change_nothing(network):
    questions = sample_questions(100, 32)
    with_two = Network.load(PRETRAINED / "any_home", threads=2)
    assert np.array_equal(network.compute_logits(*questions), with_two.compute_logits(*questions))


@pytest.mark.parametrize("width", [33, 47, 64])
def test_columns_of_no_place_change_nothing(network, width):
    place, question, edge, is_place = sample_questions(40, 32)
    rng = np.random.default_rng(1)

    def widen(values):
        rest = rng.normal(size=(40, width - 32, values.shape[2]))
        return np.concatenate([values, rest.astype(np.float32)], axis=1)

    wide = np.pad(is_place, ((0, 0), (0, width - 32)))
    found = answer(network, (widen(place), question, widen(edge), wide))
    expected = answer(network, (place, question, edge, is_place))
    assert np.array_equal(np.delete(found, range(32, width), axis=1), expected)


def test_the_order_of_places_is_of_no_account(network):
    place, question, edge, is_place = sample_questions(40, 32)
    order = np.random.default_rng(1).permutation(32)
    found = answer(network, (place[:, order], question, edge[:, order], is_place[:, order]))
    expected = answer(network, (place, question, edge, is_place))
    assert np.array_equal(found, expected[:, [*order, 32]])


def test_every_input_counts(network):
    questions = sample_questions(5, 8)
    answers = answer(network, questions)
    for number, part in enumerate(questions[:3]):
        changed = [*questions]
        changed[number] = part + np.float32(0.5)
        found = answer(network, changed)
        assert (found != answers).any(axis=1).all()


@pytest.mark.slow
def test_the_shipped_network_keeps_the_contract_of_policies():
    check_policy(lambda homes: load_player("any_home").play_in(homes), tolerance=0)
