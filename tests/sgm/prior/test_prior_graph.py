"""PriorGraph: the JSON contract, its array view, its errors."""

import copy
import json
import re
import subprocess
import sys

import numpy as np
import pytest

from sgm.prior.prior_check import find_problems
from sgm.prior.prior_graph import FurnitureType, ObjectType, Placement, PriorGraph

GOOD = {
    "version": 1,
    "metadata": {"name": "test"},
    "rooms": ["kitchen", "bedroom"],
    "furniture": [
        {"label": "table", "room": "kitchen", "prob": 0.5, "max_count": 2, "adjectives": [["red"]]},
        {"label": "table", "room": "bedroom", "prob": 0.1, "max_count": 2, "adjectives": []},
        {"label": "fridge", "room": "kitchen", "prob": 1, "max_count": 1, "adjectives": []},
    ],
    "objects": [
        {
            "label": label,
            "sample_prob": 0.5,
            "max_count": 3,
            "move_freq": 0.2,
            "add_remove_prob": 0.0,
            "adjectives": [["small", "large"]],
        }
        for label in ("mug", "egg")
    ],
    "placements": [
        {"room": None, "furniture": "table", "object": "mug", "relation": "onTop", "prob": 2.0},
        {
            "room": "kitchen",
            "furniture": "fridge",
            "object": "egg",
            "relation": "in",
            "prob": 0.25,
            "count": 7,
            "source": "hand",
        },
    ],
}


def _spoil(*path, value):
    data = copy.deepcopy(GOOD)
    target = data
    for key in path[:-1]:
        target = target[key]
    target[path[-1]] = value
    return data


def test_weights_put_coarse_rows_in_every_room_of_the_furniture():
    weights = PriorGraph.from_dict(GOOD).weights
    # nodes: 0 table/kitchen, 1 table/bedroom, 2 fridge/kitchen; relations: 0 in, 1 onTop
    expected = np.zeros((2, 3, 2))
    expected[0, [0, 1], 1] = 2.0
    expected[1, 2, 0] = 0.25
    np.testing.assert_array_equal(weights, expected)
    assert weights.dtype == np.float64
    with pytest.raises(ValueError, match="read-only"):
        weights[0, 0, 0] = 1


def test_save_and_load_give_an_equal_graph_and_equal_bytes(tmp_path):
    prior = PriorGraph.from_dict(GOOD)
    prior.save(tmp_path / "a.json")
    again = PriorGraph.load(tmp_path / "a.json")
    again.save(tmp_path / "b.json")
    assert again == prior
    assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()
    assert not list(tmp_path.glob("*.part"))


def test_checksum_ignores_metadata_and_nothing_else():
    prior = PriorGraph.from_dict(GOOD)
    assert PriorGraph.from_dict({**GOOD, "metadata": {}}).checksum == prior.checksum
    other = PriorGraph.from_dict(_spoil("placements", 1, "prob", value=0.26))
    assert other.checksum != prior.checksum


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        (("version",), 2, "version must be 1, got 2. Rebuild"),
        (("rooms",), [], "rooms must be a non-empty list"),
        (("rooms",), "kitchen", "rooms must be a non-empty list"),
        (("rooms",), ["kitchen", "kitchen"], "rooms must be unique"),
        (("extra",), 1, "known parts only, got 'extra'. Remove it"),
        (("furniture",), [], "furniture must be a non-empty list"),
        (("furniture", 1, "room"), "attic", "furniture[1].room must be in rooms, got 'attic'"),
        (("furniture", 1, "room"), "kitchen", "furniture[1] must be unique"),
        (("furniture", 0, "prob"), -0.1, "furniture[0].prob must be a finite number >= 0"),
        (("furniture", 0, "prob"), float("nan"), "furniture[0].prob must be a finite number"),
        (("furniture", 0, "max_count"), 0, "furniture[0].max_count must be a whole number >= 1"),
        (("furniture", 0, "max_count"), True, "furniture[0].max_count must be a whole number"),
        (("furniture", 0, "adjectives"), [["red", ""]], "furniture[0].adjectives must be a list"),
        (("furniture", 0, "adjectives"), ["red"], "furniture[0].adjectives must be a list"),
        (("objects", 1, "label"), "mug", "objects[1] must be unique"),
        (("objects", 1, "sample_prob"), 1.5, "objects[1].sample_prob must be a number from 0 to 1"),
        (("objects", 1, "colour"), "red", "objects[1] must have known fields only, got 'colour'"),
        (("placements", 1, "relation"), "under", "placements[1].relation must be one of in, onTop"),
        (("placements", 1, "furniture"), "sofa", "placements[1].furniture must be in furniture"),
        (("placements", 1, "room"), "bedroom", "placements[1].furniture must be in furniture"),
        (("placements", 1, "room"), "attic", "placements[1].room must be in rooms or null"),
        (("placements", 1, "object"), "cat", "placements[1].object must be in objects, got 'cat'"),
        (("placements", 1, "prob"), "much", "placements[1].prob must be a finite number >= 0"),
        (("placements", 1, "prob"), 0.0, "objects[1] must have a placement with prob > 0"),
        (("placements", 1), 3, "placements[1] must be a JSON object, got 3"),
    ],
)
def test_each_broken_rule_names_its_row(path, value, message):
    data = _spoil(*path, value=value)
    assert any(message in problem for problem in find_problems(data))
    with pytest.raises(ValueError, match=r"simulator\.priors check"):
        PriorGraph.from_dict(data, where="my.json")


def test_a_missing_field_and_a_repeated_place_are_named():
    data = copy.deepcopy(GOOD)
    del data["placements"][0]["prob"]
    assert any("placements[0] must have the field 'prob'" in text for text in find_problems(data))
    data = copy.deepcopy(GOOD)
    data["placements"].append({**GOOD["placements"][0], "room": "bedroom"})
    with pytest.raises(ValueError, match=re.escape("placements[2] must be unique")):
        PriorGraph.from_dict(data)


def test_file_errors_name_the_file_and_count_the_rest(tmp_path):
    path = tmp_path / "bad.json"
    data = _spoil("placements", 1, "relation", value="under")
    data["objects"][0]["max_count"] = 0
    path.write_text(json.dumps(data))
    with pytest.raises(ValueError, match=r"objects\[0\].max_count.*bad\.json \(1 more\)"):
        PriorGraph.load(path)
    path.write_text('{"version": 1,\n "rooms": [}')
    with pytest.raises(ValueError, match=r"must be JSON.*bad\.json, line 2, column"):
        PriorGraph.load(path)


def test_construction_in_code_is_checked_too():
    furniture = (FurnitureType("table", "kitchen", 1.0, 1, ()),)
    objects = (ObjectType("mug", 0.5, 1, 0.1, 0.0, ()),)
    with pytest.raises(ValueError, match=r"placements\[0\]\.relation must be one of"):
        PriorGraph(("kitchen",), furniture, objects, (Placement(None, "table", "mug", "on", 1.0),))


def test_the_default_loads_without_heavy_packages():
    code = (
        "import sys; from sgm.prior.prior_graph import PriorGraph; PriorGraph.default();"
        "heavy = {'matplotlib', 'rich', 'torch', 'scipy', 'pandas'} & set(sys.modules);"
        "assert not heavy, heavy"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
