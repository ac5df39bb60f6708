"""A memory hands each call to one part, and each part can be read alone."""

import inspect
import re
from pathlib import Path

import pytest

from sgm.memory.memory_clock import MemoryClock
from sgm.memory.memory_files import MemoryFiles
from sgm.memory.memory_layout import MemoryLayout
from sgm.memory.memory_looks import MemoryLooks
from sgm.memory.memory_questions import MemoryQuestions
from sgm.memory.memory_statements import MemoryStatements
from sgm.memory.memory_things import MemoryThings
from simulator import SceneGraphMemory
from tests.imports import find_imports

PARTS = (
    MemoryLayout,
    MemoryLooks,
    MemoryClock,
    MemoryQuestions,
    MemoryThings,
    MemoryStatements,
    MemoryFiles,
)
# Makes or copies a memory, asks a part for each kind of what is forgotten, or names the parts.
OTHER_CALLS = {"load", "open", "copy", "forget", "parts"}
CALLS = sorted(
    name for name in vars(SceneGraphMemory) if not name.startswith("_") and name not in OTHER_CALLS
)


@pytest.mark.parametrize("name", CALLS)
def test_a_call_is_that_of_one_part(name):
    (own,) = (vars(part)[name] for part in PARTS if name in vars(part))
    shown = vars(SceneGraphMemory)[name]
    assert type(shown) is type(own)
    if isinstance(shown, property):
        shown, own = shown.fget, own.fget
    given, taken = inspect.signature(shown), inspect.signature(own)
    both = zip(given.parameters.values(), taken.parameters.values(), strict=False)
    assert all(left == right for left, right in both)
    # A log may say more: which node was meant, and who said so.
    more = [*taken.parameters.values()][len(given.parameters) :]
    assert not more or name in ("remove_furniture", "remove_object")
    assert given.return_annotation == taken.return_annotation
    assert inspect.getdoc(shown)


@pytest.mark.parametrize("part", PARTS)
def test_a_part_stands_alone(part):
    assert part.__bases__ == (object,)
    imported = find_imports(Path(inspect.getfile(part)).read_text("utf-8"), "sgm.memory")
    assert "sgm.memory.memory_state.MemoryState" in imported
    files = {other.__module__ for other in (*PARTS, SceneGraphMemory)}
    assert {name.rpartition(".")[0] for name in imported} & files == set()
    assert [*inspect.signature(part).parameters] == ["state"]


def test_parts_share_one_state():
    memory = SceneGraphMemory()
    parts = [value for value in vars(memory).values() if isinstance(value, PARTS)]
    assert len(parts) == len(PARTS)
    assert {id(part._state) for part in parts} == {id(memory._state)}
    assert memory.copy()._state is not memory._state


def test_what_is_made_of_logs_reads_no_private_name_of_a_memory():
    replay = Path(inspect.getfile(SceneGraphMemory)).parents[1] / "replay"
    texts = {path.name: path.read_text("utf-8") for path in replay.glob("*.py")}
    assert {name for name, text in texts.items() if re.search(r"memory\._[a-z]", text)} == set()
