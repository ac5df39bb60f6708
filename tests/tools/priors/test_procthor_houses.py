"""ProcTHOR-10k import: hand-written houses in its schema, hand-counted."""

import gzip
import json

import pytest

from simulator.trace.importers.procthor import find_asset_type
from tools.priors.counts import PlacementCounts
from tools.priors.procthor_houses import count_houses, count_procthor_houses

SQUARE = [{"x": 0, "y": 0, "z": 0}, {"x": 0, "y": 0, "z": 4}, {"x": 4, "y": 0, "z": 4}]
SQUARE.append({"x": 4, "y": 0, "z": 0})

HOUSE = {
    "rooms": [
        {"id": "room|2", "roomType": "Kitchen", "floorPolygon": SQUARE},
        {"id": "room|4", "roomType": "Bedroom", "floorPolygon": []},
        {"id": "room|5", "roomType": "Garage"},
    ],
    "objects": [
        {  # Type|room|n, with Type|surface|room|n on it
            "id": "CounterTop|2|0",
            "assetId": "Countertop_L_4x4",
            "children": [
                {"id": "Book|surface|2|0", "assetId": "Book_17"},
                {"id": "Mug|surface|2|1", "assetId": "Mug_1"},
                {"id": "Mug|surface|2|2", "assetId": "Mug_2"},
                {"id": "Vase|surface|2|3", "assetId": "Vase_Tall_1"},
            ],
        },
        {  # raw ids: the type only through assetId
            "id": "4|0|0",
            "assetId": "Bed_12",
            "children": [
                {"id": "small|4|0", "assetId": "RoboTHOR_book_tropic_v"},
                {"id": "small|4|1", "assetId": "TeddyBear_3"},
            ],
        },
        {  # group name, then a type that objectType overrules
            "id": "double-pillow|4|1|0",
            "assetId": "Bed_3",
            "children": [{"id": "Pillow|4|9", "assetId": "Pillow_1", "objectType": "CellPhone"}],
        },
        {"id": "Fridge|2|3", "assetId": "Fridge_1", "children": [{"id": "Egg|surface|2|9"}]},
        {  # no room 9: the floor polygon holds it
            "id": "SideTable|9|0",
            "assetId": "Side_Table_1",
            "position": {"x": 1.0, "y": 0.5, "z": 3.0},
            "children": [{"id": "Apple|surface|9|0"}],
        },
        {"id": "Desk|9|1", "position": {"x": 9, "y": 0, "z": 9}, "children": [{"id": "Pen|9|2"}]},
        {"id": "GarbageCan|2|5", "assetId": "bin_3", "children": [{"id": "Egg|surface|2|7"}]},
        {"id": "Sofa|5|0", "assetId": "Sofa_1", "children": [{"id": "Laptop|5|1"}]},
    ],
}


def make_counts(skips_bad=False):
    return PlacementCounts("procthor", is_per_room=True, skips_bad=skips_bad)


def test_all_id_styles_are_counted_by_hand():
    counts = count_houses([(1, HOUSE), (2, {"rooms": [], "objects": []})], "x", make_counts())
    assert counts.num_units == 2
    assert dict(counts.num_rooms) == {"kitchen": 1, "bedroom": 1}
    assert dict(counts.placements) == {
        ("kitchen", "counter top", "book", "onTop"): 1,
        ("kitchen", "counter top", "mug", "onTop"): 2,
        ("bedroom", "bed", "book", "onTop"): 1,
        ("bedroom", "bed", "teddy bear", "onTop"): 1,
        ("bedroom", "bed", "phone", "onTop"): 1,  # objectType wins over the id
        ("kitchen", "fridge", "egg", "in"): 1,
        ("kitchen", "side table", "apple", "onTop"): 1,
    }
    # two beds in one bedroom are one room with a bed
    assert dict(counts.furniture) == {
        ("kitchen", "counter top"): 1,
        ("bedroom", "bed"): 1,
        ("kitchen", "fridge"): 1,
        ("kitchen", "side table"): 1,
    }
    assert dict(counts.outside["rooms"]) == {"Garage": 1, "(no known room)": 1}
    assert dict(counts.outside["furniture"]) == {"GarbageCan": 1}
    assert dict(counts.outside["objects"]) == {"Vase": 1}
    assert not counts.problems
    summary = counts.summarise()
    assert "outside the objects table: 1 (Vase 1)" in summary
    assert "outside the rooms table: 2 (Garage 1, (no known room) 1)" in summary


