"""What Foxglove's schemas say of each field and cannot check: all messages of a file keep to it."""

import math

import pytest

from sgm import Clock, SceneGraphMemory, Sighting

pytest.importorskip("mcap", reason="mcap is not installed: extra mcap")
pytest.importorskip("foxglove_schemas_protobuf", reason="no schemas: extra mcap")

from tests.sgm.export.test_mcap import START, export, look_around

LINE_LOOP, ALL = 1, 1  # of the enumerations of the schemas


@pytest.fixture
def found(tmp_path):
    memory = SceneGraphMemory(clock=Clock(START, 600), path=tmp_path / "looks.sgm")
    look_around(memory)
    shelf = memory.furniture_ids[-1]
    for number in range(3):
        memory.step()
        seen = [Sighting(f"{name} {number}", picture="a.jpg") for name in ("Löffel", "box")]
        memory.observe(shelf, seen)
    memory.save(memory.path)
    return export(memory.path, tmp_path / "out.mcap", "--things", "red mug", "Löffel 1", "keys")


def count_nanoseconds(stamp):
    assert 0 <= stamp.nanos < 10**9
    return stamp.seconds * 10**9 + stamp.nanos


def check_pose(pose):
    at, turn = pose.position, pose.orientation
    assert pose.HasField("position")
    assert all(map(math.isfinite, (at.x, at.y, at.z)))
    assert turn.x**2 + turn.y**2 + turn.z**2 + turn.w**2 == pytest.approx(1)


def check_drawn(entity):
    shapes, lines, texts = [*entity.cubes, *entity.spheres], entity.lines, entity.texts
    assert shapes or lines or texts
    for drawn in (*shapes, *lines, *texts):
        check_pose(drawn.pose)
        colour = drawn.color
        assert all(0 <= share <= 1 for share in (colour.r, colour.g, colour.b, colour.a))
        assert colour.a > 0  # else nothing is seen
    assert all(min(shape.size.x, shape.size.y, shape.size.z) > 0 for shape in shapes)
    for line in lines:
        assert line.type == LINE_LOOP
        assert (len(line.points) > 2, line.thickness > 0) == (True, True)
        assert (len(line.colors), len(line.indices)) == (0, 0)  # one colour, and all points
    assert all(text.text and text.font_size > 0 for text in texts)


def test_scenes_are_as_their_schema_says(found):
    kinds = set()
    for messages in found.values():
        for time, schema, scene in messages:
            if schema != "foxglove.SceneUpdate":
                continue
            assert [(gone.type, gone.id) for gone in scene.deletions] == [(ALL, "")]
            ids = [entity.id for entity in scene.entities]
            assert len({*ids, ""}) == len(ids) + 1  # one of an id replaces the other
            for part in (*scene.deletions, *scene.entities):
                assert count_nanoseconds(part.timestamp) == time
            for entity in scene.entities:
                assert (entity.frame_id, entity.frame_locked) == ("map", False)
                assert not entity.HasField("lifetime")  # it stays until it is replaced
                keys = [pair.key for pair in entity.metadata]
                assert len({*keys, ""}) == len(keys) + 1
                assert all(pair.value for pair in entity.metadata)
                check_drawn(entity)
                kinds |= {field.name for field, _ in entity.ListFields()}
    assert {"cubes", "spheres", "lines", "texts", "metadata"} <= kinds


def test_poses_and_frames_are_as_their_schemas_say(found):
    schemas = []
    for messages in found.values():
        for time, schema, message in messages:
            if schema == "foxglove.SceneUpdate":
                continue
            schemas.append(schema)
            assert count_nanoseconds(message.timestamp) == time
            if schema == "foxglove.PoseInFrame":
                assert message.frame_id == "map"
                check_pose(message.pose)
                continue
            assert schema == "foxglove.FrameTransform"
            assert (message.parent_frame_id, message.child_frame_id) == ("map", "camera")
            assert message.HasField("translation")
            turn = message.rotation
            assert turn.z**2 + turn.w**2 == pytest.approx(1)
            assert (turn.x, turn.y) == (0, 0)  # upright: x to where it looks, z up
    assert set(schemas) == {"foxglove.PoseInFrame", "foxglove.FrameTransform"}
