"""Rooms of the occupancy grid of a map server."""

import sys

import numpy as np
import pytest
from PIL import Image

from sgm.layout.areas import Areas
from simulator.trace.__main__ import main
from simulator.trace.importers.bag import load_areas
from simulator.trace.importers.occupancy_grid import find_rooms, load_grid

ABOUT = "image: map.pgm\nresolution: 0.05\norigin: [-1.0, -2.0, 0.0]\nnegate: 0\n"


@pytest.fixture
def grid_file(tmp_path):
    """Two rooms of 4 x 3 m beside each other, a door of 0.8 m between them, unknown around."""
    free = np.zeros((80, 200), dtype=bool)
    free[10:70, 10:90] = True  # x from -0.5 to 3.5, y from -1.5 to 1.5
    free[10:70, 94:174] = True  # x from 3.7 to 7.7
    free[30:46, 90:94] = True
    shade = np.where(free, 254, 205).astype(np.uint8)
    shade[9:71, [9, 90, 93, 174]] = 0
    shade[30:46, 90:94] = 254
    Image.fromarray(np.flipud(shade)).save(tmp_path / "map.pgm")
    (tmp_path / "map.yaml").write_text(ABOUT)
    return tmp_path / "map.yaml"


def test_rooms_are_split_at_doorways(grid_file, tmp_path, capsys):
    out = tmp_path / "areas.yaml"
    assert main(["rooms", str(grid_file), "--out", str(out)]) == 0
    assert "2 rooms" in capsys.readouterr().out
    areas = load_areas(out)
    left, right = areas.find((1.0, 0.0)), areas.find((6.0, 0.0))
    assert {left, right} == {"room 1", "room 2"}
    for x in (-0.4, 3.4):
        for y in (-1.4, 1.4):
            assert areas.find((x, y)) == left
            assert areas.find((7.2 - x, y)) == right
    assert areas.find((40.0, 0.0)) == "home"
    wide = find_rooms(load_grid(grid_file), door=0.5)  # a doorway of 0.8 m is none then
    assert len(wide) == 1
    assert Areas(wide).find((6.0, 0.0)) == "room 1"


@pytest.mark.parametrize("mode", ["trinary", "scale", "raw"])
def test_a_shade_means_what_the_mode_says(grid_file, mode):
    """A map server writes occupancy in percent with "raw", and 255 for what is not known."""
    wanted = load_grid(grid_file).is_free
    if mode == "raw":
        shade = np.asarray(Image.open(grid_file.with_name("map.pgm")))
        percent = np.select([shade == 254, shade == 0], [0, 100], 255).astype(np.uint8)
        Image.fromarray(percent).save(grid_file.with_name("map.pgm"))
    grid_file.write_text(f"{ABOUT}mode: {mode}\noccupied_thresh: 0.65\nfree_thresh: 0.25\n")
    np.testing.assert_array_equal(load_grid(grid_file).is_free, wanted)


def test_what_is_no_grid_is_one_line(grid_file, tmp_path, capsys, monkeypatch):
    for text, message in (
        ("a: 1", "map must have image, resolution and origin"),
        (ABOUT.replace("0.05", "0"), "cells of 0.001 to 1 m"),
        (ABOUT.replace("-2.0, 0.0", "-2.0, 0.5"), "yaw of 0"),
        (
            ABOUT.replace("map.pgm", "none.pgm"),
            "image of a map must be a file that exists, got none",
        ),
        (f"{ABOUT}mode: grey\n", "mode of a map must be one of trinary, scale, raw, got 'grey'"),
        (ABOUT.replace("map.pgm", ""), "image of a map must be a file that exists, got none"),
        (ABOUT.replace("map.pgm", "map.yaml"), "image of a map must be PGM or PNG"),
    ):
        grid_file.write_text(text)
        assert main(["rooms", str(grid_file), "--out", str(tmp_path / "x.yaml")]) == 1
        error = capsys.readouterr().err
        assert message in error
        assert error.count("\n") == 1
    grid_file.write_text(ABOUT)
    with monkeypatch.context() as without:
        without.setitem(sys.modules, "PIL", None)
        assert main(["rooms", str(grid_file), "--out", str(tmp_path / "x.yaml")]) == 1
    assert "got none. Run pip install pillow." in capsys.readouterr().err
    arguments = ["rooms", str(grid_file), "--out", str(tmp_path / "x.yaml"), "--door", "9"]
    assert main(arguments) == 1
    assert "Give a smaller --door" in capsys.readouterr().err
