"""What corrections change in the state of a memory; `MemoryCorrections` has the calls."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sgm.memory.memory_state import MemoryState
from sgm.memory.sighting import RELATIONS
from sgm.memory.statement import Statement
from sgm.names.words import read_words


def take_statement(
    state: MemoryState, description: str, id: str, statement: Statement, was_at: int | None = None
) -> None:
    """Take over what was said of a thing, or what the robot did with it.

    Args:
        state: of the memory.
        description: of the thing; a new one if there is none.
        id: of the thing; empty if it has none.
        statement: what, without the places where it was held to be.
        was_at: the one of several places that it is no longer at; None for all, where it is the
            only one of its description.
    """
    row = state.ensure_object(description, id)
    batch, ids = state.batch, state.furniture.ids
    edges = batch.edges
    is_left = np.isin(edges["object"], state.list_members(row)) & edges["is_true"]
    if was_at is not None:
        is_left &= edges["furniture"] == ids.index(was_at)
    elif batch.objects["num_at_once"][row] > 1:
        is_left[:] = False
    place = relation = -1
    if statement.furniture is not None and statement.relation is not None:
        place = ids.index(statement.furniture)
        relation = RELATIONS.index(statement.relation)
        is_left &= (edges["furniture"] != place) | (edges["relation"] != relation)
    left = np.flatnonzero(is_left)
    places = sorted({ids[index] for index in edges["furniture"][left] if index != place})
    batch.note_left(left, statement.confidence)
    if place < 0:
        batch.note_carried(row)
    else:
        batch.note_place(row, place, relation, statement.confidence)
    num_observed = int(batch.objects["num_observed"][row])
    statement = replace(statement, was_at=tuple(places), num_observed=num_observed)
    state.things[row] = state.things[row].add(statement)
    if state.sought and statement.furniture is not None:
        words = read_words("description", state.things[row].description)
        state.sought.pop((words, statement.furniture), None)
    state.begin_anew()


def split_off(state: MemoryState, row: int, furniture: int, name: str) -> None:
    """Let what was seen of an object at a place be another thing, of a new name."""
    other = state.ensure_object(name)
    batch, place = state.batch, state.furniture.ids.index(furniture)
    edges, objects = batch.edges, batch.objects
    moved = (edges["object"] == row) & (edges["furniture"] == place)
    edges["object"][moved] = other
    for number in (row, other):
        own = np.flatnonzero((edges["object"] == number) & (edges["num_true"] > 0))
        seen = own[np.argsort(edges["last_true"][own], kind="stable")]
        objects["num_observed"][number] = max(int(edges["num_true"][own].sum()), 1)
        objects["last_observed"][number] = edges["last_true"][seen[-1]]
        objects["last_furniture"][number] = edges["furniture"][seen[-1]]
    objects["first_observed"][other] = objects["first_observed"][row]
    objects["num_at_once"][other] = 1
    objects["num_at_once"][row] = max(int(objects["num_at_once"][row]) - 1, 1)
    said = state.things[row].statements
    state.things[other] = replace(
        state.things[other], statements=tuple(one for one in said if one.furniture == furniture)
    )
    state.things[row] = replace(
        state.things[row], statements=tuple(one for one in said if one.furniture != furniture)
    )
    batch.look_up_prior()  # of the new thing
    state.begin_anew()
