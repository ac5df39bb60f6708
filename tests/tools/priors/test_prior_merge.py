"""Merging counts to a prior: precedence, filters, aliases, normalisation; hand-worked numbers."""

import pytest

from tools.priors.counts import PlacementCounts
from tools.priors.merge import BuildOptions, build_prior

LOOSE = BuildOptions(min_edges=1, min_places=1)


def _make(source, placements, *, rooms=None, furniture=None, **flags):
    counts = PlacementCounts(source, **flags)
    counts.placements.update(placements)
    counts.num_rooms.update(rooms or {})
    counts.furniture.update(furniture or {})
    return counts


def _read(prior):
    return {(row.room, row.furniture, row.object): row.prob for row in prior.placements}


def test_first_source_wins_a_shared_relation_and_rare_evidence_weighs_less():
    first = _make(
        "first",
        {("kitchen", "fridge", "egg", "in"): 30, ("kitchen", "sink", "egg", "in"): 15},
        rooms={"kitchen": 10},
        furniture={("kitchen", "fridge"): 9, ("kitchen", "sink"): 5},
    )
    second = _make(
        "second",
        {("kitchen", "fridge", "egg", "in"): 4, ("kitchen", "counter", "egg", "onTop"): 1},
        rooms={"kitchen": 4},
        furniture={("kitchen", "fridge"): 1, ("kitchen", "counter"): 3},
    )
    prior, _ = build_prior([first, second], options=LOOSE)
    # trust 45/50 and 5/10: fridge 2/3 * .9 = .6, sink 1/3 * .9 = .3, counter 1/5 * .5 = .1
    probs = _read(prior)
    assert probs["kitchen", "fridge", "egg"] == pytest.approx(0.6)
    assert probs["kitchen", "sink", "egg"] == pytest.approx(0.3)
    assert probs["kitchen", "counter", "egg"] == pytest.approx(0.1)
    rows = {row.furniture: row for row in prior.placements if row.object == "egg"}
    assert (rows["fridge"].count, rows["fridge"].source) == (30, "first")
    assert (rows["counter"].count, rows["counter"].source) == (1, "second")
    # P(furniture | room) x sample probability of the type: 9/10 * .9, 5/10 * 1, 3/4 * .8
    assert {row.label: row.prob for row in prior.furniture} == pytest.approx(
        {"fridge": 0.81, "sink": 0.5, "counter": 0.6}
    )


def test_counts_become_rates_per_room():
    counts = _make(
        "num_homes",
        {("kitchen", "table", "mug", "onTop"): 10, ("bedroom", "bed", "mug", "onTop"): 10},
        rooms={"kitchen": 10, "bedroom": 40},
        furniture={("kitchen", "table"): 10, ("bedroom", "bed"): 40},
        is_per_room=True,
    )
    # one mug per kitchen, a quarter per bedroom: 1 / 1.25 and .25 / 1.25
    probs = _read(build_prior([counts], options=LOOSE)[0])
    assert probs["kitchen", "table", "mug"] == pytest.approx(0.8)
    assert probs["bedroom", "bed", "mug"] == pytest.approx(0.2)


def _two_rooms():
    return _make(
        "model",
        {
            ("kitchen", "table", "mug", "onTop"): 0.3,
            ("kitchen", "sink", "mug", "in"): 0.1,
            ("bedroom", "bed", "mug", "onTop"): 0.6,
        },
        is_counted=False,
    )


@pytest.mark.parametrize(
    ("scope", "expected"), [("house", (0.3, 0.1, 0.6)), ("room", (0.75, 0.25, 1.0))]
)
def test_weights_sum_to_one_over_the_scope(scope, expected):
    options = BuildOptions(scope=scope, min_edges=1, min_places=1)
    probs = _read(build_prior([_two_rooms()], options=options)[0])
    keys = [("kitchen", "table", "mug"), ("kitchen", "sink", "mug"), ("bedroom", "bed", "mug")]
    assert [probs[key] for key in keys] == pytest.approx(expected)


def test_a_source_without_rooms_vouches_for_its_furniture():
    prior, _ = build_prior([_two_rooms()], options=LOOSE)
    # share 1 x sample probability of table, sink, bed
    assert {row.label: row.prob for row in prior.furniture} == {
        "table": 0.8,
        "sink": 1.0,
        "bed": 0.9,
    }
    assert all(row.count is None for row in prior.placements)


def test_lone_places_and_empty_furniture_are_dropped_and_reported():
    labels = ("book", "phone", "pen")
    placements = {("bedroom", "desk", label, "onTop"): 10 for label in labels}
    placements |= {("bedroom", "bed", label, "onTop"): 10 for label in labels}
    placements |= {("bedroom", "sofa", "book", "onTop"): 10}  # one object type on the sofa
    placements |= {("kitchen", "table", "book", "onTop"): 10}  # one place in the kitchen
    nodes = {key[:2]: 1 for key in placements}
    counts = _make("x", placements, rooms={"bedroom": 1, "kitchen": 1}, furniture=nodes)
    prior, report = build_prior([counts])
    assert {(row.room, row.label) for row in prior.furniture} == {
        ("bedroom", "desk"),
        ("bedroom", "bed"),
    }
    assert prior.rooms == ("bedroom",)
    assert report.dropped_places == ["book (kitchen)"]
    assert report.dropped_furniture == ["sofa (bedroom): 1 object types"]
    assert "mug" in report.dropped_objects
    assert "dropped lone places: book (kitchen)" in report.summarise()


