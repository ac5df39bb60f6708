"""Collections of every task: how many snapshots, the same bytes, killed and resumed."""

from pathlib import Path

import numpy as np
import pytest

from simulator.collect import folder as collect_module
from simulator.collect import homes as collecting
from simulator.collect.folder import collect
from simulator.collect.settings import CollectConfig
from simulator.policies import make_policy
from simulator.snapshots.shards import load_shard
from simulator.tasks.registry import TASKS
from simulator.world.config import HomeConfig
from simulator.world.source import SampledSource
from simulator.world.streams import Streams

HOUSE = HomeConfig(furniture_per_room=3, objects_per_furniture=4)


def configure(task: str) -> CollectConfig:
    return CollectConfig(num_homes=5, steps=6, seed=3, task=task, homes=SampledSource(home=HOUSE))


def read_all(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


@pytest.fixture(scope="module", params=TASKS)
def reference(request, tmp_path_factory) -> tuple[str, Path]:
    """A task and its collection, made in one go by one process."""
    out = tmp_path_factory.mktemp("reference") / "data"
    collect(configure(request.param), out, progress=False)
    return request.param, out


def test_one_snapshot_per_answer(reference):
    task, folder = reference
    homes = SampledSource(home=HOUSE).make(Streams(3, "train", range(5)))
    game = TASKS[task](homes, make_policy("bayesian", homes))
    answered = []
    game.on_answer = answered.append
    values = np.stack(list(game.run(6)), axis=1)  # (H, T)
    expected = {
        "predict_location": np.full(5, 6),
        "relative_likelihood": np.full(5, 30),
        "find_object": values.sum(axis=1),  # one per look
    }[task]
    for home in range(5):
        shard = load_shard(folder / f"home_{home:06d}.safetensors")
        assert len(shard["snapshot_time"]) == expected[home]
        own = [part.answers[part.queries.home == home] for part in answered]
        np.testing.assert_array_equal(shard["snapshot_furniture_answers"], np.concatenate(own))
        assert (np.diff(shard["snapshot_time"]) >= 0).all()
        for kind in ("object", "edge", "furniture"):
            assert (shard[f"{kind}_version_valid_to"] <= expected[home]).all()
    if task == "find_object":
        assert len(set(expected.tolist())) > 1, "homes should differ in their number of looks"


def test_any_number_of_workers_gives_the_same_bytes(reference, tmp_path, monkeypatch):
    task, folder = reference
    monkeypatch.setattr(collect_module, "_HOMES_PER_JOB", 2)
    collect(configure(task), tmp_path / "data", progress=False)
    assert read_all(tmp_path / "data") == read_all(folder)


def test_an_interrupted_collection_ends_with_the_same_bytes(reference, tmp_path, monkeypatch):
    task, folder = reference
    out = tmp_path / "data"
    monkeypatch.setattr(collect_module, "_HOMES_PER_JOB", 1)
    finished = []

    def stop_after_two(*arguments):
        if len(finished) == 2:
            raise KeyboardInterrupt
        finished.append(arguments[2])
        return collect_homes(*arguments)

    collect_homes = collecting.collect_homes
    monkeypatch.setattr(collecting, "collect_homes", stop_after_two)
    with pytest.raises(KeyboardInterrupt):
        collect(configure(task), out, progress=False)
    assert len(list(out.glob("*.safetensors"))) == 2
    monkeypatch.setattr(collecting, "collect_homes", collect_homes)
    collect(configure(task), out, progress=False)
    assert read_all(out) == read_all(folder)


def test_tasks_do_not_share_a_folder(reference):
    task, folder = reference
    other = next(name for name in TASKS if name != task)
    with pytest.raises(ValueError, match=f"got task = {task} instead of {other}"):
        collect(configure(other), folder, progress=False)
