"""When furniture that a detector names is believed, and how the map may change."""

from __future__ import annotations

from dataclasses import dataclass

from sgm.checks import check_at_least, check_shares


@dataclass(frozen=True, slots=True)
class MapRules:
    """When furniture is believed, and how the map may change.

    Attributes:
        least_frames: in which furniture must have been detected.
        least_apart: metres between the places of the camera from which it must have been seen.
        least_change: metres by which a side or the middle of a box changes before it is drawn anew.
        most_change: metres that the middle of furniture moves at once, after which it is rather the
            pose that jumped.
        most_frames: after which furniture is drawn well enough.
        least_overlap: share of the smaller footprint that is in both, of detections of one label
            that are of one piece of furniture.
        least_likeness: overlap of detections with how the box looks, on average.
        least_shown: latest frames in which furniture that was found was in view, after which it may
            be found not to be there any more.
        least_named: share of these frames in which it must have been detected.
        settle: seconds between two changes of the map; visits end with each.
        longest_doubt: seconds after a jump of the pose after which it is believed, if it has not
            jumped again, though no furniture was seen where it stands: the map itself has moved,
            or the robot is elsewhere.
    """

    least_frames: int = 5
    least_apart: float = 0.3
    least_change: float = 0.04
    most_change: float = 0.4
    most_frames: int = 400
    least_overlap: float = 0.4
    least_likeness: float = 0.4
    least_shown: int = 30
    least_named: float = 0.1
    settle: float = 10.0
    longest_doubt: float = 60.0

    def __post_init__(self) -> None:
        """Raise ValueError for a number that is out of range."""
        check_at_least(
            1,
            least_frames=self.least_frames,
            most_frames=self.most_frames,
            least_shown=self.least_shown,
        )
        check_at_least(
            0,
            least_apart=self.least_apart,
            least_change=self.least_change,
            most_change=self.most_change,
            settle=self.settle,
            longest_doubt=self.longest_doubt,
        )
        check_shares(
            least_overlap=self.least_overlap,
            least_likeness=self.least_likeness,
            least_named=self.least_named,
        )
