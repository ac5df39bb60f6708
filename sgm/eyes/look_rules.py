"""By which rules frames become looks."""

from __future__ import annotations

from dataclasses import dataclass

from sgm.checks import check_at_least, check_shares


@dataclass(frozen=True, slots=True)
class LookRules:
    """What `LookBuilder` takes for in view, for seen and for one visit.

    Attributes:
        margin: metres that a point may lie behind what was measured and be in view.
        through_margin: metres that a ray must go on behind a thing to have gone through it. What
            bears a thing lies but 4 to 13 cm behind it.
        dilation: metres by which volumes are larger for detections, beside the uncertainty of the
            pose.
        num_points: points of each volume that are projected.
        pause: seconds out of view after which a visit is over.
        longest: seconds after which a visit is a look, and a new one begins.
        least_coverage: share in view below which a visit that showed nothing is no look.
        least_confidence: below it, a thing was not seen in the visit.
        most_blind: bound of the coverage where a frame has no depth image: what is in the way is
            not known.
    """

    margin: float = 0.0
    through_margin: float = 0.03
    dilation: float = 0.05
    num_points: int = 1000
    pause: float = 2.0
    longest: float = 30.0
    least_coverage: float = 0.05
    least_confidence: float = 0.5
    most_blind: float = 0.7

    def __post_init__(self) -> None:
        """Raise ValueError for a number that is out of range."""
        check_at_least(
            0, margin=self.margin, through_margin=self.through_margin, dilation=self.dilation,
            pause=self.pause, longest=self.longest,
        )  # fmt: skip
        check_at_least(1, num_points=self.num_points)
        check_shares(
            least_coverage=self.least_coverage,
            least_confidence=self.least_confidence,
            most_blind=self.most_blind,
        )
