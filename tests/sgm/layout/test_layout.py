"""One layout for memories, logs and traces: rows of files, numbers, what is left out."""

import pytest

from sgm.layout.furniture import Furniture, Room
from sgm.layout.layout import Layout


@pytest.fixture
def layout():
    furniture = [
        Furniture("fridge", 0, "white fridge", "fridge", (1.5, 2.0)),
        Furniture("shelf", 1, "shelf", "shelf 1"),
        Furniture("shelf", 1, "shelf", "shelf 2"),
    ]
    return Layout.of([Room("kitchen"), Room("bedroom", "bedroom 2"), Room("hall")], furniture)


def test_labels_and_sizes(layout):
    assert layout.room_labels == ("kitchen", "bedroom", "hall")
    assert layout.furniture_labels == ("fridge", "shelf", "shelf")
    assert layout.room_sizes == (1, 2, 0)
    assert [str(room) for room in layout.rooms.values()] == ["kitchen", "bedroom 2", "hall"]
    assert layout.describe(2) == "shelf in bedroom 2"


def test_rows_hold_what_is_known(layout):
    data = layout.to_json()
    assert data["rooms"] == [[0, "kitchen"], [1, "bedroom"], [2, "hall"]]
    assert data["furniture"][0] == [0, "fridge", 0, "white fridge", [1.5, 2.0]]
    assert data["furniture"][1] == [1, "shelf", 1, "shelf"]
    again = Layout.from_json(data, 3, 3)
    assert again.to_json() == data
    assert again.furniture[0].position == (1.5, 2.0)
    data["furniture"][1].append(None)  # as logs of version 2 wrote it
    assert Layout.from_json(data, 3, 3) == again


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ([3, "desk", 7, "desk"], "there is no room 7"),
        ([3, "desk", 0, "desk", [1, "x"]], "position must be two numbers, got"),
        ([3, "desk", 0, "desk", "12"], "position must be two numbers, got"),
        ([3, "desk", 0, "desk", [1, 2, 3, 4]], "position must be two numbers, got"),
        ([3, "desk", 0, "desk", [1, 2, float("nan")]], "position must be two numbers, got"),
        ([3, "desk", 0, "desk", [1, 1e308]], "position must be two numbers, got"),
    ],
)
def test_rows_that_do_not_fit_are_refused(layout, row, message):
    data = layout.to_json()
    data["furniture"].append(row)
    with pytest.raises(ValueError, match=message):
        Layout.from_json(data, 3, 4)


def test_a_room_is_left_out_with_its_furniture(layout):
    left = layout.leave_out(rooms=[1])
    assert (list(left.rooms), list(left.furniture)) == ([0, 2], [0])
    left = layout.leave_out(furniture=[1])
    assert (list(left.rooms), list(left.furniture)) == ([0, 1, 2], [0, 2])
    assert left.add_room("study") == 3  # no id is given twice
    assert len(layout.rooms) == 3  # the other one is as it was
