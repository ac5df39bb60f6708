"""Kinds of activity: read from definitions, and the table that ships."""

import json
from importlib.util import find_spec

import numpy as np
import pytest

from sgm.prior.prior_graph import PriorGraph
from simulator.world.routine.activity_kinds import (
    compute_object_weights,
    compute_spot_weights,
    load_kinds,
)
from tools.priors.__main__ import main
from tools.priors.activities import (
    KIND_WORDS,
    count_activities,
    find_kind,
    make_table,
)

DEFINITION = """
(define (problem {name}-0)
    (:objects mug.n.04_1 - mug.n.04 countertop.n.01_1 - countertop.n.01)
    (:init {init} (inroom countertop.n.01_1 kitchen))
    (:goal (and {goal})))
"""


def write(root, name, init, goal):
    path = root / "activity_definitions" / name / "problem0.bddl"
    path.parent.mkdir(parents=True)
    path.write_text(DEFINITION.format(name=name, init=init, goal=goal))


@pytest.mark.parametrize(
    ("activity", "kind"),
    [
        ("washing_plates", "washing up"),
        ("make_coffee", "eating"),
        ("cook_bacon", "cooking"),
        ("re_shelving_library_books", "leaving"),
        ("sorting_books_on_shelf", "reading"),
        ("clean_up_your_desk", "work"),
        ("putting_away_toys", "play"),
        ("folding_clothes", "dressing"),
        ("cleaning_toilet", "grooming"),
        ("vacuuming_floors", "cleaning"),
        ("planting_trees", None),
    ],
)
def test_a_name_says_the_kind(activity, kind):
    assert find_kind(activity) == kind


def test_a_folder_without_activities_is_refused(tmp_path):
    with pytest.raises(ValueError, match=r"bddl must hold activity_definitions.*got none in"):
        count_activities(tmp_path)


def test_activities_are_counted_by_kind(tmp_path):
    write(tmp_path, "cook_bacon", "(ontop mug.n.04_1 countertop.n.01_1)", "(cooked pan.n.01_1)")
    write(tmp_path, "cook_eggs", "", "(inside mug.n.04_1 electric_refrigerator.n.01_1)")
    write(tmp_path, "planting_trees", "(ontop mug.n.04_1 countertop.n.01_1)", "")
    kinds, left_out = count_activities(tmp_path)
    cooking = kinds["cooking"]
    assert cooking.num_activities == 2
    assert cooking.objects == {"mug": 2, "pan": 1}  # an object counts once per activity
    assert cooking.places == {("kitchen", "counter"): 1}  # of the fridge nobody knows the room
    assert left_out == ["planting_trees"]
    table = make_table(kinds)["kinds"]["cooking"]
    assert table["objects"] == {"mug": 1.0, "pan": 0.5}
    assert table["places"] == [["kitchen", "counter", 1]]
    assert table["assumed_objects"]["butter"] == 0.1


@pytest.mark.skipif(find_spec("bddl") is None, reason="needs the build-time package bddl")
def test_the_table_that_ships_is_what_the_command_makes(tmp_path, capsys):
    assert main(["activities", "--out", str(tmp_path / "activities.json")]) == 0
    made = json.loads((tmp_path / "activities.json").read_text())
    from importlib import resources

    shipped = resources.files("simulator.world.routine").joinpath("activities.json")
    assert made == json.loads(shipped.read_text())
    assert "of no kind: 107 (" in capsys.readouterr().out
    assert sum(kind["num_activities"] for kind in made["kinds"].values()) == 1016 - 107


def test_a_broken_definition_is_an_error(tmp_path, capsys):
    write(tmp_path, "cook_bacon", "", "(")
    assert main(["activities", "--out", str(tmp_path / "out.json"), "--bddl", str(tmp_path)]) == 1
    assert "error: " in capsys.readouterr().err
    assert not (tmp_path / "out.json").exists()


def test_every_kind_takes_something_of_the_shipped_prior_and_is_done_somewhere():
    prior = PriorGraph.default()
    labels = [row.label for row in prior.objects]
    weights = compute_object_weights(labels, np.array([row.move_freq for row in prior.objects]))
    assert list(load_kinds()) == list(KIND_WORDS)
    assert (weights.sum(axis=1) > 0).all()
    kinds = list(load_kinds())
    of = dict(zip(labels, weights.T, strict=True))
    assert kinds[of["plate"].argmax()] in ("washing up", "eating", "cooking")
    assert kinds[of["toy"].argmax()] == "play"
    assert not of["microwave"].any()  # it never moves in the prior
    # A synonym is used like what it stands for: plates like a plate, a smartphone like a phone.
    np.testing.assert_allclose(of["plates"], of["plate"])
    np.testing.assert_allclose(of["smartphone"], of["phone"])


def test_types_that_no_activity_names_are_used_a_little_by_every_kind():
    weights = compute_object_weights(["mug", "sextant"], np.ones(2))
    assert (weights[:, 1] > 0).all()
    assert weights[:, 1].max() < weights[:, 0].max()
    assert (compute_object_weights(["sextant", "astrolabe"], np.ones(2)) > 0).all()


def test_a_kind_is_done_at_its_furniture_else_in_its_rooms_else_anywhere():
    kinds = list(load_kinds())
    washing, grooming = kinds.index("washing up"), kinds.index("grooming")
    rooms, where = ["kitchen", "bathroom"], np.array([0, 0, 1])
    weights = compute_spot_weights(rooms, ["sink", "fridge", "toilet"], where)
    # In a kitchen the sink counts 10 in BEHAVIOR; fridges and toilets are not for washing up.
    assert weights[washing].tolist() == [10, 0, 0]
    weights = compute_spot_weights(rooms, ["chair", "fridge", "bidet"], where)
    assert weights[grooming, 2] > 0  # no furniture of its own: anywhere in a bathroom
    weights = compute_spot_weights(["attic"], ["chest"], np.array([0]))
    assert (weights == 1).all()
