"""`python -m sgm.export mcap`: what is in the file, by the reader of mcap and its own schemas."""

import contextlib
import itertools
import os
import re
import signal
import subprocess
import time
from datetime import datetime

import pytest

from sgm import Clock, SceneGraphMemory, Sighting
from sgm.export.__main__ import main
from sgm.layout.box import Box
from sgm.layout.viewpoint import Viewpoint

reader = pytest.importorskip("mcap.reader", reason="mcap is not installed: extra mcap")
pytest.importorskip("foxglove_schemas_protobuf", reason="no schemas: extra mcap")
from google.protobuf.descriptor_pb2 import FileDescriptorSet  # noqa: E402
from google.protobuf.message_factory import GetMessages  # noqa: E402

SECOND = 10**9
START = datetime(2026, 11, 16, 7)
ZERO = int((START - datetime(1970, 1, 1)).total_seconds()) * SECOND


def look_around(memory):
    """A fridge with a box, an L-shaped counter, a desk with a position, a shelf with nothing."""
    kitchen, study = memory.add_room("kitchen"), memory.add_room("study")
    fridge = memory.add_furniture(
        "fridge", kitchen, box=Box((0.4, 2, 0.85), (0.6, 0.65, 1.7), 1.5, "door")
    )
    corners = [(2, 0), (4, 0), (4, 1), (3, 1), (3, 2), (2, 2)]
    counter = memory.add_furniture("counter", kitchen, box=Box.of_polygon(corners, 0, 1))
    desk = memory.add_furniture("desk", study, position=(6, 1))
    memory.add_furniture("shelf", study)
    memory.observe(fridge, [Sighting("milk", "in")])
    memory.observe(desk, [Sighting("red mug", id=3), Sighting("red mug", id=4)])
    memory.step(3)
    seen = [Sighting("bowl", position=(2.5, 0.5, 1.05))]
    memory.observe(counter, seen, viewpoint=Viewpoint(1, 1, 1.5, 0.5, 1.0, 4.0))
    return memory


@pytest.fixture
def log(tmp_path):
    memory = SceneGraphMemory(clock=Clock(START, 600), path=tmp_path / "looks.sgm")
    look_around(memory).save(tmp_path / "home.sgm")
    return tmp_path / "looks.sgm"


def read(path):
    """Messages by topic, each with its time, decoded by the schemas that are in the file alone."""
    found: dict = {}
    with path.open("rb") as file:
        for schema, channel, message in reader.make_reader(file).iter_messages():
            assert (schema.encoding, channel.message_encoding) == ("protobuf", "protobuf")
            kind = GetMessages(FileDescriptorSet.FromString(schema.data).file)[schema.name]
            decoded = kind.FromString(message.data)
            found.setdefault(channel.topic, []).append((message.log_time, schema.name, decoded))
    return found


def export(source, out, *arguments):
    assert main(["mcap", str(source), str(out), "--finder", "bayesian", *arguments]) == 0
    return read(out)


