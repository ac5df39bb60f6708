"""A relation that is declared: a memory keeps it, it is asked about, cameras see it, pages say it.

The row of the schema's table and the volume of a box (`Box.volume`) are all that is written.
"""

import pytest

from tests.declared import CHANGE, run_python

DECLARED = (
    CHANGE
    + """
row = '    "nextTo": Relation("beside", "next to", "in front", "front"),'
change("sgm.schema", "}\\nRELATIONS =", row + "\\n}\\nRELATIONS =")
before = '        if relation == "in":'
volume = '''        if relation == "nextTo":  # half a metre before the front
            length, width, height = self.size
            middle = self.to_map(np.array([length / 2 + 0.25, 0, 0]))
            return replace(self, center=tuple(middle), size=(0.5, width, height), interior="none")
'''
change("sgm.layout.box", before, volume + before)
"""
)
MEMORY = """
from sgm import Adaptive, Finder, SceneGraphMemory, Sighting
from sgm.finder.search_plan import plan_search
from sgm.memory.memory_event import read_events
from sgm.replay.replay import replay
from simulator.snapshots.nodes_and_edges import Pairs, join_nodes, propose_edges
from simulator.snapshots.taken import take_snapshots

folder = Path(sys.argv[1])
memory = SceneGraphMemory(path=folder / "looks.sgm")
kitchen = memory.add_room("kitchen")
fridge, table = (memory.add_furniture(label, kitchen) for label in ("fridge", "table"))
memory.observe(fridge, [Sighting("cup", "next to"), Sighting("milk", "in")])
memory.step()
memory.observe(fridge, [], {"nextTo": 1})  # the cup alone was looked for
memory.note_moved("broom", table, "anna", "nextTo")
places = {name: memory.last_seen(name) for name in ("cup", "milk", "broom")}
print({name: (at.relation, at.is_there) for name, at in places.items()})
memory.save(folder / "home.sgm")
again = SceneGraphMemory.load(folder / "home.sgm")
*_, (replayed, _, _) = replay(read_events(folder / "looks.sgm"))
assert again.to_dict() == replayed.to_dict() == memory.to_dict()
found = Finder(Adaptive()).rank(memory, "broom")
print(found.places[0].relation, plan_search("broom", found.places[:1]).looks[0].instruction)
queries = memory.query("cup")
snapshots = take_snapshots(memory.batch, queries)
edges = propose_edges(snapshots, memory.batch.propose_places(queries)[0], False)
pairs = Pairs.list(snapshots, edges, join_nodes(snapshots)[1])
print(len(pairs.first) - 1, sorted(set(edges["relation"].tolist())))
"""