@pytest.mark.parametrize(
    ("asset", "kind"),
    [
        ("Countertop_L_4x4", "CounterTop"),
        ("RoboTHOR_office_chair_jules", "Chair"),
        ("Toilet_Paper_Hanger_1", "ToiletPaperHanger"),
        ("ToiletPaper_2", "ToiletPaper"),
        ("DecorativeBox3", "Box"),
        ("Tennis_Racquet_2", "TennisRacket"),
        ("TV_Stand_201_1", "TVStand"),
        ("Wall_Decor_1", None),
        ("", None),
    ],
)
def test_types_of_asset_ids(asset, kind):
    assert find_asset_type(asset) == kind


def _cyclic_house():
    table = {"id": "DiningTable|2|0"}
    table["children"] = [table]
    return {"rooms": HOUSE["rooms"], "objects": [table]}


@pytest.mark.parametrize(
    ("house", "message"),
    [
        (7, "house must have the lists 'rooms' and 'objects'"),
        ({"rooms": []}, "house must have the lists"),
        ({"rooms": [{"id": "room|2"}], "objects": []}, r"rooms\[0\] must have the texts"),
        ({"rooms": [], "objects": [{"children": []}]}, r"objects\[0\] must have an 'id'"),
        ({"rooms": [], "objects": [{"id": "Bed|2|0", "children": 3}]}, "children must be a list"),
        (_cyclic_house(), r"objects\[0\]\.children\[0\] must not be its own parent"),
    ],
)
def test_bad_houses_are_named_or_skipped(house, message):
    with pytest.raises(ValueError, match=rf"{message}.* at houses:3.*--skip-bad"):
        count_houses([(3, house)], "houses", make_counts())
    counts = count_houses([(3, house), (4, HOUSE)], "houses", make_counts(skips_bad=True))
    assert len(counts.problems) == 1
    assert sum(counts.placements.values()) == 8  # the good house counts in full
    assert "bad rows skipped: 1; first: " in counts.summarise()


def test_a_file_streams_and_a_bad_line_is_named(tmp_path):
    path = tmp_path / "train.jsonl.gz"
    path.write_bytes(gzip.compress(f"{json.dumps(HOUSE)}\n{{oops\n\n{json.dumps(HOUSE)}".encode()))
    with pytest.raises(ValueError, match=r"one line of JSON.*train\.jsonl\.gz:2"):
        count_procthor_houses(path)
    counts = count_procthor_houses(path, skip_bad=True)
    assert counts.num_units == 2
    assert counts.placements["kitchen", "counter top", "mug", "onTop"] == 4
    assert "train.jsonl.gz:2" in counts.problems[0]


def test_a_truncated_archive_is_named_and_what_it_holds_counts_on_request(tmp_path):
    lines = "".join(f"{json.dumps({**HOUSE, 'seed': seed})}\n" for seed in range(200))
    path = tmp_path / "train.jsonl.gz"
    path.write_bytes(gzip.compress(lines.encode())[:-200])
    with pytest.raises(ValueError, match=r"complete gzip file.*train\.jsonl\.gz after line \d+"):
        count_procthor_houses(path)
    counts = count_procthor_houses(path, skip_bad=True)
    assert 0 < counts.num_units <= 200
    assert "complete gzip" in counts.problems[-1]


def test_the_prior_package_is_asked_for_by_name(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "prior", None)
    with pytest.raises(ModuleNotFoundError, match="pip install prior"):
        count_procthor_houses(None)


def test_a_line_that_memory_may_not_hold_is_refused(tmp_path):
    """17 MB of one letter in a file of 17 KB."""
    path = tmp_path / "train.jsonl.gz"
    path.write_bytes(gzip.compress(json.dumps(HOUSE).encode() + b"\n" + b" " * (17 << 20)))
    with pytest.raises(ValueError, match=r"at most 16777216 bytes, got more at train\.jsonl\.gz:2"):
        count_procthor_houses(path)
