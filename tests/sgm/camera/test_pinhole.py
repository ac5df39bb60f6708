import math

import numpy as np
import pytest

from sgm.eyes import Detection, Intrinsics, Pose

CAMERA = Intrinsics(500.0, 500.0, 319.5, 239.5, 640, 480)


def test_projection_by_hand():
    # (.2, -.1, 2): 500 * .1 + 319.5 and 239.5 - 500 * .05
    pixels = CAMERA.project(np.array([[0.2, -0.1, 2.0], [0.0, 0.0, -1.0]]))
    assert np.allclose(pixels[0], [369.5, 214.5])
    assert np.isnan(pixels[1]).all()
    assert np.allclose(CAMERA.unproject(pixels[:1], np.array([2.0])), [[0.2, -0.1, 2.0]])


def test_pixels_in_the_image():
    pixels = np.array([[-0.5, -0.5], [639.4, 479.4], [639.5, 0], [np.nan, 3]])
    assert CAMERA.contains(pixels).tolist() == [True, True, False, False]


def test_a_camera_that_looks_along_x():
    pose = Pose.look_at((1, 0, 1.5), (3, 0, 1.5))
    # a point ahead, to the left (y) and above: z forward, x right, y down
    assert np.allclose(pose.to_camera(np.array([[3, 0.5, 1.8]])), [[-0.5, -0.3, 2.0]])


def test_pose_of_matrix_quaternion_and_target_agree():
    looking = Pose.look_at((1, 0, 1.5), (3, 0, 1.5))
    # x right = -y, y down = -z, z forward = x: the quaternion of ROS's optical frames
    turned = Pose.from_quaternion((1, 0, 1.5), (-0.5, 0.5, -0.5, 0.5))
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = looking.rotation, looking.position
    for pose in (turned, Pose.from_matrix(matrix), Pose.from_matrix(matrix[:3])):
        assert np.allclose(pose.rotation, looking.rotation)
        assert np.allclose(pose.position, looking.position)
    points = np.random.default_rng(0).normal(size=(20, 3))
    assert np.allclose(looking.to_map(looking.to_camera(points)), points)


def test_uncertainty_grows_with_distance():
    pose = Pose.look_at((0, 0, 1), (1, 0, 1), position_sd=0.03, angle_sd=0.02)
    assert pose.compute_sd(2.0) == pytest.approx(0.05)  # sqrt(.03^2 + .04^2)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Intrinsics(0, 500, 1, 1, 640, 480), r"focal lengths .* above 0, got \[0\.0, 500"),
        (lambda: Intrinsics(500, math.inf, 1, 1, 640, 480), "fx, fy, cx, cy of intrinsics must be"),
        (lambda: Intrinsics(500, 500, 1, 1, 640, 0), "height of an image must be a whole number"),
        (lambda: Intrinsics.from_matrix(np.zeros(9), 640, 480), "focal lengths"),
        (lambda: Intrinsics.from_matrix(np.zeros(4), 640, 480), "camera matrix must be finite"),
        (lambda: Pose(np.ones((3, 3)), np.zeros(3)), "rotation must be an orthonormal matrix"),
        (lambda: Pose(np.diag([1, 1, -1]), np.zeros(3)), "rotation must be an orthonormal matrix"),
        (lambda: Pose(np.eye(3), [0, np.nan, 0]), "position of a camera must be finite numbers"),
        (lambda: Pose(np.eye(3), np.zeros(3), -1.0), "position_sd must be at least 0, got -1"),
        (lambda: Pose.from_matrix(np.ones((4, 4))), "last row of a pose must be 0, 0, 0, 1"),
        (lambda: Pose.from_quaternion((0, 0, 0), (0, 0, 0, 0)), "quaternion must have the length"),
        (lambda: Pose.look_at((0, 0, 0), (0, 0, 1)), "target must not be above or below"),
        (lambda: Detection("mug"), "detection must have a box or a center, got neither for 'mug'"),
        (lambda: Detection("mug", 1.2, (0, 0, 1, 1)), r"score of 'mug' must lie in \[0, 1\]"),
        (lambda: Detection("", 1, (0, 0, 1, 1)), "name of a detection must"),
        (lambda: Detection("mug", 1, (0, np.nan, 1, 1)), "box of 'mug' must be finite"),
        (lambda: Detection("mug", 1, (5, 0, 1, 1)), "box of a detection must be left, top"),
        (lambda: Detection("mug", 1, (np.nan, 0, 1, 1)), "box of 'mug' must be finite numbers"),
        (lambda: Detection("mug", center=(0, 0, 0), size=(1, -1, 1)), "size of a detection must"),
        (lambda: Detection("mug", 1, center=(0, 0)), "center of 'mug' must be finite numbers"),
    ],
)
def test_bad_input_is_one_line(make, message):
    with pytest.raises(ValueError, match=message) as error:
        make()
    assert "\n" not in str(error.value)


def test_intrinsics_of_a_camera_matrix():
    matrix = [500, 0, 319.5, 0, 500, 239.5, 0, 0, 1]
    assert Intrinsics.from_matrix(matrix, 640, 480) == CAMERA
