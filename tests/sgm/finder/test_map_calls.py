"""The map by calls in words: all that Python can change of it, and a whole map at once."""

import inspect

import pytest

from sgm.eyes import Box
from sgm.finder.finder import Finder
from sgm.finder.map_calls import MapCalls
from sgm.finder.service import MemoryService
from sgm.memory.memory_layout import MemoryLayout
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.policies import Bayesian
from sgm.serve.calls import BY_NAME
from tests.sgm.memory.sessions import dump

# What a call of `SceneGraphMemory` that changes the map is called here; names say place.
CALLED = {
    "add_room": "add_room",
    "rename_room": "rename_room",
    "remove_room": "remove_room",
    "add_furniture": "add_place",
    "name_furniture": "name_place",
    "move_furniture": "move_place",
    "merge_furniture": "merge_places",
    "remove_furniture": "remove_place",
    "transform": "transform_map",
}
FRIDGE = {"center": [1, 4, 0.9], "size": [0.7, 0.6, 1.8], "yaw": 1.57, "interior": "door"}
MAP = {
    "rooms": [
        "kitchen",
        {"name": "bedroom 1", "label": "bedroom"},
        {"name": "bedroom 2", "label": "bedroom", "floor": [[5, 0], [9, 4]]},
    ],
    "furniture": [
        {"name": "white fridge", "label": "fridge", "room": "kitchen", **FRIDGE, "open_cost": 2},
        {"name": "bed", "room": "bedroom 1", "position": [3, 1, 0]},
        {"name": "bed", "room": "bedroom 2", "center": [7, 2, 0.3], "size": [2, 1.6, 0.6]},
        {
            "name": "counter",
            "room": "kitchen",
            "polygon": [[0, 0], [2, 0], [2, 1], [0, 3]],
            "bottom": 0,
            "top": 0.9,
        },
    ],
}


@pytest.fixture
def service():
    return MemoryService(SceneGraphMemory(), Finder(Bayesian()), now=None)


def test_all_that_python_changes_of_a_map_can_be_called():
    """Both lists, as they are: a call that is new in one of them is missing in the other."""
    writing = {
        name
        for name, method in inspect.getmembers(MemoryLayout, inspect.isfunction)
        if not name.startswith("_") and "write(" in inspect.getsource(method)
    }
    assert writing == CALLED.keys()
    for name, call in CALLED.items():
        assert hasattr(SceneGraphMemory, name)
        assert BY_NAME[call].is_write
    own = {name for name in vars(MapCalls) if not name.startswith("_")}
    assert own == {*CALLED.values(), "set_map"}
    assert own <= BY_NAME.keys()


def test_a_call_takes_all_that_python_takes():
    """Of furniture: its box is said by the fields of a box."""
    for name, call in CALLED.items():
        python = set(inspect.signature(getattr(SceneGraphMemory, name)).parameters) - {"self"}
        if "box" in python:
            python |= {"center", "size", "yaw", "interior", "polygon"}
        renamed = {"furniture": "place", "description": "name", "box": None}
        wanted = {renamed.get(one, one) for one in python} - {None}
        assert wanted <= {argument.name for argument in BY_NAME[call].arguments}


def test_calls_do_as_python_does(service):
    other = SceneGraphMemory()
    service.add_room("kitchen")
    service.add_room("study")
    noted = service.add_place("fridge", "kitchen", "white fridge", **FRIDGE, open_cost=2)
    service.add_place("desk", 1, position=(6, 1, 0))
    service.add_place("shelf", "study")
    assert (noted.place, noted.room, noted.position) == (0, 0, (1.0, 4.0, 0.9))
    kitchen, study = other.add_room("kitchen"), other.add_room("study")
    box = Box((1, 4, 0.9), (0.7, 0.6, 1.8), 1.57, "door")
    other.add_furniture("fridge", kitchen, "white fridge", None, box, 2.0)
    other.add_furniture("desk", study, position=(6, 1))
    other.add_furniture("shelf", study)
    assert dump(service.memory) == dump(other)
    service.rename_room("study", "office")
    service.name_place("desk", "table", "big table")
    service.move_place("white fridge", center=(2, 4, 0.9))
    service.move_place("shelf", "kitchen", (0, 1), open_cost=3)
    other.rename_room(study, "office")
    other.name_furniture(1, "table", "big table")
    other.move_furniture(0, box=Box((2, 4, 0.9), (0.7, 0.6, 1.8), 1.57, "door"))
    other.move_furniture(2, kitchen, (0, 1), open_cost=3)
    assert dump(service.memory) == dump(other)
    service.merge_places("big table", "shelf")
    service.transform_map(1.0, (1, 2), "new")
    service.remove_place("white fridge")
    other.merge_furniture(1, 2)
    other.transform(1.0, (1, 2), "new")
    other.remove_furniture(0)
    assert dump(service.memory) == dump(other)
    service.remove_room("office")
    other.remove_room(study)
    assert dump(service.memory) == dump(other)


