"""What the page says in words: what happened in a step, and what is known of furniture."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from dataclasses import dataclass
from operator import attrgetter

import numpy as np

from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.thing import ROBOT
from sgm.schema import RELATION_TABLE
from sgm.store.event_kinds import get_by_kind
from simulator.story.story import PastLook, PastStatement, Story

MOST_LOOKS = 12  # at a furniture node
MOST_THINGS = 60  # at a furniture node
_MOST_NAMED = 12  # in a line


@dataclass(frozen=True)
class TextTable:
    """A table in words: its title, names of the columns, cells, and a note below it."""

    title: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    note: str = ""


def tell_step(story: Story, memory: SceneGraphMemory, step: int) -> list[str]:
    """Say what happened in a step, a line each: questions, then looks and statements in order."""
    names = {number: memory.describe(number) for number in memory.furniture_ids}
    lines = [
        f"asked for {question.description}: said {names.get(question.furniture, 'nothing')}, "
        f"{'right' if question.is_right else 'wrong'}"
        for question in story.questions
        if question.step == step
    ]
    first = bisect_left(story.looks, step, key=attrgetter("step"))
    end = bisect_right(story.looks, step, key=attrgetter("step"))
    said = [statement for statement in story.statements if statement.step == step]
    names |= {
        statement.merged: statement.other for statement in said if statement.merged is not None
    }
    for number in range(first, end + 1):
        while said and (said[0].num_looks <= number or number == end):
            lines.append(tell_statement(said.pop(0)))
        if number < end and story.looks[number].furniture in names:
            look = story.looks[number]
            lines.append(f"looked at {names[look.furniture]}: {_tell_look(look)}")
    return lines or ["nothing was seen or asked"]


# The text of an event by its kind, for all that `simulator.story.past_memory` tells.
STATEMENT_TEXTS = {
    "picked_up": "the robot picked up {thing}",
    "put_down": "the robot put down {thing} at {place}",
    "moved": "{thing} at {place}",
    "rename": "{thing} is called {other}",
    "merge": "{thing} and {other} are one thing",
    "split": "{thing} is no longer one thing with others",
    "split_off": "{thing} at {place} is another thing, {other}",
    "remove_object": "there is no {thing}; it is forgotten",
    "remove_furniture": "{place} is gone; it is forgotten",
    "name": "{place} is called {other}",
    "merge_furniture": "{place} and {other} are one piece of furniture",
}


def tell_statement(said: PastStatement) -> str:
    """Tell what was said, or what the robot did."""
    text = get_by_kind(STATEMENT_TEXTS, said.kind, __name__)
    told = text.format(thing=said.thing, other=said.other, place=said.place)
    if text.startswith("the robot") or not said.by:
        return told
    return f"{'the robot' if said.by == ROBOT else said.by} said: {told}"


def tell_furniture(story: Story, memory: SceneGraphMemory, furniture: int) -> list[TextTable]:
    """Say what was seen at a furniture node, when, and what was missed."""
    node = memory.furniture_ids.index(furniture)
    edges, time = memory.batch.edges, memory.time
    is_there = memory.batch.find_present(np.arange(edges.num_rows))
    rows = np.flatnonzero((edges["furniture"] == node) & (edges["num_true"] > 0)).tolist()
    rows.sort(key=lambda edge: (-int(is_there[edge]), -int(edges["last_true"][edge])))
    things = tuple(
        (
            memory.descriptions[edges["object"][edge]],
            "there" if is_there[edge] else _tell_gone(story, memory, node, edge),
            story.get_time(int(edges["last_true"][edge])),
            f"{time - int(edges['last_true'][edge])}",
            f"{edges['num_true'][edge]} of {edges['num_observed'][edge]}",
        )
        for edge in rows[:MOST_THINGS]
    )
    more = f"and {len(rows) - MOST_THINGS} more" if len(rows) > MOST_THINGS else ""
    merged = _list_merged(story, furniture, time)
    looks = [look for look in story.looks if look.furniture in merged and look.step <= time]
    told = tuple(
        (story.get_time(look.step), _tell_look(look)) for look in looks[: -MOST_LOOKS - 1 : -1]
    )
    return [
        TextTable(
            memory.describe(furniture),
            ("object", "", "last seen", "steps ago", "seen in looks"),
            things,
            more,
        ),
        TextTable(f"{len(looks)} looks, the latest first", ("when", "what"), told),
    ]


def _list_merged(story: Story, furniture: int, time: int) -> set[int]:
    """Return the ids of what is one with a furniture node by a time step, its own too."""
    merged = {furniture}
    for said in reversed(story.statements):
        if said.merged is not None and said.step <= time and said.furniture in merged:
            merged.add(said.merged)
    return merged


def _tell_gone(story: Story, memory: SceneGraphMemory, node: int, edge: int) -> str:
    """Say by what a thing is not there: by a statement, or by a look, here or elsewhere."""
    if memory.batch.edges["is_true"][edge]:
        return "seen elsewhere since"
    since = int(memory.batch.edges["last_changed"][edge])
    if int(memory.batch.furniture_last_observed[0, node]) > since:
        return "missing at the last look"
    things = story.things
    numbers = things.find((memory.descriptions[memory.batch.edges["object"][edge]],), memory.time)
    spoken_of = zip(story.statements, things.spoken_of, strict=True)
    if any(said.step == since and number in numbers for said, number in spoken_of):
        return "said to be elsewhere"
    return "missing at the last look"


def _tell_look(look: PastLook) -> str:
    if look.sought is not None:
        return f"no {look.sought}"
    parts = [f"saw {_join(look.seen)}" if look.seen else "saw nothing"]
    if look.missed:
        parts.append(f"missed {_join(look.missed)}")
    if isinstance(look.coverage, tuple):
        shares = zip(look.coverage, RELATION_TABLE.values(), strict=True)
        shown = [f"{share:.0%} of the {relation.part}" for share, relation in shares]
        parts.append(f"{' and '.join(shown)} in view")
    elif look.coverage < 1:
        parts.append(f"{look.coverage:.0%} of it in view")
    return "; ".join(parts)


def _join(names: tuple[str, ...]) -> str:
    more = len(names) - _MOST_NAMED
    return ", ".join(names[:_MOST_NAMED]) + (f" and {more} more" if more > 0 else "")
