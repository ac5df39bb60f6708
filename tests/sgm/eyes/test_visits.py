import numpy as np
import pytest

from sgm.camera.camera_view import CameraView
from sgm.camera.scene import Scene
from sgm.eyes import Intrinsics, Pose
from sgm.eyes.visits import Visits
from tests.sgm.eyes.scenes import TABLE


@pytest.mark.parametrize(("apart", "coverage"), [(0.0, 0.5), (1.0, 1.0)])
def test_what_one_stand_shows_was_seen_whatever_others_show(apart, coverage):
    """A point beside an edge is shown by .8 of its pixels in one frame, by .1 in two others.

    From one stand their mean of 1 / 3 decides. From three stands it is the middle between that and
    the best, .567. The other one of two points is in view of all frames.
    """
    scene = Scene({7: TABLE}, num_points=2)
    visits, camera = Visits(scene), Intrinsics(1.0, 1.0, 0.5, 0.5, 2, 2)
    for number, share in enumerate((0.8, 0.1, 0.1)):
        pose = Pose(np.eye(3), np.array([apart * number, 0.0, 0.0]))
        view = CameraView(scene, pose, camera, None, (0.2, 4.0))
        visits.note_points(number, np.array([1]), np.array([[1.0, share]]), view)
    (visit,) = visits.take_ended()
    assert visit.points.compute_coverage(scene, visit.place)["onTop"] == coverage
