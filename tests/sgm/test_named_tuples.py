"""The order of the fields of a named tuple means nothing: all are made and read by name."""

import ast
import json
import subprocess
from importlib.util import find_spec
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

ANSWERS = """
import json, sys, typing
from datetime import datetime

turned = []
if sys.argv[1] == "turned":  # fields of all named tuples of the package stand the other way round
    make = typing.NamedTupleMeta.__new__

    def turn(kind, name, bases, content):
        if content["__module__"].startswith("sgm."):
            turned.append(name)
            fields = reversed(content["__annotations__"].items())
            in_order = sorted(fields, key=lambda one: one[0] in content)  # with a default: last
            content["__annotations__"] = dict(in_order)
        return make(kind, name, bases, content)

    typing.NamedTupleMeta.__new__ = turn

from sgm import Adaptive, Bayesian, Clock, Finder, ObjectFinder, SceneGraphMemory, Sighting
from sgm.finder.service import MemoryService

memory = SceneGraphMemory(clock=Clock(datetime(2026, 3, 2, 7), 1800))
kitchen, hall = memory.add_room("kitchen"), memory.add_room("hall")
places = [memory.add_furniture(*one) for one in (
    ("fridge", kitchen), ("table", kitchen), ("sink", kitchen), ("table", hall), ("shelf", hall),
)]
things = ("red mug", "blue mug", "milk", "keys", "book", "gizmo")
for step in range(40):
    memory.step(1 + step % 3)
    place = step * 7 % 5
    seen = [name for number, name in enumerate(things) if (step * number + number) % 5 == place]
    coverage = {"in": 0.2, "onTop": 0.9} if step % 11 == 10 else 1 - step % 4 / 10
    memory.observe(places[place], [Sighting(name) for name in seen], coverage)
memory.observe(places[1], [Sighting("red mug"), Sighting("red mug", confidence=0.7)])
memory.note_moved("keys", places[3], by="anna")
finders = (ObjectFinder.load(), Finder(Adaptive()), Finder(Bayesian()))
answers = [repr(finder.rank(memory, thing)) for finder in finders for thing in (*things, "vase")]
plain = SceneGraphMemory()
plain.observe(plain.add_furniture("desk", plain.add_room("hall")), [Sighting("mug")])
answers.append(repr(MemoryService(plain, finders[2]).where_is("the red mug and the keys")))
print(json.dumps([answers, turned]))
"""


def answer(python, order):
    done = subprocess.run(
        [python, "-c", ANSWERS, order], capture_output=True, text=True, check=True, cwd=ROOT
    )
    answers, turned = json.loads(done.stdout)
    return answers, set(turned)


def list_named_tuples(package):
    """Names of all named tuples of a package, and its modules by path."""
    folder = Path(find_spec(package).origin).parent  # where it is installed
    modules = {path: ast.parse(path.read_text("utf-8")) for path in folder.rglob("*.py")}
    kinds = {
        node.name
        for module in modules.values()
        for node in ast.walk(module)
        if isinstance(node, ast.ClassDef)
        and any(isinstance(base, ast.Name) and base.id == "NamedTuple" for base in node.bases)
    }
    return kinds, modules


@pytest.mark.slow
def test_fields_may_stand_in_any_order(python):
    expected, _ = answer(python, "declared")
    found, turned = answer(python, "turned")
    assert found == expected
    assert turned == list_named_tuples("sgm")[0]
    assert len(turned) > 10


@pytest.mark.slow
@pytest.mark.parametrize("package", ["sgm", "simulator"])
def test_all_are_made_by_name(package):
    kinds, modules = list_named_tuples(package)
    found = []
    for path, module in modules.items():
        for outer in ast.walk(module):
            own = {outer.name} & kinds if isinstance(outer, ast.ClassDef) else set()
            for node in ast.walk(outer) if own or outer is module else ():
                if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
                    is_kind = node.func.id in kinds or (own and node.func.id == "cls")
                    by_order = [one for one in node.args if not isinstance(one, ast.Starred)]
                    if is_kind and by_order:  # a starred one takes over all fields of another
                        found.append(f"{path}:{node.lineno}")
    assert kinds
    assert sorted(set(found)) == []
