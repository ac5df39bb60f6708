"""Symbolic ProcTHOR houses from databases written here: laws of the sampler, geometry by hand."""

import json

import numpy as np
import pytest

from tools.priors.procthor_assets import load_assets, place_members
from tools.priors.procthor_databases import count_procthor_databases
from tools.priors.procthor_rooms import (
    FreeFloor,
    Rectangle,
    choose_weighted,
    sample_room_sizes,
)
from tools.priors.procthor_rules import HOUSE_SPECS

ROOMS = ("inKitchens", "inLivingRooms", "inBedrooms", "inBathrooms")


def _make_asset(kind, x, z, split="train"):
    box = {"x": x, "y": 1.0, "z": z}
    return {"assetId": f"{kind}_{x}", "objectType": kind, "boundingBox": box, "split": split}


def _make_member(name, kind, asset, parent=None, **position):
    place = {"x": 0.0, "z": 0.0, "relativeAnchorToParent": 4, "xAlignment": 1, "zAlignment": 1}
    member = {"name": name, "rotation": 0, "assetIds": {kind: [asset]}}
    member["position"] = {**place, "verticalAlignment": "nextTo", **position}
    return member if parent is None else {**member, "parentInstanceId": parent}


@pytest.fixture
def databases(tmp_path):
    """Bed, desk with a chair and a huge wardrobe for bedrooms; a toilet; small objects."""
    assets = {
        "Bed": [_make_asset("Bed", 1.2, 2.0), _make_asset("Bed", 9.0, 9.0, split="val")],
        "Dresser": [_make_asset("Dresser", 50.0, 50.0)],
        "Desk": [_make_asset("Desk", 1.2, 0.6)],
        "Chair": [_make_asset("Chair", 0.5, 0.4)],
        "Toilet": [_make_asset("Toilet", 0.4, 0.6, split=None)],
    }
    weights = {room: {} for room in ROOMS}
    weights["inBedrooms"] = {"Bed": 2, "Dresser": 2, "Desk": 2, "Book": 2, "CellPhone": 1}
    weights["inBathrooms"] = {"Toilet": 2, "ToiletPaper": 2}
    weights["inKitchens"] = {"Desk": 1}
    weights["inLivingRooms"] = {"Desk": 1}
    flags = dict.fromkeys(assets, True)
    annotations = {
        **weights,
        "onFloor": flags,
        "inCorner": flags,
        "onEdge": flags,
        "inMiddle": {},
        "multiplePerRoom": {"Book": True},
    }
    receptacles = {
        "Bed": {"Book": {"count": 1, "p": 0.0}, "CellPhone": {"count": 1, "p": 1.0}},
        "Desk": {"Book": {"count": 1, "p": 1.0}},
        "Toilet": {"ToiletPaper": {"count": 1, "p": 2.0}},
    }
    room_weights = {"kitchens": 0, "livingRooms": 0, "bedrooms": 1, "bathrooms": 0}
    group = {
        "treeData": [{"instanceId": 1, "children": [{"instanceId": 2}]}],
        "assetMetadata": {
            "1": _make_member("Desk", "Desk", "Desk_1.2"),
            "2": _make_member(
                "Chair", "Chair", "Chair_0.5", 1, relativeAnchorToParent=7, z=0.1, zAlignment=2
            ),
        },
        "groupProperties": {
            "location": {"corner": True, "edge": True, "middle": False},
            "properties": {"allowDuplicates": False},
            "roomWeights": room_weights,
        },
    }
    (tmp_path / "asset_groups").mkdir()
    files = {
        "asset-database": assets,
        "placement-annotations": annotations,
        "receptacles": receptacles,
        "asset_groups/desk-with-chair": group,
    }
    for name, data in files.items():
        (tmp_path / f"{name}.json").write_text(json.dumps(data))
    return tmp_path


def test_same_seed_same_counts(databases):
    first = count_procthor_databases(databases, num_houses=40, seed=3)
    again = count_procthor_databases(databases, num_houses=40, seed=3)
    other = count_procthor_databases(databases, num_houses=40, seed=4)
    assert first.placements == again.placements
    assert first.furniture == again.furniture
    assert first.placements != other.placements


def test_counts_keep_the_generators_rules(databases):
    counts = count_procthor_databases(databases, num_houses=300)
    rooms, furniture = counts.num_rooms, counts.furniture
    assert counts.num_units == 300
    assert set(rooms) == {"kitchen", "living room", "bedroom", "bathroom"}
    assert furniture["bathroom", "toilet"] > 0.9 * rooms["bathroom"]  # placed first, and it fits
    assert furniture["bedroom", "bed"] > 0.8 * rooms["bedroom"]
    assert ("bedroom", "dresser") not in furniture  # 50 m wide
    assert furniture["bedroom", "chair"] > 0  # comes with the group alone
    # weight 1 is skipped with .8 at each of at most 7 attempts, 2 becomes certain
    assert furniture["kitchen", "desk"] / rooms["kitchen"] < 1 - 0.8**7 + 0.05
    # p = 2 always spawns and one a room is the limit; bias <= .1, so p = 0 + .2 - .3 + ... varies
    paper = counts.placements["bathroom", "toilet", "toilet paper", "onTop"]
    assert paper == furniture["bathroom", "toilet"]
    phones = counts.placements["bedroom", "bed", "phone", "onTop"]
    assert 0.8 < phones / furniture["bedroom", "bed"] <= 1
    # three copies whenever p = 1 spawns at all
    books = counts.placements["bedroom", "desk", "book", "onTop"]
    assert books % 3 == 0
    assert ("kitchen", "desk", "book", "onTop") not in counts.placements  # books have no weight