@pytest.mark.parametrize(
    ("call", "arguments"),
    [
        ("add_place", {"label": "rack", "room": "kitchen", "center": (0, 0, 1)}),
        ("move_place", {"place": "shelf"}),
        ("move_place", {"place": "shelf", "center": (0, 0, 1)}),
    ],
)
def test_who_gives_the_place_as_the_point_to_stand_at_is_told(service, call, arguments):
    # A robot would be told that the shelf was moved, drive there, and look 4 m back.
    size = (1, 0.3, 2)
    service.add_room("kitchen")
    service.add_place("shelf", "kitchen", center=(0, 0, 1), size=size)
    content = dump(service.memory)
    with pytest.raises(ValueError, match=r"or less from its extents, got \[3.0, 3.0\], 3.8 m away"):
        getattr(service, call)(**arguments, size=size, position=(3, 3))
    assert dump(service.memory) == content
    service.move_place("shelf", position=(3, 2), center=(3, 3, 1))
    service.move_place("shelf", position=(3, 1))
    assert service.memory.boxes[0].center == (3, 3, 1)


def test_a_map_in_one_call_and_again(service):
    noted = service.set_map(**MAP)
    assert noted.said == "3 rooms added, 5 places added"
    layout = service.memory.layout
    names = [layout.describe(number) for number in layout.furniture]
    assert names == [
        "floor of bedroom 2 in bedroom",
        "white fridge in kitchen",
        "bed in bedroom",
        "bed in bedroom",
        "counter in kitchen",
    ]
    beds = [piece.room for piece in layout.furniture.values() if piece.label == "bed"]
    assert beds == [1, 2]
    assert layout.furniture[1].open_cost == 2
    assert layout.furniture[2].position == (3, 1)
    assert len(layout.furniture[4].box.outline) == 4
    service.observe("white fridge", ["milk"])
    before = dump(service.memory)
    assert service.set_map(**MAP).said == "the map was known"
    assert dump(service.memory) == before
    moved = {**MAP, "furniture": [{**MAP["furniture"][0], "center": [2, 4, 0.9]}]}
    assert service.set_map(**moved).said == "1 place moved"
    assert service.where_is("milk").places[0].name == "white fridge in kitchen"
    assert service.memory.boxes[1].center == (2, 4, 0.9)
    costly = {**MAP, "furniture": [{**moved["furniture"][0], "open_cost": 7}]}
    assert service.set_map(**costly).said == "1 cost of opening changed"
    assert service.set_map(**costly).said == "the map was known"
    assert service.list_places("kitchen").rows[0].open_cost == 7


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ({"rooms": []}, "map must have rooms and furniture"),
        ({"furniture": [{"name": "bed", "room": "attic"}]}, "room of furniture 0 in map must be"),
        ({"furniture": [{"name": "bed"}]}, "furniture 0 in map must have the fields name, room"),
        ({"furniture": [{"name": "bed", "room": "kitchen", "colour": 1}]}, "got .*colour"),
        (
            {"furniture": [{"name": "bed", "room": "kitchen", "center": [1, 2, 3]}]},
            "extents of furniture 0 in map must be center and size, or polygon.*got no size",
        ),
        (
            {
                "furniture": [
                    {"name": "bed", "room": "kitchen", "size": [0, 1, 1], "center": [0] * 3}
                ]
            },
            "furniture 0 in map: size of a box must be at least",
        ),
    ],
)
def test_a_malformed_map_changes_nothing(service, change, line):
    before = dump(service.memory)
    with pytest.raises(ValueError, match=line):
        service.set_map(**{**MAP, **change})
    assert dump(service.memory) == before


