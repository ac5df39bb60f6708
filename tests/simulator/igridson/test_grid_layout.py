import re

import numpy as np
import pytest

from simulator.igridson.layout_file import load_layout, parse_layout


def test_shipped_home_is_the_papers(home):
    assert set(home.rooms) == {"kitchen", "living room", "bedroom", "bathroom"}
    assert len(home.furniture) == 21
    columns, rows = home.size
    assert columns != rows
    assert home.is_door.sum() >= 3
    counts = np.bincount(home.furniture_room, minlength=4)
    assert (counts > 0).all()
    assert (np.diff(home.furniture_room) >= 0).all()  # room after room, as Houses asks


def test_shipped_furniture_is_known_to_the_prior_and_of_various_sizes(home, default_prior):
    known = {(row.room, row.label) for row in default_prior.furniture}
    assert set(home.places) <= known
    areas = {piece.label: piece.width * piece.height for piece in home.furniture}
    assert areas["bed"] > areas["sofa"] > areas["armchair"] > areas["chair"]


def test_small_layout_cell_by_cell(small_text):
    layout = parse_layout(small_text)
    assert layout.size == (9, 5)
    assert layout.places == [
        ("kitchen", "fridge"),
        ("kitchen", "counter top"),
        ("bedroom", "bed"),
    ]
    assert layout.furniture_at.tolist() == [
        [-1] * 9,
        [-1, 0, -1, -1, -1, -1, -1, 2, -1],
        [-1, -1, -1, -1, -1, -1, -1, 2, -1],
        [-1, 1, 1, -1, -1, -1, -1, 2, -1],
        [-1] * 9,
    ]
    assert layout.room[1].tolist() == [-1, 0, 0, 0, -1, 1, 1, 1, -1]
    assert np.argwhere(layout.is_door).tolist() == [[2, 4]]
    assert layout.start == (2, 2)


def test_furniture_is_ordered_room_after_room(small_text):
    shuffled = small_text.replace("1 1  1x1  fridge\n", "").replace(
        "7 1  1x3  bed\n", "7 1  1x3  bed\n1 1  1x1  fridge\n"
    )
    places = parse_layout(shuffled).places
    assert places == [("kitchen", "counter top"), ("kitchen", "fridge"), ("bedroom", "bed")]