EYES = """
import numpy as np
from sgm.eyes import Box, LookBuilder
from sgm.memory.scene_graph_memory import SceneGraphMemory
from simulator.box_world.true_view import sample_cells
from tests.sgm.eyes.scenes import (
    CAMERA, FLOOR, compute_true_share, detect, look_around, put_on, render
)

table = Box((2.0, 0.0, 0.35), (0.8, 1.2, 0.7), np.pi)  # its front looks to -x
memory = SceneGraphMemory()
kitchen = memory.add_room("kitchen")
number = memory.add_furniture("table", kitchen, box=table)
mug, ball = put_on(table, 0.1, 0.3), Box((1.3, 0.2, 0.12), (0.2, 0.2, 0.24))
solid, poses = [table, FLOOR, mug, ball], look_around(table.center)
for has_depth in (True, False):
    builder = LookBuilder(memory.layout.furniture)
    for frame, pose in enumerate(poses):
        found = [detect("mug", mug, pose), detect("ball", ball, pose)]
        depth = render(solid, pose) if has_depth else None
        builder.frame(0.2 * frame, pose, CAMERA, found, depth)
    (look,) = builder.finish()
    print(sorted((thing.description, thing.relation) for thing in look.seen))
    true = compute_true_share(table, "nextTo", solid, poses)
    assert abs(look.coverage["nextTo"] - min(true, 1 if has_depth else 0.7)) < 0.05
    if has_depth:
        look.tell(memory)
places = {name: memory.last_seen(name) for name in ("mug", "ball")}
print({name: (place.relation, place.is_there) for name, place in places.items()})
memory.move_furniture(number, box=Box((2.0, 0.0, 0.35), (0.9, 1.2, 0.7), np.pi))
print(memory.last_seen("ball").position is not None)  # it is in the volume still
points = sample_cells(table, "nextTo", 100, rng=np.random.default_rng(0))
assert table.volume("nextTo").contains(points).all()
"""
WORLD = """
from sgm.schema import RELATIONS, PlaceCode
from simulator.box_world.world import BoxWorld
from simulator.world.config import HomeConfig
from simulator.world.source import SampledSource
from simulator.world.streams import Streams

source = SampledSource(home=HomeConfig(furniture_per_room=2, objects_per_furniture=2))
homes = source.make(Streams(1, "test", [0]))
world = BoxWorld(homes)
homes.object_place[0, 0] = PlaceCode.of(3, RELATIONS.index("nextTo"))
world.things.update()
print([RELATIONS[relation] for slot, relation in world.list_there(3) if slot == 0])
volume = world.floor.furniture[3].volume("nextTo")
print(bool(volume.contains(world.things.center[0])), world.things.get_box(0)[0][2] < 0.2)
"""
PAGES = """
import nep.view.answers, nep.any_home.onnx_export
from nep.view.texts import _tell_look
from sgm.network.network import EDGE_COLUMNS
from simulator.story.story import PastLook

look = PastLook(1, 0, ("cup",), coverage=(0.5, 0.25, 1.0))
print(_tell_look(look))
print(EDGE_COLUMNS)
"""
BATCHES = """
from datamodules.feature_config import FeatureConfig
from datamodules.batch_builder import BatchBuilder
from nep.paper.encoders import MLP
from nep.paper.nep_module import NEPModule
from nep.players.policy import NEPPolicy
from sgm import SceneGraphMemory, Sighting
from simulator.snapshots.taken import take_snapshots

memory = SceneGraphMemory()
kitchen = memory.add_room("kitchen")
fridge, table = (memory.add_furniture(label, kitchen) for label in ("fridge", "table"))
memory.observe(fridge, [Sighting("cup", "next to")])
builder = BatchBuilder(FeatureConfig(candidates="all"))
for name in ("cup", "milk"):
    queries = memory.query(name)
    batch = builder.build(take_snapshots(memory.batch, queries))
    found = dict(zip(batch.query_furniture.tolist(), batch.query_relation.tolist(), strict=True))
    likeliest = queries.prior[0].argmax(axis=1).tolist()
    print(sorted(found.items()) == [(0, 2 if name == "cup" else likeliest[0]), (1, likeliest[1])])
policy = NEPPolicy(NEPModule(MLP(units=4), transformer=False), builder)
places, _ = policy.score_places(memory.batch, memory.query("cup"))
print((places > -1e9).argmax(axis=2).tolist()[0][0], places.shape[2])
"""


def test_a_declared_relation_is_kept_asked_and_joined(tmp_path):
    places, first, groups = run_python(DECLARED + MEMORY, str(tmp_path))
    said = {"cup": ("nextTo", False), "milk": ("in", True), "broom": ("nextTo", True)}
    assert places == str(said)
    assert first == "nextTo look next to the table in kitchen"
    assert groups.startswith("6 [0, ")  # floor, room, furniture, and one for each relation


@pytest.mark.slow
def test_cameras_see_a_declared_relation():
    seen, blind, believed, is_placed = run_python(DECLARED + EYES)
    assert seen == str([("ball", "nextTo"), ("mug", "onTop")])
    assert believed == str({"mug": ("onTop", True), "ball": ("nextTo", True)})
    assert blind == str([("mug", "onTop")])  # without depth the ball is on some floor
    assert is_placed == "True"


@pytest.mark.slow
def test_homes_of_boxes_have_a_declared_relation():
    there, spot = run_python(DECLARED + WORLD)
    assert there == str(["nextTo"])
    assert spot == "True True"  # in the volume, on the ground


@pytest.mark.slow
def test_pages_and_networks_name_a_declared_relation():
    said, columns = run_python(DECLARED + PAGES)
    assert said == (
        "saw cup; 50% of the inside and 25% of the upper side and 100% of the front in view"
    )
    assert columns == str(("prior", "is_onTop", "is_nextTo"))


@pytest.mark.slow
def test_batches_and_networks_have_a_declared_relation():
    """Where it was seen, each place is asked about in the relation that it was seen in."""
    cup, milk, answered = run_python(DECLARED + BATCHES)
    assert (cup, milk) == ("True", "True")
    assert answered == "2 3"
