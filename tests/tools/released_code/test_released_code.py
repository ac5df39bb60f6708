"""What the released code does otherwise: each switch does what its title says."""

import json

import numpy as np
import pytest
import torch

from datamodules.batch import Batch
from datamodules.batch_builder import BatchBuilder
from datamodules.feature_config import FeatureConfig
from datamodules.snapshot_loader import SnapshotDataset
from nep.paper.encoders import HEAT
from nep.paper.nep_module import NEPModule
from nep.report.tables import Difference
from sgm.prior.prior_graph import PriorGraph
from simulator.collect.folder import collect
from simulator.collect.settings import CollectConfig
from simulator.world.config import HomeConfig
from simulator.world.source import PaperSource
from simulator.world.streams import Streams
from tools.released_code import __main__ as study
from tools.released_code.kept_starts import KeptStarts
from tools.released_code.switches import SWITCHES

RULES = HomeConfig(noise_zero_prob=0.6, rooms=("kitchen",))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("homes")
    collect(CollectConfig(num_homes=1, steps=6, seed=3), path, progress=False)
    return path


def load(folder, num_hops: int = 1) -> Batch:
    dataset = SnapshotDataset(folder, BatchBuilder(FeatureConfig(), num_hops))
    return dataset.__getitems__(range(6))


def read_starts(source) -> np.ndarray:
    """The weight in T of the place where each object is at t = 0."""
    homes = source(PriorGraph.default(), RULES).make(Streams(0, "test", range(3)))
    home, slot = np.nonzero(homes.is_present)
    rows = homes.transition_rows(home, homes.object_code[home, slot])
    return rows[np.arange(len(rows)), homes.object_place[home, slot]]


def test_noise_keeps_where_an_object_begins():
    assert (read_starts(PaperSource) == 0).any()
    assert (read_starts(KeptStarts) > 0).all()
    told = [source(PriorGraph.default(), RULES).describe() for source in (PaperSource, KeptStarts)]
    assert told[0] != told[1]  # collections of one are not those of the other


def test_an_observed_edge_is_counted_twice_more(folder):
    """Scaled by .5: n true and m observed become n + 1 and m + 2."""
    before = load(folder).edge_feature
    with SWITCHES["counted_twice"].change():
        after = load(folder).edge_feature
    more = (after - before)[:, [3, 4]].unique(dim=0)
    assert more.tolist() == [[0, 0], [1, 0.5]]
    assert load(folder).edge_feature.equal(before)


def test_what_was_never_observed_is_marked(folder):
    before = load(folder)
    with SWITCHES["never_marked"].change():
        after = load(folder)
    assert not (before.edge_feature == -1).any()
    changed = (after.edge_feature != before.edge_feature).any(dim=1)
    assert after.edge_feature[changed][:, [1, 5, 7]].unique(dim=0).tolist() == [
        [-1.0, pytest.approx(0.1), pytest.approx(0.1)]
    ]
    assert (after.node_feature == -1).any()


def test_networks_have_the_released_sizes(folder):
    batch = load(folder)
    with SWITCHES["narrow_edges"].change():
        edge = NEPModule(HEAT(64)).predictor.edge_embedding(batch)
    assert edge.shape[1] == 64
    assert not edge[:, 32:].any()
    with SWITCHES["three_layers"].change():
        deep = NEPModule(HEAT(64)).predictor.node_embedding
    assert sum(isinstance(part, torch.nn.Linear) for part in deep.modules()) == 3


def test_all_together_are_each_of_them(folder):
    """Features, sizes and messages change at once, and are back when it is over."""
    before, names = load(folder), SWITCHES.keys() - {"together"}
    together = SWITCHES["together"]
    with together.change():
        batch, module = load(folder), NEPModule(HEAT(64))
        marked = batch.edge_feature[:, 1] == -1
        assert marked.any()
        assert batch.edge_feature[marked][:, 5].tolist() == pytest.approx([0.1] * int(marked.sum()))
        assert batch.edge_feature[:, 3].gt(before.edge_feature[:, 3]).any()
        edge = module.predictor.edge_embedding
        assert not edge(batch)[:, 32:].any()
        for part in (edge, module.predictor.node_embedding):
            assert sum(isinstance(layer, torch.nn.Linear) for layer in part.modules()) == 3
    assert load(folder).edge_feature.equal(before.edge_feature)
    assert {*together.options} == {option for name in names for option in SWITCHES[name].options}
    assert together.source == SWITCHES["kept_starts"].source


