"""Reading and writing traces; every fault is named with its file and row."""

from dataclasses import replace
from datetime import datetime

import pytest
from hypothesis import given
from hypothesis import strategies as st

from simulator.trace import Event, find_traces, load_trace, save_trace
from simulator.trace.layout import get_label
from simulator.trace.trace import remember_trace


def test_labels_descriptions_and_places_are_read(write_home):
    trace = load_trace(write_home(start="2024-05-06T07:30", end_s=30000))
    layout = trace.layout
    assert layout.room_labels == ("kitchen", "bedroom")
    assert layout.furniture_labels == ("table", "shelf", "shelf")
    assert [row.description for row in layout.furniture.values()] == ["table", "oak shelf", "shelf"]
    assert [row.room for row in layout.furniture.values()] == [0, 0, 1]
    assert trace.start == datetime(2024, 5, 6, 7, 30)
    assert (trace.name, trace.start_s, trace.end_s) == ("home", 0, 30000)
    assert trace.events[0] == Event(0, "mug", "large red mug", 0, 1)
    assert trace.events[1] == Event(0, "milk", "milk", 0, 0)  # "Table" is the table
    assert trace.events[2] == Event(0, "book 7", "book", 1, 0)
    assert trace.events[6] == Event(9000, "milk", "milk", -1, 0)
    assert trace.events[7] == Event(10800, "pen", "pen", 2, 1)


def test_positions_are_read_written_and_remembered(write_home):
    events = """time_s,object,furniture,relation,x,y,z
0,mug,table,onTop,1.5,2,0.8
0,milk,table,onTop,,,
60,mug,shelf 2,in,4,-1,0.5
"""
    trace = load_trace(write_home(events=events))
    assert [event.position for event in trace.events] == [(1.5, 2, 0.8), None, (4, -1, 0.5)]
    save_trace(trace, trace_folder := write_home(name="other").parent / "again")
    assert load_trace(trace_folder).events == trace.events
    memory = remember_trace(trace)
    assert memory.last_seen("mug").position == (4, -1, 0.5)
    assert memory.last_seen("milk").position is None


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ("1,2,", "x, y, z must be three numbers or empty, got '1, 2, ' for 'mug'. Give metres"),
        ("1,2,high", "x, y, z must be three numbers or empty, got '1, 2, high'"),
        ("1,2,nan", "position of 'mug' must"),
        ("1,2,1e6", "position of 'mug' must lie within"),
    ],
)
def test_bad_positions_name_the_row(write_home, row, message):
    events = f"time_s,object,furniture,relation,x,y,z\n0,mug,table,onTop,{row}\n"
    with pytest.raises(ValueError, match=f"row 2: {message}"):
        load_trace(write_home(events=events))


def test_arrivals_and_slots_are_counted_by_hand(write_home):
    trace = load_trace(write_home())
    # places: 2 * furniture + (1 if onTop). Back to the table is an arrival, onTop of the same
    # shelf is none.
    assert {words: dict(row) for words, row in trace.arrivals.items()} == {
        "large red mug": {1: 2, 2: 2},
        "milk": {0: 1},
        "book": {2: 1, 5: 1},
        "pen": {5: 1},
    }
    assert trace.num_slots == 3


def test_what_was_written_is_read_again(write_home, tmp_path):
    trace = load_trace(write_home(start="2024-05-06T07:30:10", end_s=30000.5))
    save_trace(trace, tmp_path / "copy" / "home")
    again = load_trace(tmp_path / "copy" / "home")
    assert again == trace
    assert again.checksum == trace.checksum
    save_trace(trace, tmp_path / "copy" / "home")  # again: it is there
    other = replace(trace, events=trace.events[:-1])
    with pytest.raises(ValueError, match=r"must not hold another trace.*Choose another one"):
        save_trace(other, tmp_path / "copy" / "home")
    assert load_trace(tmp_path / "copy" / "home") == trace
    assert other.checksum != trace.checksum


def test_names_that_differ_in_case_alone_are_an_error(write_home):
    folder = write_home()
    path = folder / "events.csv"
    text = path.read_text(encoding="utf-8")
    path.write_text(text + "90000,Milk,table,in,\n", encoding="utf-8")
    with pytest.raises(ValueError, match=r"must not differ in case alone, got 'Milk' after 'milk'"):
        load_trace(folder)
    path.write_text(text + "90000,book_7,table,in,\n", encoding="utf-8")  # as "book 7"
    assert load_trace(folder).events[-1].object == "book 7"


names = st.text("ab 1_", min_size=1, max_size=6).filter(lambda text: text.replace("_", " ").strip())


@pytest.mark.slow
@given(rows=st.lists(st.tuples(st.floats(0, 1e6), names, st.integers(0, 2)), min_size=1))
def test_any_events_survive_a_file(rows, tmp_path_factory):
    folder = tmp_path_factory.mktemp("home")
    text = '{"rooms": ["r"], "furniture": [{"name": "x", "room": "r"}, {"name": "y", "room": "r"}]}'
    (folder / "layout.json").write_text(text)
    lines = ["time_s,object,furniture,relation"]
    known = set()
    for time, name, place in sorted(rows):
        words = " ".join(name.replace("_", " ").split())
        if place < 2 or words in known:
            lines.append(f"{time},{name},{('x', 'y', '')[place]},in")
            known.add(words)
    (folder / "events.csv").write_text("\n".join([*lines, "2e6,last,x,in"]))
    trace = load_trace(folder)
    save_trace(trace, folder / "again")
    assert load_trace(folder / "again").events == trace.events


