"""A file of another program that is none of its form ends the command in one line."""

import json
import os
import shutil

import pytest

from simulator.import_command import _WITH_OPTIONS
from simulator.trace.__main__ import main
from simulator.trace.importers import IMPORTERS

from . import test_bag, test_coco, test_frigate, test_hd_epic, test_virtualhome
from .test_home_assistant import write_config
from .test_hydra_files import LABELS
from .test_trace_importers import HOUSE, make_scene_graph

BAD = {
    "empty": b"",
    "spaces": b" \n\t\n",
    "another type": b"7",
    "a list": b"[[[]], 3, null]",
    "an object": b'{"nodes": {}, "edges": {}, "rooms": 3, "objects": {}, "images": {}, "data": []}',
    "NaN": b'{"nodes": NaN, "edges": Infinity, "rooms": NaN, "images": NaN}',
    "a huge number": b"9" * 5000,
    "too many levels": b"[" * 100_000,
    "UTF-16": b"\xff\xfe" + "[1]".encode("utf-16-le"),
    "bytes": bytes(range(256)) * 8,
    "a surrogate": b'{"\\ud800": "\\udfff"}',
    "a key twice": b'{"nodes": [], "nodes": [], "edges": []}',
}


def write_virtualhome(folder):
    (folder / "graph.json").write_text(json.dumps(test_virtualhome.GRAPH))


def write_procthor(folder):
    (folder / "house.json").write_text(json.dumps(HOUSE))


def write_spark_dsg(folder):
    spark_dsg = pytest.importorskip("spark_dsg", reason="spark_dsg is not installed: extra spark")
    make_scene_graph(folder / "graph.json", spark_dsg)
    (folder / "labels.yaml").write_text(LABELS)


def write_frigate(folder):
    (folder / "events.json").write_text(json.dumps(test_frigate.EVENTS))
    (folder / "places.yaml").write_text(test_frigate.PLACES)


def write_coco(folder):
    test_coco.write_files(folder)
    whole = json.loads((folder / "coco.json").read_text())
    (folder / "coco.json").write_text(json.dumps(whole.pop("annotations")))
    (folder / "instances.json").write_text(json.dumps(whole))


def write_bag(folder):
    pytest.importorskip("rosbags", reason="rosbags is not installed: extra bag")
    test_bag.write_recording(folder / "run", "MCAP")
    (folder / "map.yaml").write_text(test_coco.MAP)


def write_hd_epic(folder):
    test_hd_epic.write(folder, {}, {})


COCO = "{}/coco.json --images {}/instances.json --poses {}/poses.txt --camera {}/camera.yaml"
# By format: what writes its files, the arguments of the command, and the files that are spoilt.
FORMATS = {
    "procthor": (write_procthor, "{}/house.json", ["house.json"]),
    "virtualhome": (write_virtualhome, "{}/graph.json", ["graph.json"]),
    "home-assistant": (
        lambda folder: write_config(folder / "config"),
        "{}/config",
        [f"config/.storage/core.{kind}_registry" for kind in ("area", "device", "entity")],
    ),
    "spark-dsg": (
        write_spark_dsg, "{}/graph.json --labels {}/labels.yaml", ["graph.json", "labels.yaml"]
    ),
    "frigate": (write_frigate, "{}/events.json --places {}/places.yaml", ["events.json"]),
    "coco": (
        write_coco, COCO,
        ["coco.json", "instances.json", "poses.txt", "camera.yaml"],
    ),
    "bag": (write_bag, "{}/run --map {}/map.yaml", ["run/run.mcap", "map.yaml"]),
    "hd_epic": (write_hd_epic, "{}", ["assoc_info.json", "mask_info.json"]),
}  # fmt: skip


def list_bad(content):
    """All that a file may hold instead, by what is wrong; None for what is no file."""
    return {
        **BAD,
        "half": content[: len(content) // 2],
        "a folder": None,
        "a pipe": None,
        "a circle": None,
    }


def put(path, kind, content):
    path.unlink()
    if kind == "a folder":
        path.mkdir()
    elif kind == "a pipe":
        os.mkfifo(path)
    elif kind == "a circle":
        path.symlink_to(path)
    else:
        path.write_bytes(content)


def test_every_format_is_spoilt():
    assert set(FORMATS) == {*IMPORTERS, *_WITH_OPTIONS} - {"homer"}  # which torch reads


@pytest.mark.slow
@pytest.mark.parametrize("form", FORMATS)
def test_a_file_of_another_form_ends_in_one_line(tmp_path, capsys, form):
    """No traceback, nothing written, and no pipe is waited for."""
    write, arguments, names = FORMATS[form]
    good, work = tmp_path / "good", tmp_path / "work"
    good.mkdir()
    write(good)
    given = ["import", form, *arguments.replace("{}", str(work)).split(), "--out", f"{work}/out"]
    for name in names:
        for kind, content in list_bad((good / name).read_bytes()).items():
            shutil.copytree(good, work)
            put(work / name, kind, content)
            before = set(work.rglob("*"))
            status, said = main(given), capsys.readouterr()
            what = f"{name}, {kind}: {said.err or said.out}"
            assert (status, said.out, said.err.count("\n")) == (1, "", 1), what
            assert said.err.startswith("error: "), what
            assert " must " in said.err, what
            assert len(said.err) < 1000, what
            assert set(work.rglob("*")) == before, what
            shutil.rmtree(work)
