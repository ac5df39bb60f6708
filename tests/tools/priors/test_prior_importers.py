"""iGibson, BEHAVIOR and one's own table: small hand-written inputs, hand-counted."""

import json

import pytest

from tools.priors.behavior import count_behavior, parse_expression
from tools.priors.igibson import count_igibson
from tools.priors.table import count_table


def _write_model(root, category, model, entries):
    path = root / "objects" / category / model / "misc" / "placement_probs.json"
    path.parent.mkdir(parents=True)
    path.write_text(entries if isinstance(entries, str) else json.dumps(entries))


def test_igibson_normalises_each_model_then_averages(tmp_path):
    # sums to 2: .285 and .715 of the counter and the table; the second model is all fridge
    entries = {"counter-kitchen-onTop": 0.57, "table-living_room-onTop": 1.43}
    _write_model(tmp_path, "mug", "a", entries)
    _write_model(tmp_path, "mug", "b", {"fridge-kitchen-inside": 4.0, "piano-kitchen-onTop": 1.0})
    _write_model(tmp_path, "mug", "c", {"table-garage-onTop": 1.0})  # nothing of it is ours
    _write_model(tmp_path, "sushi", "a", {"counter-kitchen-onTop": 1.0})
    counts = count_igibson(tmp_path)
    assert dict(counts.placements) == pytest.approx(
        {
            ("kitchen", "counter", "mug", "onTop"): 0.285 / 2,
            ("living room", "table", "mug", "onTop"): 0.715 / 2,
            ("kitchen", "fridge", "mug", "in"): 1 / 2,
        }
    )
    assert counts.num_units == 3
    assert dict(counts.outside["objects"]) == {"sushi": 1}
    assert dict(counts.outside["furniture"]) == {"piano": 1}
    assert dict(counts.outside["rooms"]) == {"garage": 1}
    assert count_igibson(tmp_path / "objects").placements == counts.placements


@pytest.mark.parametrize(
    ("entries", "message"),
    [
        ("{oops", "model must hold a JSON object"),
        ([1], "model must hold a JSON object, got a list"),
        ({"counter-onTop": 1.0}, "key must be furniture-room-onTop"),
        ({"counter-kitchen-under": 1.0}, "key must be furniture-room-onTop"),
        ({"counter-kitchen-onTop": -1}, "weight of 'counter-kitchen-onTop' must be a finite"),
        ({"counter-kitchen-onTop": "x"}, "weight of 'counter-kitchen-onTop' must be a finite"),
    ],
)
def test_bad_igibson_models_are_named_or_skipped(tmp_path, entries, message):
    _write_model(tmp_path, "mug", "bad", entries)
    _write_model(tmp_path, "mug", "good", {"counter-kitchen-onTop": 1.0})
    with pytest.raises(ValueError, match=rf"{message}.*mug/bad/misc/placement_probs.json"):
        count_igibson(tmp_path)
    counts = count_igibson(tmp_path, skip_bad=True)
    assert counts.placements["kitchen", "counter", "mug", "onTop"] == 1.0
    assert len(counts.problems) == 1


def test_igibson_folder_without_models_is_refused(tmp_path):
    with pytest.raises(ValueError, match=r"got none.*Pass the ig_dataset folder"):
        count_igibson(tmp_path)


ACTIVITY = """(define (problem tidy-0) (:domain omnigibson)
  (:objects mug.n.04_1 mug.n.04_2 - mug.n.04 countertop.n.01_1 - countertop.n.01)
  (:init (ontop mug.n.04_1 countertop.n.01_1) (ontop mug.n.04_2 countertop.n.01_1)
         (ontop bowl.n.01_1 countertop.n.01_1) (ontop mug.n.04_3 floor.n.01_1)
         (inside rag.n.01_1 bucket.n.01_1) (ontop book.n.02_1 piano.n.01_1)
         (inroom countertop.n.01_1 kitchen) (inroom cabinet.n.01_1 kitchen)
         (inroom floor.n.01_1 garage) (inroom piano.n.01_1 living_room))
  (:goal (and (forall (?mug.n.04 - mug.n.04) (inside ?mug.n.04 ?cabinet.n.01_1))
              (not (ontop knife.n.01_1 countertop.n.01_1)))))"""


def _write_behavior(root, activities):
    for name, text in activities.items():
        path = root / "activity_definitions" / name / "problem0.bddl"
        path.parent.mkdir(parents=True)
        path.write_text(text)
    data = root / "generated_data"
    data.mkdir(parents=True)
    (data / "category_mapping.csv").write_text(
        "category,synset\ncountertop,countertop.n.01\nbar,countertop.n.01\n"
        "bottom_cabinet,cabinet.n.01\ntop_cabinet,cabinet.n.01\nfridge,electric_refrigerator.n.01\n"
    )
    kitchen = {"countertop-a": 2, "bar-b": 1, "bottom_cabinet-c": 1, "lamp-d": 1}
    scenes = {
        "Rs_int": {"kitchen_0": kitchen, "kitchen_1": {"top_cabinet-e": 1}, "closet_0": {}},
        "restaurant_asian": {"kitchen_0": {"fridge-f": 1}},
    }
    inventory = {"scenes": scenes}
    (data / "combined_room_object_list.json").write_text(json.dumps(inventory))


