"""`python -m sgm.eyes`: the map of a memory as YAML, corrected by a person, and taken again."""

import pytest
import yaml

from sgm import SceneGraphMemory
from sgm.eyes import Box
from sgm.eyes.__main__ import main
from sgm.memory.sighting import Sighting
from sgm.ros import HomeMap


@pytest.fixture
def files(tmp_path):
    """A memory with two rooms of one label, a spot, and a polygon; its file, log and map."""
    memory = SceneGraphMemory(path=tmp_path / "looks.sgm")
    rooms = [memory.add_room("bedroom"), memory.add_room("bedroom")]
    memory.add_furniture("fridge", rooms[0], 'the "big" fridge: white', open_cost=2.0,
                         box=Box((1, 2, 0.85), (0.6, 0.65, 1.7), 1.57, "door"))  # fmt: skip
    memory.add_furniture(
        "counter",
        rooms[1],
        position=(3, 4),
        box=Box.of_polygon([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)], 0, 1),
    )
    spot = memory.add_furniture("spot", rooms[1], box=Box((5, 5, 0.5), (0.5, 0.5, 0.04)))
    memory.add_furniture("shelf", rooms[0])  # no camera can see it
    memory.observe(spot, [Sighting("keys")])
    memory.save(tmp_path / "home.sgm")
    return tmp_path


def run(files, *arguments):
    return main([str(files / one) if "." in one else one for one in arguments])


def test_a_map_goes_there_and_back(files, capsys):
    for source in ("home.sgm", "looks.sgm"):
        assert run(files, "map", source, "--out", "map.yaml") == 0
        assert "2 rooms, 3 pieces of furniture" in capsys.readouterr().out
        data = yaml.safe_load((files / "map.yaml").read_text("utf-8"))
        again = SceneGraphMemory()
        HomeMap.from_values(data).add_to(again)
        memory = SceneGraphMemory.load(files / "home.sgm")
        known = [row for row in memory.layout.furniture.values() if row.box is not None]
        for row, own in zip(again.layout.furniture.values(), known, strict=True):
            assert (row.label, row.description) == (own.label, own.description)
            assert (row.room, row.position, row.open_cost) == (
                own.room,
                own.position,
                own.open_cost,
            )
            assert row.box.center == pytest.approx(own.box.center, abs=1e-3)
            assert row.box.interior == own.box.interior
    assert run(files, "correct", "home.sgm", "--map", "map.yaml") == 0
    assert "nothing to correct" in capsys.readouterr().out


def test_corrections_are_taken(files, capsys):
    run(files, "map", "home.sgm", "--out", "map.yaml")
    data = yaml.safe_load((files / "map.yaml").read_text("utf-8"))
    fridge, _, spot = data["furniture"]
    spot.update(name="key board", label="hook")
    fridge.update(center=[4.0, 2.0, 0.85], interior="open", room="hall")
    data["rooms"].append("hall")
    data["furniture"] = [
        fridge,
        spot,
        {"name": "bench", "room": "hall", "center": [9, 9, 0.2], "size": [1, 1, 0.4]},
    ]
    (files / "map.yaml").write_text(yaml.safe_dump(data))
    assert run(files, "correct", "home.sgm", "--map", "map.yaml") == 0
    said = capsys.readouterr().out
    for part in ("1 rooms added", "furniture removed", "furniture added", "renamed", "moved"):
        assert part in said
    memory = SceneGraphMemory.load(files / "home.sgm")
    names = [memory.describe(number) for number in memory.furniture_ids]
    assert names == [
        'the "big" fridge: white in hall',
        "key board in bedroom",
        "shelf in bedroom",
        "bench in hall",
    ]
    assert memory.last_seen("keys").furniture == spot["id"]  # what was seen there stays
    assert memory.layout.furniture[fridge["id"]].box.interior == "open"


@pytest.mark.parametrize(
    ("field", "value", "part"),
    [("open_cost", 6.5, "costs of opening changed"), ("position", [9.0, 8.0], "furniture moved")],
)
def test_a_correction_of_a_single_field_is_taken_over(files, capsys, field, value, part):
    """Of these alone nothing was said, and nothing done."""
    run(files, "map", "home.sgm", "--out", "map.yaml")
    data = yaml.safe_load((files / "map.yaml").read_text("utf-8"))
    fridge = data["furniture"][0]
    fridge[field] = value
    (files / "map.yaml").write_text(yaml.safe_dump(data))
    assert run(files, "correct", "home.sgm", "--map", "map.yaml") == 0
    assert part in capsys.readouterr().out
    node = SceneGraphMemory.load(files / "home.sgm").layout.furniture[fridge["id"]]
    assert getattr(node, field) == (tuple(value) if field == "position" else value)
    assert run(files, "correct", "home.sgm", "--map", "map.yaml") == 0
    assert part not in capsys.readouterr().out


def test_bad_maps_are_one_line(files, capsys):
    for text, message in (
        ("a: [", "map must be YAML"),
        ("[]", "map must have rooms and furniture"),
        (
            "rooms: [a]\nfurniture: [{name: b, room: a, center: [0,0,0], size: [1,1,1], id: 99}]",
            "id of furniture must be one of the memory, got 99",
        ),
        (
            "rooms: [a]\nfurniture: [{name: b, room: a, center: [0,0,0], size: [1,1,1], id: x}]",
            "must be a whole number, got 'x'",
        ),
    ):
        (files / "map.yaml").write_text(text)
        assert run(files, "correct", "home.sgm", "--map", "map.yaml") == 1
        error = capsys.readouterr().err
        assert message in error
        assert error.count("\n") == 1
    assert run(files, "map", "none.sgm", "--out", "map.yaml") == 1
    assert "memory file must be one that can be read" in capsys.readouterr().err
