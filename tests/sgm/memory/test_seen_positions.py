"""Where things were seen in the map: what is kept, what is forgotten, what other calls do to it."""

import math

import numpy as np
import pytest

from sgm.layout.box import Box
from sgm.memory.memory_event import read_events
from sgm.replay.replay import replay
from sgm.store.home_reader import HomeReader
from simulator import SceneGraphMemory, Sighting
from tests.sgm.memory.sessions import dump

COUNTER = Box((2.0, 3.0, 0.45), (0.6, 2.0, 0.9))
TABLE = Box((5.0, 3.0, 0.4), (0.8, 1.2, 0.8))
AT = (1.9, 3.1, 0.95)


@pytest.fixture
def memory(tmp_path):
    """A counter 0 and a table 1."""
    memory = SceneGraphMemory(path=tmp_path / "looks.sgm")
    room = memory.add_room("kitchen")
    memory.add_furniture("counter", room, box=COUNTER)
    memory.add_furniture("table", room, box=TABLE)
    return memory


def see(memory, place, *positions, name="mug", **about):
    memory.observe(place, [Sighting(name, position=at, **about) for at in positions])


def find(memory, name="mug"):
    """Positions of a thing by place, of the latest sighting there."""
    return {seen.furniture: seen.position for seen in reversed(memory.places_of(name))}


def test_the_last_position_and_its_error_are_kept(memory):
    see(memory, 0, AT, position_sd=0.02)
    memory.step()
    see(memory, 0, (1.8, 2.5, 0.95))
    (seen,) = memory.places_of("mug")
    assert seen.position == (1.8, 2.5, 0.95)
    assert seen.position_sd is None
    memory.step()
    see(memory, 0, AT, position_sd=0.03)
    assert memory.last_seen("mug").position_sd == 0.03
    (seen,) = memory.to_dict()["rooms"][0]["furniture"][0]["objects"]
    assert seen["position"] == list(AT)


def test_the_usual_position_is_a_mean_that_no_outlier_moves_far(memory):
    """Thrice at x = 1 and once 3 m away: a step of 0.3 m / 4. Then the mean goes on, of five."""
    for x in (1.0, 1.0, 1.0, 4.0):
        see(memory, 0, (x, 3.0, 0.9))
        memory.step()
    assert memory.last_seen("mug").usual_position == pytest.approx((1.075, 3.0, 0.9))
    see(memory, 0, (1.175, 3.0, 0.9))
    assert memory.last_seen("mug").usual_position == pytest.approx((1.095, 3.0, 0.9))


def test_a_habit_may_change(memory):
    for x in [1.0] * 50 + [1.2] * 50:
        see(memory, 0, (x, 3.0, 0.9))
        memory.step()
    assert memory.last_seen("mug").usual_position[0] > 1.17  # a mean of all would be 1.1


def test_a_look_without_a_position_leaves_it(memory):
    see(memory, 0, AT)
    memory.step()
    see(memory, 0, None)
    assert find(memory) == {0: AT}


def test_what_a_look_misses_has_no_position_until_it_is_seen_again(memory):
    see(memory, 0, AT)
    memory.step()
    memory.observe(0, [])
    assert find(memory) == {0: None}
    assert memory.last_seen("mug").usual_position == AT
    memory.step()
    see(memory, 0, None)  # it came back, nobody knows to where
    assert find(memory) == {0: None}
    see(memory, 0, (2.0, 2.0, 0.95))
    assert find(memory) == {0: (2.0, 2.0, 0.95)}


def test_each_place_and_relation_has_its_own(memory):
    see(memory, 0, AT)
    spoon = Sighting("spoon", "in", position=(5.0, 3.0, 0.4))
    memory.observe(1, [Sighting("mug", position=(5.0, 3.0, 0.85)), spoon])
    assert find(memory) == {0: None, 1: (5.0, 3.0, 0.85)}  # it was moved there
    assert find(memory, "spoon") == {1: (5.0, 3.0, 0.4)}


def test_a_doubtful_sighting_has_none(memory):
    see(memory, 0, AT)
    doubted = Sighting("mug", confidence=0.4, position=(2.0, 2.0, 0.9))
    memory.observe(0, [doubted, Sighting("cup")])
    assert memory.batch.positions["x"].tolist() == [1.9]


def test_of_several_of_a_kind_the_nearest_to_the_last_one_counts_else_the_surest(memory):
    seen = [Sighting("mug", confidence=0.7, position=AT), Sighting("mug", position=(2, 2, 0.95))]
    memory.observe(0, seen)
    assert find(memory) == {0: (2.0, 2.0, 0.95)}
    memory.step()
    see(memory, 0, AT, (2.0, 2.1, 0.95))
    assert find(memory) == {0: (2.0, 2.1, 0.95)}


