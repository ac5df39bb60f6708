"""Detections in the format of COCO with poses: what is seen where, from files in that form."""

import json
import math

import numpy as np
import pytest
from PIL import Image

from sgm import SceneGraphMemory
from simulator.trace.__main__ import main
from simulator.trace.importers.bag import load_home_map
from simulator.trace.importers.coco import read_coco

START = 1_700_000_000.0
# A camera of 160 x 120 pixels, f = 100, 1.5 m high, 2 m before a table of .8 m: it looks along x,
# 20 degrees down. x right is -y of the map.
TILT = math.radians(20)
FORWARD = np.array([math.cos(TILT), 0, -math.sin(TILT)])
RIGHT = np.array([0.0, -1.0, 0.0])
ROTATION = np.column_stack([RIGHT, np.cross(FORWARD, RIGHT), FORWARD])
POSITION = np.array([0.0, 0.0, 1.5])
CAMERA = {"image_width": 160, "image_height": 120, "camera_matrix": {
    "rows": 3, "cols": 3, "data": [100, 0, 80, 0, 100, 60, 0, 0, 1]}}  # fmt: skip
MAP = """
rooms: [kitchen]
furniture:
  - {name: table, room: kitchen, center: [2, 0, 0.4], size: [0.8, 1.2, 0.8]}
"""
MUG = np.array([2.0, 0.1, 0.85])


def make_quaternion(rotation):
    w = math.sqrt(1 + np.trace(rotation)) / 2
    x, y, z = (rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0],
               rotation[1, 0] - rotation[0, 1])  # fmt: skip
    return x / (4 * w), y / (4 * w), z / (4 * w), w


def see_table():
    """z of every pixel, metres: the table's top, else the floor."""
    u, v = np.meshgrid(np.arange(160), np.arange(120))
    rays = np.stack([(u - 80) / 100, (v - 60) / 100, np.ones(u.shape)], axis=-1) @ ROTATION.T
    depth = np.full(u.shape, 6.0)
    for height in (0.0, 0.8):
        with np.errstate(divide="ignore"):
            away = (height - POSITION[2]) / rays[..., 2]
        point = POSITION + rays * away[..., None]
        is_on = away > 0
        if height:
            is_on &= (np.abs(point[..., 0] - 2) < 0.4) & (np.abs(point[..., 1]) < 0.6)
        depth = np.where(is_on, np.minimum(away, 6.0), depth)
    return depth


@pytest.fixture
def files(tmp_path):
    write_files(tmp_path)
    return tmp_path


