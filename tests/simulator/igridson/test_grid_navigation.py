from collections import deque
from itertools import pairwise

import numpy as np
import pytest

from simulator.igridson.layout_file import parse_layout
from simulator.igridson.navigation import DIRECTIONS, Routes

SIDES = ((0, 1), (1, 0), (0, -1), (-1, 0))


def flood(layout, start):
    """Breadth-first search, written without the package: steps to each cell walked on."""
    steps = {start: 0}
    todo = deque([start])
    while todo:
        x, y = todo.popleft()
        for dx, dy in SIDES:
            cell = (x + dx, y + dy)
            if cell in steps or layout.is_wall[cell[1], cell[0]]:
                continue
            if layout.furniture_at[cell[1], cell[0]] >= 0:
                continue
            steps[cell] = steps[x, y] + 1
            todo.append(cell)
    return steps


def steps_to_furniture(layout, steps, furniture):
    """Fewest steps to a cell beside the furniture that is no door."""
    beside = {(x + dx, y + dy) for x, y in layout.furniture[furniture].cells for dx, dy in SIDES}
    return min(steps[c] for c in beside if c in steps and not layout.is_door[c[1], c[0]])


def test_all_path_lengths_equal_an_independent_search(home):
    routes = Routes(home)
    for index, (x, y) in enumerate(routes.cells.tolist()):
        steps = flood(home, (x, y))
        for furniture in range(len(home.furniture)):
            expected = steps_to_furniture(home, steps, furniture)
            assert routes.to_furniture[index, furniture] == expected


def test_every_path_is_a_walk_of_that_length_through_free_cells(home):
    routes = Routes(home)
    rng = np.random.default_rng(0)
    for _ in range(500):
        cell = int(rng.integers(len(routes.cells)))
        furniture = int(rng.integers(len(home.furniture)))
        path = routes.find_path(cell, furniture, int(rng.integers(4)))
        assert len(path) == routes.to_furniture[cell, furniture] + 1
        assert path[0] == tuple(routes.cells[cell])
        assert all(home.is_free[y, x] for x, y in path)
        steps = {(b[0] - a[0], b[1] - a[1]) for a, b in pairwise(path)}
        assert steps <= set(DIRECTIONS)
        x, y = path[-1]
        assert furniture in {home.furniture_at[y + dy, x + dx] for dx, dy in SIDES}


def test_hand_worked_distances(small_text):
    # Row 2 is k k k + b b: from (2, 2) to beside the bed, (6, 2), are 4 steps through the door;
    # the fridge at (1, 1) has (2, 1) and (1, 2) beside it, one step; the counter top is at (2, 3).
    routes = Routes(parse_layout(small_text))
    start = routes.find_cell((2, 2))
    assert routes.to_furniture[start].tolist() == [1, 0, 4]
    # between: (1, 2) is beside both fridge and counter top; (2, 2) is 4 from (6, 2), (2, 1) 5.
    assert routes.between.tolist() == [[0, 0, 5], [0, 0, 4], [5, 4, 0]]


def test_straight_on_is_preferred(small_text):
    routes = Routes(parse_layout(small_text.replace("7 1  1x3  bed", "7 3  1x1  bed")))
    path = routes.find_path(routes.find_cell((2, 2)), 2, direction=0)
    assert path == [(2, 2), (3, 2), (4, 2), (5, 2), (6, 2), (7, 2)]


def test_doors_are_walked_through_but_not_stood_in(home):
    routes = Routes(home)
    stands = routes.cells[np.unique(routes.stand)]
    assert not home.is_door[stands[:, 1], stands[:, 0]].any()
    doors = routes.index[home.is_door]
    assert (routes.distance[doors] >= 0).all()


@pytest.mark.parametrize("position", [(0, 0), (1, 1), (99, 0), (-1, 2)])
def test_positions_that_are_not_free_are_refused(home, position):
    with pytest.raises(ValueError, match=f"got column {position[0]}, row {position[1]}"):
        Routes(home).find_cell(position)