def test_what_is_said_of_a_thing_ends_its_position(memory):
    for act in (
        lambda: memory.picked_up("mug"),
        lambda: memory.put_down("mug", 0),
        lambda: memory.note_moved("mug", 1, by="anna"),
    ):
        see(memory, 0, AT)
        act()
        assert find(memory)[0] is None
    memory.step()
    see(memory, 1, (5.0, 3.0, 0.85))
    assert find(memory)[1] == (5.0, 3.0, 0.85)


def test_one_of_several_that_is_moved_leaves_those_elsewhere(memory):
    see(memory, 0, AT, (2.0, 2.1, 0.95))  # two at once
    see(memory, 1, (5.0, 3.0, 0.85))
    memory.note_moved("mug", 1, by="anna", was_at=1, relation="on")
    assert find(memory) == {0: AT, 1: None}


def test_furniture_that_is_drawn_anew_keeps_what_lies_there_and_one_that_is_moved_does_not(memory):
    see(memory, 0, AT)
    memory.move_furniture(0, box=Box((2.05, 3.0, 0.47), (0.7, 1.9, 0.9)))
    assert find(memory) == {0: AT}
    memory.move_furniture(0, box=Box((2.0, 6.0, 0.45), (0.6, 2.0, 0.9)))
    assert find(memory) == {0: None}
    see(memory, 0, (2.0, 6.0, 0.95))
    hall = memory.add_room("hall")
    memory.move_furniture(0, room=hall)  # it is not known where
    assert find(memory) == {0: None}


def test_to_transform_and_ask_is_to_ask_and_transform(memory):
    """By a quarter turn and (10, 0): (x, y) is (10 - y, x)."""
    see(memory, 0, AT, position_sd=0.02)
    memory.step()
    see(memory, 0, (2.0, 2.5, 0.95), position_sd=0.02)
    before = memory.last_seen("mug")
    memory.transform(math.pi / 2, (10, 0))
    after = memory.last_seen("mug")
    for name in ("position", "usual_position"):
        x, y, z = getattr(before, name)
        assert getattr(after, name) == pytest.approx((10 - y, x, z))
    assert after.position_sd == before.position_sd
    x, y, yaw = memory.get_pose(0, after.position)
    assert math.cos(yaw) == pytest.approx(
        (after.position[0] - x) / math.dist((x, y), after.position[:2])
    )
    see(memory, 0, (10 - 2.6, 2.0, 0.95))  # and they go on in the new frame
    assert find(memory) == {0: pytest.approx((7.4, 2.0, 0.95))}


def test_a_transform_out_of_the_world_changes_nothing(memory):
    see(memory, 0, (1e5 - 1, 3.1, 0.95))
    before = dump(memory)
    with pytest.raises(ValueError, match=r"positions must lie within 100000 m.*Give metres"):
        memory.transform(0.0, (10, 0))
    assert dump(memory) == before


def test_things_that_are_merged_are_at_the_latest_position_and_apart_again_when_split(memory):
    see(memory, 0, AT, name="cup")
    memory.step()
    see(memory, 0, AT, (1.95, 3.1, 0.95))
    memory.observe(0, [Sighting("cup", position=AT), Sighting("mug", position=(1.97, 3.1, 0.95))])
    apart = find(memory, "cup"), find(memory, "mug")
    memory.merge("cup", "mug")
    assert find(memory, "cup") == find(memory, "mug") == {0: (1.97, 3.1, 0.95)}
    memory.split("cup")
    assert (find(memory, "cup"), find(memory, "mug")) == apart


def test_what_is_split_off_a_thing_takes_its_position_along(memory):
    see(memory, 0, AT)
    see(memory, 1, (5.0, 3.0, 0.85))
    memory.split("mug", 1, "beaker")
    assert (find(memory, "mug"), find(memory, "beaker")) == ({0: AT}, {1: (5.0, 3.0, 0.85)})
    memory.rename("beaker", "jug")
    assert find(memory, "jug") == {1: (5.0, 3.0, 0.85)}
    memory.forget("jug")
    assert memory.batch.positions["x"].tolist() == [1.9]


def test_furniture_that_is_merged_hands_its_positions_on(memory):
    """Twice at x = 2 on one, once at x = 5 on the other: the mean is 3, the last one is 5."""
    see(memory, 0, (2.0, 3.0, 0.95))
    see(memory, 0, (2.0, 3.0, 0.95))
    see(memory, 1, AT, name="cup")
    memory.step()
    see(memory, 1, (5.0, 3.0, 0.85))
    memory.step()
    memory.merge_furniture(0, 1)
    (seen,) = memory.places_of("mug")
    assert seen.position == (5.0, 3.0, 0.85)
    assert seen.usual_position == pytest.approx((3.0, 3.0, 0.95 - 0.1 / 3))
    memory.remove_furniture(0)
    assert memory.batch.positions.num_rows == 0


