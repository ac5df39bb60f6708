"""How well it is known where a thing lay, and what a ray through there tells."""

import numpy as np
import pytest

from sgm.camera.camera_view import CameraView
from sgm.camera.depth_image import DepthImage
from sgm.camera.detection import Measured
from sgm.camera.scene import Scene
from sgm.eyes import Box, Detection, Intrinsics, LookBuilder, Pose
from sgm.eyes.tracks import Track, Tracks
from tests.sgm.eyes.scenes import CAMERA, TABLE, detect, look_around, put_on, render


def show(builder, poses, known, solid, things=(), start=0.0):
    """Take frames from poses, which the robot knows as others, and return the look at the table."""
    for number, (pose, given) in enumerate(zip(poses, known, strict=True)):
        found = [detect(name, body, pose) for name, body in things]
        depth = render([*solid, *(body for _, body in things)], pose)
        builder.frame(start + 0.2 * number, given, CAMERA, found, depth)
    (look,) = builder.finish()
    return look


def test_a_depth_that_changes_from_pixel_to_pixel_is_uncertain():
    """Depth grows by .1 m a row: half the range of three rows is .1 m. Holes say nothing."""
    depth = np.repeat(1 + 0.1 * np.arange(9.0)[:, None], 9, axis=1)
    camera, pose = Intrinsics(10.0, 10.0, 4.0, 4.0, 9, 9), Pose(np.eye(3), np.zeros(3))
    box = np.array([[3.5, 3.5, 4.5, 4.5]])
    for changed, expected in ((None, 0.1), (np.nan, 0.1), (np.inf, 1.35)):
        if changed is not None:
            depth[4, 3] = changed
        view = CameraView(Scene({}), pose, camera, DepthImage(depth, camera), (0.2, 4.0))
        found, sd = view.measure_boxes(box)
        assert found == pytest.approx([1.4])
        assert sd == pytest.approx([expected])  # of infinity, (4 - 1.3) / 2 m: none is farther


def test_measurements_of_one_thing_count_by_how_certain_their_depth_is():
    """Weights are 1 / (.3^2 + .01^2) and 1 / .01^2: 11.1 and 10,000. The pose does not average."""
    far = Measured(np.array([0.3, 0.0, 0.0]), 0.1, 0.1, 0.02, depth_sd=0.3)
    near = Measured(np.zeros(3), 0.04, 0.1, 0.02)
    track = Track("mug", far.center, far.radius, far.height, far.sd)
    for frame, at in enumerate((far, near)):
        track.add(Detection("mug", center=(0, 0, 0)), frame, 1, at)
    assert track.center[0] == pytest.approx(0.3 * 11.1 / 10011.1, rel=1e-3)
    assert track.radius == pytest.approx(0.04, abs=1e-3)
    assert track.center_sd == pytest.approx(np.hypot(0.02, 0.01), rel=1e-3)


def test_a_thing_whose_depth_is_uncertain_gets_no_place_by_it_until_it_is_better_known():
    """The depth of bottles before a far wall is known to a metre: their position is none."""
    bottles = Detection("bottles", 0.9, center=(0, 0, 0))
    tracks = Tracks()
    for frame in range(6):
        at = Measured(np.zeros(3), 0.1, 0.1, 0.02, depth_sd=1.0 if frame < 5 else 0.1)
        tracks.add(bottles, frame, -1, at)
        found = tracks.take_sure(0.5, 3, frame)
        assert [track.name for track in found] == ["bottles"] * (frame == 5)


def test_a_small_thing_seen_from_far_in_a_box_a_pixel_too_high_is_not_missed():
    """From 3 m away and .4 m above the table, a pixel is .15 m of it: farther behind it seems.

    The ruler hides the watch, but not the place where it seemed to be.
    """
    watch = put_on(TABLE, -0.1, 0.0, (0.03, 0.05, 0.01))
    ruler = Box((1.84, 0.0, 0.715), (0.02, 0.3, 0.03))
    pose = Pose.look_at((-1.0, 0.0, 1.1), TABLE.center)
    left, top, right, bottom = detect("watch", watch, pose).box
    builder = LookBuilder({7: TABLE})
    high = Detection("watch", 0.9, (left, top - 1, right, bottom - 1))
    builder.frame(0.0, pose, CAMERA, [high], render([TABLE, watch], pose))
    assert next(builder.finish()).seen[0].description == "watch"
    look = show(builder, [pose] * 3, [pose] * 3, [TABLE, ruler, watch], start=100.0)
    assert look.hidden == ("watch",)


def move(poses, offset, position_sd):
    return [Pose(pose.rotation, pose.position + offset, position_sd) for pose in poses]


@pytest.mark.parametrize(("position_sd", "hidden"), [(0.0, ()), (0.03, ("mug",))])
def test_a_thing_may_be_hidden_beside_its_spot(position_sd, hidden):
    """The robot is 6 cm beside where it knows to be, and a box stands before the mug alone.

    If it knew that for sure, rays through the spot of the mug would show that it is gone.
    """
    mug, poses = put_on(TABLE, 0.1, 0.0), look_around(TABLE.center, turn=0.0, num=3)
    aside = move(poses, (0.0, 0.06, 0.0), position_sd)
    screen = Box((1.7, 0.0, 0.8), (0.02, 0.075, 0.2))
    builder = LookBuilder({7: TABLE})
    assert show(builder, poses, aside, [TABLE], [("mug", mug)]).seen[0].description == "mug"
    true = move(poses, (0.0, 0.0, 0.0), position_sd)
    assert show(builder, poses, true, [TABLE, screen, mug], start=100.0).hidden == hidden


@pytest.mark.parametrize(("position_sd", "hidden"), [(0.0, ()), (0.03, ("mug",))])
def test_what_stands_at_the_very_spot_must_be_there_for_sure(position_sd, hidden):
    """Bodies of 7 cm with one middle overlap. Errors of 2 x 4 cm may set them apart."""
    mug, poses = put_on(TABLE, 0.1, 0.0), look_around(TABLE.center, turn=0.2)
    poses = move(poses, (0.0, 0.0, 0.0), position_sd)
    builder = LookBuilder({7: TABLE})
    show(builder, poses, poses, [TABLE], [("mug", mug)])
    assert show(builder, poses, poses, [TABLE], [("can", mug)], start=100.0).hidden == hidden
