"""What a player is scored in."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar


class Game(ABC):
    """Homes, what is asked in them, and how answers are scored.

    Attributes:
        scored_by: modules whose code decides a score; where it changes, scores are played again.
        plays_together: whether all players of a game are played in one go, since what they are
            asked about takes longer to make than they take to answer.
    """

    scored_by: ClassVar[tuple[str, ...]]
    plays_together: ClassVar[bool] = False

    @abstractmethod
    def describe(self) -> dict[str, Any]:
        """Return everything that scores depend on but the player and the code, as JSON values."""

    @abstractmethod
    def play(self, players: Mapping[str, Any]) -> dict[str, Any]:
        """Score players, by name, from what makes each of them; the scores are JSON values."""

    @abstractmethod
    def tell(self) -> dict[str, Any]:
        """Return what is kept beside the scores, so that a table needs no homes.

        Returns:
            "title": of its table. "units": the home or household that each score of a player is of.
        """
