"""A relation that is declared in the schema alone: a memory keeps it, and is asked about it."""

import subprocess
import sys

from tests.imports import ROOT

# Before anything of ours is imported, so that all that counts relations counts three.
SESSION = """
import sys, types
from pathlib import Path

source = Path("sgm/schema.py").read_text("utf-8")
for old, new in (
    ('RELATIONS = ("in", "onTop")', 'RELATIONS = ("in", "onTop", "nextTo")'),
    ('"onTop", "under")', '"onTop", "under", "nextTo", "beside")'),
    ('"onTop": "under"}', '"onTop": "under", "nextTo": "beside"}'),
    ('("object", "onTop", "furniture"),', '("object", "onTop", "furniture"),\\n'
     '    ("object", "nextTo", "furniture"),'),
    ('("furniture", "under", "object"),', '("furniture", "under", "object"),\\n'
     '    ("furniture", "beside", "object"),'),
):
    assert old in source, old
    source = source.replace(old, new)
schema = types.ModuleType("sgm.schema")
import sgm
sys.modules["sgm.schema"] = sgm.schema = schema
exec(compile(source, "sgm/schema.py", "exec"), schema.__dict__)

from sgm import Adaptive, Finder, SceneGraphMemory, Sighting
from sgm.memory.log_reader import read_log
from sgm.replay.replay import replay
from simulator.snapshots.graph import Pairs, join_nodes, propose_edges
from simulator.snapshots.taken import take_snapshots

folder = Path(sys.argv[1])
memory = SceneGraphMemory(log=folder / "looks.jsonl")
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
*_, (replayed, _, _) = replay(read_log(folder / "looks.jsonl"))
assert again.to_dict() == replayed.to_dict() == memory.to_dict()
print(Finder(Adaptive()).rank(memory, "broom").places[0].relation)
queries = memory.query("cup")
snapshots = take_snapshots(memory.batch, queries)
edges = propose_edges(snapshots, memory.batch.propose_places(queries)[0], False)
pairs = Pairs.list(snapshots, edges, join_nodes(snapshots)[1])
print(len(pairs.first) - 1, sorted(set(edges["relation"].tolist())))
"""


def test_a_relation_of_the_schema_is_kept_asked_and_joined(tmp_path):
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", SESSION, str(tmp_path)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    places, first, groups = done.stdout.splitlines()
    said = {"cup": ("nextTo", False), "milk": ("in", True), "broom": ("nextTo", True)}
    assert places == str(said)
    assert first == "nextTo"
    assert groups.startswith("6 [0, ")  # floor, room, furniture, and one for each relation
