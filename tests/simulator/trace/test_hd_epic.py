"""Kitchens of HD-EPIC, from files of our own in its form."""

import json
from datetime import datetime

import pytest

from simulator.trace.__main__ import main
from simulator.trace.events import GONE
from simulator.trace.importers.hd_epic import read_hd_epic
from simulator.trace.source import RecordedSource
from simulator.trace.trace import load_trace

FIRST, SECOND = "P01-20240202-110250", "P01-20240203-080000"
OTHER = "P02-20240210-120000"


def track(start, end, *masks):
    return {"track_id": f"track {start}", "time_segment": [start, end], "masks": list(masks)}


def mask(seconds, fixture):
    return {
        "frame_number": int(seconds * 30), "3d_location": [0.0, 1.0, 2.0], "bbox": [0, 0, 9, 9],
        "fixture": fixture,
    }  # fmt: skip


def write(folder, associations, masks):
    folder.mkdir(exist_ok=True)
    (folder / "assoc_info.json").write_text(json.dumps(associations))
    (folder / "mask_info.json").write_text(json.dumps(masks))
    return folder


@pytest.fixture
def folder(tmp_path):
    """A mug goes from the cupboard to the counter and the sink; a peel is used up; two knives."""
    associations = {
        SECOND: {
            "x": {"name": "mug1", "tracks": [track(5.0, 6.0, "m5", "m6")]},
            "y": {"name": "knife", "tracks": [track(20.0, 21.0, "k5", "k6")]},
        },
        FIRST: {
            "a": {
                "name": "mug",
                "tracks": [track(40.0, 45.0, "m3", "m4"), track(10.0, 12.0, "m1", "m2")],
            },
            "b": {"name": "orange peel", "tracks": [track(30.0, 33.0, "p1", "p2")]},
            "c": {"name": "knife", "tracks": [track(50.0, 52.0, "k1", "k2")]},
            "d": {"name": "Knife2", "tracks": [track(60.0, 61.0, "k3", "k4")]},
            "e": {"name": "cloth", "tracks": [track(1.0, 2.0, "c1", "c2")]},
            "f": {"name": "lid", "tracks": [track(3.0, 4.0, "no such mask")]},
        },
        OTHER: {"z": {"name": "pan", "tracks": [track(1.5, 4.5, "q1", "q2")]}},
    }
    masks = {
        FIRST: {
            "m1": mask(10, "P01_cupboard.009"),
            "m2": mask(12, "P01_counter.002"),
            "m3": mask(40, "P01_counter.002"),
            "m4": mask(45, "P01_sink.001"),
            "p1": mask(30, "P01_counter.002"),
            "p2": mask(33, None),
            "k1": mask(50, "P01_drawer.001"),
            "k2": mask(52, "P01_counter.002"),
            "k3": mask(60, "P01_drawer.001"),
            "k4": mask(61, "P01_sink.001"),
            "c1": mask(1, "Null"),
            "c2": mask(2, None),
        },
        SECOND: {
            "m5": mask(5, "P01_cupboard.009"),
            "m6": mask(6, "P01_counter.002"),
            "k5": mask(20, "P01_counter.002"),
            "k6": mask(21, "P01_drawer.001"),
        },
        OTHER: {"q1": mask(1.5, "P02_hob"), "q2": mask(4.5, "P02_counter.010")},
    }
    return write(tmp_path / "hd_epic", associations, masks)


def tell(trace):
    names = {position: node.name for position, node in trace.layout.furniture.items()} | {GONE: ""}
    return [(event.time_s, event.object, names[event.furniture]) for event in trace.events]


def test_a_kitchen_worked_out_by_hand(folder):
    first, other = read_hd_epic(folder).traces
    assert (first.name, other.name) == ("P01", "P02")
    labels = [(node.label, node.name) for node in first.layout.furniture.values()]
    assert labels == [
        ("counter", "counter 2"),
        ("cupboard", "cupboard 9"),
        ("drawer", "drawer 1"),
        ("sink", "sink 1"),
    ]
    assert first.start == datetime(2024, 2, 2)
    began = 11 * 3600 + 2 * 60 + 50
    later = (24 + 8) * 3600
    assert tell(first) == [
        (began, "mug", "cupboard 9"),
        (began, "orange peel", "counter 2"),
        (began, "knife", "drawer 1"),
        (began, "knife 2", "drawer 1"),
        (began + 10, "mug", ""),
        (began + 12, "mug", "counter 2"),
        (began + 30, "orange peel", ""),  # put down at no fixture: used up
        (began + 40, "mug", ""),
        (began + 45, "mug", "sink 1"),
        (began + 50, "knife", ""),
        (began + 52, "knife", "counter 2"),
        (began + 60, "knife 2", ""),
        (began + 61, "knife 2", "sink 1"),
        (later, "mug", "cupboard 9"),  # the next video finds it there; the knife is where it was
        (later + 5, "mug", ""),
        (later + 6, "mug", "counter 2"),
        (later + 20, "knife", ""),
        (later + 21, "knife", "drawer 1"),
    ]
    assert first.until_s == later + 21
    assert {event.object: event.description for event in first.events} == {
        "mug": "mug",
        "orange peel": "orange peel",
        "knife": "knife",
        "knife 2": "knife",
    }
    relations = {
        first.layout.furniture[event.furniture].label: event.relation
        for event in first.events
        if event.furniture != GONE
    }
    assert relations == {"counter": 1, "cupboard": 0, "drawer": 0, "sink": 0}
    assert tell(other)[0] == (12 * 3600, "pan", "hob")