BROKEN = {
    "in a wall": (
        "1 3  2x1",
        "1 3  4x1",
        "'counter top' must stand on floor, got a wall at column 4, row 3",
    ),
    "in a door": ("1 3  2x1", "4 2  1x1", "got a door at column 4, row 2"),
    "outside": ("7 1  1x3", "9 1  1x3", "map of 9 x 5 cells, got column 9, row 1"),
    "two on one cell": (
        "1 3  2x1",
        "1 1  1x2",
        "'counter top' must have its cells to itself, got 'fridge' at column 1, row 1",
    ),
    "no door": ("#kkk+bbb#", "#kkk#bbb#", "no door that leads to 'bedroom' at column 5, row 1"),
    "door into nothing": (
        "#########\n#kkk#",
        "####+####\n#kkk#",
        "border must be wall all round, got a door at column 4, row 0",
    ),
    "blocked door": (
        "7 1  1x3  bed",
        "5 1  1x3  bed",
        "door at column 4, row 2: 'bed' at column 5, row 2",
    ),
    "open border": ("#kkk+bbb#", "kkkk+bbb#", "got floor at column 0, row 2"),
    "start in a wall": ("\n2 2\n", "\n0 2\n", "got column 0, row 2, which is a wall"),
    "start in furniture": ("\n2 2\n", "\n1 1\n", "got column 1, row 1, which is 'fridge'"),
    "start outside": ("\n2 2\n", "\n20 2\n", "which is outside the map"),
    "uneven map": ("#kkk+bbb#", "#kkk+bbb", "got 8 cells instead of 9 in row 2 (line 8)"),
    "unknown letter": ("#kkk+bbb#", "#kkk+bxb#", "got 'x' at column 6, row 2 (line 8)"),
    "no size": ("1 1  1x1  fridge", "1 1  fridge", "in line 12"),
    "empty size": ("1 1  1x1  fridge", "1 1  0x1  fridge", "in line 12"),
    "negative": ("1 1  1x1  fridge", "-1 1  1x1  fridge", "got '-1 1' in line 12"),
    "no label": ("1 1  1x1  fridge", "1 1  1x1", "in line 12"),
    "bad room": ("k kitchen", "kitchen", "got 'kitchen' in line 3"),
    "same room name": ("b bedroom", "b kitchen", "different names, got kitchen, kitchen"),
    "room without cells": ("b bedroom", "b bedroom\nc cellar", "got none for 'cellar'"),
    "room without furniture": ("7 1  1x3  bed\n", "", "got none in 'bedroom'"),
    "wrong version": ("layout 1", "layout 2", "got 'iGridson layout 2'"),
    "no section": ("start\n2 2\n", "", "section 'start'"),
    "text before a section": ("layout 1\n", "layout 1\nhello\n", "got 'hello' in line 2"),
    "two starts": ("\n2 2\n", "\n2 2\n3 2\n", "got 2 lines"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_broken_layouts_are_refused_by_cell(small_text, name):
    old, new, message = BROKEN[name]
    assert old in small_text
    text = small_text.replace(old, new, 1)
    with pytest.raises(ValueError, match=re.escape(message)) as info:
        parse_layout(text)
    assert str(info.value).endswith(".")  # with a remedy


def test_door_must_have_floor_on_opposite_sides(small_text):
    text = small_text.replace("#kkk#bbb#\n#########", "#kkk#bbb#\n#+#######\n#########").replace(
        "1 3  2x1  counter top", "2 3  1x1  counter top"
    )
    with pytest.raises(ValueError, match=r"door at column 1, row 4: .*a wall at column 1, row 5"):
        parse_layout(text)


def test_unreachable_furniture_is_named(small_text):
    walled_in = small_text.replace("1 3  2x1  counter top", "1 2  1x1  table\n2 1  1x1  chair")
    with pytest.raises(ValueError, match=r"beside 'fridge' at column 1, row 1\."):
        parse_layout(walled_in)


def test_comments_and_files(small_text, tmp_path):
    path = tmp_path / "home.txt"
    path.write_text(small_text.replace("fridge\n", "fridge  ; cold\n\n; note\n"), "utf-8")
    assert load_layout(path).furniture[0].label == "fridge"
    with pytest.raises(FileNotFoundError):
        load_layout(tmp_path / "missing.txt")


def test_furniture_the_prior_does_not_know_is_refused(small_text, default_prior):
    from simulator.igridson.find_object import make_homes
    from simulator.world.streams import Streams

    layout = parse_layout(small_text.replace("fridge", "spaceship"))
    with pytest.raises(ValueError, match="got 'spaceship' in 'kitchen'"):
        make_homes(default_prior, layout, Streams(0, "test", [0]))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "1 1  1x1  fridge",
            "1 1  99999x99999  fridge",
            r"inside the map of 9 x 5 cells, got column 9, row 1",
        ),
        ("1 1  1x1  fridge", "1 1  1x" + "9" * 5000 + "  fridge", r"line \d+\. .*most 9 digits"),
        ("1 1  1x1  fridge", "9999999999 1  1x1  fridge", r"line \d+\. .*most 9 digits"),
    ],
)
def test_furniture_larger_than_the_map_is_refused_before_its_cells_are_listed(
    small_text, old, new, message
):
    assert old in small_text
    with pytest.raises(ValueError, match=message):
        parse_layout(small_text.replace(old, new))


def test_a_map_of_too_many_cells_is_refused(small_text):
    head, _, _ = small_text.partition("map\n")
    wide = "#" * 1001 + "\n"
    with pytest.raises(ValueError, match=r"at most 1000000 cells, got 1001 x 1000\. Draw a"):
        parse_layout(f"{head}map\n{wide * 1000}\nfurniture\n1 1  1x1  fridge\nstart\n1 1\n")


def test_a_layout_that_is_no_text_or_too_long_names_its_file(tmp_path):
    path = tmp_path / "home.txt"
    path.write_bytes(b"iGridson layout 1\n\xff\xfe")
    with pytest.raises(ValueError, match=r"layout must be UTF-8, got .*home\.txt"):
        load_layout(path)
    with path.open("wb") as file:
        file.truncate(1 << 33)  # takes no room on the disk
    with pytest.raises(ValueError, match=r"layout must be a file of at most .*home\.txt"):
        load_layout(path)
