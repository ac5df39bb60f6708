"""Memory files: exact resume, small, and never trusted."""

import json
from fractions import Fraction

import numpy as np
import pytest

from sgm.memory.memory_files import write_file
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
    assert (tmp_path / "home.sgm").stat().st_size < 60_000


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


def test_the_file_is_json_that_people_can_read(file):
    content = json.loads(file.read_text(encoding="utf-8"))["content"]
    assert content["furniture"][0] == [0, "fridge", 0, "white fridge"]
    assert content["descriptions"] == ["milk", "氷"]
    assert "氷" in file.read_text(encoding="utf-8")


def test_a_file_cut_short_or_altered_anywhere_is_refused(file):
    whole = file.read_bytes()
    rng = np.random.default_rng(0)
    for end in [0, 1, *rng.integers(2, len(whole) - 2, 20)]:
        file.write_bytes(whole[:end])
        with pytest.raises(ValueError, match=r"memory file must be .*home\.sgm"):
            SceneGraphMemory.load(file)
    for position in rng.integers(0, len(whole) - 1, 60):
        altered = bytearray(whole)
        altered[position] ^= 1
        file.write_bytes(altered)
        with pytest.raises(ValueError, match=r"memory file('s version)? must be .*home\.sgm"):
            SceneGraphMemory.load(file)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"version": 3}, r"^memory file's version must be 1, got 3 in .*home\.sgm\. Make it again"),
        ({"version": True}, r"version must be 1, got True"),
        ({"version": None}, r"version must be 1, got None"),
        ({"format": "poem"}, r"must be one that SceneGraphMemory\.save wrote"),
        ({"checksum": "0"}, r"must be as it was saved, got another checksum"),
        ({"content": None}, r"must be as it was saved, got another checksum"),
    ],
)
def test_another_head_is_refused(file, change, message):
    file.write_text(json.dumps(json.loads(file.read_text(encoding="utf-8")) | change))
    with pytest.raises(ValueError, match=message):
        SceneGraphMemory.load(file)


@pytest.mark.parametrize(
    "content", [b"[1, 2]", b"null", b"\xff\xfe", b"[" * 100_000, b"PK\x03\x04"]
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
        (["edges", "num_true", 0], 0.5),
        (["edges", "last_true", 0], 5),  # later than now
        (["edges", "is_true"], [True]),
        (["edges", "missed"], [-1.0]),
        (["edges", "missed"], ["much", "more"]),
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
    data = json.loads(file.read_text(encoding="utf-8"))
    part = data["content"]
    for step in path[:-1]:
        part = part[step]
    part[path[-1]] = value
    file.write_bytes(write_file(data["content"]))
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
    memory = SceneGraphMemory(log=tmp_path / "looks.jsonl")
    memory.add_furniture("shelf", memory.add_room("kitchen"))
    (shelf,) = np.array(memory.furniture_ids)
    for share in (np.float32(0.75), Fraction(3, 4), 1, True, np.int64(1)):
        memory.observe(shelf, [Sighting("mug", confidence=share)], share)
        memory.note_absent(shelf, "plate", share)
        memory.save(tmp_path / "home.sgm")
        copy = SceneGraphMemory.load(tmp_path / "home.sgm")
        copy.save(tmp_path / "copy.sgm")
        assert (tmp_path / "home.sgm").read_bytes() == (tmp_path / "copy.sgm").read_bytes()


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
    SceneGraphMemory.load(tmp_path / "home.sgm").save(tmp_path / "copy.sgm")
    assert (tmp_path / "home.sgm").read_bytes() == (tmp_path / "copy.sgm").read_bytes()
    looks = json.loads((tmp_path / "copy.sgm").read_bytes())["content"]["looks"]
    assert [look[4:] for look in looks] == [[], ["mug"]]


def test_questions_leave_no_trace_in_a_file_once_their_step_is_over(tmp_path):
    """600 unknown words stayed among the labels, 8 KB, for good."""
    memory = SceneGraphMemory()
    shelf = memory.add_furniture("shelf", memory.add_room("kitchen"))
    memory.observe(shelf, [Sighting("red mug")])
    memory.step()
    memory.save(tmp_path / "before.sgm")
    for number in range(600):
        memory.query(f"thing{number}")
    memory.query("green mug")  # "mug" stays: a label of what was seen
    memory.query("kitchen")
    memory.query("floor")
    memory.step()
    memory.save(tmp_path / "after.sgm")
    before, after = (
        json.loads((tmp_path / name).read_bytes())["content"]
        for name in ("before.sgm", "after.sgm")
    )
    assert after == before | {"time": 2, "history": after["history"]}
    assert len(after["labels"]) == 5


def test_an_empty_memory_is_saved_too(tmp_path):
    SceneGraphMemory().save(tmp_path / "empty.sgm")
    memory = SceneGraphMemory.load(tmp_path / "empty.sgm")
    assert memory.to_dict() == {"time": 0, "rooms": [], "unplaced": []}
    assert memory.add_furniture("shelf", room=memory.add_room("attic")) == 0
