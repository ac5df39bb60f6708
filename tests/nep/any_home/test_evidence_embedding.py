"""Evidence in the network: standardised, the clock hidden at times, and needed where asked for."""

import numpy as np
import pytest
import torch

from datamodules.batch_builder import BatchBuilder
from datamodules.feature_config import EVIDENCE_DIM, QUESTION_DIM, FeatureConfig
from datamodules.snapshot_loader import SnapshotDataset
from nep.any_home.any_home_module import AnyHomeModule
from nep.any_home.evidence_embedding import EvidenceEmbedding
from nep.players.policy import NEPPolicy
from sgm.evidence.columns import PLACE_COLUMNS
from sgm.evidence.evidence_features import compute_features
from simulator.collect.folder import collect
from simulator.collect.settings import CollectConfig
from simulator.policies import make_policy
from simulator.tasks.registry import TASKS
from simulator.world.config import HomeConfig
from simulator.world.source import SampledSource
from simulator.world.streams import Streams

HOME = HomeConfig(furniture_per_room=3, objects_per_furniture=4)
FEATURES = FeatureConfig(temporal=False, semantic=False, candidates="all", evidence=True)


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    folder = tmp_path_factory.mktemp("evidence")
    config = CollectConfig(
        num_homes=3, steps=12, policy="adaptive", homes=SampledSource(home=HOME), evidence=True
    )
    collect(config, folder, progress=False)
    return SnapshotDataset(folder, BatchBuilder(FEATURES, num_hops=0))


def play(policy, on_answer, homes=(0, 1, 2)):
    """Play the collection's game again."""
    state = SampledSource(home=HOME).make(Streams(0, "train", homes))
    game = TASKS["predict_location"](state, policy or make_policy("adaptive", state))
    game.on_answer = lambda answer: on_answer(game.rollout.memory, answer)
    for _ in game.run(12):
        pass


@pytest.mark.slow
def test_collected_evidence_is_what_a_live_memory_says(dataset):
    live = []
    play(None, lambda memory, answer: live.append(compute_features(memory, answer.queries)))
    found = dataset.snapshots.take(np.arange(36))
    place = np.stack([one.place for one in live], axis=1)  # (H, T, F, D)
    place = place.astype(np.float16).reshape(-1, EVIDENCE_DIM)
    np.testing.assert_array_equal(found.extras["evidence"], place)
    question = np.stack([one.question for one in live], axis=1).reshape(-1, QUESTION_DIM)
    np.testing.assert_array_equal(found.question_extras["evidence"], question)


def test_every_furniture_node_has_one_query_edge(dataset):
    graph = dataset.__getitems__(range(36))
    first = graph.furniture.start
    ends = graph.edge_dst[graph.query_edge] - first
    assert sorted(ends.tolist()) == list(range(36 * 12))
    assert graph.query_snapshot.bincount().tolist() == [12] * 36


def test_of_two_remembered_relations_the_truer_one_is_asked(dataset):
    """Both "in" and "onTop" at one place: the query edge is the one with more sightings."""
    snapshots = dataset.snapshots.take(np.arange(36))
    batch = BatchBuilder(FEATURES, num_hops=0).build(snapshots)
    own = snapshots.query_object[snapshots.objects["snapshot"][snapshots.edges["object"]]]
    own = np.flatnonzero(own == snapshots.edges["object"])
    num_true = np.full((len(snapshots.furniture["label"]), 2), -1)
    sightings = snapshots.edges["num_true"][own]
    num_true[snapshots.edges["furniture"][own], snapshots.edges["relation"][own]] = sightings
    row = snapshots.find_first("furniture")[batch.query_snapshot] + batch.query_furniture.numpy()
    is_seen = num_true[row].max(axis=1) >= 0
    best = num_true[row].argmax(axis=1)
    assert is_seen.any()
    np.testing.assert_array_equal(batch.query_relation[is_seen], best[is_seen])


