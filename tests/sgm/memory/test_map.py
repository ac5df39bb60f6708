"""The map that positions are in: a memory of another one is refused, or moved into it."""

import math

import pytest

from sgm.layout.box import Box
from sgm.memory.memory_event import read_events
from sgm.replay.replay import replay
from simulator import SceneGraphMemory, Sighting
from tests.sgm.memory.sessions import dump


@pytest.fixture
def memory(tmp_path):
    """A desk with a position, a shelf with a box, a bed with neither, on the old map."""
    memory = SceneGraphMemory(path=tmp_path / "looks.sgm", map_id="old")
    room = memory.add_room("study")
    desk = memory.add_furniture("desk", room, position=(1.0, 2.0))
    memory.add_furniture("shelf", room, box=Box((3.0, 0.0, 0.5), (0.4, 1.0, 1.0), yaw=0.5))
    memory.add_furniture("bed", room)
    memory.observe(desk, [Sighting("pen")])
    memory.save(tmp_path / "home.sgm")
    return memory


def test_a_memory_of_another_map_is_refused(memory, tmp_path):
    file = tmp_path / "home.sgm"
    assert SceneGraphMemory.load(file).map_id == "old"
    assert SceneGraphMemory.load(file, map_id="old").map_id == "old"
    with pytest.raises(
        ValueError, match=r"must be of the map .*'new', got one of 'old' for .*tran"
    ):
        SceneGraphMemory.load(file, map_id="new")


def test_a_memory_without_a_map_takes_the_one_that_is_given(tmp_path):
    SceneGraphMemory().save(tmp_path / "home.sgm")
    memory = SceneGraphMemory.load(tmp_path / "home.sgm", map_id="first")
    memory.save(tmp_path / "home.sgm")
    assert SceneGraphMemory.load(tmp_path / "home.sgm").map_id == "first"


def test_positions_and_boxes_are_moved_into_another_map(memory):
    """Turned by a quarter, (x, y) is (-y, x); then moved by (10, 0)."""
    before = memory.places_of("pen")
    memory.transform(math.pi / 2, (10, 0), map_id="new")
    desk, shelf, bed = memory.layout.furniture.values()
    assert desk.position == pytest.approx((8.0, 1.0))
    assert shelf.box.center == pytest.approx((10.0, 3.0, 0.5))
    assert shelf.box.yaw == pytest.approx(0.5 + math.pi / 2)
    assert (bed.position, bed.box) == (None, None)
    assert memory.map_id == "new"
    assert memory.places_of("pen") == before
    memory.transform(0.0, (-10, 0))
    memory.transform(-math.pi / 2)
    desk, shelf, _ = memory.layout.furniture.values()
    assert desk.position == pytest.approx((1.0, 2.0))
    assert shelf.box.center == pytest.approx((3.0, 0.0, 0.5))


def test_it_is_logged_and_saved(memory, tmp_path):
    memory.transform(1.0, (0.5, 0.1 + 0.2), map_id="new")
    memory.step()
    *_, (again, _, _) = replay(read_events(tmp_path / "looks.sgm"))
    memory.save(tmp_path / "home.sgm")
    loaded = SceneGraphMemory.load(tmp_path / "home.sgm", map_id="new")
    assert dump(again) == dump(loaded) == dump(memory)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((math.nan,), "angle must"),
        ((0.0, (1,)), "position must be two numbers|shift must"),
        ((0.0, None), "shift must be two numbers, got None"),
        ((0.0, (1, 2, 0.3)), "shift must be two numbers, got .*: heights stay as they are"),
        ((0.0, (0, 0), "a\nb"), "map_id must be a text of one line"),
        ((0.0, (1e9, 0)), "box must lie within"),
    ],
)
def test_bad_transforms_change_nothing(memory, tmp_path, arguments, message):
    before = dump(memory), (tmp_path / "looks.sgm").read_bytes()
    with pytest.raises(ValueError, match=message):
        memory.transform(*arguments)
    assert (dump(memory), (tmp_path / "looks.sgm").read_bytes()) == before