def test_furniture_that_no_room_holds_is_dropped_and_reported():
    counts = _make(
        "x",
        {("kitchen", "table", "mug", "onTop"): 9, ("kitchen", "bed", "mug", "onTop"): 1},
        rooms={"kitchen": 5},
        furniture={("kitchen", "table"): 5},
    )
    prior, report = build_prior([counts], options=LOOSE)
    assert [row.label for row in prior.furniture] == ["table"]
    assert report.dropped_furniture == ["bed (kitchen): in no room of the sources"]


def test_aliases_inherit_unless_a_source_placed_them():
    counts = _make(
        "x",
        {
            ("living room", "sofa", "apple", "onTop"): 6,
            ("living room", "table", "apple", "onTop"): 2,
            ("living room", "table", "lemon", "onTop"): 3,
        },
        rooms={"living room": 10},
        furniture={("living room", "sofa"): 8, ("living room", "table"): 5},
    )
    prior, _ = build_prior([counts], options=LOOSE)
    probs = _read(prior)
    # the sofa's weight .75 is shared with its alias couch
    assert probs["living room", "sofa", "apple"] == pytest.approx(0.375)
    assert probs["living room", "couch", "apple"] == pytest.approx(0.375)
    assert probs["living room", "couch", "banana"] == pytest.approx(0.375)
    assert probs["living room", "table", "lemon"] == pytest.approx(1.0)
    assert ("living room", "sofa", "lemon") not in probs
    nodes = {row.label: row.prob for row in prior.furniture}
    assert nodes["sofa"] == nodes["couch"] == pytest.approx(0.8 * 0.75 / 2)
    sources = {(row.object, row.furniture): row.source for row in prior.placements}
    assert sources["banana", "table"] == "x (as apple)"


def test_a_type_without_places_takes_those_of_its_alias():
    counts = _make(
        "x",
        {("bedroom", "bed", "teddy bear", "onTop"): 3},
        rooms={"bedroom": 1},
        furniture={("bedroom", "bed"): 1},
    )
    prior, _ = build_prior([counts], options=LOOSE)
    assert {"toy", "teddy bear", "legos"} <= {row.object for row in prior.placements}


def test_coarse_graph_adds_the_rooms_up():
    options = BuildOptions(coarse=True, min_edges=1)
    counts = _make(
        "x",
        {
            ("kitchen", "table", "mug", "onTop"): 1,
            ("bedroom", "table", "mug", "onTop"): 2,
            ("bedroom", "desk", "mug", "onTop"): 1,
        },
        rooms={"kitchen": 2, "bedroom": 2},
        furniture={("kitchen", "table"): 2, ("bedroom", "table"): 1, ("bedroom", "desk"): 1},
    )
    prior, _ = build_prior([counts], options=options)
    assert _read(prior) == {(None, "table", "mug"): 0.75, (None, "desk", "mug"): 0.25}
    assert {row.furniture: row.count for row in prior.placements} == {"table": 3, "desk": 1}
    assert {(row.room, row.label) for row in prior.furniture} == {
        ("kitchen", "table"),
        ("bedroom", "table"),
        ("bedroom", "desk"),
    }
    assert (prior.weights.sum(axis=(1, 2)) > 1).all()  # the table's row fills both rooms


def test_rows_without_a_room_spread_over_the_rooms_of_their_furniture():
    counts = _make(
        "own",
        {
            (None, "table", "mug", "onTop"): 1.0,
            ("kitchen", "table", "egg", "onTop"): 1.0,
            ("bedroom", "table", "pen", "onTop"): 1.0,
        },
    )
    probs = _read(build_prior([counts], options=LOOSE)[0])
    assert probs["kitchen", "table", "mug"] == probs["bedroom", "table", "mug"] == 0.5
    lost = _make("own", {(None, "table", "mug", "onTop"): 1.0})
    with pytest.raises(ValueError, match="furniture with known rooms, got 'table' from own"):
        build_prior([lost], options=LOOSE)


def test_rows_without_a_room_keep_their_rank_among_the_sources():
    own = _make("own", {(None, "bed", "book", "onTop"): 1.0}, is_counted=False)
    other = _make(
        "other",
        {("bedroom", "bed", "book", "onTop"): 15, ("bedroom", "desk", "book", "onTop"): 5},
        rooms={"bedroom": 2},
        furniture={("bedroom", "bed"): 2, ("bedroom", "desk"): 1},
    )
    prior, _ = build_prior([own, other], options=LOOSE)
    # own bed 1; other's desk 5/20 with trust 20/25 = .2; normalised by 1.2
    rows = {row.furniture: row for row in prior.placements if row.object == "book"}
    assert (rows["bed"].source, rows["desk"].source) == ("own", "other")
    assert rows["desk"].prob == pytest.approx(0.2 / 1.2, abs=1e-6)


def test_nothing_left_is_an_error():
    with pytest.raises(ValueError, match="rooms must be a non-empty list"):
        build_prior([_make("x", {})])
