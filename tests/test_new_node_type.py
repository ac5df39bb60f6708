"""A node type that is declared, a box at furniture that holds objects: graphs and networks have it.

Its row of the schema's table is all that is written. No memory knows of boxes, so that the test
puts some into snapshots of simulated homes.
"""

import importlib.util

import pytest

from sgm.schema import NODE_TABLE, NodeType, check_node_types
from tests.declared import CHANGE, run_python

DECLARED = (
    CHANGE
    + """
row = '    "box": NodeType("furniture", table="boxes", holds="object"),'
before = '    "object": NodeType("furniture"'
change("sgm.schema", before, row + "\\n" + before)
"""
)
DATA = """
from dataclasses import replace

import numpy as np
import torch

from datamodules.feature_config import FeatureConfig
from datamodules.sgm_datamodule import SGMDataModule
from sgm.schema import EDGE_TYPES, LAYOUT_PAIRS, NODE_TYPES
from simulator.snapshots.snapshots import forget, forget_absence
from simulator.world.config import HomeConfig

data = SGMDataModule(
    FeatureConfig(), data_dir=sys.argv[1], workers=1, num_homes=1, num_val_homes=1, steps=10,
    home=HomeConfig(furniture_per_room=2, objects_per_furniture=2),
)
data.prepare_data()
data.setup("fit")
snapshots = data.train_dataset.snapshots.take(np.arange(6))


def put_boxes(snapshots):
    # A box at the first furniture of each snapshot, with its first object in it, and an empty one.
    first, thing = (snapshots.find_first(table)[:-1] for table in ("furniture", "objects"))
    num = snapshots.num_snapshots
    boxes = {
        "snapshot": np.repeat(np.arange(num), 2),
        "label": np.repeat(snapshots.furniture["label"][first], 2),
        "furniture": np.repeat(first, 2),
    }
    held_in = np.full(len(snapshots.objects["label"]), -1)
    held_in[thing] = 2 * np.arange(num)
    objects = {**snapshots.objects, "box": held_in}
    return replace(snapshots, objects=objects, more_nodes={"boxes": boxes})


boxed = put_boxes(snapshots)
"""
GRAPH = """
print(NODE_TYPES, LAYOUT_PAIRS[2:])
loaded = next(iter(data.train_dataloader()))
batch, plain = data.builder.build(boxed), data.builder.build(snapshots)
for made in (loaded, plain, batch):
    nodes = dict(zip(NODE_TYPES, made.node_counts, strict=True))
    edges = dict(zip(EDGE_TYPES, made.edge_counts, strict=True))
    print(nodes["box"], [edges[etype] for etype in EDGE_TYPES if "box" in etype])
split = batch.split_edges(torch.stack([batch.edge_src, batch.edge_dst], 1))
first = batch.first_node
up, down = split["object", "in", "box"], split["box", "contains", "object"]
print((up - torch.tensor([first["object"], first["box"]]))[:, 1].tolist())
print(up.flip(1).equal(down), split["box", "in", "furniture"].shape[0])
parts, was = batch.split_edges(batch.edge_feature), plain.split_edges(plain.edge_feature)
print(all(parts[etype].equal(was[etype]) for etype in EDGE_TYPES if "box" not in etype))
entered = torch.bincount(batch.edge_dst, minlength=batch.num_nodes).float()
print(batch.degree.equal(entered), batch.query_furniture.equal(plain.query_furniture))
for forgetting in (forget, forget_absence):
    print(dict(zip(NODE_TYPES, data.builder.build(forgetting(boxed)).node_counts))["box"])
"""
NETWORK = """
from nep.paper.encoders import GCN, HAN, HEAT, HGT, MLP
from nep.paper.nep_module import NEPModule

torch.manual_seed(0)
for encoder in (GCN, HAN, HEAT, HGT, MLP):
    module = NEPModule(encoder(units=8))
    data.builder.num_hops = None
    batch, plain = data.builder.build(boxed), data.builder.build(snapshots)
    loss, _ = module.compute_loss(batch)
    loss.backward()
    for loaded in data.train_dataloader():
        module.compute_loss(loaded)[0].backward()
    module.eval()
    reads = not module.predictor(batch).allclose(module.predictor(plain), atol=1e-6)
    print(encoder.__name__, bool(loss.isfinite()), reads)
"""
DGL = """
from datamodules.edited_graph import read_batch

batch = data.builder.build(boxed)
graph = batch.graph
print(graph.num_nodes("box"), graph.num_edges(("object", "in", "box")), len(graph.ntypes))
again = read_batch(graph, batch.text, batch.num_snapshots)
print(again.edge_src.equal(batch.edge_src), again.node_counts == batch.node_counts)
"""
SPACE = """
from sgm import SceneGraphMemory, Sighting
from simulator.gym.memory_graph import make_graphs

memory = SceneGraphMemory()
shelf = memory.add_furniture("shelf", memory.add_room("study"))
memory.observe(shelf, [Sighting("cup")])
(graph,) = make_graphs(memory.batch, memory.query("cup"))
print(graph.nodes[:, 0].astype(int).tolist(), len(graph.edges))
"""


@pytest.mark.slow
def test_graphs_have_a_declared_node_type(tmp_path):
    types, loaded, plain, boxed, held, both, kept, degrees, *forgotten = run_python(
        DECLARED + DATA + GRAPH, str(tmp_path)
    )
    node_types = ("house", "floor", "room", "furniture", "box", "object")
    layout = ("furniture", "room"), ("box", "furniture"), ("object", "box")
    assert types == f"{node_types} {layout}"
    assert loaded == plain == "0 [0, 0, 0, 0]"  # no memory knows of any
    assert boxed == "12 [12, 12, 6, 6]"
    assert held == "[0, 2, 4, 6, 8, 10]"
    assert both == "True 12"
    assert kept == "True"  # all other edges have the features that they had
    assert degrees == "True True"
    assert forgotten == ["0", "12"]


@pytest.mark.slow
def test_networks_read_a_declared_node_type(tmp_path):
    found = run_python(DECLARED + DATA + NETWORK, str(tmp_path))
    reads = {"GCN": True, "HAN": True, "HEAT": True, "HGT": True, "MLP": False}
    assert found == [f"{name} True {is_read}" for name, is_read in reads.items()]


@pytest.mark.slow
@pytest.mark.dgl
@pytest.mark.skipif(importlib.util.find_spec("dgl") is None, reason="DGL is not installed")
def test_graphs_of_dgl_have_a_declared_node_type(tmp_path):
    counts, again = run_python(DECLARED + DATA + DGL, str(tmp_path))
    assert counts == "12 6 6"
    assert again == "True True"


@pytest.mark.slow
def test_spaces_of_gymnasium_number_a_declared_node_type():
    (found,) = run_python(DECLARED + SPACE)
    assert found == "[0, 1, 2, 3, 5] 4"  # the home, its floor, the study, the shelf, the cup


@pytest.mark.parametrize(
    ("name", "node", "message"),
    [
        ("box", NodeType("bag", table="boxes"), "have a parent that is declared before it"),
        ("box", NodeType(table="boxes"), "have a parent that is declared before it"),
        ("box", NodeType("furniture", table="boxes", holds="sock"), "hold a declared type"),
        ("box", NodeType("furniture"), "have a table below a type that has one"),
    ],
)
def test_a_row_that_does_not_say_where_nodes_are_is_refused(name, node, message):
    with pytest.raises(ValueError, match=f"node type {name} must {message}, got "):
        check_node_types({**NODE_TABLE, name: node})
