"""How many of the questions of people are about what."""

from __future__ import annotations

from dataclasses import asdict, dataclass

from sgm.checks import check_shares


@dataclass(frozen=True, slots=True)
class QuestionShares:
    """Shares of the kinds of questions that `AskAnything` asks; they add up to at most 1.

    Things are asked for whether they are in the home at that time or not. All remaining questions
    are about what the robot has seen, each thing as often as every other one.

    Attributes:
        owned: about all that people have, seen by the robot or not, by how often a type moves.
        unknown: about a thing that the home has never had.
        absent: about a thing that the robot has seen, or that was there before, and that is not in
            the home now, where there is one; else about what the robot has seen.
        used: about a thing that the robot has seen, and that people have moved in the last five
            steps at which it looked, seen since or not, where there is one: what is in use is asked
            for.
        found: about a thing that the robot has found moved in these steps, where there is one: it
            may have gone on, be back, or have been another one of its name.
        task: the questions of the paper's tasks, marked with `asks_moved`: half of them are about
            what has moved in this very step (docs/design.md, ruling 9).
    """

    owned: float = 0.15
    unknown: float = 0.05
    absent: float = 0.0
    used: float = 0.0
    found: float = 0.0
    task: float = 0.0

    def __post_init__(self) -> None:
        """Raise ValueError if a share is not in [0, 1], or they add up to more than 1."""
        shares = asdict(self)
        check_shares(**shares)
        if sum(shares.values()) > 1 + 1e-9:
            raise ValueError(
                f"shares of questions must add up to at most 1, got {sum(shares.values()):g}. "
                "Lower one."
            )
