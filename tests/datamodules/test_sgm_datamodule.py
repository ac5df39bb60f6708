"""The data module: collects once, splits homes, batches in a seeded order."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from datamodules.sgm_datamodule import SGMDataModule
from datamodules.snapshot_loader import SnapshotDataset
from sgm.evidence.columns import EVIDENCE_VERSION
from sgm.schema import QUERY_EDGE_TYPES
from simulator.world.config import HomeConfig
from simulator.world.mixture.paper_homes import PaperSizesSource
from simulator.world.mixture.source import MixtureSource


def make_datamodule(tmp_path, **changes) -> SGMDataModule:
    values = {
        "num_homes": 2,
        "steps": 6,
        "num_val_homes": 1,
        "batch_size": 5,
        "workers": 1,
        "data_dir": str(tmp_path),
    } | changes
    return SGMDataModule(**values)


def fingerprint(batch) -> list[float]:
    return [float(batch.to_pyg()[etype]["feature"].double().sum()) for etype in QUERY_EDGE_TYPES]


def test_collects_once_and_gives_whole_batches(tmp_path):
    data = make_datamodule(tmp_path)
    data.prepare_data()
    written = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.safetensors")}
    assert len(written) == 3  # two homes to train on, one to validate on
    data.prepare_data()
    assert written == {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.safetensors")}
    data.setup()
    batches = list(data.train_dataloader())
    assert [batch.num_snapshots for batch in batches] == [5, 5, 2]
    assert [batch.num_snapshots for batch in data.val_dataloader()] == [5, 1]
    targets = torch.cat(
        [batch.to_pyg()[etype]["target"] for batch in batches for etype in QUERY_EDGE_TYPES]
    )
    assert set(targets[~targets.isnan()].tolist()) == {0.0, 1.0}


def test_order_is_seeded_and_differs_between_epochs(tmp_path):
    data, again = make_datamodule(tmp_path), make_datamodule(tmp_path)
    for module in (data, again):
        module.prepare_data()
        module.setup()
    loader, other = data.train_dataloader(), again.train_dataloader()
    first = [fingerprint(batch) for batch in loader]
    assert first == [fingerprint(batch) for batch in other]
    assert first != [fingerprint(batch) for batch in loader]


def test_a_limit_draws_other_snapshots_once(tmp_path):
    """5 of the 12 training snapshots, the same in every epoch and every run, none of them twice."""
    everything = make_datamodule(tmp_path)
    limited = [make_datamodule(tmp_path, train_snapshots=5, val_snapshots=100) for _ in range(2)]
    for data in (everything, *limited):
        data.prepare_data()
        data.setup()
    numbers = [list(data.train_dataset.indices) for data in limited]
    assert numbers[0] == numbers[1] == sorted(set(numbers[0]))
    assert len(numbers[0]) == 5
    (batch,) = list(limited[0].train_dataloader())
    assert batch.num_snapshots == 5
    whole = everything.train_dataset.snapshots.take(np.array(numbers[0]))
    found = sorted(batch.to_pyg()["object"]["temporal"][:, 1].tolist())
    rebuilt = limited[0].builder.build(whole).to_pyg()["object"]["temporal"][:, 1]
    assert found == sorted(rebuilt.tolist())
    assert len(limited[0].val_dataset) == len(everything.val_dataset) == 6


def test_other_settings_get_another_folder(tmp_path):
    data = make_datamodule(tmp_path)
    folders = {data.get_folder(data.train_config), data.get_folder(data.val_config)}
    for changes in (
        {"home": HomeConfig(dynamic_nodes=False)},
        {"seed": 1},
        {"steps": 7},
        {"policy": "random"},
    ):
        other = make_datamodule(tmp_path, **changes)
        folders |= {other.get_folder(other.train_config), other.get_folder(other.val_config)}
    assert len(folders) == 10


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"num_homes": 0}, r"num_homes must be at least 1, got 0"),
        ({"policy": "clairvoyant"}, r"policy must be one of random, .*got 'clairvoyant'"),
        ({"batch_size": 0}, r"batch_size must be at least 1, got 0"),
        ({"train_snapshots": 0}, r"train_snapshots must be at least 1, got 0"),
        ({"seed": -1}, r"seed must be non-negative, got -1"),
    ],
)
def test_values_out_of_range_are_refused(tmp_path, changes, message):
    with pytest.raises(ValueError, match=message):
        make_datamodule(tmp_path, **changes)
    assert not list(tmp_path.iterdir())


def test_a_batch_is_moved_as_plain_tensors(tmp_path, collection):
    """A CPU build of DGL cannot move a graph: one is made anew on the device of the training."""
    data = SGMDataModule(data_dir=str(tmp_path), workers=1)
    batch = SnapshotDataset(collection, data.builder)[0]
    here = batch.homogeneous
    assert data.transfer_batch_to_device(batch, torch.device("cpu"), 0) is batch
    moved = data.transfer_batch_to_device(batch, torch.device("meta"), 0)
    assert moved.edge_src.device.type == "meta"
    assert moved.homogeneous is not here
    assert moved.homogeneous.edges()[0].device.type == "meta"


def test_a_second_task_is_trained_on_too(tmp_path):
    """In other homes: 2 homes of 6 questions, and 2 of 6 searches with a look or more each."""
    data = make_datamodule(tmp_path, also_tasks=["find_object"])
    data.prepare_data()
    data.setup()
    folders = [data.get_folder(config) for config in (data.train_config, *data.also_configs)]
    sizes = [len(SnapshotDataset(folder, data.builder)) for folder in folders]
    assert sizes[0] == 12
    assert sizes[1] > 12
    assert len(data.train_dataset) == sum(sizes)
    assert data.also_configs[0].seed != data.train_config.seed


def test_a_second_source_is_trained_on_too(tmp_path):
    """Two sources times two tasks, in four collections; what is validated on stays the first."""
    data = make_datamodule(
        tmp_path, homes=MixtureSource, also_homes=[PaperSizesSource], also_tasks=["find_object"]
    )
    folders = {data.get_folder(config) for config in (data.train_config, *data.also_configs)}
    assert len(folders) == 4
    assert not any("evidence" in str(folder) for folder in folders)
    evidence = replace(data.train_config, evidence=True)
    assert f"-evidence{EVIDENCE_VERSION}" in str(data.get_folder(evidence))  # of these columns
    kinds = [config.homes.describe()["homes"] for config in data.also_configs]
    assert kinds == ["mixed", "paper sizes", "paper sizes"]
    assert data.val_config.homes.describe()["homes"] == "mixed"


def test_the_looks_of_a_second_policy_are_trained_on_too(tmp_path):
    data = make_datamodule(
        tmp_path, also_policies=["adaptive", "nep.players.policy:NEPPolicy=any_home"]
    )
    data.prepare_data()
    data.setup()
    assert [config.policy.partition("=")[0] for config in data.also_configs] == [
        "adaptive",
        "nep.players.policy:NEPPolicy",
    ]
    assert len({config.seed for config in (data.train_config, *data.also_configs)}) == 3
    assert len(data.train_dataset) == 3 * 12
    assert data.val_config.policy == data.train_config.policy
    assert "=" not in data.get_folder(data.also_configs[1]).parent.name  # by its checksum instead
