"""What the page answers: maps, tables and histories for a question at a step."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Collection
from dataclasses import dataclass
from threading import Lock
from typing import Any

from nep.view.history_figure import make_history
from nep.view.map_figure import MapContent, View, make_map
from nep.view.page_state import Judges, Stage
from nep.view.texts import TextTable, tell_ranking, tell_search
from sgm.finder.search_plan import plan_search
from simulator.drawing.history import History
from simulator.replay.story import Story

SEARCH, TRUTH = "search plan", "truth"  # what may be drawn besides
_HISTORIES_KEPT = 64
_PLANNED = 5  # places of a search plan


@dataclass(frozen=True, slots=True)
class ShownAnswer:
    """What one judge says.

    Attributes:
        figure: of the map.
        tables: the ranking, and the search plan if it was asked for.
        problem: why there is no answer, in a line; empty if there is one.
    """

    figure: dict[str, Any]
    tables: tuple[TextTable, ...] = ()
    problem: str = ""


class Desk:
    """Answers of finders about a stage."""

    def __init__(self, stage: Stage, judges: Judges) -> None:
        """Answer about a stage."""
        self.stage = stage
        self.judges = judges
        self._histories: OrderedDict[tuple[Any, ...], History] = OrderedDict()
        self._lock = Lock()

    def answer(
        self,
        step: int,
        asked: str = "",
        judge: str = "bayesian",
        options: Collection[str] = (SEARCH, TRUTH),
        view: View | None = None,
        selected: int | None = None,
        story: Story | None = None,
    ) -> ShownAnswer:
        """Ask one judge, and draw what it says.

        Args:
            step: of the story.
            asked: what is looked for, in words; empty for nothing.
            judge: name of the finder.
            options: what is drawn besides, some of `SEARCH` and `TRUTH`.
            view: what is on the screen; None for all.
            selected: furniture that was clicked.
            story: what is asked about; None for what the stage shows now.

        Raises:
            ValueError: if the story has no such step.
        """
        story = story or self.stage.story
        memory = story.memory_at(step)
        ranking, search, problem = None, None, ""
        tables: list[TextTable] = []
        true_places: list[int] = []
        if asked:
            try:
                ranking = self.judges.get(judge).rank(memory, asked)
                tables.append(tell_ranking(ranking, judge))
                if SEARCH in options:
                    search = plan_search(asked, ranking.places[:_PLANNED])
                    tables.append(tell_search(search))
            except ValueError as error:
                problem = str(error)
            if ranking is not None and TRUTH in options and story.truth is not None:
                is_there = story.truth.find(
                    ranking.resolution.matches or (asked,), memory.num_furniture
                )
                true_places = [
                    memory.furniture_ids[node] for node in is_there[step].nonzero()[0].tolist()
                ]
        content = MapContent(
            plan=self.stage.get_plan(step, story),
            memory=memory,
            ranking=ranking,
            search=search,
            true_places=true_places,
            looked={look.furniture: look.viewpoint for look in story.looks if look.step == step},
            selected=selected,
            view=view,
        )
        return ShownAnswer(make_map(content), tuple(tables), problem)

    def trace(self, description: str, judge: str | None, step: int) -> dict[str, Any]:
        """Return the figure of the history of a thing, with a line at a step.

        Raises:
            ValueError: if the description is no name.
        """
        story = self.stage.story
        key = (self.stage.version, description, judge)
        with self._lock:  # who asks for the same meanwhile gets it then
            history = self._histories.get(key)
            if history is None:
                finder = None if judge is None else self.judges.get(judge)
                history = self._histories[key] = story.trace_object(description, finder)
                while len(self._histories) > _HISTORIES_KEPT:
                    self._histories.popitem(last=False)
        return make_history(history, step * story.step_hours)