def test_files_and_logs_carry_them_to_the_bit(memory, tmp_path):
    see(memory, 0, (0.1 + 0.2, 1 / 3, 0.95), position_sd=1 / 7)
    memory.step()
    see(memory, 0, (0.1, 2 / 3, 0.95), id="7")
    memory.save(tmp_path / "home.sgm")
    assert dump(SceneGraphMemory.load(tmp_path / "home.sgm")) == dump(memory)
    *_, (again, _, _) = replay(read_events(tmp_path / "looks.sgm"))
    assert dump(again) == dump(memory)


def test_an_older_state_is_not_changed_by_later_looks(memory):
    see(memory, 0, AT)
    memory.step()
    asked = memory.ask(["mug"])
    copy = memory.copy()
    see(memory, 0, (2.0, 2.0, 0.95))
    assert asked.sightings[0].position == AT
    assert asked.current.positions["x"].tolist() == [1.9]
    assert find(copy) == {0: AT}


def test_a_memory_without_positions_has_none(memory, tmp_path):
    memory.observe(0, [Sighting("mug")])
    seen = memory.last_seen("mug")
    assert (seen.position, seen.position_sd, seen.usual_position) == (None, None, None)
    with HomeReader(tmp_path / "looks.sgm") as reader:
        _, rows = reader.read(from_first=True)
    assert "position" not in rows[-1].arguments
    memory.save(tmp_path / "looks.sgm")
    with HomeReader(tmp_path / "looks.sgm") as reader:
        snapshot, _ = reader.read()
    assert {name for name in snapshot.arrays if name.startswith("positions")} == {
        "positions.object"
    }


@pytest.mark.parametrize(
    ("position", "sd", "message"),
    [
        ((1, 2), None, r"position of 'mug' must be finite numbers of shape \(3,\), got \(1, 2\)"),
        ((1, 2, math.nan), None, "position of 'mug' must be finite numbers"),
        ((1, 2, math.inf), None, "position of 'mug' must be finite numbers"),
        ("here", None, "position of 'mug' must be finite numbers"),
        ((1, 2, 10**400), None, "position of 'mug' must be finite numbers"),
        ((1, -2e5, 0), None, "position of 'mug' must lie within 100000 m.*metres in the frame"),
        ((1, 2, 3), -0.1, r"position_sd of 'mug' must be a number of metres, 0 or more, got -0.1"),
        ((1, 2, 3), math.nan, "position_sd of 'mug' must be a number of metres"),
        ((1, 2, 3), 1e9, "position_sd of 'mug' must be a number of metres"),
        ((1, 2, 3), "x", "position_sd of 'mug' must be a number of metres"),
        (None, 0.1, "position of 'mug' must be finite numbers of shape .* got None"),
    ],
)
def test_bad_positions_are_refused(position, sd, message):
    with pytest.raises(ValueError, match=message):
        Sighting("mug", position=position, position_sd=sd)


def test_positions_may_be_arrays(memory):
    see(memory, 0, np.array([1.9, 3.1, 0.95]), position_sd=np.float32(0.5))
    assert memory.last_seen("mug").position == AT


def test_one_stands_before_what_was_seen(memory):
    """The counter is 2 m long, and its front looks to x; the thing lies near its end."""
    assert memory.get_pose(0) == pytest.approx((3.0, 3.0, math.pi))
    x, y, yaw = memory.get_pose(0, (1.9, 3.8, 0.95))
    assert (x, y) == pytest.approx((3.0, 3.8))
    assert abs(yaw) == pytest.approx(math.pi)
    floor = memory.add_furniture("floor", 0, box=Box.of_floor((0, 0), (8, 8)))
    x, y, _ = memory.get_pose(floor, (6.0, 6.0, 0.0))
    assert 0.4 < math.dist((x, y), (6, 6)) < 1.2  # not on it
    bare = memory.add_furniture("bed", 0)
    assert memory.get_pose(bare) is None
    x, y, yaw = memory.get_pose(bare, (6.0, 6.0, 0.5))  # before the thing
    assert 0.4 < math.dist((x, y), (6, 6)) < 1.2
    assert (x + math.cos(yaw), y + math.sin(yaw)) == pytest.approx((6, 6), abs=0.6)
    given = memory.add_furniture("sofa", 0, position=(1.0, 1.0))
    assert memory.get_pose(given) == (1.0, 1.0, 0.0)  # it is not known which way to look
    assert memory.get_pose(given, (2.0, 1.0, 0.5)) == pytest.approx((1.0, 1.0, 0.0))
    with pytest.raises(KeyError, match="furniture must be an id"):
        memory.get_pose(99)
    with pytest.raises(ValueError, match="position of what is looked at must be finite"):
        memory.get_pose(0, (1, 2))
