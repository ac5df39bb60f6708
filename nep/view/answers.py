"""What the page asks for: states, answers, histories and changes, as JSON values."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable
from dataclasses import asdict
from functools import lru_cache
from threading import Lock
from typing import Any

import numpy as np

from nep.view.page_state import Judges, Stage
from nep.view.plan_shapes import PlanShapes, list_ways, make_cone
from nep.view.texts import tell_furniture, tell_step
from sgm.finder.ranking import Ranking
from sgm.finder.search_plan import plan_search
from sgm.memory.seen_positions import tell_positions
from sgm.memory.sighting import Point
from sgm.schema import RELATION_TABLE, PlaceCode
from simulator.drawing.history import History
from simulator.story.story import Story

MOST_PLACES = 12  # of a ranking, in words
MOST_CHANGES = 300  # the latest ones
MOST_LOOKS = 400  # before a step, whose places the map shows
_HISTORIES_KEPT = 64
_PLANNED = 5  # places of a search plan
_LEAST_PLANNED = 0.01  # probability of each of them but the first
_DIGITS = 4  # of probabilities


class Desk:
    """Answers about a stage; calls raise ValueError where the story has no such step."""

    def __init__(self, stage: Stage, judges: Judges) -> None:
        """Answer about a stage."""
        self.stage = stage
        self.judges = judges
        self._names: dict[str, int] = {}
        self._names_lock = Lock()
        self._trace = lru_cache(_HISTORIES_KEPT)(self._trace_object)
        self._lock = Lock()

    def tell_page(self, asked: str = "") -> dict[str, Any]:
        """Return what the page has to know before it asks."""
        story = self.stage.story
        clock = story.clock
        return {
            "title": story.title,
            "asked": asked,
            "judges": self.judges.names,
            "isLive": self.stage.is_live,
            "hasTruth": story.truth is not None,
            "clock": None
            if clock is None
            else {"start": clock.start.isoformat(), "stepSeconds": clock.step_seconds},
            **self.watch(),
        }

    def watch(self) -> dict[str, Any]:
        """Return how far the story goes, and whether it could be read."""
        story = self.stage.story
        return {
            "version": self.stage.version,
            "first": story.first_step,
            "last": story.num_steps,
            "problem": self.stage.problem,
        }

    def list_names(self, since: int = 0) -> list[str]:
        """Return the names that the objects of states are numbers of, from one on."""
        with self._names_lock:
            return list(self._names)[since:]

    def tell_plan(self, step: int) -> dict[str, Any]:
        """Return rooms, furniture and doors at a step."""
        return self.stage.get_shapes(step).to_json()

    def tell_state(self, step: int) -> dict[str, Any]:
        """Return what is remembered at a step: things, looks, and what happened."""
        story = self.stage.story
        memory = story.memory_at(step)
        plan, shapes = self.stage.get_plan(step, story)
        batch = memory.batch
        edges = batch.edges
        rows = np.flatnonzero(edges["num_true"] > 0)
        is_present = batch.find_present(rows)
        points = [position for position, *_ in tell_positions(batch, rows, is_present)]
        with self._names_lock:  # a new name gets the next number
            numbers = [self._names.setdefault(n, len(self._names)) for n in memory.descriptions]
        names = np.array(numbers, dtype=np.int64)  # (O,)
        return {
            "step": step,
            "time": story.get_time(step),
            "plan": plan,
            "numNames": len(self._names),
            "things": {
                "place": PlaceCode.of(edges["furniture"][rows], edges["relation"][rows]).tolist(),
                "relations": [[row.adverb, row.is_inside] for row in RELATION_TABLE.values()],
                "name": names[edges["object"][rows]].tolist(),
                "seen": edges["last_true"][rows].tolist(),
                "there": is_present.astype(int).tolist(),
                "at": [_round_point(position) for position in points],
            },
            "lastLook": np.maximum(batch.furniture_last_observed[0], -1).tolist(),
            "looks": _list_looks(story, shapes, step),
            "events": tell_step(story, memory, step),
        }

    def answer(self, step: int, words: str, judge: str = "bayesian") -> dict[str, Any]:
        """Ask one judge where something is.

        Returns:
            The ranking and a search plan; `problem` alone where the words are no name.
        """
        story = self.stage.story
        memory = story.memory_at(step)
        shapes = self.stage.get_shapes(step, story)
        try:
            ranking = self.judges.get(judge).rank(memory, words)
        except ValueError as error:
            return {"judge": judge, "problem": str(error)}
        likely = [place for place in ranking.places if place.probability >= _LEAST_PLANNED]
        search = plan_search(words, (likely or ranking.places[:1])[:_PLANNED])
        index = {number: node for node, number in enumerate(shapes.furniture_ids)}
        true_places: list[int] = []
        if story.truth is not None:
            holds = story.truth.find(ranking.resolution.matches or (words,), memory.num_furniture)
            true_places = holds[step].nonzero()[0].tolist()
        return {
            "judge": judge,
            "title": str(ranking.resolution),
            "rows": _list_rows(ranking),
            "probability": {
                index[place.furniture]: round(place.probability, _DIGITS)
                for place in ranking.places
                if place.furniture in index
            },
            "search": {
                "looks": [
                    {
                        "furniture": index[look.place.furniture],
                        "say": look.instruction,
                        "cost": round(look.cost, 1),
                        "shows": round(look.place.detection, _DIGITS),
                    }
                    for look in search
                ],
                "found": round(search.found, _DIGITS),
                "cost": round(search.expected_cost, 1),
                "ways": list_ways(shapes, [index[look.place.furniture] for look in search]),
            },
            "truth": true_places,
        }

    def tell_furniture(self, step: int, furniture: int) -> list[dict[str, Any]]:
        """Return what was seen at a furniture node by a step, as tables; none if it is unknown."""
        story = self.stage.story
        memory = story.memory_at(step)
        if furniture not in memory.furniture_ids:
            return []
        return [asdict(table) for table in tell_furniture(story, memory, furniture)]

    def tell_changes(self, step: int) -> dict[str, Any]:
        """Return what has changed by a step, `memory.changes`, the latest first."""
        memory = self.stage.story.memory_at(step)
        changes = memory.changes(0)
        known = set(memory.furniture_ids)
        return {
            "rows": [
                {
                    **asdict(change),
                    "from": _name(memory, change.from_place, known),
                    "to": _name(memory, change.to_place, known),
                    "probability": round(change.probability, _DIGITS),
                }
                for change in changes[:MOST_CHANGES]
            ],
            "more": max(len(changes) - MOST_CHANGES, 0),
        }

    def trace(self, words: str, judge: str) -> dict[str, Any]:
        """Return the history of a thing: belief, truth and looks at the places that matter.

        Raises:
            ValueError: if the words are no name.
        """
        with self._lock:  # who asks for the same meanwhile gets it then
            return self._trace(self.stage.version, words, judge)

    def _trace_object(self, version: int, words: str, judge: str) -> dict[str, Any]:
        """Compute a history; what is kept of another `version` of the story is not found again."""
        story = self.stage.story
        return tell_history(story.trace_object(words, self.judges.get(judge)), story.step_hours)


def _round_point(position: Point | None) -> list[float] | None:
    """Return x and y on the plan, to a centimetre; None where they are unknown."""
    return None if position is None else [round(position[0], 2), round(position[1], 2)]


def tell_history(history: History, step_hours: float) -> dict[str, Any]:
    """Return a history, its times in steps."""
    belief = history.belief

    def list_marks(hours: np.ndarray, places: np.ndarray, values: Iterable[Any]) -> list[list[Any]]:
        rows = zip(hours.tolist(), places.tolist(), values, strict=True)
        return [[round(hour / step_hours), place, mark] for hour, place, mark in rows]

    return {
        "words": history.description,
        "places": history.places,
        "edges": np.round(history.edges / step_hours, 2).tolist(),
        "belief": None
        if belief is None
        else [[None if np.isnan(p) else round(float(p), 3) for p in shares] for shares in belief.T],
        "stays": [
            [place, begin / step_hours, end / step_hours]
            for place, begin, end in history.list_stays()
        ],
        "looks": list_marks(history.look_hour, history.look_place, map(int, history.is_found)),
        "said": list_marks(history.said_hour, history.said_place, history.said_by),
    }


def _list_rows(ranking: Ranking) -> list[dict[str, Any]]:
    """List the answer in words: *elsewhere* first, then the likeliest places."""
    rows: list[dict[str, Any]] = [
        {"p": ranking.elsewhere, "name": "elsewhere", "why": "at no place that the memory knows"}
    ]
    if ranking.with_robot:
        rows.append({"p": ranking.with_robot, "name": "with the robot", "why": "it carries it"})
    rows += [
        {
            "p": place.probability,
            "name": place.name,
            "relation": RELATION_TABLE[place.relation].adverb
            if place.relation in RELATION_TABLE
            else "",  # the place itself was asked for
            "why": place.why,
            "furniture": place.furniture,
            **({} if place.picture is None else {"picture": place.picture}),
        }
        for place in ranking.places[:MOST_PLACES]
    ]
    others = ranking.places[MOST_PLACES:]
    if others:
        left = sum(place.probability for place in others)
        name = f"{len(others)} other place{'s' if len(others) > 1 else ''}"
        rows.append({"p": left, "name": name, "why": ""})
    return [{**row, "p": round(row["p"], _DIGITS)} for row in rows]


def _list_looks(story: Story, shapes: PlanShapes, step: int) -> list[dict[str, Any]]:
    """List the latest looks until a step: furniture, when, from where, and of this step the cone.

    Of earlier steps those alone that say from where they were.
    """
    index = {number: node for node, number in enumerate(shapes.furniture_ids)}
    end = bisect_right(story.looks, step, key=lambda look: look.step)
    rows = []
    for look in story.looks[max(end - MOST_LOOKS, 0) : end]:
        node = index.get(look.furniture)
        if node is None or not (look.step == step or look.viewpoint):
            continue
        entry: dict[str, Any] = {"furniture": node, "step": look.step}
        if look.step == step:
            cone = make_cone(shapes, node, look.viewpoint)
            if cone is not None:
                entry["cone"] = np.round(cone, 3).tolist()
        elif look.viewpoint is not None:
            entry["at"] = [round(look.viewpoint.x, 3), round(look.viewpoint.y, 3)]
        rows.append(entry)
    return rows


def _name(memory: Any, furniture: int | None, known: set[int]) -> str | None:
    return memory.describe(furniture) if furniture in known else None
