import numpy as np
import pytest

from sgm.camera.pinhole import Pose
from sgm.layout.box import Box
from simulator.box_world.depth_camera import DepthCamera, make_intrinsics
from simulator.box_world.ray_kernel import Solids, find_hidden
from simulator.box_world.sizes import list_levels, list_parts


@pytest.fixture
def camera():
    return DepthCamera(make_intrinsics(21, 17, 90.0), noise=0.0, hole_share=0.0)


def test_depth_of_a_box_by_hand(camera):
    """A cube of 1 m, its front 2 m ahead; f = 21 / 2 / tan 45 = 10.5 pixels.

    The front is 1 m at 2 m: 10.5 / 2 = 5.25 pixels, the columns 10 - 2.6 to 10 + 2.6: five.
    """
    solids = Solids.of_boxes([Box((2.5, 0.0, 1.0), (1.0, 1.0, 1.0))], owner=0)
    shot = camera.shoot(solids, 1, Pose.look_at((0, 0, 1), (1, 0, 1)), rng=np.random.default_rng(0))
    assert np.isfinite(shot.true_depth).sum() == 25
    np.testing.assert_allclose(shot.true_depth[6:11, 8:13], 2.0)
    assert (shot.owner[6:11, 8:13] == 0).all()
    assert shot.num_alone.tolist() == [25]
    np.testing.assert_allclose(shot.depth[6:11, 8:13], 2.0)  # no noise, no holes
    assert np.isposinf(shot.depth).sum() == 21 * 17 - 25  # farther than can be measured
    near = Solids.of_boxes([Box((0.6, 0.0, 1.0), (1.0, 9.0, 9.0))], owner=0)  # its front at .1 m
    shot = camera.shoot(near, 1, Pose.look_at((0, 0, 1), (1, 0, 1)), rng=np.random.default_rng(0))
    assert np.isneginf(shot.depth).all()


def test_what_stands_before_hides(camera):
    boxes = [Box((2.5, 0.0, 1.0), (1.0, 1.0, 1.0)), Box((1.5, 0.0, 1.0), (0.1, 3.0, 3.0))]
    solids = Solids.join([Solids.of_boxes([box], number) for number, box in enumerate(boxes)])
    shot = camera.shoot(solids, 2, Pose.look_at((0, 0, 1), (1, 0, 1)), rng=np.random.default_rng(0))
    assert (shot.owner != 0).all()
    assert shot.num_alone[0] == 25  # it would take these if nothing stood before it
    np.testing.assert_allclose(shot.true_depth[8, 10], 1.45)


def _cast_plainly(boxes, pose, camera):
    """z of each pixel by the slabs of every box, a pixel at a time."""
    depth = np.full((camera.height, camera.width), np.inf)
    for row in range(camera.height):
        for column in range(camera.width):
            ray = np.array([(column - camera.cx) / camera.fx, (row - camera.cy) / camera.fy, 1.0])
            for box in boxes:
                start = box.to_own(pose.position)
                along = box.to_own(pose.position + pose.rotation @ ray) - start
                ends = np.sort((np.array([[-0.5], [0.5]]) * box.size - start) / along, axis=0)
                enter, leave = ends[0].max(), ends[1].min()
                if 0.02 <= enter <= leave:
                    depth[row, column] = min(depth[row, column], enter)
    return depth


@pytest.mark.parametrize("seed", range(4))
def test_rays_agree_with_a_plain_loop(camera, seed):
    rng = np.random.default_rng(seed)
    boxes = [
        Box(
            tuple(rng.uniform((-3, -3, 0), (3, 3, 2))),
            tuple(rng.uniform(0.05, 2.0, 3)),
            rng.uniform(-3, 3),
        )
        for _ in range(12)
    ]
    pose = Pose.look_at(rng.uniform(-2, 2, 3), rng.uniform(-1, 1, 3))
    shot = camera.shoot(Solids.of_boxes(boxes, 0), 1, pose, rng=rng)
    plain = _cast_plainly(boxes, pose, camera.intrinsics)
    assert np.isfinite(plain).any()
    np.testing.assert_allclose(shot.true_depth, plain, rtol=1e-9)
    # What a pixel shows is not hidden, and what lies a little behind it is.
    rows, columns = np.nonzero(np.isfinite(plain))
    pixels = np.column_stack([columns, rows])
    for factor, hides in ((0.999, False), (1.001, True)):
        points = pose.to_map(camera.intrinsics.unproject(pixels, plain[rows, columns] * factor))
        hidden = find_hidden(Solids.of_boxes(boxes, 0), pose.position, points)
        is_around = np.any([box.contains(pose.position) for box in boxes])
        assert hides or is_around or not hidden.any()
        assert not hides or hidden.all()


def test_parts_of_furniture():
    box = Box((1.0, 2.0, 0.5), (0.6, 0.8, 1.0), yaw=0.5)
    assert list_parts(box, "solid") == [box]
    assert len(list_parts(box, "table")) == 5  # a board and four legs
    shelves = list_parts(box, "shelves")
    assert len(list_parts(box, "doors", is_open=True)) == len(shelves)
    assert len(list_parts(box, "doors")) == len(shelves) + 1
    for shape in ("table", "shelves", "basin", "doors"):
        for part in list_parts(box, shape):
            corners = part.to_map(
                np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
                * np.array(part.size)
                / 2
            )
            assert box.contains(corners, 1e-9).all(), shape


def test_levels_by_hand():
    """1 m with boards of 2 cm above and below leaves .96 m: three spaces of .32 m."""
    np.testing.assert_allclose(list_levels(1.0), [-0.48, -0.16, 0.16])


def test_holes_and_noise():
    camera = DepthCamera(make_intrinsics(200, 160), noise=0.01, hole_share=0.1)
    solids = Solids.of_boxes([Box((2.5, 0.0, 1.0), (1.0, 9.0, 9.0))], owner=0)
    pose = Pose.look_at((0, 0, 1), (1, 0, 1))
    shot = camera.shoot(solids, 1, pose, rng=np.random.default_rng(1))
    # 32,000 pixels: the share of holes is .1 +- .0017, one standard deviation.
    assert abs(np.isnan(shot.depth).mean() - 0.1) < 0.007
    error = (shot.depth - shot.true_depth)[np.isfinite(shot.depth)]
    assert abs(error.std() - 0.04) < 0.001  # .01 x 2 x 2
