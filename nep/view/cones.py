"""From where furniture was looked at, and what of the home the camera saw then."""

from __future__ import annotations

import numpy as np

from nep.view.plan_shapes import PlanShapes
from sgm.layout.viewpoint import Viewpoint


def make_cone(shapes: PlanShapes, node: int, viewpoint: Viewpoint | None) -> np.ndarray | None:
    """Return the camera and both ends of what it saw, (3, 2); None where nothing is known.

    A look that says from where it was has the cone of its camera, as far as the furniture reaches.
    Else the cone is that from where one stands to look at furniture with a footprint, and the angle
    that the furniture fills.
    """
    corners = shapes.outlines[node] if shapes.is_to_scale[node] else None
    if viewpoint is not None:
        at = np.array([viewpoint.x, viewpoint.y])
        away = np.inf if corners is None else np.linalg.norm(corners - at, axis=1).max()
        return viewpoint.compute_corners(float(away))
    stand = shapes.stands[node]
    if corners is None or not np.isfinite(stand).all():
        return None
    return np.array([stand, *find_outer_corners(stand, corners)])


def find_outer_corners(stand: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return the two corners (2, 2) between which furniture (k, 2) is seen from a position (2,)."""
    ahead = corners.mean(axis=0) - stand
    offset = corners - stand
    side = ahead[0] * offset[:, 1] - ahead[1] * offset[:, 0]
    angle = np.arctan2(side, offset @ ahead)
    return np.asarray(corners[[angle.argmin(), angle.argmax()]])