def test_gaps_may_be_cut_to_a_length(folder):
    (cut,) = read_hd_epic(folder, ["P01"], gap_minutes=10).traces
    (whole,) = read_hd_epic(folder, ["P01"]).traces
    assert cut.start is None
    assert [event.object for event in cut.events] == [event.object for event in whole.events]
    assert cut.events[0].time_s == 0
    # The first video is known to last 61 seconds.
    assert [time for time, name, where in tell(cut) if name == "mug"][-3:] == [661, 666, 667]


def test_what_is_not_read_is_counted(folder):
    said = read_hd_epic(folder).summarise()
    assert "P01: 4 furniture nodes, 4 objects, 18 events" in said
    assert "left out, moves without masks: 1" in said
    assert "left out, things at no fixture: 2" in said  # the cloth, and the lid


def test_the_command_writes_traces_that_can_be_played(folder, tmp_path, capsys):
    out = tmp_path / "kitchens"
    assert main(["import", "hd_epic", str(folder), "--out", str(out), "--gap_minutes", "10"]) == 0
    said = capsys.readouterr().out
    assert f"trace: {out / 'P01'}" in said
    trace = load_trace(out / "P01")
    (read,) = read_hd_epic(folder, ["P01"], gap_minutes=10).traces
    assert tell(trace) == tell(read)
    source = RecordedSource(folders=[str(out / "P01")], step_seconds=60.0)
    assert source.num_steps >= 10
    command = ["import", "hd_epic", str(folder), "--out", str(out)]
    assert main([*command, "--participants", "P07"]) == 1
    assert "participants must be among P01, P02, got 'P07'" in capsys.readouterr().err
    assert main([*command, "--gap_minutes", "-1"]) == 1
    assert "gap_minutes must be 0 or more, got -1" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("associations", "masks", "message"),
    [
        ([], {}, r"assoc_info.json must be an object of videos, got \[\]"),
        ({"kitchen": {}}, {}, r"video must be PARTICIPANT-YYYYMMDD-HHMMSS, got 'kitchen'"),
        ({"P01-20241302-110250": {}}, {}, r"video must be PARTICIPANT-YYYYMMDD-HHMMSS"),
        ({FIRST: {"a": {"name": "mug"}}}, {}, r"association must be an object with name and tr"),
        ({FIRST: {"a": {"name": 3, "tracks": []}}}, {}, r"name must be a text, got 3"),
        (
            {FIRST: {"a": {"name": "mug", "tracks": [{"time_segment": [2, 1], "masks": []}]}}},
            {},
            r"time_segment must be two times in seconds, in order, got \[2, 1\]",
        ),
        (
            {FIRST: {"a": {"name": "mug", "tracks": [track(0, 1, "m")]}}},
            {FIRST: {"m": {"frame_number": "x"}}},
            "mask must be an object with a frame_number",
        ),
        (
            {FIRST: {"a": {"name": "mug", "tracks": [track(0, 1, "m")]}}},
            {FIRST: {"m": {"frame_number": 1, "fixture": 7}}},
            "fixture must be a name or null, got",
        ),
        ({FIRST: {}}, {}, "participants must have things at fixtures, got none for P01"),
        ({}, {}, "participants must be among none, got no video"),
    ],
)
def test_files_of_another_form_are_refused_in_one_line(tmp_path, associations, masks, message):
    folder = write(tmp_path / "own", associations, masks)
    with pytest.raises(ValueError, match=message):
        read_hd_epic(folder)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(ValueError, match=r"assoc_info.json must be a JSON file of HD-EPIC"):
        read_hd_epic(tmp_path)
