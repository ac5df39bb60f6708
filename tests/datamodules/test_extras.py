"""Extras of snapshots, a filter's belief and the relevance of places, read back on query edges."""

import dataclasses

import numpy as np
import pytest

from datamodules.batch_builder import BatchBuilder
from datamodules.feature_config import FeatureConfig
from datamodules.more_features import compute_belief_features
from datamodules.snapshot_loader import SnapshotDataset
from sgm.schema import EDGE_TYPES, QUERY_EDGE_TYPES
from simulator.collect.folder import collect
from simulator.collect.settings import CollectConfig
from simulator.policies import make_policy
from simulator.snapshots.taken import take_snapshots
from simulator.tasks.registry import TASKS
from simulator.world.config import HomeConfig
from simulator.world.source import SampledSource
from simulator.world.streams import Streams
from tests.snapshot_columns import assert_equal_snapshots

HOUSE = HomeConfig(furniture_per_room=3, objects_per_furniture=4)


def test_features_by_hand():
    """Others at most 1; 1 + log10(sum) / 4 with the sum in [1e-4, 1]: 0.01 -> 0.5."""
    belief = np.array([[0.006, 0.004, 0.5, 0.75], [0.5, 3.0, 1.0, 0.3], [0.0, 0.0, 0.02, 1.0]])
    expected = [[0.006, 0.004, 0.5, 0.5, 0.75], [0.5, 1, 1, 1, 0.3], [0, 0, 0, 0.02, 1]]
    np.testing.assert_allclose(compute_belief_features(belief), expected, atol=1e-7)


@pytest.mark.parametrize("policy", ["bayesian", "home_filter"])
@pytest.mark.parametrize("task", ["predict_location", "relative_likelihood", "find_object"])
def test_a_collected_belief_is_what_a_live_filter_believes(task, policy, tmp_path):
    config = CollectConfig(
        num_homes=2, steps=6, task=task, policy=policy, homes=SampledSource(home=HOUSE), belief=True
    )
    collect(config, tmp_path, progress=False)
    dataset = SnapshotDataset(tmp_path, BatchBuilder(FeatureConfig(belief=True)))
    homes = SampledSource(home=HOUSE).make(Streams(0, "train", range(2)))
    game = TASKS[task](homes, make_policy(policy, homes))
    filters = make_policy("home_filter", homes)
    filters.reset(game.rollout.memory)
    game.rollout.on_change = lambda change: filters.observe(game.rollout.memory, change)
    live, home = [], []

    def keep(answered):
        live.append(filters.compute_features(game.rollout.memory, answered.queries))
        home.append(answered.queries.home)

    game.on_answer = keep
    for _ in game.run(config.steps):
        pass
    order = np.argsort(np.concatenate(home), kind="stable")
    found = dataset.snapshots.take(np.arange(len(dataset))).extras["belief"]
    np.testing.assert_array_equal(found, np.concatenate(live)[order].reshape(-1, 4))


def test_a_collection_without_belief_is_what_it_was(tmp_path):
    """Same bytes of every other column, and a clear error where a model asks for the belief."""
    for name, belief in (("with", True), ("without", False)):
        config = CollectConfig(num_homes=1, steps=5, homes=SampledSource(home=HOUSE), belief=belief)
        collect(config, tmp_path / name, progress=False)
    with_belief, without = (
        SnapshotDataset(tmp_path / name, BatchBuilder(FeatureConfig())).snapshots.take(np.arange(5))
        for name in ("with", "without")
    )
    assert (list(with_belief.extras), list(without.extras)) == (["belief"], [])
    assert_equal_snapshots(dataclasses.replace(with_belief, extras={}), without)
    builder = BatchBuilder(FeatureConfig(belief=True))
    with pytest.raises(ValueError, match=r"must hold belief .* got none. .*`--belief true`"):
        builder.build(without)


def test_belief_stands_on_its_query_edge_alone():
    homes = SampledSource(home=HOUSE).make(Streams(0, "val", range(3)))
    game = TASKS["predict_location"](homes, make_policy("bayesian", homes))
    batches = []

    def keep(answered):
        queries = answered.queries
        belief = np.zeros((len(queries.home), 12, 4), dtype=np.float32)
        # the same number at no two places: query q, furniture f -> (12 q + f + 1) / 100
        belief[..., 3] = np.arange(1, 12 * len(belief) + 1).reshape(-1, 12) / 100
        snapshots = take_snapshots(game.rollout.memory, queries, extras={"belief": belief})
        batches.append(BatchBuilder(FeatureConfig(belief=True), 1).build(snapshots))

    game.on_answer = keep
    for _ in game.run(5):
        pass
    for batch in batches:
        for etype in EDGE_TYPES:
            data = batch.to_pyg()[etype]
            assert data["feature"].shape[1] == 14
            if etype not in QUERY_EDGE_TYPES:
                assert not data["feature"][:, 9:].any()
                continue
            query, furniture = data["query"], batch.to_pyg()[etype].edge_index[1]
            local = batch.to_pyg()["furniture"]["index"][furniture]
            expected = (12 * query + local + 1).where(query >= 0, 0) / 100
            np.testing.assert_allclose(data["feature"][:, 13], expected, atol=1e-6)


def test_relevance_is_the_true_rows_of_t(tmp_path):
    """Collected, read back and put on the query edges: the row of T of the object asked for."""
    config = CollectConfig(
        num_homes=2,
        steps=4,
        task="relative_likelihood",
        homes=SampledSource(home=HOUSE),
        relevance=True,
    )
    collect(config, tmp_path, progress=False)
    dataset = SnapshotDataset(tmp_path, BatchBuilder(FeatureConfig(), 0))
    homes = SampledSource(home=HOUSE).make(Streams(0, "train", range(2)))
    game = TASKS["relative_likelihood"](homes, make_policy("bayesian", homes))
    rows, home = [], []

    def keep(answered):
        codes = game.rollout.memory.objects["key"][answered.queries.object]
        row = homes.transition_rows(answered.queries.home, codes)
        rows.append(row.reshape(len(row), -1, 2).sum(axis=2))
        home.append(answered.queries.home)

    game.on_answer = keep
    for _ in game.run(config.steps):
        pass
    order = np.argsort(np.concatenate(home), kind="stable")
    expected = np.concatenate(rows)[order]
    indices = np.arange(len(dataset))
    found = dataset.snapshots.take(indices).extras["relevance"]
    np.testing.assert_allclose(found, expected.ravel(), rtol=1e-6)
    graph = dataset.__getitems__(indices.tolist()).to_pyg()
    for etype in QUERY_EDGE_TYPES:
        data, furniture = graph[etype], graph[etype].edge_index[1]
        local = graph["furniture"]["index"][furniture]
        np.testing.assert_allclose(
            data["relevance"], expected[data["query"].numpy(), local.numpy()], rtol=1e-6
        )


def test_a_task_without_relevance_has_none(tmp_path):
    config = CollectConfig(num_homes=1, steps=3, homes=SampledSource(home=HOUSE), relevance=True)
    collect(config, tmp_path, progress=False)
    dataset = SnapshotDataset(tmp_path, BatchBuilder(FeatureConfig()))
    assert not dataset.snapshots.take(np.arange(3)).extras
    assert "relevance" not in dataset[0].to_pyg()[QUERY_EDGE_TYPES[0]]
