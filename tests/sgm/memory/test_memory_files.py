"""Memory files: exact resume, small, and never trusted."""

import json
import re
import sqlite3
from contextlib import closing
from fractions import Fraction

import numpy as np
import pytest

from sgm import check
from sgm.memory.memory_event import read_events
from sgm.memory.written_tables import list_parts
from sgm.store.event import StoredEvent
from sgm.store.home_reader import HomeReader
from sgm.store.snapshot import Snapshot, write_snapshot
from simulator import (
    Bayesian,
    HomeConfig,
    PriorGraph,
    SampledHomes,
    SceneGraphMemory,
    Sighting,
    Streams,
)
from simulator.world.sensing import observe


@pytest.fixture
def walk():
    """A memory of a home of 32 furniture nodes, and 300 more looks at it."""
    homes = SampledHomes(PriorGraph.default(), HomeConfig(), Streams(1, "val", [0]))
    memory = SceneGraphMemory()
    rooms = [memory.add_room(room) for room in homes.configs[0].rooms]
    for label, room in zip(homes.furniture_labels[0], homes.furniture_room[0], strict=True):
        memory.add_furniture(str(label), room=rooms[room])
    rng = np.random.default_rng(0)
    looks = []
    for _ in range(600):
        homes.evolve()
        furniture = int(rng.integers(32))
        seen = observe(homes, np.array([furniture]))
        texts = [homes.object_descriptions.text(int(code)) for code in seen.seen_code]
        relations = [("in", "onTop")[relation] for relation in seen.seen_relation]
        looks.append((furniture, list(map(Sighting, texts, relations))))
    for look in looks[:300]:
        memory.observe(*look)
        memory.step()
    return memory, looks[300:]


@pytest.mark.slow
def test_resumes_exactly(walk, tmp_path):
    memory, looks = walk[0].copy(), walk[1]
    memory.query("mug")  # its hypothetical edges are open until the next step
    memory.save(tmp_path / "home.sgm")
    copy = SceneGraphMemory.load(tmp_path / "home.sgm")
    for turn, (furniture, seen) in enumerate(looks):
        for one in (memory, copy):
            one.observe(furniture, seen)
        description = seen[0].description if seen else f"novelty {turn}"
        assert memory.rank(Bayesian(), description) == copy.rank(Bayesian(), description)
        for one in (memory, copy):
            one.step()
    for table in ("objects", "edges"):
        mine, theirs = getattr(memory.batch, table), getattr(copy.batch, table)
        for name in mine:
            assert mine[name].tobytes() == theirs[name].tobytes(), name
    assert memory.batch.labels == copy.batch.labels
    assert memory.to_dict() == copy.to_dict()


def test_is_small(walk, tmp_path):
    memory, _ = walk
    for number in range(200 - len(memory.descriptions)):
        memory.observe(number % 32, [Sighting(f"thing number {number}")])
    assert memory.num_furniture == 32
    assert len(memory.descriptions) >= 200
    memory.save(tmp_path / "home.sgm")
    assert (tmp_path / "home.sgm").stat().st_size < 200_000


@pytest.fixture
def file(tmp_path):
    """A saved memory of two places and two objects."""
    memory = SceneGraphMemory()
    kitchen = memory.add_room("Küche")
    fridge = memory.add_furniture("fridge", room=kitchen, description="white fridge")
    memory.add_furniture("counter top", room=kitchen)
    memory.observe(fridge, [Sighting("milk", "in"), Sighting("氷", "in")])
    memory.step()
    memory.save(tmp_path / "home.sgm")
    return tmp_path / "home.sgm"


def forge(file, *statements):
    """Change a file as another program would."""
    with closing(sqlite3.connect(file)) as connection, connection:
        connection.execute("PRAGMA writable_schema = ON")
        for statement in statements:
            connection.execute(*([statement] if isinstance(statement, str) else statement))


def test_the_file_is_a_database_that_people_can_read(file):
    with closing(sqlite3.connect(file)) as connection:
        query = "SELECT thing, place, room, relation FROM sightings"
        assert connection.execute(query).fetchall() == [
            ("milk", "white fridge", "Küche", "in"),
            ("氷", "white fridge", "Küche", "in"),
        ]