def test_messages_go_up_alone(folder):
    """Objects hear nothing: their neighbours make no difference to them."""
    batch, encoder = load(folder), HEAT(8)
    node, edge = torch.randn(batch.num_nodes, 8), torch.randn(batch.num_edges, 8)
    other = node.clone()
    other[batch.furniture] += 1
    objects = slice(batch.furniture.stop, None)
    plain, moved = (encoder(batch.homogeneous, nodes, edge)[objects] for nodes in (node, other))
    assert not plain.equal(moved)
    with SWITCHES["up_alone"].change():
        plain, moved = (encoder(batch.homogeneous, nodes, edge)[objects] for nodes in (node, other))
    assert plain.equal(moved)


def test_attention_is_dropped_in_training_alone(folder):
    batch, encoder = load(folder), HEAT(8)
    node, edge = torch.randn(batch.num_nodes, 8), torch.randn(batch.num_edges, 8)
    with SWITCHES["attention_dropout"].change():
        with torch.no_grad():
            first, second = (encoder(batch.homogeneous, node, edge) for _ in range(2))
        third = encoder(batch.homogeneous, node, edge)
    assert first.equal(second)
    assert not first.equal(third)


def test_page_compares_homes_and_trainings():
    """.3 and .4, .5 and .6 in two homes: MLP has .35, HEAT .55, .2 more in each."""
    scores = {
        "off/dropout/mlp/0": study.summarise(np.array([[0.3] * 20, [0.4] * 20])),
        "off/dropout/heat/0": study.summarise(np.array([[0.5] * 20, [0.6] * 20])),
        "off/as_it_is/mlp/0": study.summarise(np.repeat([[0.1, 0.4], [0.2, 0.5]], 10, axis=1)),
    }
    page = study.make_page(study.Study(), scores)
    assert "| off | dropout .25 | 1 | 0.350 | 0.550 | +0.200" in page
    assert "| off | NEP-MLP | 1 | 0.150 | 0.450 | +0.300" in page


@pytest.mark.parametrize(
    ("high", "verdict"),
    [(0.047, "none of these brings"), (0.048, "feed-forward 96: up to there")],
)
def test_page_says_whether_a_switch_reaches_the_released_difference(high, verdict):
    """It is +.048; one interval ends there or just below, and what was not played is named."""
    found = {"dropout": 0.01, "as_it_is": 0.09, "feed_forward": high}
    text = study.conclude(
        {name: Difference(0.0, -0.01, value, 0.5, 0.01) for name, value in found.items()}
    )
    assert f"Of 2 switches the highest interval ends at {high:+.3f}: {verdict}" in text
    left = text.partition("Not played there, one at a time: ")[2]
    assert "batches of 200" in left
    assert "dropout .25" not in left


@pytest.mark.slow
def test_study_goes_on_where_it_stopped(tmp_path, monkeypatch):
    options = ["num_homes=2", "steps=3", "num_val_homes=1", "train_snapshots=5"]
    command = [
        *("--runs", f"{tmp_path}/runs", "--data", f"{tmp_path}/data", "--out", f"{tmp_path}/out"),
        *("--num_homes", "2", "--steps", "2", "--nodes", "off", "--switches", "feed_forward"),
        "--options=" + json.dumps([*(f"--data.{o}" for o in options), "--trainer.max_epochs=1"]),
    ]
    study.main(command)
    page = (tmp_path / "out" / "released_code.md").read_text("utf-8")
    assert "| off | feed-forward 96 | 1 |" in page
    monkeypatch.setattr(study, "play", None)  # nothing is left to play
    study.main(command)
    assert (tmp_path / "out" / "released_code.md").read_text("utf-8") == page


@pytest.mark.parametrize("given", [["[off]"], ['["off"]'], ["off"], ["[false]"]])
def test_homes_are_named_as_in_the_table(tmp_path, given):
    """Off is a boolean in YAML, which options are."""
    scores = {f"off/as_it_is/{name}/0": study.summarise(np.ones((2, 20))) for name in study.TITLES}
    (tmp_path / "released_code.json").write_text(json.dumps(scores), "utf-8")
    study.main(["--out", str(tmp_path), "--switches", "as_it_is", "--nodes", *given])
    assert "| off | as it is | 1 | 1.000 | 1.000 |" in (tmp_path / "released_code.md").read_text(
        "utf-8"
    )


def test_a_switch_that_there_is_not_is_named(capsys):
    with pytest.raises(SystemExit, match="2"):
        study.main(["--switches", "more"])
    assert "switch must be one of as_it_is, kept_starts" in capsys.readouterr().err