def test_extents_are_whole(service):
    service.add_room("kitchen")
    for extents, line in (
        ({"center": (1, 2, 3)}, "extents of place must be .* got no size"),
        ({"yaw": 1.0}, "got no center and no size"),
        ({"polygon": [(0, 0), (1, 0), (0, 1)], "top": 1}, "got no bottom"),
        ({"center": (1, 2, 3), "size": (1, 1, 1), "top": 1}, "got top"),
        ({"center": (1, 2, 3), "size": (1, 1, 1), "interior": "deep"}, "interior of a box must be"),
        ({"position": (1,)}, "position of place must be"),
        ({"open_cost": -1}, "open_cost must be a finite number"),
    ):
        with pytest.raises(ValueError, match=line):
            service.add_place("fridge", "kitchen", **extents)
    assert not service.memory.num_furniture


def test_rooms_and_places_that_are_unclear_are_asked_for(service):
    service.set_map(**MAP)
    before = dump(service.memory)
    assert service.rename_room("bedroom", "study").status == "ambiguous"
    assert service.remove_room("attic").status == "unknown"
    assert service.move_place("bed", "kitchen").status == "ambiguous"
    assert dump(service.memory) == before
    assert service.rename_room(2, "study").said == "bedroom is called study"
    with pytest.raises(KeyError, match="room must be an id"):
        service.remove_room(9)


def test_candidates_of_rooms_of_one_name_are_rooms_to_call_again_with(service):
    """Of two bedrooms it was asked for one without a namesake, and there was none."""
    service.set_map(**MAP)
    asked = service.add_place("desk", "bedroom")
    assert asked.candidates == ("bedroom (room 1)", "bedroom (room 2)")
    assert asked.ask == "Do you mean the bedroom (room 1) or the bedroom (room 2)?"
    for number, candidate in enumerate(asked.candidates, start=1):
        assert service.add_place("desk", candidate).room == number
        assert {row.room_id for row in service.list_places(candidate).rows} == {number}
    assert service.rename_room("bedroom (room 2)", "study").room == 2
    assert service.rename_room("bedroom (room 9)", "study").status == "unknown"


def test_what_opening_costs_may_be_corrected(service, tmp_path):
    """No call changed it, and a map that was sent again with another cost was "known"."""
    service.memory.save(tmp_path / "home.sgm")
    memory = SceneGraphMemory.open(tmp_path / "home.sgm")
    kitchen = memory.add_room("kitchen")
    fridge = memory.add_furniture("fridge", kitchen, position=(1, 1))
    memory.observe(fridge, [Sighting("milk", "in")])
    finder = Finder(Bayesian())
    assert finder.search(memory, "milk").next().cost == 1
    memory.move_furniture(fridge, open_cost=4)
    assert finder.search(memory, "milk").next().cost == 5
    assert memory.get_position(fridge) == (1, 1)
    memory.move_furniture(fridge, position=(2, 1))
    assert SceneGraphMemory.load(tmp_path / "home.sgm").layout.furniture[fridge].open_cost == 4
    with pytest.raises(ValueError, match="open_cost must be a finite number"):
        memory.move_furniture(fridge, open_cost=-1)


@pytest.mark.parametrize("room", ["kitchen", "bath", "living room", "pantry"])
def test_the_name_of_a_room_is_no_floor_of_it(service, room):
    """With a floor of a map, or a "kitchen table", nothing was known in the kitchen."""
    service.set_map(
        rooms=[{"name": room, "floor": [[0, 0], [3, 2]]}, "hall"],
        furniture=[
            {"name": "sink", "room": room},
            {"name": f"{room} table", "room": room},
            {"name": "bench", "room": "hall"},
        ],
    )
    service.observe("sink", ["towel", "soap"])
    service.observe(f"{room} table", ["bowl"])
    service.observe("bench", ["hat"])
    said = service.ask(f"what is in the {room}?").said
    assert all(thing in said for thing in ("towel", "soap", "bowl"))
    assert "hat" not in said
    assert service.ask(f"is the towel in the {room}?").said.startswith("Yes")
    assert service.where_is(f"the towel in the {room}").places[0].name == f"sink in {room}"
    assert "bowl" in service.ask(f"what is on the {room} table?").said
    assert "Nothing is known" in service.ask(f"what is on the floor of the {room}?").said
    assert service.list_things(room).status == "ambiguous"