def write(memory):
    return json.dumps(memory.parts.state.get_content_to_save().to_json())


def check_altered(file, expected):
    """Tell whether a file is refused in one line that names it; else it must hold the same."""
    said = ""
    try:
        memory = SceneGraphMemory.load(file)
    except ValueError as error:
        said = str(error)
    if not said:
        assert write(memory) == expected
        return False
    assert re.fullmatch(r".*memory file.*home\.sgm.*", said)
    return True


@pytest.mark.slow
def test_a_file_cut_short_or_altered_anywhere_is_refused_or_holds_the_same(file):
    """What no one reads may be anything: free space, and tables for people."""
    with SceneGraphMemory.open(file) as memory:
        memory.observe(0, [Sighting("milk", "in")])
        memory.step()
        memory.parts.files.file.num_new = 0  # no snapshot: its events are read
    whole = file.read_bytes()
    expected = write(SceneGraphMemory.load(file))
    rng = np.random.default_rng(0)
    for end in [0, 1, *rng.integers(2, len(whole) - 2, 20)]:
        file.write_bytes(whole[:end])
        assert check_altered(file, expected)
    used = [place for place in range(len(whole)) if whole[place]]
    refused = 0
    for position in rng.choice(used, 300, replace=False):
        altered = bytearray(whole)
        altered[position] ^= 1
        file.write_bytes(altered)
        refused += check_altered(file, expected)
    assert refused > 50


@pytest.mark.parametrize(
    ("statement", "message"),
    [
        (
            "PRAGMA user_version = 3",
            r"^memory file's version must be 1, got 3 in .*home\.sgm",
        ),
        (
            "PRAGMA application_id = 7",
            r"that SceneGraphMemory wrote, got a database of",
        ),
        ("CREATE TABLE more (a)", r"must be one that SceneGraphMemory wrote, got other tables"),
        ("CREATE VIEW more AS SELECT 1", r"got other tables"),
        (
            "CREATE TRIGGER more AFTER INSERT ON events BEGIN DELETE FROM events; END",
            r"got other tables",
        ),
        ("DROP VIEW moves", r"got other tables"),
        ("CREATE INDEX more ON events (time)", r"got other tables"),
        ("CREATE TABLE _litestream_seq (id INTEGER CHECK (id > 1), seq)", r"got other tables"),
        ("CREATE VIEW _litestream_lock AS SELECT 1 AS id", r"got other tables"),
        ("DELETE FROM snapshots", r"got no snapshot"),
        ("UPDATE snapshots SET time = 7", r"time 7"),
        ("UPDATE snapshots SET content = 'x'", r"another checksum"),
        ("UPDATE snapshot_arrays SET type = 'f8'", r"another checksum"),
        ("UPDATE snapshot_arrays SET numbers = zeroblob(90)", r"another checksum"),
        ("DELETE FROM snapshot_arrays WHERE name LIKE 'edges%'", r"another checksum"),
        (
            "INSERT INTO events VALUES (1, 1, 'step', '{\"num_steps\":1}', NULL, 0)",
            r"no event 1 as it was written",
        ),
        (
            "INSERT INTO events VALUES (2, 1, 'step', '{\"num_steps\":1}', NULL, 0)",
            r"no event 1 as it was written, but 2",
        ),
    ],
)
def test_another_database_is_refused(file, statement, message):
    forge(file, statement)
    for read in (SceneGraphMemory.load, SceneGraphMemory.open, read_events):
        with pytest.raises(ValueError, match=message):
            read(file)


def test_a_replicated_file_goes_on(file):
    """Litestream 0.5.17 makes these two tables in every database that it replicates."""
    forge(
        file,
        "CREATE TABLE _litestream_seq (id INTEGER PRIMARY KEY, seq INTEGER)",
        "CREATE TABLE _litestream_lock (id INTEGER)",
        "INSERT INTO _litestream_seq VALUES (1, 7)",
    )
    with SceneGraphMemory.open(file) as memory:
        memory.step()
        before = write(memory)
    assert write(SceneGraphMemory.load(file)) == before
    assert check.main([str(file)]) == 0
    forge(file, "CREATE TABLE more (a)")
    with pytest.raises(ValueError, match=r"got other tables"):
        SceneGraphMemory.load(file)


