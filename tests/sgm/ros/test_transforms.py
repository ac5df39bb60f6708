import numpy as np
import pytest

from sgm.ros.transforms import TransformTree

HALF = np.sqrt(0.5)


def test_a_chain_of_frames_by_hand():
    """The robot is at (2, 1) and looks to the left; the camera is .5 m before it and 1 m up.

    Before it is +y of the map: the camera is at (2, 1.5, 1).
    """
    tree = TransformTree()
    tree.add("map", "odom", 0.0, (1, 1, 0), (0, 0, 0, 1), is_still=True)
    tree.add("odom", "base", 5.0, (1, 0, 0), (0, 0, HALF, HALF))
    tree.add("base", "camera", 0.0, (0.5, 0, 1), (0, 0, 0, 1), is_still=True)
    matrix, known = tree.find("map", "camera", 5.0)
    np.testing.assert_allclose(matrix[:3, 3], (2, 1.5, 1), atol=1e-12)
    np.testing.assert_allclose(matrix[:3, 0], (0, 1, 0), atol=1e-12)
    assert known == 5.0
    back, _ = tree.find("camera", "/map", 5.0)
    np.testing.assert_allclose(back @ matrix, np.eye(4), atol=1e-12)
    assert tree.find("map", "arm", 5.0) is None
    assert tree.find("map", "camera", 4.9) is None  # nobody knew it so early


def test_between_two_transforms_and_after_the_last():
    tree = TransformTree()
    tree.add("map", "base", 1.0, (0, 0, 0), (0, 0, 0, 1))
    tree.add("map", "base", 2.0, (4, 0, 0), (0, 0, HALF, HALF))
    matrix, known = tree.find("map", "base", 1.25)
    np.testing.assert_allclose(matrix[:3, 3], (1, 0, 0))
    assert known == 1.25
    matrix, _ = tree.find("map", "base", 1.5)
    np.testing.assert_allclose(matrix[:2, 0], (HALF, HALF))  # 45 degrees
    matrix, known = tree.find("map", "base", 2.5)
    np.testing.assert_allclose(matrix[:3, 3], (4, 0, 0))
    assert known == 2.0  # half a second old


def test_what_is_kept_and_a_clock_that_was_set_back():
    tree = TransformTree(keeps=10)
    for second in range(30):
        tree.add("map", "base", second, (second, 0, 0), (0, 0, 0, 1))
    assert tree.find("map", "base", 15.0) is None
    tree.add("map", "base", 28.5, (99, 0, 0), (0, 0, 0, 1))  # late: left out
    np.testing.assert_allclose(tree.find("map", "base", 28.5)[0][0, 3], 28.5)
    tree.add("map", "base", 3.0, (7, 0, 0), (0, 0, 0, 1))
    np.testing.assert_allclose(tree.find("map", "base", 3.0)[0][0, 3], 7)


def test_a_circle_of_frames_ends():
    tree = TransformTree()
    tree.add("a", "b", 0.0, (1, 0, 0), (0, 0, 0, 1), is_still=True)
    tree.add("b", "a", 0.0, (1, 0, 0), (0, 0, 0, 1), is_still=True)
    assert tree.find("c", "a", 0.0) is None
    assert tree.find("a", "b", 0.0) is not None


@pytest.mark.parametrize(
    ("position", "quaternion", "message"),
    [
        ((0, 0, np.nan), (0, 0, 0, 1), "position of a transform must be finite"),
        ((0, 0, 0), (0, 0, 0, 0), "length 1, got 0 from 'map' to 'base'"),
    ],
)
def test_bad_transforms(position, quaternion, message):
    with pytest.raises(ValueError, match=message):
        TransformTree().add("map", "base", 0.0, position, quaternion)


def test_frames_are_bounded():
    tree = TransformTree()
    for number in range(1000):
        tree.add("map", f"frame {number}", 0.0, (0, 0, 0), (0, 0, 0, 1), is_still=True)
    with pytest.raises(ValueError, match="frames must be at most 1000"):
        tree.add("map", "one more", 0.0, (0, 0, 0), (0, 0, 0, 1), is_still=True)
