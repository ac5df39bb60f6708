import json
import math
import sqlite3
from contextlib import closing

import numpy as np
import pytest

from sgm import Sighting
from sgm.layout.viewpoint import Viewpoint
from sgm.memory.memory_event import read_events
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.replay.replay import replay
from sgm.store.event import insert_event, read_rows

CAMERA = Viewpoint(1.0, 2.0, 1.4, yaw=0.5, angle=1.2, reach=4.0)


def test_corners_by_hand():
    """Ahead is +y; half of 60 degrees to both sides: (-sin 30, cos 30) and (sin 30, cos 30) x 2."""
    camera = Viewpoint(1.0, 2.0, 1.4, yaw=math.pi / 2, angle=math.pi / 3, reach=4.0)
    expected = [[1, 2], [0, 2 + math.sqrt(3)], [2, 2 + math.sqrt(3)]]
    np.testing.assert_allclose(camera.compute_corners(2.0), expected, atol=1e-12)
    far = camera.compute_corners() - (1, 2)
    np.testing.assert_allclose(np.linalg.norm(far, axis=1), [0, 4, 4])


def test_a_file_holds_from_where_was_looked(tmp_path):
    path = tmp_path / "looks.sgm"
    with SceneGraphMemory(path=path) as memory:
        table = memory.add_furniture("table", memory.add_room("kitchen"))
        memory.observe(table, [Sighting("mug")], viewpoint=CAMERA)
        memory.observe(table, [], 0.5)
        expected = memory.to_dict()
    with closing(sqlite3.connect(path)) as connection:
        looks = [row for row in read_rows(connection, 0) if row.kind == "look"]
    assert json.loads(looks[0].arguments)["viewpoint"] == [1.0, 2.0, 1.4, 0.5, 1.2, 4.0]
    assert "viewpoint" not in json.loads(looks[1].arguments)
    read = [event.values["viewpoint"] for event in read_events(path) if event.kind == "look"]
    assert read == [CAMERA, None]
    again = [before for before, _, _ in replay(read_events(path))][-1]
    assert again.to_dict() == expected  # the memory itself does not use it
    forged = looks[0]._replace(
        arguments=json.dumps({**json.loads(looks[0].arguments), "viewpoint": [1, 2, 3]})
    )
    with closing(sqlite3.connect(path)) as connection, connection:
        connection.execute("DELETE FROM events WHERE number = ?", (forged.number,))
        insert_event(connection, forged)
    with pytest.raises(ValueError, match="viewpoint must be a list of x, y, z"):
        read_events(path)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"x": math.nan}, "viewpoint must be finite numbers"),
        ({"yaw": "north"}, "viewpoint must be finite numbers"),
        ({"angle": 0}, "angle and reach of a viewpoint must lie above 0"),
        ({"angle": 4}, "the angle below pi, got 4 and"),
        ({"reach": -1}, "angle and reach of a viewpoint must lie above 0"),
    ],
)
def test_bad_values(values, message):
    good = {"x": 0, "y": 0, "z": 1, "yaw": 0, "angle": 1, "reach": 4}
    with pytest.raises(ValueError, match=message):
        Viewpoint(**{**good, **values})


def test_a_memory_wants_a_viewpoint():
    memory = SceneGraphMemory()
    table = memory.add_furniture("table", memory.add_room("kitchen"))
    with pytest.raises(TypeError, match=r"viewpoint must be a Viewpoint, got \(1, 2\)\. Take"):
        memory.observe(table, [], viewpoint=(1, 2))