@pytest.mark.parametrize(
    ("name", "label"),
    [("shelf", "shelf"), ("Side_Table 12", "side table"), ("mug_2", "mug"), ("7", "7")],
)
def test_label_of_a_name(name, label):
    assert get_label(name) == label


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ("-1,mug,table,onTop,", r"row 12: time_s must be a number of seconds >= 0, got '-1'"),
        ("nan,mug,table,onTop,", "time_s must be a number"),
        ("3600,mug,table,onTop,", r"must not decrease, got 3600 after 21600. Sort the rows"),
        ("30000,,table,onTop,", "object must be a non-empty text"),
        ("30000,mug,tabel,onTop,", r"must be in layout.json, got 'tabel'.*known: table, shelf_1"),
        ("30000,mug,table,under,", r"relation must be one of in, onTop, got 'under'"),
        ("30000,mug,table,onTop,blue mug", "description of an object must stay the same"),
        ("30000,cup,,,", "object must be somewhere before it is gone, got 'cup'"),
        ("30000,mug,table", "row must have 5 cells, got 3"),
        ("30000,mug,table,onTop,a,b", "row must have 5 cells, got 6"),
    ],
)
def test_bad_events_name_the_row(write_home, good_events, row, message):
    folder = write_home(events=good_events + row + "\n")
    with pytest.raises(ValueError, match=message) as caught:
        load_trace(folder)
    assert f"{folder}/events.csv, row 12: " in str(caught.value)


@pytest.mark.parametrize(
    ("events", "message"),
    [
        ("", "events must have the columns time_s, object, furniture, relation.*got nothing"),
        ("time_s,object,furniture\n", "must have the columns"),
        ("time_s,object,furniture,relation,colour\n", "must have the columns.*colour"),
        (
            'time_s,object,furniture,relation\n0,"mug,table,in\n',
            "row 2: a row must be .* CSV, got unexpected end of data",
        ),
    ],
)
def test_bad_headers(write_home, events, message):
    with pytest.raises(ValueError, match=message):
        load_trace(write_home(events=events))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"rooms": []}, "rooms must be a list with entries"),
        ({"rooms": ["kitchen", "Kitchen"]}, r"rooms\[1\].name must be unique, got 'Kitchen' again"),
        ({"furniture": [7]}, r"furniture\[0\] must be a JSON object, got 7"),
        ({"furniture": [{"name": "a", "room": "attic"}]}, r"furniture\[0\].room must be one of"),
        ({"furniture": [{"name": "a"}]}, r"furniture\[0\].room must be a non-empty text"),
        ({"furniture": [{"name": "", "room": "kitchen"}]}, "must be a non-empty text"),
        ({"furniture": [{"name": "a", "room": "kitchen", "x": 1}]}, "must have the fields"),
        ({"version": 2}, "version must be 1, got 2"),
        ({"floors": []}, "layout must have the fields.*got 'floors'"),
        ({"start": "yesterday"}, "start must be a date and time, got 'yesterday'. Write it like"),
        ({"start": "2024-05-06T07:30+02:00"}, "start must be local time"),
        ({"end_s": -3}, "end_s must be a number of seconds > 0, got -3"),
        ({"end_s": 100}, "end_s must not be before the last event, got 100 before 21600"),
    ],
)
def test_bad_layouts_name_the_entry(write_home, change, message):
    folder = write_home(**change)
    with pytest.raises(ValueError, match=message) as caught:
        load_trace(folder)
    assert f"{folder}/layout.json" in str(caught.value)


def test_bad_files(write_home, tmp_path):
    with pytest.raises(ValueError, match=r"layout must be JSON in UTF-8.*Mend it"):
        load_trace(write_home(layout="{", name="a"))
    with pytest.raises(ValueError, match=r"layout must be a JSON object, got \[\]"):
        load_trace(write_home(layout="[]", name="b"))
    with pytest.raises(ValueError, match=r"layout must be a file that can be read"):
        load_trace(tmp_path / "none")
    folder = write_home(name="c")
    (folder / "events.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ValueError, match=r"events must be UTF-8.*Save it as UTF-8"):
        load_trace(folder)
    (folder / "events.csv").unlink()
    with pytest.raises(ValueError, match=r"events must be a file that can be read"):
        load_trace(folder)
    (folder / "simulation.json").write_text('{"version": 1, "rules": 3}')
    write_home(name="d").joinpath("simulation.json").write_text('{"version": 1, "rules": 3}')
    with pytest.raises(ValueError, match=r"simulation must be whole, got .*delete the file"):
        load_trace(tmp_path / "d")


def test_folders_of_traces_are_searched(write_home, tmp_path):
    (tmp_path / "many").mkdir()
    folders = [write_home(name=f"many/home_{i}") for i in (2, 1)]
    single = write_home(name="single")
    assert find_traces([single, tmp_path / "many"]) == [single, *folders[::-1]]
    (tmp_path / "empty").mkdir()
    with pytest.raises(ValueError, match=r"trace must be a folder with layout.json"):
        find_traces([tmp_path / "empty"])


def test_a_huge_folder_is_not_searched(tmp_path, monkeypatch):
    monkeypatch.setattr("simulator.trace.trace._MOST_ENTRIES", 3)
    for number in range(4):
        (tmp_path / f"{number}").touch()
    with pytest.raises(ValueError, match=r"hold at most 3 files .* got more in .* Name the folder"):
        find_traces([tmp_path])