@pytest.mark.slow
def test_house_bias_follows_its_law(databases):
    # On a bed a book spawns with p = 0 + .2 + bias, bias = -.3 + .4 Beta(3.5, 1.9). With one copy
    # (p = 0), E = .2 - .3 + .4 * 3.5 / 5.4 = .159; the clip at 0 touches Beta < .25, which adds
    # less than .005. Standard error over about 1,300 beds is .01.
    counts = count_procthor_databases(databases, num_houses=1000)
    rate = counts.placements["bedroom", "bed", "book", "onTop"] / counts.furniture["bedroom", "bed"]
    assert rate == pytest.approx(0.159, abs=0.03)


def test_group_size_by_hand(databases):
    assets = load_assets(databases)
    (group,) = assets.rooms["bedroom"].groups
    # desk 1.2 x .6 at the origin; the chair's back edge stands .1 in front of its front edge:
    # depth .6 + .1 + .4 = 1.1, width that of the desk
    assert group.max_size == pytest.approx((1.2, 1.1))
    choices = {"Desk": ("Desk", 1.2, 0.6), "Chair": ("Chair", 2.0, 0.4)}
    assert place_members(group, choices) == pytest.approx((2.0, 1.1))
    assert len(assets.rooms["bedroom"].width) == 3  # the bed of another split is left out


def test_free_floor_by_hand():
    floor = FreeFloor(4.0, 3.0)
    floor.subtract(Rectangle(0.0, 0.0, 1.0, 1.0))
    assert set(floor.rectangles) == {Rectangle(1.0, 0.0, 4.0, 3.0), Rectangle(0.0, 1.0, 4.0, 3.0)}
    floor.subtract(Rectangle(1.0, 0.0, 4.0, 3.0))
    assert floor.rectangles == [Rectangle(0.0, 1.0, 1.0, 3.0)]
    floor.subtract(Rectangle(-1.0, -1.0, 9.0, 9.0))
    assert floor.rectangles == []
    assert floor.sample_rectangle(lambda: 0.0, set()) is None


def test_free_floor_covers_what_is_not_taken():
    rng = np.random.default_rng(5)
    for _ in range(30):
        floor, taken = FreeFloor(5.0, 4.0), []
        for _ in range(5):
            x0, z0 = rng.uniform(0, 4), rng.uniform(0, 3)
            taken.append(Rectangle(x0, z0, x0 + rng.uniform(0.2, 1), z0 + rng.uniform(0.2, 1)))
            floor.subtract(taken[-1])
        points = rng.uniform((0, 0), (5, 4), size=(200, 2))
        for x, z in points:
            is_taken = any(r.x0 < x < r.x1 and r.z0 < z < r.z1 for r in taken)
            is_free = any(r.x0 <= x <= r.x1 and r.z0 <= z <= r.z1 for r in floor.rectangles)
            assert is_free != is_taken


def test_anchor_is_a_corner_an_edge_or_the_middle():
    floor = FreeFloor(4.0, 3.0)
    assert floor.sample_anchor(lambda: 0.0, Rectangle(0.0, 0.0, 1.0, 1.0)) == "x-z-"
    assert floor.sample_anchor(lambda: 0.0, Rectangle(3.0, 1.0, 4.0, 2.0)) == "x+"
    assert floor.sample_anchor(lambda: 0.9, Rectangle(3.0, 1.0, 4.0, 2.0)) == ""  # 30 %
    assert floor.sample_anchor(lambda: 0.0, Rectangle(1.0, 1.0, 2.0, 2.0)) == ""


def test_floor_plans_have_the_rooms_of_their_specification():
    rng = np.random.default_rng(1)
    sizes = [sample_room_sizes(rng.random, lambda n: rng.beta(0.5 * n, 6.0)) for _ in range(3000)]
    # sum(weight x rooms) / sum(weight) = 89 / 22 = 4.045; standard deviation 2.7, error .05
    assert sum(weight for weight, _, _ in HOUSE_SPECS) == 22
    assert np.mean([len(rooms) for rooms in sizes]) == pytest.approx(89 / 22, abs=0.15)
    assert all(width > 0.3 and depth > 0.3 for rooms in sizes for _, width, depth in rooms)


def test_choose_weighted_follows_the_weights():
    assert [choose_weighted(lambda at=at: at, [1, 0, 3]) for at in (0.0, 0.24, 0.26, 0.999)] == [
        0,
        0,
        2,
        2,
    ]


def test_no_houses_and_no_package_are_refused(databases, monkeypatch):
    with pytest.raises(ValueError, match="num_houses must be at least 1, got 0"):
        count_procthor_databases(databases, num_houses=0)
    monkeypatch.setattr("tools.priors.packages.find_spec", lambda name: None)
    with pytest.raises(ModuleNotFoundError, match=r"package 'procthor'.*pip install --no-deps"):
        count_procthor_databases(num_houses=1)