def test_groups_that_are_off_are_zero(dataset):
    snapshots = dataset.snapshots.take(np.arange(36))
    config = FeatureConfig(evidence=True, evidence_without=("filters", "trust"))
    batch = BatchBuilder(config).build(snapshots)
    place, question = batch.evidence.numpy(), batch.question.numpy()
    is_off = np.array([name.startswith("filters.") for name in PLACE_COLUMNS])
    assert not place[:, is_off].any()
    assert place[:, ~is_off].any()
    assert question.any()
    with pytest.raises(ValueError, match=r"evidence_without must hold some of .* got 'filter'"):
        FeatureConfig(evidence_without=("filter",))


def test_evidence_is_asked_for_by_name(dataset):
    snapshots = dataset.snapshots.take(np.arange(2))
    snapshots.extras.pop("evidence")
    with pytest.raises(ValueError, match=r"must hold evidence .* got none. Collect with `--evid"):
        BatchBuilder(FEATURES).build(snapshots)


def make_graph(dataset, batch=range(36)):
    return dataset.__getitems__(list(batch))


def embed(embedding, graph):
    return embedding(graph.evidence, graph.question, graph.node_snapshot[graph.furniture])[0]


def test_a_batch_without_evidence_is_refused(random_batch):
    with pytest.raises(ValueError, match=r"batch must hold evidence .* got none"):
        AnyHomeModule(8)(random_batch(0))


def test_columns_are_standardised_by_what_training_showed(dataset):
    graph = make_graph(dataset)
    embedding = EvidenceEmbedding(8, 1, clock_dropout=0.0)
    embed(embedding, graph)
    embedding.eval()
    scaled = embedding.place_scale(graph.evidence)
    varies = graph.evidence.var(dim=0) > 0.01
    assert scaled[:, varies].mean(dim=0).abs().max() < 1e-3
    assert (scaled[:, varies].var(dim=0) - 1).abs().max() < 0.06  # the least variance is added


def test_hidden_clocks_are_homes_without_one(dataset):
    """These homes have no clock: to hide it changes nothing."""
    graph = make_graph(dataset)
    torch.manual_seed(0)
    always = EvidenceEmbedding(8, 1, clock_dropout=1.0)
    never = EvidenceEmbedding(8, 1, clock_dropout=0.0)
    never.load_state_dict(always.state_dict())
    torch.testing.assert_close(embed(always, graph), embed(never, graph))


def test_a_network_plays_as_it_scores_what_was_collected(dataset):
    torch.manual_seed(0)
    module = AnyHomeModule(16, members=1).eval()
    policy = NEPPolicy(module, BatchBuilder(FEATURES, num_hops=0))
    scores = []
    play(None, lambda memory, answer: scores.append(policy.scores(memory, answer.queries)))
    with torch.no_grad():
        graph = make_graph(dataset)
        logits = module(graph)
    place = graph.edge_dst[graph.query_edge] - graph.furniture.start
    stored = torch.zeros(36 * 12).index_copy_(0, place, logits)
    found = np.stack(scores, axis=1).reshape(-1)
    np.testing.assert_allclose(found, stored.numpy(), atol=2e-3)  # float16 on disk


@pytest.mark.slow
def test_it_learns_which_place_is_true(dataset):
    torch.manual_seed(0)
    module = AnyHomeModule(16, members=1)
    torch.nn.init.zeros_(module.predictor.evidence_embedding.shortcut.weight)
    graph = make_graph(dataset)
    optimizer = torch.optim.Adam(module.parameters(), lr=1e-2)
    losses = []
    for _ in range(150):
        loss = module.compute_loss(graph)[0]
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        losses.append(loss.item())
    assert losses[0] > 2
    assert losses[-1] < 0.3


def test_an_untrained_network_answers_what_the_filter_believes(dataset):
    torch.manual_seed(0)
    module = AnyHomeModule(16, members=1).eval()
    torch.nn.init.zeros_(module.predictor.head[-1].weight)
    graph = make_graph(dataset)
    with torch.no_grad():
        logits = module(graph)
    place = graph.edge_dst[graph.query_edge] - graph.furniture.start
    belief = graph.evidence[:, PLACE_COLUMNS.index("filters.log_belief_asked")]
    torch.testing.assert_close(logits, belief[place])