@pytest.mark.parametrize(
    ("kind", "arguments"),
    [
        ("dance", {}),
        ("step", {"num_steps": -1}),
        ("step", {}),
        ("step", []),
        ("look", {"furniture": 9, "coverage": 1, "seen": []}),
        ("look", {"furniture": 0, "coverage": 1, "seen": [["", "in", 1]]}),
        ("look", {"furniture": "0", "coverage": 1, "seen": []}),
        ("configure", {"clock": 7}),
    ],
)
def test_a_forged_event_is_refused(file, kind, arguments):
    row = StoredEvent(1, 1, kind, json.dumps(arguments), None)
    values = (*row, row.compute_checksum())
    forge(file, ("INSERT INTO events VALUES (?, ?, ?, ?, ?, ?)", values))
    with pytest.raises(ValueError, match=r"(event 1 of|every look of) a memory"):
        SceneGraphMemory.load(file)


@pytest.mark.parametrize(
    "content", [b"[1, 2]", b"null", b"\xff\xfe", b"[" * 100_000, b"PK\x03\x04", b""]
)
def test_other_files_are_refused(file, content):
    file.write_bytes(content)
    with pytest.raises(ValueError, match=r"memory file must be .*home\.sgm"):
        SceneGraphMemory.load(file)


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (["time"], -1),
        (["time"], "now"),
        (["time"], 1e300),
        (["rooms"], [[0, "kitchen"], [0]]),
        (["furniture", 0, 2], 7),  # in a room that is not there
        (["furniture", 1, 0], 9),  # an id that was never given
        (["furniture", 0], ["fridge"]),
        (["edges", "object", 0], 2),
        (["edges", "furniture"], [-1, 0]),
        (["edges", "relation"], [2, 0]),
        (["edges", "num_true"], [0.5, 1.0]),
        (["edges", "last_true", 0], 5),  # later than now
        (["edges", "is_true"], [1]),
        (["edges", "missed"], [-1.0]),
        (["edges", "confidence"], [1.5, 0.0]),
        (["objects", "last_furniture", 0], 2),
        (["objects"], {}),
        (["furniture_counters", "num_observed"], [1]),
        (["descriptions", 1], "Milk"),
        (["descriptions"], ["old red mug", "red old mug"]),  # one name
        (["labels"], ["house"]),
        (["labels", 2], ["kitchen"]),
        (["asked"], 2),
        (["prior"], None),
    ],
)
def test_content_that_does_not_fit_together_is_refused(file, path, value):
    """A forged file has the right checksum."""
    with HomeReader(file) as reader:
        snapshot, _ = reader.read()
    values = {**snapshot.values}
    for name, column in snapshot.arrays.items():
        table, _, column_name = name.partition(".")
        values.setdefault(table, {})[column_name] = column.tolist()
    part = values
    for step in path[:-1]:
        part = part[step]
    part[path[-1]] = value
    arrays = {
        f"{table}.{name}": np.array(column)
        for table in list_parts()
        for name, column in values.pop(table, {}).items()
    }
    with closing(sqlite3.connect(file, isolation_level=None)) as connection:
        write_snapshot(connection, Snapshot(0, snapshot.time, values, arrays))
    with pytest.raises(
        ValueError, match=r"must be as it was saved, got (?!another checksum).*home\.sgm"
    ):
        SceneGraphMemory.load(file)


def test_a_missing_file_or_folder_is_named(tmp_path):
    with pytest.raises(ValueError, match=r"file must be one that can be read, .*none\.sgm"):
        SceneGraphMemory.load(tmp_path / "none.sgm")
    with pytest.raises(ValueError, match=r"file must be one that can be read"):
        SceneGraphMemory.load(tmp_path)
    with pytest.raises(FileNotFoundError, match=r"folder of a memory file must exist.*Make it"):
        SceneGraphMemory().save(tmp_path / "none" / "home.sgm")


