"""A row of features per place: numbers by hand, homes of other sizes, and wrappers."""

import numpy as np

from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from simulator.gym.place_rows import PLACE_COLUMNS, compute_place_rows

COLUMN = {name: column for column, name in enumerate(PLACE_COLUMNS)}


def test_rows_by_hand():
    memory = SceneGraphMemory()
    kitchen = memory.add_room("kitchen")
    fridge, counter, _ = (
        memory.add_furniture(name, kitchen) for name in ("fridge", "counter top", "cabinet")
    )
    memory.observe(counter, [Sighting("mug")])
    memory.step(2)
    memory.observe(counter, [Sighting("mug")])
    memory.step()
    memory.observe(counter, [])
    memory.step(2)
    memory.observe(fridge, [Sighting("milk", "in")])
    memory.step()
    queries = memory.query("mug")
    (rows,) = compute_place_rows(memory.batch, queries)
    prior = queries.prior[0].sum(axis=1)
    expected = [
        [prior[0], 0, 0, 0, 0, 1 / 2],  # looked at 1 step ago, for milk
        # Seen twice, the last time 4 steps ago, then missed at the look 3 steps ago.
        [prior[1], 0, np.log(3), np.log(2), 1 / 5, 1 / 4],
        [prior[2], 0, 0, 0, 0, 0],
    ]
    np.testing.assert_allclose(rows, expected, rtol=1e-6)
    memory.observe(counter, [Sighting("mug")])
    (rows,) = compute_place_rows(memory.batch, memory.query("mug"))
    np.testing.assert_allclose(rows[1, 1:], [1, np.log(4), np.log(2), 1, 1], rtol=1e-6)
