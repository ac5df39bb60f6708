"""Hour of day and day of week as edge features: by hand, from shards, and only if known."""

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest
import torch

from datamodules.batch_builder import BatchBuilder
from datamodules.feature_config import FeatureConfig
from datamodules.more_features import compute_clock_features
from datamodules.sgm_datamodule import SGMDataModule
from sgm.schema import EDGE_TYPES
from simulator.snapshots.stored import StoredSnapshots

HOUR = 3600
DAY = 24 * HOUR
# Sine and cosine of 2 pi / 7, Tuesday, and of 12 pi / 7, Sunday.
TUESDAY = [0.781831, 0.623490]
SUNDAY = [-0.781831, 0.623490]


def test_features_by_hand():
    """Monday 06:00 after never; Tuesday 12:00 after Monday 18:00; Sunday 21:00 after 03:00."""
    clock = np.array([[0, HOUR], [12 * HOUR, 6 * HOUR], [6 * DAY, 3 * HOUR]], dtype=float)
    found = compute_clock_features(clock, np.array([6, 4, 7]), np.array([-1, 1, 1]))
    half = 0.5**0.5  # 21:00 is 7/8 of the circle: (-half, half); 03:00 is 1/8: (half, half)
    expected = [
        [1, 0, 0, 1, 0, 0, 0, 0],
        [0, -1, *TUESDAY, -1, 0, 0, 1],
        [-half, half, *SUNDAY, half, half, *SUNDAY],
    ]
    np.testing.assert_allclose(found, expected, atol=1e-6)
    assert found.dtype == np.float32


def test_they_stand_on_the_edges_of_objects_alone(hand_written):
    """Time 10 of steps of an hour from Monday 20:00: Tuesday 06:00; last seen at 6, 02:00."""
    snapshots = dataclasses.replace(hand_written, clock=np.array([[20.0 * HOUR, HOUR]]))
    graph = BatchBuilder(FeatureConfig(clock=True)).build(snapshots).to_pyg()
    now = [1, 0, *TUESDAY]
    seen = [0.5, 0.866025, *TUESDAY]  # 30 degrees
    for etype in EDGE_TYPES:
        feature = graph[etype]["feature"].numpy()
        assert feature.shape[1] == 17
        plain = BatchBuilder(FeatureConfig()).build(hand_written).to_pyg()[etype]
        np.testing.assert_array_equal(feature[:, :9], plain["feature"])
        if "object" not in etype:
            assert not feature[:, 9:].any()
        elif etype[1] in ("onTop", "under"):  # the mug on the table, and maybe the apple there
            np.testing.assert_allclose(feature[:, 9:], [now + seen, now + [0] * 4], atol=1e-6)
        else:  # maybe the apple in the fridge
            np.testing.assert_allclose(feature[:, 9:], [now + [0] * 4], atol=1e-6)


def test_they_come_after_the_belief_and_survive_forgetting(hand_written):
    snapshots = dataclasses.replace(
        hand_written,
        clock=np.array([[20.0 * HOUR, HOUR]]),
        extras={"belief": np.full((2, 4), 0.5, dtype=np.float32)},
    )
    config = FeatureConfig(memory=False, belief=True, clock=True)
    graph = BatchBuilder(config).build(snapshots).to_pyg()
    feature = graph["object", "in", "furniture"]["feature"].numpy()
    np.testing.assert_allclose(feature[:, 14:], [[1, 0, *TUESDAY, 0, 0, 0, 0]], atol=1e-6)


def test_no_clock_is_an_error(hand_written):
    builder = BatchBuilder(FeatureConfig(clock=True))
    for clock in (None, np.full((1, 2), np.nan)):
        snapshots = dataclasses.replace(hand_written, clock=clock)
        with pytest.raises(ValueError, match=r"must have a clock for features.clock, got one with"):
            builder.build(snapshots)


