"""A network as a policy: one score per candidate place, the same for one home as for many."""

import numpy as np
import pytest
import torch

from datamodules.batch_builder import BatchBuilder
from datamodules.feature_config import FeatureConfig
from datamodules.more_features import compute_belief_features
from nep.paper.encoders import GCN, HAN, HEAT, HGT, MLP
from nep.paper.nep_module import NEPModule
from nep.players.policy import NEPPolicy
from simulator import HomeConfig, PriorGraph, SampledHomes, SceneGraphMemory, Sighting, Streams
from simulator.policies import make_policy
from simulator.snapshots.taken import take_snapshots
from simulator.tasks.predict_location import predict_locations
from simulator.tasks.rollout import Rollout
from simulator.testing import check_policy
from tests.candidates import list_candidates


def make_nep_policy(make_encoder) -> NEPPolicy:
    torch.manual_seed(0)  # of the encoder's weights, too, whatever ran before
    module = NEPModule(make_encoder())
    return NEPPolicy(module, BatchBuilder(FeatureConfig(), module.num_hops))


@pytest.mark.parametrize("encoder", [MLP, GCN, HEAT, HGT, HAN])
def test_scores_are_finite_exactly_at_the_candidates(encoder):
    policy = make_nep_policy(encoder)
    config = HomeConfig(furniture_per_room=4)
    homes = SampledHomes(PriorGraph.default(), config, Streams(0, "val", range(3)))
    rollout = Rollout(homes, make_policy("bayesian", homes))
    for step in predict_locations(rollout, 10):
        scores = policy.scores(rollout.memory, step.queries)
        candidates = list_candidates(rollout.memory, step.queries).any(axis=2)
        np.testing.assert_array_equal(np.isfinite(scores), candidates)


