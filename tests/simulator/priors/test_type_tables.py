"""The two tables of the paper's appendix."""

from sgm.files import read_table
from simulator.priors.types import load_names, load_types


def test_all_rows_of_the_paper_are_there():
    types = load_types()
    assert (len(types.furniture), len(types.objects)) == (22, 108)
    mug = types.objects["mug"]
    assert (mug.sample_prob, mug.max_count, mug.move_freq, mug.add_remove_prob) == (
        0.8,
        12,
        0.6,
        0.01,
    )
    # the paper's second `chair` row
    chair, armchair = types.furniture["chair"], types.furniture["armchair"]
    assert (chair.sample_prob, chair.max_count) == (0.75, 12)
    assert (armchair.sample_prob, armchair.max_count) == (0.6, 2)


def test_types_have_as_many_adjectives_as_the_paper_says():
    types = load_types()
    for name, rows in (("furniture.csv", types.furniture), ("objects.csv", types.objects)):
        for row in read_table("simulator.priors", name):
            words = [word for group in rows[row["label"]].adjectives for word in group]
            assert len(words) == int(row["num_adjectives"]), row["label"]
            assert len(set(words)) == len(words), row["label"]


def test_aliases_have_the_metadata_of_their_type():
    objects = read_table("simulator.priors", "objects.csv")
    rows = {row["label"]: row for row in objects}
    for row in objects:
        if row["alias_of"]:
            other = rows[row["alias_of"]]
            for field in ("sample_prob", "max_count", "move_freq", "add_remove_prob"):
                assert row[field] == other[field], row["label"]


def test_names_of_data_sets_lead_to_types_of_the_tables():
    types = load_types()
    for source in ("procthor", "behavior", "igibson"):
        names = load_names(source)
        assert set(names.furniture.values()) <= types.furniture.keys()
        assert set(names.objects.values()) <= types.objects.keys()
    names = load_names("procthor")
    assert names.find_object("CellPhone") == "phone"
    assert names.find_object("AlarmClock") == "alarm clock"
    assert names.find_furniture("TVStand") == "tv stand"
    assert names.find_furniture("DogBed") is None
    assert names.find_room("LivingRoom") == "living room"


def test_only_fridge_cabinet_and_sink_hold_things_inside():
    inside = {row.label for row in load_types().furniture.values() if row.relation == "in"}
    assert inside == {"fridge", "top cabinet", "sink"}
