"""Snapshots of tasks with several queries or looks a step equal the live memories."""

import dataclasses

import numpy as np
import pytest
import torch

from datamodules.batch_builder import BatchBuilder
from datamodules.feature_config import FeatureConfig
from datamodules.snapshot_loader import SnapshotDataset
from sgm.schema import QUERY_EDGE_TYPES
from simulator.collect.folder import collect
from simulator.collect.settings import CollectConfig
from simulator.policies import make_policy
from simulator.snapshots.taken import take_snapshots
from simulator.tasks.registry import TASKS
from simulator.world.config import HomeConfig
from simulator.world.source import SampledSource
from simulator.world.streams import Streams
from tests.snapshot_columns import assert_equal_snapshots


@pytest.mark.parametrize("task", ["relative_likelihood", "find_object"])
def test_snapshots_on_disk_equal_the_live_memories(task, tmp_path):
    home = HomeConfig(furniture_per_room=3, objects_per_furniture=4)
    config = CollectConfig(num_homes=3, steps=8, task=task, homes=SampledSource(home=home))
    collect(config, tmp_path, progress=False)
    dataset = SnapshotDataset(tmp_path, BatchBuilder(FeatureConfig()))
    homes = config.homes.make(Streams(0, "train", range(3)))
    game = TASKS[task](homes, make_policy(config.policy, homes))
    live, home_rows = [], []

    def keep(answered):
        live.append((take_snapshots(game.rollout.memory, answered.queries), answered.answers))
        home_rows.append(answered.queries.home)

    game.on_answer = keep
    for _ in game.run(config.steps):
        pass
    total = np.bincount(np.concatenate(home_rows), minlength=3)
    assert len(dataset) == total.sum()
    number = np.cumsum(total) - total  # of each home's next snapshot in the dataset
    for (snapshots, answers), part_home in zip(live, home_rows, strict=True):
        indices = np.empty(len(part_home), dtype=np.int64)
        for position, own in enumerate(part_home):
            indices[position] = number[own]
            number[own] += 1
        read = dataset.snapshots.take(indices)
        assert_equal_snapshots(read, dataclasses.replace(snapshots, answers=answers.ravel()))
    targets = [dataset.__getitems__([0, 1, 2]).to_pyg()[etype] for etype in QUERY_EDGE_TYPES]
    known = torch.cat([data["target"][data["query"] >= 0] for data in targets])
    assert set(known.tolist()) == {0.0, 1.0}