def write_files(folder):
    """Six pictures in a second, and a second visit without the mug ten minutes later."""
    local = ROTATION.T @ (MUG - POSITION)
    u, v = 100 * local[0] / local[2] + 80, 100 * local[1] / local[2] + 60
    depth = see_table()
    depth[int(v) - 4 : int(v) + 5, int(u) - 4 : int(u) + 5] = local[2]
    (folder / "depth").mkdir()
    images, annotations, poses = [], [], ["# timestamp tx ty tz qx qy qz qw"]
    numbers = " ".join(f"{value:.9f}" for value in (*POSITION, *make_quaternion(ROTATION)))
    for index in range(12):
        time = START + (index % 6) * 0.2 + (index // 6) * 600
        images.append(
            {"id": index + 1, "file_name": f"{time:.1f}.png", "width": 160, "height": 120}
        )
        poses.append(f"{time + 0.01:.2f} {numbers}")
        shown = depth if index < 6 else see_table()
        picture = Image.fromarray((shown * 1000).astype(np.uint16))
        picture.save(folder / "depth" / f"{time:.1f}.png")
        if index < 6:
            box = [u - 4, v - 4, 8, 8]
            annotations.append(
                {"image_id": index + 1, "category_id": 47, "bbox": box, "score": 0.9}
            )
            annotations.append({"image_id": index + 1, "category_id": 1, "bbox": [0, 0, 9, 9]})
    annotations.append({"image_id": 1, "category_id": 99, "bbox": [0, 0, 9, 9]})
    categories = [{"id": 1, "name": "person"}, {"id": 47, "name": "coffee_mug"}]
    whole = {"images": images, "annotations": annotations, "categories": categories}
    (folder / "coco.json").write_text(json.dumps(whole))
    (folder / "poses.txt").write_text("\n".join(poses))
    (folder / "camera.yaml").write_text(json.dumps(CAMERA))
    (folder / "map.yaml").write_text(MAP)


def read(files, name="coco.json", **options):
    return read_coco(
        files / name, files / "poses.txt", files / "camera.yaml", depth=files / "depth",
        home=load_home_map(files / "map.yaml"), **options,
    )  # fmt: skip


def test_a_mug_is_seen_where_it_is_and_missed_later(files):
    looks = read(files)
    memory = looks.memory
    assert (looks.num_looks, memory.time, memory.descriptions) == (2, 1, ("coffee mug",))
    (seen,) = memory.places_of("coffee mug")
    assert (seen.time, seen.furniture, seen.relation, seen.is_there) == (0, 0, "onTop", False)
    # Its depth image is flat: the middle is taken to lie half of its width, .085 m, behind that.
    assert seen.usual_position == pytest.approx(MUG, abs=0.1)
    assert looks.counts["images"] == 12
    assert looks.counts["annotations that are none"] == 1
    assert memory.clock.start.isoformat() == "2023-11-14T22:13:20"


def test_results_come_with_their_images(files):
    whole = json.loads((files / "coco.json").read_text())
    (files / "results.json").write_text(json.dumps(whole.pop("annotations")))
    (files / "instances.json").write_text(json.dumps(whole))
    looks = read(files, "results.json", images=files / "instances.json")
    assert looks.memory.descriptions == ("coffee mug",)


def test_times_may_be_timestamps_or_dates(files):
    whole = json.loads((files / "coco.json").read_text())
    for row in whole["images"]:
        row["timestamp"] = float(row["file_name"].removesuffix(".png"))
    whole["images"][0] |= {"timestamp": None, "date_captured": "2023-11-14 22:13:20"}
    (files / "coco.json").write_text(json.dumps(whole))
    assert read(files).num_looks == 2


def test_things_with_a_center_need_no_depth(files):
    whole = json.loads((files / "coco.json").read_text())
    for row in whole["annotations"]:
        row["center"] = MUG.tolist()
    (files / "coco.json").write_text(json.dumps(whole))
    home = load_home_map(files / "map.yaml")
    looks = read_coco(
        files / "coco.json", files / "poses.txt", files / "camera.yaml", home=home
    )  # fmt: skip
    assert looks.memory.descriptions == ("coffee mug",)


def test_the_command_writes_a_memory(files, capsys):
    arguments = ["import", "coco", str(files / "coco.json"), "--depth", str(files / "depth")]
    for name in ("poses.txt", "camera.yaml", "map.yaml"):
        arguments += [f"--{name.partition('.')[0]}", str(files / name)]
    assert main([*arguments, "--memory", str(files / "home.sgm")]) == 0
    assert "2 looks, 1 things, 1 pieces of furniture" in capsys.readouterr().out
    assert SceneGraphMemory.load(files / "home.sgm").descriptions == ("coffee mug",)


@pytest.mark.parametrize(
    ("part", "key", "value"),
    [
        ("categories", "id", [1]),
        ("categories", "id", {}),
        ("categories", "name", 7),
        ("categories", "name", None),
        ("images", "id", [1]),
        ("annotations", "image_id", {}),
        ("annotations", "category_id", [47]),
        ("annotations", "bbox", [10**400, 0, 1, 1]),
        ("annotations", "bbox", "box"),
        ("annotations", "score", "much"),
        ("annotations", "track_id", [1]),
        ("annotations", "center", [1e300, 0, 0]),
        ("annotations", "center", [10**400, 0, 0]),
        ("annotations", "center", 5),
        ("images", "width", 2**63),
        ("images", "height", 0),
        ("images", "height", True),
    ],
)
def test_an_entry_of_another_form_is_counted_or_left_out(files, part, key, value):
    whole = json.loads((files / "coco.json").read_text())
    for row in whole[part][:2]:
        row[key] = value
    (files / "coco.json").write_text(json.dumps(whole))
    counts = read(files).counts
    assert counts["annotations that are none"] + counts["images without id, size or time"] > 1


@pytest.mark.parametrize(
    ("name", "content", "error"),
    [
        ("coco.json", "{", "detections must be JSON"),
        ("coco.json", "{}", "must have the list 'annotations'"),
        ("coco.json", "[]", "Give --images"),
        ("poses.txt", "1 2 3", "in line 1 of"),
        ("poses.txt", "# none", "poses must have a line each"),
        ("poses.txt", "1 0 0 0 0 0 0 1", "within 0.05 s of a pose, got none of 12"),
        ("poses.txt", f"{START} 1e300 0 0 0 0 0 1", "position of a camera must lie within"),
        ("poses.txt", f"{START} 0 0 0 0 0 0 2", "quaternion must have the length 1, got 2 of"),
        ("poses.txt", f"{START} 0 0 0 0 -1e300 0 2", "is the pose at 1700000000 in"),
        ("camera.yaml", "{}", "nine numbers of camera_matrix"),
        ("camera.yaml", json.dumps(CAMERA).replace("100", "-1"), "focal lengths fx and fy must be"),
        ("camera.yaml", json.dumps(CAMERA).replace("100", "1" * 400), "nine numbers of"),
        ("camera.yaml", None, "camera must be a file that can be read"),
    ],
)
def test_bad_files_end_in_one_line(files, capsys, name, content, error):
    if content is None:
        (files / name).unlink()
    else:
        (files / name).write_text(content)
    arguments = ["import", "coco", str(files / "coco.json"), "--poses", str(files / "poses.txt")]
    arguments += ["--camera", str(files / "camera.yaml"), "--memory", str(files / "home.sgm")]
    assert main(arguments) == 1
    said = capsys.readouterr()
    assert (said.out, said.err.count("\n")) == ("", 1)
    assert error in said.err
    assert not (files / "home.sgm").exists()


def test_an_import_that_fails_leaves_no_memory(files, capsys):
    """It would be in the way of the next try."""
    whole = json.loads((files / "coco.json").read_text())
    (files / "coco.json").write_text(json.dumps(whole | {"annotations": []}))
    before = set(files.iterdir())
    arguments = ["import", "coco", str(files / "coco.json"), "--map", str(files / "map.yaml")]
    arguments += ["--poses", str(files / "poses.txt"), "--camera", str(files / "camera.yaml")]
    outputs = ["--memory", str(files / "home.sgm"), "--out", str(files / "out")]
    assert main([*arguments, *outputs]) == 1
    assert "log must hold a sighting" in capsys.readouterr().err
    assert set(files.iterdir()) == before
    assert main([*arguments, "--memory", str(files / "none" / "home.sgm")]) == 1
    assert "folder of a file must exist" in capsys.readouterr().err
    assert not (files / "home.sgm").exists()


def test_a_crowd_is_no_thing_at_a_place(files):
    """Annotations of COCO with iscrowd are one box around many things."""
    whole = json.loads((files / "coco.json").read_text())
    for row in whole["annotations"]:
        row["iscrowd"] = int(row["category_id"] == 47)
    (files / "coco.json").write_text(json.dumps(whole))
    looks = read(files)
    assert looks.counts["annotations of crowds"] == 6
    assert looks.memory.descriptions == ()


def test_detections_in_images_that_are_not_there_are_counted(files):
    """They would be looks that saw nothing, without a word: ids as texts, for example."""
    whole = json.loads((files / "coco.json").read_text())
    for row in whole["annotations"]:
        row["image_id"] = str(row["image_id"])
    (files / "coco.json").write_text(json.dumps(whole))
    assert read(files).counts["annotations of no image"] == 12
