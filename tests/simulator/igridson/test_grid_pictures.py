"""What can be checked of a picture without eyes: geometry, colours, files."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from simulator.drawing.home import compute_shade
from simulator.igridson.drawing import (
    AGENT,
    ASKED,
    BELIEF,
    CAPTION,
    FOUND,
    FURNITURE,
    GLYPH,
    LABEL_SIZE,
    LABEL_TOP,
    LINE,
    HomePicture,
    mix,
)
from simulator.igridson.scene import GridScene, GridThing, list_things
from simulator.igridson.video import check_format, film_searches, save_video

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def picture(home):
    return HomePicture(home, tile=40)


def crop(picture, frame, furniture):
    piece = picture.layout.furniture[furniture]
    top, left = piece.row * picture.tile, piece.column * picture.tile
    return frame[top : top + piece.height * picture.tile, left : left + piece.width * picture.tile]


def count(frame, color):
    return int((frame == np.array(color, dtype=np.uint8)).all(axis=-1).sum())


def test_labels_fit_their_furniture(picture):
    for piece, lines in zip(picture.layout.furniture, picture._labels, strict=True):
        assert " ".join(lines) == piece.label
        assert LABEL_TOP + len(lines) * LINE < piece.height
        for line in lines:
            assert picture._measure(line, LABEL_SIZE) <= piece.width - 0.08


def test_objects_neither_overlap_each_other_nor_labels_nor_borders(picture):
    layout = picture.layout
    for index, piece in enumerate(layout.furniture):
        label_end = piece.row + LABEL_TOP + len(picture._labels[index]) * LINE
        for num_things in range(1, 12):
            spots = [spot for x, y in piece.cells for spot in picture._list_spots(x, y, num_things)]
            for (x, y), (other_x, other_y) in itertools.combinations(spots, 2):
                assert np.hypot(x - other_x, y - other_y) > 2 * GLYPH
            for x, y in spots:
                assert piece.column + GLYPH < x < piece.column + piece.width - GLYPH
                assert label_end + 0.8 * GLYPH < y < piece.row + piece.height - GLYPH


def test_room_names_stand_in_walls_without_doors(picture):
    layout = picture.layout
    for index, name in enumerate(layout.rooms):
        cells = np.argwhere(layout.room == index)
        (top, left), (_, right) = cells.min(axis=0), cells.max(axis=0)
        x = picture._shift_off_doors((left + right + 1) / 2, top - 1, name)
        half = picture._measure(name, 0.42) / 2
        covered = layout.is_wall[top - 1, int(x - half) : int(np.ceil(x + half))]
        assert covered.all()


def test_size_and_caption(picture):
    scene = GridScene(position=(11, 4), direction=0)
    frame = picture.draw(scene)
    assert frame.shape == (round((14 + CAPTION) * 40), 22 * 40, 3)
    assert frame.dtype == np.uint8
    with_title = picture.draw(replace(scene, title="find the mug", note="look 1 of 10"))
    assert (frame[: 14 * 40] == with_title[: 14 * 40]).all()
    assert (frame[14 * 40 :] != with_title[14 * 40 :]).any()


def test_belief_colours_furniture(picture):
    belief = np.zeros(21)
    belief[[2, 5]] = 1.0, 0.25
    frame = picture.draw(GridScene(position=(11, 4), direction=0, belief=belief))
    half = mix(FURNITURE, BELIEF, 0.5)  # the shade is the square root
    assert count(crop(picture, frame, 2), BELIEF) > 1000
    assert count(crop(picture, frame, 5), half) > 2000
    assert count(crop(picture, frame, 0), FURNITURE) > 1000


def test_looked_at_and_found_are_marked(picture):
    scene = GridScene(position=(11, 4), direction=0, looked_at=(3, 8))
    frame = picture.draw(scene)
    assert count(crop(picture, frame, 3), AGENT) > 50
    assert count(crop(picture, frame, 8), AGENT) > 50
    assert count(crop(picture, frame, 9), AGENT) == 0
    frame = picture.draw(replace(scene, is_found=True))
    assert count(crop(picture, frame, 3), AGENT) > 50
    assert count(crop(picture, frame, 8), FOUND) > 50


def test_the_agent_is_where_it_is(picture):
    for position, direction in (((11, 4), 0), ((5, 3), 3)):
        frame = picture.draw(GridScene(position=position, direction=direction))
        x, y = position
        assert count(frame[y * 40 : y * 40 + 40, x * 40 : x * 40 + 40], AGENT) > 200


def test_every_object_asked_for_gets_a_star_even_in_a_crowd(picture):
    cell = picture.layout.furniture[6].cells[0]  # a chair of one cell
    crowd = tuple(GridThing(cell, False, (58, 112, 214), False) for _ in range(15))
    frame = picture.draw(
        GridScene((11, 4), 0, things=(*crowd, GridThing(cell, False, (0, 0, 0), is_asked=True)))
    )
    assert count(crop(picture, frame, 6), ASKED) > 20
    frame = picture.draw(GridScene((11, 4), 0, things=crowd))
    assert count(crop(picture, frame, 6), ASKED) == 0


def test_things_are_those_of_the_home(make_env):
    env = make_env()
    env.reset(seed=1)
    things = list_things(env.homes, env.placement, int(env.homes.object_code[0, 0]))
    assert len(things) == 126
    # an empty slot has place -1, which is odd
    assert sum(t.is_inside for t in things) == (env.homes.object_place[0] % 2 == 0).sum()
    assert any(t.is_asked for t in things)
    env.shows_all = False
    assert env.get_scene().things == ()
    env.looked_at = [1]
    shown = env.get_scene().things
    assert len(shown) == (env.homes.object_furniture[0] == 1).sum()


def test_shades_grow_with_probability():
    assert [compute_shade(p) for p in (0, 0.25, 1, 2)] == [0, 0.5, 1, 1]
    assert mix((0, 0, 0), (100, 200, 50), 0.5) == (50, 100, 25)


@pytest.mark.parametrize("tile", [10, 100_000])
def test_tiles_that_are_too_small_or_too_large_are_refused(home, tile):
    with pytest.raises(ValueError, match=f"tile must lie in 32 to 320 pixels, got {tile}"):
        HomePicture(home, tile=tile)


def film(make_env, num_searches=1):
    from simulator.igridson.find_object import Searcher
    from simulator.policies import make_policy

    searcher = Searcher(lambda homes: make_policy("bayesian", homes))
    env = make_env(render_mode="rgb_array", tile_size=32)
    return film_searches(env, searcher, 0, num_searches, 2)


def test_gifs_loop_and_are_small(make_env, tmp_path):
    frames = film(make_env)
    path = tmp_path / "sub" / "search.gif"
    save_video(frames, path)
    with Image.open(path) as image:
        assert image.info["loop"] == 0
        assert image.size == (frames[0].shape[1], frames[0].shape[0])
        assert 1 < image.n_frames <= len(frames)
        image.seek(image.n_frames - 1)
        last = np.asarray(image.convert("RGB")).astype(int)
    assert np.abs(last - frames[-1]).mean() < 3  # a palette of 256 colours
    assert path.stat().st_size < 1_500_000


def test_films_repeat_themselves_for_a_seed(make_env):
    first, second = film(make_env), film(make_env)
    assert len(first) == len(second)
    assert all((a == b).all() for a, b in zip(first, second, strict=True))


def test_mp4_goes_through_ffmpeg(make_env, tmp_path, monkeypatch):
    """A stand-in for ffmpeg that keeps what it is given."""
    command = tmp_path / "ffmpeg"
    command.write_text(f'#!/bin/sh\necho "$@" > {tmp_path}/arguments\ncat > {tmp_path}/bytes\n')
    command.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:/bin:/usr/bin")
    frames = film(make_env)[:5]
    save_video(frames, tmp_path / "search.mp4")
    height, width, _ = frames[0].shape
    assert f"-s {width}x{height}" in (tmp_path / "arguments").read_text()
    assert (tmp_path / "bytes").read_bytes() == b"".join(frame.tobytes() for frame in frames)
    command.write_text("#!/bin/sh\ncat > /dev/null\necho no codec >&2\nexit 1\n")
    with pytest.raises(OSError, match=r"got exit status 1 .*no codec"):
        save_video(frames, tmp_path / "search.mp4")


def test_bad_videos_are_refused(make_env, tmp_path, monkeypatch):
    from simulator.igridson.find_object import Searcher

    with pytest.raises(ValueError, match=r"\.gif or \.mp4, got 'search.avi'"):
        check_format(tmp_path / "search.avi")
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(FileNotFoundError, match="Install ffmpeg"):
        check_format(tmp_path / "search.mp4")
    with pytest.raises(ValueError, match="got 0 after 0"):
        film_searches(make_env(), Searcher(lambda homes: None), 0, 0, 0)