def test_a_log_becomes_scenes_over_time(log, tmp_path, capsys):
    found = export(log, tmp_path / "out.mcap", "--things", "red mug", "keys")
    assert set(found) == {
        "/furniture", "/things", "/look", "/tf", "/belief/red_mug", "/belief/keys",
        "/next/red_mug", "/next/keys",
    }  # fmt: skip
    total = sum(map(len, found.values()))
    assert f"{total} messages in 8 topics" in capsys.readouterr().out
    # Every scene is whole, whatever was before.
    for topic, messages in found.items():
        for _, schema, message in messages:
            if schema == "foxglove.SceneUpdate":
                assert [deletion.type for deletion in message.deletions] == [1], topic  # ALL
                assert {entity.frame_id for entity in message.entities} <= {"map"}
    # Lines of step 0: start, 2 rooms, 4 pieces, 2 looks, of which the looks are the 8th and 9th.
    looks = [stamp - ZERO for stamp, _, _ in found["/look"]]
    assert looks == [7 * 6 * SECOND // 10, 8 * 6 * SECOND // 10, 1800 * SECOND]
    assert [len(message.entities) for _, _, message in found["/things"]] == [0, 1, 3, 4]


def test_furniture_things_and_looks_stand_where_they_are(log, tmp_path):
    found = export(log, tmp_path / "out.mcap", "--things")
    furniture = {entity.id: entity for entity in found["/furniture"][-1][2].entities}
    (cube,) = furniture["furniture 0"].cubes
    assert (cube.pose.position.x, cube.pose.position.y, cube.pose.position.z) == (0.4, 2, 0.85)
    assert (cube.size.x, cube.size.y, cube.size.z) == (0.6, 0.65, 1.7)
    assert cube.pose.orientation.z == pytest.approx(0.68164, abs=1e-5)  # sin(0.75)
    assert furniture["furniture 0"].texts[0].text == "fridge in kitchen"
    low, high = furniture["furniture 1"].lines
    assert {(point.x, point.y) for point in high.points} == {
        (2, 0), (4, 0), (4, 1), (3, 1), (3, 2), (2, 2)
    }  # fmt: skip
    assert ({point.z for point in low.points}, {point.z for point in high.points}) == ({0}, {1})
    extents = [
        next(pair.value for pair in furniture[f"furniture {n}"].metadata if pair.key == "extents")
        for n in range(4)
    ]
    assert extents == ["measured", "measured", "assumed", "laid out"]
    texts = {text.text for entity in furniture.values() for text in entity.texts}
    assert {"kitchen", "study"} < texts
    things = {entity.texts[0].text: entity for entity in found["/things"][-1][2].entities}
    assert set(things) == {"bowl", "milk", "red mug"}  # two mugs have one text
    at = things["bowl"].spheres[0].pose.position
    assert (at.x, at.y, at.z) == (2.5, 0.5, 1.05)
    assert things["milk"].spheres[0].pose.position.z == pytest.approx(0.85)  # inside: the middle
    assert things["red mug"].spheres[0].pose.position.z == pytest.approx(0.8)  # on top
    look, frame = found["/look"][-1][2], found["/tf"][-1][2]
    assert (look.pose.position.x, look.pose.position.z) == (1, 1.5)
    assert (frame.parent_frame_id, frame.child_frame_id) == ("map", "camera")
    assert frame.rotation.w == pytest.approx(0.96891, abs=1e-5)  # cos(0.25)


def test_a_belief_is_that_of_the_finder(log, tmp_path):
    from sgm import Bayesian, Finder

    found = export(log, tmp_path / "out.mcap", "--things", "milk")
    memory = SceneGraphMemory.load(tmp_path / "home.sgm")
    ranking = Finder(Bayesian()).rank(memory, "milk")
    entities = found["/belief/milk"][-1][2].entities
    shown = {
        pairs["name"]: float(pairs["probability"])
        for entity in entities
        if "probability" in (pairs := {pair.key: pair.value for pair in entity.metadata})
    }
    assert shown == {
        place.name: pytest.approx(place.probability, abs=1e-4)
        for place in ranking
        if place.probability >= 0.005
    }
    likely = max(entities, key=lambda entity: entity.cubes[0].color.a if entity.cubes else 0)
    colour = likely.cubes[0].color
    assert colour.r > colour.b
    assert likely.texts[0].text == f"{ranking[0].probability:.0%}"
    # Asked once a step, after what has changed in it.
    assert [stamp - ZERO for stamp, _, _ in found["/belief/milk"]] == [
        8 * 6 * SECOND // 10, 1800 * SECOND
    ]  # fmt: skip


def test_a_memory_without_a_log_is_one_moment(log, tmp_path):
    SceneGraphMemory.load(log).save(tmp_path / "alone.sgm")
    found = export(tmp_path / "alone.sgm", tmp_path / "out.mcap")
    assert {stamp - ZERO for messages in found.values() for stamp, _, _ in messages} == {
        1800 * SECOND
    }
    assert {"/belief/bowl", "/belief/milk", "/belief/red_mug"} < set(found)


def test_a_home_without_coordinates_and_clock_is_laid_out(tmp_path):
    memory = SceneGraphMemory(path=tmp_path / "looks.sgm")
    rooms = [memory.add_room("kitchen"), memory.add_room("bath")]
    places = [memory.add_furniture("shelf", rooms[n // 8]) for n in range(16)]
    memory.observe(places[0], [Sighting(f"cup {n}") for n in range(30)])
    found = export(tmp_path / "looks.sgm", tmp_path / "out.mcap", "--things")
    cubes = [cube for entity in found["/furniture"][-1][2].entities for cube in entity.cubes]
    middles = {(cube.pose.position.x, cube.pose.position.y) for cube in cubes}
    assert len(middles) == 16
    spots = [entity.spheres[0].pose.position for entity in found["/things"][-1][2].entities]
    assert len({(spot.x, spot.y) for spot in spots}) == 30
    assert all(abs(spot.x - spots[0].x) <= 0.25 for spot in spots)  # on a shelf of half a metre
    assert found["/furniture"][0][0] == 0  # the beginning of 1970


@pytest.mark.slow
@pytest.mark.parametrize("end", [signal.SIGINT, signal.SIGTERM])
def test_a_home_is_followed_until_the_end(tmp_path, python, end):
    home = SceneGraphMemory(clock=Clock(START, 600), path=tmp_path / "home.sgm")
    out = tmp_path / "out.mcap"
    running = subprocess.Popen(
        [python, "-m", "sgm.export", "mcap", str(tmp_path / "home.sgm"), str(out), "--follow",
         "--finder", "bayesian"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert running.stdout.readline().startswith("following ")
    look_around(home)
    home.save(home.path)
    home.step()
    home.observe(home.furniture_ids[0], [Sighting("butter", "in")])
    until = time.monotonic() + 60
    while b"butter" not in _read_torn(out):  # what was written is in the file before it ends
        assert time.monotonic() < until
        time.sleep(0.05)
    running.send_signal(end)
    said, wrong = running.communicate(timeout=60)
    assert (running.returncode, wrong) == (0, "")
    assert said.startswith("mcap: ")
    found = read(out)
    texts = {entity.texts[0].text for entity in found["/things"][-1][2].entities}
    assert texts == {"bowl", "butter", "red mug"}
    assert "/belief/milk" in found  # it was among the first that were seen


def _read_torn(path):
    """All messages of a file that is being written."""
    from mcap.exceptions import McapError
    from mcap.records import Message
    from mcap.stream_reader import StreamReader

    content = b""
    with path.open("rb") as file, contextlib.suppress(McapError, EOFError):
        for record in StreamReader(file).records:
            content += record.data if isinstance(record, Message) else b""
    return content


def test_an_old_file_stays_where_the_new_one_cannot_begin(log, tmp_path, capsys):
    export(log, tmp_path / "out.mcap", "--things")
    before = (tmp_path / "out.mcap").read_bytes()
    for more in (["--follow"], []):
        arguments = ["mcap", str(log), str(tmp_path / "out.mcap"), "--finder", "none", *more]
        assert main(arguments) == 1
        assert "exported folder or one of any_home" in capsys.readouterr().err
        assert (tmp_path / "out.mcap").read_bytes() == before


@pytest.mark.parametrize("is_there", [True, False])
def test_a_file_that_another_one_replaces_is_followed_no_more(
    log, tmp_path, monkeypatch, capsys, is_there
):
    """Its changes would be missing in the file, without a word."""
    out = tmp_path / "out.mcap"

    def replace(_):
        monkeypatch.undo()
        if is_there:
            (tmp_path / "home.sgm").replace(log)
        else:
            log.unlink()

    monkeypatch.setattr("sgm.export.__main__.time.sleep", replace)
    arguments = ["mcap", str(log), str(out), "--follow", "--finder", "bayesian"]
    assert main(arguments) == 1
    said = capsys.readouterr().err
    assert "memory file must stay in its place while it is followed" in said
    assert said.count("\n") == 1
    assert "/belief/milk" in read(out)  # what was written has its index


@pytest.mark.parametrize("more", [[], ["--follow"]])
def test_what_is_no_file_is_not_written_to(log, tmp_path, capsys, more):
    """Nor waited for: a pipe without a reader would stop the command for good."""
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "folder").mkdir()
    (tmp_path / "circle").symlink_to(tmp_path / "circle")
    for name in ("pipe", "folder", "circle", "folder/none/out.mcap"):
        assert main(["mcap", str(log), str(tmp_path / name), "--finder", "bayesian", *more]) == 1
        said = capsys.readouterr()
        assert re.fullmatch(r"error: (\[Errno \d+\] )?(path|folder) .*must .*\n", said.err), (
            said.err
        )


@pytest.mark.parametrize(
    ("source", "out", "error"),
    [
        ("none.sgm", "out.mcap", "memory file must be one that can be read, got"),
        ("home.sgm", "home.sgm", "out must be a new file, or one of MCAP, got"),
        ("home.sgm", "none/out.mcap", "none/out.mcap"),
        ("text.txt", "out.mcap", "text.txt"),
        ("old.sgm", "out.mcap", "time must lie from 1970 to 2261 in a file of MCAP"),
    ],
)
def test_bad_input_ends_in_one_line(log, tmp_path, capsys, source, out, error):
    (tmp_path / "text.txt").write_text("no memory\n")
    SceneGraphMemory(clock=Clock(START.replace(year=1926))).save(tmp_path / "old.sgm")
    before = (tmp_path / "home.sgm").read_bytes()
    assert main(["mcap", str(tmp_path / source), str(tmp_path / out)]) == 1
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1
    assert error in said.err
    assert (tmp_path / "home.sgm").read_bytes() == before
    assert not (tmp_path / "out.mcap").exists()


@pytest.mark.filterwarnings("ignore:looks must be few in a time step")
def test_a_scene_is_later_than_the_one_before(tmp_path):
    """Its deletion takes away what is earlier than it, and nothing of the same time."""
    memory = SceneGraphMemory(clock=Clock(START, 600), path=tmp_path / "looks.sgm")
    desk = memory.add_furniture("desk", memory.add_room("study"))
    for number in range(1100):  # more than have a time of their own by the clock
        memory.observe(desk, [Sighting(f"cup {number % 2}")])
    found = export(tmp_path / "looks.sgm", tmp_path / "out.mcap", "--things")
    stamps = [stamp for stamp, _, _ in found["/things"]]
    assert len(stamps) == 1101
    assert all(first < second for first, second in itertools.pairwise(stamps))
