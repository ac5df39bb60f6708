"""Files that earlier versions wrote are read as they always were: memories, logs, their trace.

`earlier_files` holds what one session left behind, written by the version of the package that had
the format in its name, and in `expected.json` what version 4 of the code read of it.
"""

import json
from pathlib import Path

import pytest

from sgm.memory.look_log import read_log
from sgm.memory.replay import replay
from simulator import PriorGraph, SceneGraphMemory

FILES = Path(__file__).parent / "earlier_files"
EXPECTED = json.loads((FILES / "expected.json").read_text(encoding="utf-8"))
DERIVED = ("home", "key", "label", "type", "prior")  # columns that are looked up, never written


def list_content(memory):
    """List all that was observed, by table and column, and the home."""
    batch, layout = memory.batch, memory.layout
    tables = {
        f"{table} {name}": getattr(batch, table)[name].tolist()
        for table in ("objects", "edges")
        for name in getattr(batch, table).names
        if name not in DERIVED
    }
    return tables | {
        "time": batch.time,
        "clock": None if memory.clock is None else memory.clock.to_json(),
        "labels": list(batch.labels),
        "descriptions": list(memory.descriptions),
        "rooms": [[number, room.label] for number, room in layout.rooms.items()],
        "furniture": [
            [number, row.label, row.room, row.description, row.position and list(row.position)]
            for number, row in layout.furniture.items()
        ],
        "furniture num_observed": batch.furniture_num_observed[0].tolist(),
        "furniture last_observed": batch.furniture_last_observed[0].tolist(),
        "history": batch.history.to_json(),
    }


@pytest.mark.parametrize("version", [1, 2, 3, 4])
def test_a_memory_of_every_version_is_read(version, tmp_path):
    name = f"home_v{version}.sgm"
    memory = SceneGraphMemory.load(FILES / name, prior=PriorGraph.household())
    content = list_content(memory)
    assert {key: content[key] for key in EXPECTED[name]} == EXPECTED[name]
    memory.save(tmp_path / name)
    assert list_content(SceneGraphMemory.load(tmp_path / name)) == content


@pytest.mark.parametrize("version", [1, 2])
def test_a_log_of_every_version_is_replayed(version):
    name = f"looks_v{version}.jsonl"
    *_, (memory, _, _) = replay(read_log(FILES / name))
    content = list_content(memory)
    assert {key: content[key] for key in EXPECTED[name]} == EXPECTED[name]
