"""Where things were seen in the map: the last position at each place, and the usual one."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from typing import TypeAlias

import numpy as np

from sgm.arrays.table import Table
from sgm.layout.box import Box
from sgm.layout.turns import turn_flat
from sgm.memory.look_weights import SURE
from sgm.memory.merged_rows import group_places, merge_rows
from sgm.memory.remembered import Remembered
from sgm.memory.sighting import Point, Sighting
from sgm.messages import shorten
from sgm.schema import MOST_METRES, NEVER, POSITIONS, RELATIONS, Columns, PlaceCode

# Position, its standard deviation, and the usual position.
Told: TypeAlias = tuple[Point | None, float | None, Point | None]

_REACH = 0.3  # metres: what was seen farther from the usual position moves it no more than that
_MOST_SEEN = 20  # sightings of which a usual position is the mean: a habit may change
_BESIDE = 0.2  # metres from furniture within which a thing may lie on or in it
_XYZ = ("x", "y", "z")
_USUAL = ("usual_x", "usual_y", "usual_z")


def note_positions(
    table: Table, furniture: int, rows: Sequence[int], seen: Sequence[Sighting], time: int
) -> None:
    """Take over the positions of the sightings of one look, of objects by their rows.

    Of several of one object, the one counts that is nearest to where it was seen last there, else
    the surest. The usual position u of the n-th sighting at p moves by a bounded step, so that no
    single one counts much: u + (p - u) min(1, 0.3 m / |p - u|) / n.

    Args:
        table: of positions.
        furniture: index of the place.
        rows: of the objects that were seen, one for each sighting.
        seen: the sightings; those without a position, or unsure ones, change nothing.
        time: time step.

    Source: Huber (1964), "Robust Estimation of a Location Parameter", as a running mean.
    """
    found: dict[tuple[int, int], list[Sighting]] = {}
    for object_row, sighting in zip(rows, seen, strict=True):
        if sighting.position is not None and sighting.confidence >= SURE:
            found.setdefault((object_row, RELATIONS.index(sighting.relation)), []).append(sighting)
    rows_there = np.flatnonzero(table["furniture"] == furniture)
    keys = zip(
        table["object"][rows_there].tolist(), table["relation"][rows_there].tolist(), strict=True
    )
    known = dict(zip(keys, rows_there.tolist(), strict=True))
    for (object_row, relation), sightings in found.items():
        known_row = known.get((object_row, relation))
        sighting = _choose(
            sightings, None if known_row is None else _get_point(table, known_row, _XYZ)
        )
        assert sighting.position is not None
        sd = -1.0 if sighting.position_sd is None else sighting.position_sd
        x, y, z = sighting.position
        if known_row is None:
            table.append(
                1,
                object=object_row,
                furniture=furniture,
                relation=relation,
                time=time,
                x=x,
                y=y,
                z=z,
                sd=sd,
                usual_x=x,
                usual_y=y,
                usual_z=z,
            )
            continue
        number = int(table["num_seen"][known_row]) + 1
        offset = np.array(sighting.position) - _get_point(table, known_row, _USUAL)
        step = min(1.0, _REACH / max(float(np.linalg.norm(offset)), 1e-9))
        step /= min(number, _MOST_SEEN)
        for name, metres in zip(_USUAL, offset.tolist(), strict=True):
            table[name][known_row] += step * metres
        latest = {"num_seen": number, "time": time, "sd": sd, "x": x, "y": y, "z": z}
        for name, value in latest.items():
            table[name][known_row] = value


def _choose(seen: Sequence[Sighting], last: np.ndarray | None) -> Sighting:
    """Return the sighting that is nearest to a point, else the surest one."""
    if last is None:
        return max(seen, key=lambda sighting: sighting.confidence)
    return min(seen, key=lambda sighting: math.dist(sighting.position or (0, 0, 0), last))


def _get_point(table: Table, row: int, names: Sequence[str]) -> np.ndarray:
    return np.array([table[name][row] for name in names])


def forget_positions(table: Table, objects: Collection[int], furniture: Collection[int]) -> None:
    """Note that objects were said to be moved from furniture, or put there: where, is unknown."""
    if table.num_rows:
        is_old = np.isin(table["object"], list(objects))
        is_old &= np.isin(table["furniture"], list(furniture))
        table["time"][is_old] = NEVER


def keep_positions_at(table: Table, furniture: int, box: Box | None) -> None:
    """Forget what is at furniture no longer, which was moved; None where it stands is unknown."""
    rows_there = np.flatnonzero(table["furniture"] == furniture)
    points = np.column_stack([table[name][rows_there] for name in _XYZ])
    is_away = np.ones(len(rows_there), dtype=bool)
    if box is not None and len(rows_there):
        is_away = ~is_beside(box, points)
    table["time"][rows_there[is_away]] = NEVER


def is_beside(box: Box, points: np.ndarray | Point) -> np.ndarray:
    """Tell whether points, (n, 3) or one, are at furniture with a box, bool (n,)."""
    beside: np.ndarray = box.compute_reach(np.atleast_2d(points)) <= _BESIDE
    return beside


def turn_positions(
    table: Table, angle: float, shift: tuple[float, float]
) -> Mapping[str, np.ndarray]:
    """Return the columns of positions that were turned around the origin, and moved then.

    Raises:
        ValueError: if one would lie where no home is.
    """
    new: dict[str, np.ndarray] = {}
    for first, second in (_XYZ[:2], _USUAL[:2]):
        new[first], new[second] = turn_flat(table[first], table[second], angle, shift)
    for values in new.values():
        if (np.abs(values) > MOST_METRES).any():
            raise ValueError(
                f"positions must lie within {MOST_METRES:g} m, got {shorten(shift)} as their shift."
                " Give metres."
            )
    return new


def join_positions(columns: Columns) -> dict[str, np.ndarray]:
    """Make one row of those of one object, furniture node and relation, in the order of the first.

    The last position is the latest; usual ones are the mean, by how often each was seen.
    """
    return merge_rows(POSITIONS, columns, group_places(columns))


def find_positions(memory: Remembered, edges: np.ndarray) -> list[int]:
    """Return the row of the position of each edge (n,) of a memory of one home, -1 for none."""
    table = memory.positions
    if not table.num_rows:
        return [-1] * len(edges)

    def number(columns: Table, rows: np.ndarray | slice) -> np.ndarray:
        place = columns["object"][rows].astype(np.int64) * memory.num_furniture
        return PlaceCode.of(place + columns["furniture"][rows], columns["relation"][rows])

    numbers = number(table, slice(None))
    order = np.argsort(numbers)
    wanted = number(memory.edges, edges)
    nearest = order[np.minimum(np.searchsorted(numbers, wanted, sorter=order), len(numbers) - 1)]
    rows: list[int] = np.where(numbers[nearest] == wanted, nearest, -1).tolist()
    return rows


def tell_positions(memory: Remembered, edges: np.ndarray, is_present: np.ndarray) -> list[Told]:
    """Return of each edge (n,) where the object is, how sure that is, and where it usually lies.

    Where it is, is known as long as it is there, bool (n,), which `MemoryBatch.find_present` tells,
    and nothing was said of it since.
    """
    table, told = memory.positions, list[Told]()
    found = zip(edges, find_positions(memory, edges), is_present, strict=True)
    for edge, position_row, is_there in found:
        if position_row < 0:
            told.append((None, None, None))
            continue
        x, y, z = _get_point(table, position_row, _USUAL).tolist()
        usual, time = (x, y, z), int(table["time"][position_row])
        if not is_there or time == NEVER or memory.edges["last_changed"][edge] > time:
            told.append((None, None, usual))
            continue
        x, y, z = _get_point(table, position_row, _XYZ).tolist()
        sd = float(table["sd"][position_row])
        told.append(((x, y, z), None if sd < 0 else sd, usual))
    return told
