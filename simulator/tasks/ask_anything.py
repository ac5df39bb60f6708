"""Questions of people: they ask for what they need, not for what has just moved."""

from __future__ import annotations

from typing import ClassVar

from simulator.tasks.predict_location import PredictLocation


class AskAnything(PredictLocation):
    """Predict Object Location, where what has just moved is asked for no more than other things.

    A home scores 1 if the chosen furniture holds the object. Networks are to learn from both kinds
    of questions (`data.also_tasks`); it is in no table, and not in the paper.
    """

    title = "Predict Object Location, anything"
    asks_moved: ClassVar[float] = 0.0