def write_trace(folder: Path, start: str | None, num_hours: int = 30) -> Path:
    """A mug that changes its place every hour."""
    folder.mkdir(parents=True)
    layout = {
        "rooms": ["kitchen"],
        "furniture": [{"name": name, "room": "kitchen"} for name in ("table", "shelf")],
    }
    layout |= {} if start is None else {"start": start}
    (folder / "layout.json").write_text(json.dumps(layout))
    rows = [f"{hour * HOUR},mug,{('table', 'shelf')[hour % 2]},in" for hour in range(num_hours)]
    (folder / "events.csv").write_text("\n".join(["time_s,object,furniture,relation", *rows]))
    return folder


def make_datamodule(tmp_path, features=FeatureConfig(), **homes) -> SGMDataModule:
    folder = str(tmp_path / "data")
    return SGMDataModule(data_dir=folder, workers=1, features=features, **homes)


@pytest.mark.slow
def test_recorded_homes_are_collected_and_read_with_their_clock(tmp_path):
    train = [
        str(write_trace(tmp_path / "a", "2026-11-16T00:00")),
        str(write_trace(tmp_path / "b", "2026-11-17T12:00", num_hours=40)),
    ]
    val = [str(write_trace(tmp_path / "c", "2026-11-18T00:00", num_hours=10))]
    data = make_datamodule(tmp_path, FeatureConfig(clock=True), trace=train, val_trace=val)
    data.prepare_data()
    data.setup()
    sizes = [(config.num_homes, config.steps) for config in (data.train_config, data.val_config)]
    assert sizes == [(2, 29), (1, 9)]  # what all homes were recorded for
    assert (len(data.train_dataset), len(data.val_dataset)) == (58, 9)
    snapshots = data.train_dataset.snapshots.take(np.array([0, 28, 29]))
    assert snapshots.clock.tolist() == [[0, HOUR], [0, HOUR], [1.5 * DAY, HOUR]]
    assert snapshots.time.tolist() == [1, 29, 1]
    (batch,) = list(data.val_dataloader())
    feature = torch.cat([batch.to_pyg()[e]["feature"] for e in EDGE_TYPES if "object" in e])
    wednesday = torch.tensor(4 * torch.pi / 7).sin()
    torch.testing.assert_close(feature[:, 11], wednesday.expand(len(feature)))
    on_circle = feature[:, 13:15].square().sum(dim=1).round(decimals=3)
    assert set(on_circle.tolist()) == {0.0, 1.0}  # never seen there, or seen at some hour
    folder = data.get_folder(data.train_config)
    other = make_datamodule(tmp_path, trace=train, val_trace=val, step_seconds=1800)
    assert other.get_folder(other.train_config) != folder


def test_a_collection_without_a_clock_has_none(collection):
    snapshots = StoredSnapshots.open(collection).take(np.arange(3))
    assert snapshots.clock is None


def test_traces_that_cannot_be_trained_on(tmp_path):
    known = [str(write_trace(tmp_path / "known", "2026-11-16T00:00"))]
    unknown = [str(write_trace(tmp_path / "unknown", None))]
    clock = FeatureConfig(clock=True)
    for changes, message in (
        ({"features": clock}, r"got sampled homes, in which no time of day.*recorded homes"),
        ({"features": clock, "trace": known, "val_trace": unknown}, "layout.json of unknown. Add"),
        ({"trace": known}, r"must come together, .*and val_trace None. Name folders for both"),
        ({"by_day": True}, "by_day and replays must come with trace, got no trace. Name a folder"),
        ({"trace": known, "val_trace": known}, "must differ from those to train on, got known in"),
        ({"trace": known, "val_trace": []}, "traces must be one or more folders, got none"),
        ({"trace": ["nowhere"], "val_trace": known}, "trace must be a folder with layout.json"),
    ):
        with pytest.raises(ValueError, match=message):
            make_datamodule(tmp_path, **changes)
    assert not (tmp_path / "data").exists()