def test_behavior_counts_activities_not_facts(tmp_path):
    _write_behavior(tmp_path, {"one": ACTIVITY, "two": ACTIVITY.replace("tidy-0", "tidy-1")})
    counts = count_behavior(tmp_path)
    # two mugs on one counter are one activity each time; `not` and unknown parents do not count
    assert dict(counts.placements) == {
        ("kitchen", "counter", "mug", "onTop"): 2,
        ("kitchen", "top cabinet", "mug", "in"): 2,
    }
    assert dict(counts.num_rooms) == {"kitchen": 2}  # the restaurant is no home
    # counter and bar are one furniture of one kitchen; a bottom cabinet is not a top cabinet
    assert dict(counts.furniture) == {("kitchen", "counter"): 1, ("kitchen", "top cabinet"): 1}
    assert counts.outside["objects"]["bowl.n.01"] == 2
    assert counts.outside["furniture"]["piano.n.01"] == 2
    assert counts.outside["rooms"]["garage"] == 2


def test_an_unbalanced_activity_is_named_or_skipped(tmp_path):
    _write_behavior(tmp_path, {"one": ACTIVITY, "two": "(define (problem"})
    with pytest.raises(ValueError, match=r"balanced definition.*two/problem0\.bddl"):
        count_behavior(tmp_path)
    counts = count_behavior(tmp_path, skip_bad=True)
    assert (counts.num_units, len(counts.problems)) == (1, 1)


@pytest.mark.parametrize("text", ["(a (b)", "a) (b", "(a) (b)", ""])
def test_expressions_must_balance(text):
    with pytest.raises(ValueError, match=r"many|open"):
        parse_expression(text)


def test_a_table_fills_in_what_it_leaves_out(tmp_path):
    path = tmp_path / "mine.csv"
    path.write_text(
        "room,furniture,object,relation,weight\n"
        "Kitchen,fridge,egg,,3\nkitchen,fridge,egg,inside,2\nliving_room,Coffee Table,mug,,\n"
        ",sofa,book,on,1\nattic,sofa,book,,1\nkitchen,oven,pan,,1\nkitchen,table,cat,,1\n"
    )
    counts = count_table(path)
    assert dict(counts.placements) == {
        ("kitchen", "fridge", "egg", "in"): 5.0,
        ("living room", "coffee table", "mug", "onTop"): 1.0,
        (None, "sofa", "book", "onTop"): 1.0,
    }
    assert counts.is_counted
    assert {part: sum(names.values()) for part, names in counts.outside.items()} == {
        "rooms": 1,
        "furniture": 1,
        "objects": 1,
    }


def test_a_json_table_reads_like_a_csv_one(tmp_path):
    path = tmp_path / "mine.json"
    path.write_text(json.dumps([{"furniture": "bed", "object": "book", "weight": 0.5}]))
    counts = count_table(path)
    assert dict(counts.placements) == {(None, "bed", "book", "onTop"): 0.5}
    assert not counts.is_counted


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ("kitchen,fridge,,in,1", "object must be named"),
        ("kitchen,fridge,egg,under,1", "relation must be onTop or in, got 'under'"),
        ("kitchen,fridge,egg,in,-1", "weight must be a number >= 0, got '-1'"),
        ("kitchen,fridge,egg,in,many", "weight must be a number >= 0, got 'many'"),
        ("kitchen,fridge,egg,in,1,more", "row must have the columns"),
    ],
)
def test_bad_table_rows_are_named_or_skipped(tmp_path, row, message):
    path = tmp_path / "mine.csv"
    path.write_text(f"room,furniture,object,relation,weight\nkitchen,fridge,egg,in,1\n{row}\n")
    with pytest.raises(ValueError, match=rf"{message}.*at mine\.csv:3\. Mend the row"):
        count_table(path)
    counts = count_table(path, skip_bad=True)
    assert (counts.num_units, len(counts.problems)) == (1, 1)


def test_tables_that_are_none_are_refused(tmp_path):
    path = tmp_path / "mine.csv"
    path.write_bytes(b"furniture,object\ncaf\xe9,egg\n")
    with pytest.raises(ValueError, match=r"table must be UTF-8, got .*mine\.csv"):
        count_table(path)
    path.write_text(f"a,{'x' * 5000}\n1,2\n")
    with pytest.raises(ValueError, match=r"got \['a', 'x{190,200}\.\.\. in mine\.csv"):
        count_table(path)
    path.write_text("a,b\n1,2\n")
    with pytest.raises(ValueError, match=r"columns furniture and object.*mine\.csv"):
        count_table(path)
    path = tmp_path / "mine.json"
    path.write_text("{}")
    with pytest.raises(ValueError, match="JSON list of rows"):
        count_table(path)
