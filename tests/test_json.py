"""JSON of files: what is wrong with it is said in words, by every loader, with the file's name."""

import json

import pytest

from nep.players.checkpoints import load_config
from nep.report.results import Results
from sgm.files import parse_json, read_json
from sgm.prior.prior_graph import load_prior
from simulator import SceneGraphMemory
from simulator.snapshots.shards import load_manifest
from simulator.trace import load_trace
from simulator.trace.importers.procthor import read_procthor

DEEP = b"[" * 100_000 + b"]" * 100_000
FAULTS = {
    "deep": (DEEP, "nested too deeply"),
    "twice": (b'{"a": 1, "b": {"a": 1, "a": 2}}', "the key 'a' twice in one object"),
    "nan": (b'{"a": NaN}', "NaN, which is no JSON"),
    "infinite": (b'{"a": [-Infinity]}', "-Infinity, which is no JSON"),
    "huge": (b"1" * 5_000, "Exceeds the limit"),
    "bytes": (b'{"a": "\xff"}', "can't decode byte 0xff in position 7"),
    "cut": (b'{"a": ', "line 1 column 7"),
}


def test_good_json(tmp_path):
    value = {"a": [1, 2.5, None, True, "ü"], "b": {"a": {}}}
    assert parse_json(json.dumps(value)) == value
    (tmp_path / "file").write_bytes(json.dumps(value, ensure_ascii=False).encode("utf-8-sig"))
    assert read_json(tmp_path / "file") == value
    assert parse_json("[Infinity]", allow_nan=True) == [float("inf")]


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_are_said_in_words(fault):
    content, message = FAULTS[fault]
    with pytest.raises(ValueError, match=message):
        parse_json(content)


LOADERS = {
    "layout.json": lambda path: load_trace(path.parent),
    "simulation.json": lambda path: load_trace(path.parent),
    "manifest.json": lambda path: load_manifest(path.parent),
    "home.sgm": SceneGraphMemory.load,
    "prior.json": load_prior,
    "config.json": lambda path: load_config(path.parent),
    "results.json": Results.load,
    "house.json": lambda path: read_procthor(path, ()),
}


@pytest.mark.parametrize("fault", ["deep", "bytes", "huge", "cut"])
@pytest.mark.parametrize("name", LOADERS)
def test_every_loader_answers_in_one_line(name, fault, tmp_path):
    (tmp_path / "layout.json").write_text(
        '{"rooms": ["kitchen"], "furniture": [{"name": "table", "room": "kitchen"}]}'
    )
    (tmp_path / "events.csv").write_text("time_s,object,furniture,relation\n0,mug,table,onTop\n")
    path = tmp_path / name
    path.write_bytes(FAULTS[fault][0])
    with pytest.raises(ValueError, match=str(tmp_path)):
        LOADERS[name](str(path) if name == "prior.json" else path)