def test_another_prior_is_only_taken_if_it_is_given(file):
    data = json.loads(json.dumps(PriorGraph.default().to_dict()))
    data["placements"] = [row for row in data["placements"] if row["object"] != "milk"]
    data["objects"] = [row for row in data["objects"] if row["label"] != "milk"]
    other = PriorGraph.from_dict(data)
    memory = SceneGraphMemory.load(file, prior=other)
    assert memory.last_seen("milk").furniture == 0
    assert memory.batch.objects["type"].tolist() == [-1, -1]
    assert memory.batch.edges["prior"].tolist() == [0, 0]
    memory.save(file)
    with pytest.raises(ValueError, match=r"prior must be the one of the memory.*PriorGraph\.def"):
        SceneGraphMemory.load(file)
    again = SceneGraphMemory.load(file, prior=PriorGraph.default())
    assert again.batch.edges["prior"][0] > 0


def test_numbers_of_any_kind_are_saved(tmp_path):
    """A detector's confidences are float32, ids come out of arrays; both ended in a TypeError."""
    memory = SceneGraphMemory(path=tmp_path / "kept.sgm")
    memory.add_furniture("shelf", memory.add_room("kitchen"))
    (shelf,) = np.array(memory.furniture_ids)
    for share in (np.float32(0.75), Fraction(3, 4), 1, True, np.int64(1)):
        memory.observe(shelf, [Sighting("mug", confidence=share)], share)
        memory.note_absent(shelf, "plate", share)
        memory.save(tmp_path / "home.sgm")
        copy = SceneGraphMemory.load(tmp_path / "home.sgm")
        copy.save(tmp_path / "copy.sgm")
        assert write(SceneGraphMemory.load(tmp_path / "copy.sgm")) == write(memory)


def test_sightings_may_come_from_any_iterable():
    """An iterator was used up by the check, and the look had found nothing."""
    memory = SceneGraphMemory()
    shelf = memory.add_furniture("shelf", memory.add_room("kitchen"))
    memory.observe(shelf, (Sighting(name) for name in ("mug", "plate")))
    assert memory.places_of("mug")
    assert memory.places_of("plate")


def test_a_look_for_one_thing_after_it_was_seen_is_saved(tmp_path):
    """Looks of the step are done again on loading: they took back what was noted after them."""
    memory = SceneGraphMemory()
    shelf = memory.add_furniture("shelf", memory.add_room("kitchen"))
    memory.observe(shelf, [Sighting("mug")])
    memory.note_absent(shelf, "mug")
    memory.save(tmp_path / "home.sgm")
    copy = SceneGraphMemory.load(tmp_path / "home.sgm")
    assert write(copy) == write(memory)
    looks = json.loads(write(copy))["looks"]
    assert [look[4:] for look in looks] == [[], ["mug"]]


def test_questions_leave_no_trace_once_their_step_is_over():
    """600 unknown words stayed among the labels, 8 KB, for good."""
    memory = SceneGraphMemory()
    shelf = memory.add_furniture("shelf", memory.add_room("kitchen"))
    memory.observe(shelf, [Sighting("red mug")])
    memory.step()
    before = json.loads(write(memory))
    for number in range(600):
        memory.query(f"thing{number}")
    memory.query("green mug")  # "mug" stays: a label of what was seen
    memory.query("kitchen")
    memory.query("floor")
    memory.step()
    after = json.loads(write(memory))
    assert after == before | {"time": 2, "history": after["history"]}
    assert len(after["labels"]) == 5


def test_an_empty_memory_is_saved_too(tmp_path):
    SceneGraphMemory().save(tmp_path / "empty.sgm")
    memory = SceneGraphMemory.load(tmp_path / "empty.sgm")
    assert memory.to_dict() == {"time": 0, "rooms": [], "unplaced": []}
    assert memory.add_furniture("shelf", room=memory.add_room("attic")) == 0