@pytest.mark.parametrize("encoder", [MLP, GCN, HEAT])
def test_the_pruned_graph_scores_like_the_full_one(encoder):
    pruned = make_nep_policy(encoder)
    full = NEPPolicy(pruned._module, BatchBuilder(FeatureConfig()))
    homes = SampledHomes(PriorGraph.default(), HomeConfig(), Streams(0, "val", range(2)))
    rollout = Rollout(homes, make_policy("bayesian", homes))
    for step in predict_locations(rollout, 8):
        scores = [policy.scores(rollout.memory, step.queries) for policy in (pruned, full)]
        np.testing.assert_allclose(*scores, rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize("encoder", [MLP, GCN])
@pytest.mark.parametrize("temporal", [False, True])
def test_what_is_left_out_of_a_snapshot_is_not_read(encoder, temporal, monkeypatch):
    torch.manual_seed(0)
    module = NEPModule(encoder())
    builder = BatchBuilder(FeatureConfig(temporal=temporal), module.num_hops)
    assert builder.reads_asked_alone == (encoder is MLP and not temporal)
    policy = NEPPolicy(module, builder)
    homes = SampledHomes(PriorGraph.default(), HomeConfig(), Streams(0, "val", range(2)))
    rollout = Rollout(homes, policy)
    assert len(list(predict_locations(rollout, 5))) == 5
    queries, scores = rollout.ask()[1], []
    for alone in (builder.reads_asked_alone, False):
        monkeypatch.setattr(BatchBuilder, "reads_asked_alone", alone)
        scores.append(policy.score_places(rollout.memory, queries))
    for one, other in zip(*scores, strict=True):
        np.testing.assert_array_equal(one, other)


def test_a_home_scores_the_same_alone_and_beside_others():
    policy = make_nep_policy(HEAT)
    scores = []
    for numbers in ([2], [0, 1, 2]):
        homes = SampledHomes(PriorGraph.default(), HomeConfig(), Streams(0, "val", numbers))
        rollout = Rollout(homes, policy)
        scores.append([step.scores[-1] for step in predict_locations(rollout, 6)])
    np.testing.assert_allclose(scores[0], scores[1], rtol=1e-4, atol=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("encoder", [MLP, GCN, HEAT, HGT, HAN])
def test_a_network_keeps_the_contract_of_policies(encoder):
    """In homes of different sizes, too."""
    check_policy(lambda homes: make_nep_policy(encoder), tolerance=1e-4)


def test_scoring_leaves_the_model_in_training_mode():
    policy = make_nep_policy(MLP)
    policy._module.train()
    homes = SampledHomes(PriorGraph.default(), HomeConfig(), Streams(0, "val", [0]))
    first, second = (
        next(predict_locations(Rollout(homes, policy), 1)).scores.shape,
        policy._module.training,
    )
    assert first == (1, 32)
    assert second


def test_what_has_played_first_can_be_trained_with_the_same_builder():
    """Scoring runs in inference mode; none of its tensors may be kept for a training step."""
    module = NEPModule(HEAT())
    builder = BatchBuilder(FeatureConfig(), module.num_hops)
    homes = SampledHomes(PriorGraph.default(), HomeConfig(), Streams(0, "val", [0]))
    rollout = Rollout(homes, NEPPolicy(module, builder))
    (step,) = predict_locations(rollout, 1)
    batch = builder.build(take_snapshots(rollout.memory, step.queries))
    module.predictor(batch).sum().backward()
    assert all(weight.grad is not None for weight in module.predictor.node_embedding.parameters())


def test_ranks_a_memory_without_any_simulator():
    memory = SceneGraphMemory()
    kitchen, attic = memory.add_room("kitchen"), memory.add_room("attic")
    counter = memory.add_furniture("counter top", room=kitchen)
    memory.add_furniture("hammock", room=attic)  # neither label is in any training data
    memory.observe(counter, [Sighting("large red mug"), Sighting("flux capacitor", "in")])
    memory.step()
    policy = make_nep_policy(HEAT)
    for description in ("large red mug", "flux capacitor", "never seen at all"):
        ranking = memory.rank(policy, description)
        assert sorted(furniture for furniture, _ in ranking) == [0, 1]
        assert np.isfinite(ranking[0][1])


def test_without_memory_looks_change_no_score():
    """HMS sees the layout and the question alone, a network with memory what was seen, too."""
    home = HomeConfig(furniture_per_room=4)
    for remembers in (False, True):
        torch.manual_seed(0)
        module = NEPModule(GCN(), transformer=False)
        policy = NEPPolicy(module, BatchBuilder(FeatureConfig(memory=remembers), module.num_hops))
        scores = []
        for looks in (0, 1):
            homes = SampledHomes(PriorGraph.default(), home, Streams(0, "val", range(2)))
            rollout = Rollout(homes, policy)
            rollout.evolve()
            for furniture in range(looks * homes.num_furniture):
                rollout.look(np.full(2, furniture))
            _, queries = rollout.ask_for(np.arange(2), np.zeros(2, dtype=int))
            scores.append(policy.scores(rollout.memory, queries))
        assert np.array_equal(*scores) != remembers


def test_a_network_that_reads_a_belief_follows_it_online(monkeypatch):
    """The columns that the network sees are those of a filter that plays beside it."""
    torch.manual_seed(0)
    module = NEPModule(MLP(units=8), reads=["belief"])
    home = HomeConfig(furniture_per_room=4)
    homes = SampledHomes(PriorGraph.default(), home, Streams(0, "val", range(2)))
    builder = BatchBuilder(FeatureConfig(belief=True), 0)
    policy = NEPPolicy(module, builder).play_in(homes)
    believer = make_policy("home_filter", homes)
    seen, build = [], builder.build
    monkeypatch.setattr(builder, "build", lambda taken: seen.append(build(taken)) or seen[-1])
    rollout = Rollout(homes, policy)
    believer.reset(rollout.memory)
    rollout.on_change = lambda change: believer.observe(rollout.memory, change)
    for step in predict_locations(rollout, 6):
        believed = believer.compute_features(rollout.memory, step.queries)
        batch = seen[-1]
        expected = compute_belief_features(believed[batch.query_snapshot, batch.query_furniture])
        found = batch.edge_feature[batch.query_edge, 9:]
        np.testing.assert_allclose(found, expected, atol=1e-6)
    assert len(seen) == 6


def test_a_network_that_reads_a_belief_needs_the_rules():
    module = NEPModule(MLP(units=8), reads=["belief"])
    policy = NEPPolicy(module, BatchBuilder(FeatureConfig(belief=True), 0))
    homes = SampledHomes(PriorGraph.default(), HomeConfig(), Streams(0, "val", [0]))
    with pytest.raises(ValueError, match="must hold belief"):
        next(predict_locations(Rollout(homes, policy), 1))


def test_a_file_that_is_no_checkpoint_is_refused(tmp_path):
    path = tmp_path / "odd.ckpt"
    torch.save({"weights": torch.zeros(3)}, path)
    with pytest.raises(ValueError, match=r"must be one that nep\.fit wrote.*odd\.ckpt"):
        NEPPolicy.load(path)
    path.write_bytes(b"not a checkpoint")
    with pytest.raises(ValueError, match=r"must be one that nep\.fit wrote.*odd\.ckpt"):
        NEPPolicy.load(path)
