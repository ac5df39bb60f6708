"""Registries of Home Assistant as a map, from files in their form."""

import json

import pytest

from sgm import SceneGraphMemory
from simulator.trace.__main__ import main
from simulator.trace.importers.home_assistant import read_home_assistant


def registry(kind, rows, name):
    return {
        "version": 1, "minor_version": 8, "key": f"core.{kind}_registry", "data": {name: rows}
    }  # fmt: skip


AREAS = [
    {"id": "kitchen", "name": "Kitchen", "aliases": [], "floor_id": None, "icon": None},
    {"id": "wohnzimmer", "name": "Living Room", "aliases": [], "floor_id": "ground"},
    {"id": "hall", "name": "Hall"},
    {"name": None},
]
DEVICES = [
    {"id": "d1", "name": "Samsung RF28", "name_by_user": "Kitchen Fridge", "area_id": "kitchen"},
    {"id": "d2", "name": "Bosch Dishwasher", "name_by_user": None, "area_id": "kitchen"},
    {"id": "d3", "name": "Hue bridge", "name_by_user": None, "area_id": "hall"},
    {"id": "d4", "name": "Old oven", "name_by_user": None, "area_id": "kitchen",
     "disabled_by": "user"},
    {"id": "d5", "name": "Sofa light strip sofa", "name_by_user": None, "area_id": None},
]  # fmt: skip
ENTITIES = [
    {"entity_id": "sensor.fridge_temperature", "device_id": "d1", "area_id": None,
     "name": None, "original_name": "Temperature fridge"},
    {"entity_id": "cover.wardrobe", "device_id": None, "area_id": "hall", "name": None,
     "original_name": None},
    {"entity_id": "light.desk", "device_id": "d3", "area_id": "wohnzimmer", "name": "Desk",
     "original_name": "Light"},
    {"entity_id": "light.desk_2", "device_id": None, "area_id": "wohnzimmer", "name": "desk"},
    {"entity_id": "light.ceiling", "device_id": None, "area_id": "wohnzimmer", "name": "Ceiling"},
]  # fmt: skip


@pytest.fixture
def config(tmp_path):
    write_config(tmp_path / "config")
    return tmp_path / "config"


def write_config(folder):
    storage = folder / ".storage"
    storage.mkdir(parents=True)
    for kind, rows, name in (
        ("area", AREAS, "areas"), ("device", DEVICES, "devices"), ("entity", ENTITIES, "entities")
    ):  # fmt: skip
        (storage / f"core.{kind}_registry").write_text(json.dumps(registry(kind, rows, name)))


def test_areas_are_rooms_and_some_devices_furniture(config):
    trace, builder = read_home_assistant(config)
    rooms = {number: room.label for number, room in trace.layout.rooms.items()}
    found = [
        (piece.label, piece.description, rooms[piece.room])
        for piece in trace.layout.furniture.values()
    ]
    assert found == [
        ("fridge", "fridge", "kitchen"),
        ("dishwasher", "bosch dishwasher", "kitchen"),
        ("wardrobe", "wardrobe", "hall"),
        ("desk", "desk", "living room"),  # named twice, in another area than its device
    ]
    assert trace.events == ()
    assert dict(builder.left_out) == {
        "an area without id and name": ["{'name': None}"],
        "no furniture": ["Hue bridge", "Ceiling"],
        "disabled": ["Old oven"],
        "in no area": ["Sofa light strip sofa"],
    }


@pytest.mark.parametrize("name", ["_", "a\nb", "\0", "\ud800", "x" * 300, "", None, 7, ["a"]])
def test_what_has_no_name_is_left_out(config, name):
    for kind, rows, among in (("area", AREAS, "areas"), ("device", DEVICES, "devices")):
        changed = [rows[0] | {"name": name, "name_by_user": name}, *rows[1:]]
        path = config / ".storage" / f"core.{kind}_registry"
        path.write_text(json.dumps(registry(kind, changed, among)))
        trace, builder = read_home_assistant(config)
        assert "desk" in [piece.label for piece in trace.layout.furniture.values()]
        assert "fridge" not in [piece.label for piece in trace.layout.furniture.values()]
        assert len(builder.left_out["an area without id and name"]) == 2


def test_labels_of_ones_own_are_furniture(config):
    trace, _ = read_home_assistant(config, ["bridge"])
    assert "hue bridge" in [piece.description for piece in trace.layout.furniture.values()]


def test_folder_storage_and_file_are_the_same(config):
    whole, _ = read_home_assistant(config)
    for path in (config / ".storage", config / ".storage" / "core.area_registry"):
        assert read_home_assistant(path)[0].layout == whole.layout


def test_the_map_is_a_memory_that_has_looked_at_nothing(config, tmp_path, capsys):
    memory = tmp_path / "home.sgm"
    assert main(["import", "home-assistant", str(config), "--memory", str(memory)]) == 0
    assert "placed: 3 rooms, 4 furniture nodes, 0 objects" in capsys.readouterr().out
    loaded = SceneGraphMemory.load(memory)
    assert loaded.find_furniture("the fridge in the kitchen") == (0,)
    assert loaded.descriptions == ()


@pytest.mark.parametrize(
    ("kind", "content", "error"),
    [
        ("area", None, "must have the file core.area_registry"),
        ("area", "{", "registry must be JSON"),
        ("area", "[]", "must have the list 'areas'"),
        ("device", '{"data": {"devices": {}}}', "must have the list 'devices'"),
        ("area", '{"data": {"areas": []}}', "home must have a room that can be placed"),
        ("device", '{"data": {"devices": []}}', None),
    ],
)
def test_bad_registries_end_in_one_line(config, tmp_path, capsys, kind, content, error):
    path = config / ".storage" / f"core.{kind}_registry"
    if content is None:
        path.unlink()
    else:
        path.write_text(content)
    status = main(["import", "home-assistant", str(config), "--out", str(tmp_path / "out")])
    assert status == (error is not None)
    said = capsys.readouterr()
    if error is not None:
        assert (said.out, said.err.count("\n")) == ("", 1)
        assert error in said.err
