"""Features of an answer: by hand, by name, and the same however many homes there are."""

import math

import numpy as np
import pytest

from sgm.evidence.columns import (
    CLOCK_GROUPS,
    COLUMNS_OF_PLACES,
    COLUMNS_OF_QUESTIONS,
    PLACE_COLUMNS,
    PLACE_GROUP_COLUMNS,
    QUESTION_COLUMNS,
    QUESTION_GROUP_COLUMNS,
    UNITS,
)
from sgm.evidence.evidence_features import compute_features, compute_groups
from sgm.policies.adaptive import Adaptive
from sgm.text.vectors import Alike
from simulator.tasks.rollout import Rollout

FRIDGE, SHELF, TABLE, BED, BEDROOM_SHELF, DESK = range(6)
MUG, PLATE = 0, 4
ANY = (-math.inf, math.inf)
BOUNDS = dict.fromkeys(UNITS, ANY)
BOUNDS |= dict.fromkeys(("0 or 1", "share", "probability", "rank", "moves"), (0, 1))
BOUNDS |= {"cosine": (-1, 1), "count": (0, math.inf), "hours": (0, math.inf)}


def see(memory, furniture, *objects, home=0):
    """One step, then a look at which objects of types are seen; key and type are the same."""
    memory.step()
    types = np.array(objects, dtype=int)
    homes = np.full(len(types), home)
    label = np.array([memory.labels.index(("mug", "", "", "", "plate")[o]) for o in objects])
    rows = memory.ensure_objects(homes, types, label.astype(int), types)
    memory.observe(np.array([home]), np.array([furniture]), rows, np.ones(len(rows), dtype=int))


def ask(memory, object_type=MUG, home=0):
    label = np.array([memory.labels.index("mug" if object_type == MUG else "plate")])
    return memory.query(np.array([home]), np.array([object_type]), label, np.array([object_type]))


@pytest.fixture
def memory(make_tiny_memory):
    """Mug and plate on the table at 1, the mug there again at 2, on the desk at 3, gone at 4."""
    memory = make_tiny_memory()
    see(memory, TABLE, MUG, PLATE)
    see(memory, TABLE, MUG)
    see(memory, DESK, MUG)
    see(memory, DESK)
    memory.step()
    return memory


@pytest.fixture
def columns(memory):
    """Every feature of the mug by name; those of places are (F,)."""
    found = compute_features(memory, ask(memory))
    places = dict(zip(PLACE_COLUMNS, found.place[0].T, strict=True))
    return places | dict(zip(QUESTION_COLUMNS, found.question[0], strict=True))


def test_features_of_other_questions_differ_where_they_reckon_with_moves(memory):
    queries, found = ask(memory), {}
    for share in (0.5, 0.25, 0.0):
        features = compute_features(memory, queries, share)
        found[share] = dict(zip(PLACE_COLUMNS, features.place[0].T, strict=True))
        found[share] |= dict(zip(QUESTION_COLUMNS, features.question[0], strict=True))
    tasks, people = found[0.5], found[0.0]
    for name in ("asked", "left_asked"):
        of_all = {"asked": "learnt", "left_asked": "left"}[name]
        own, other = (people[f"filters.log_belief_{filter}"] for filter in (name, of_all))
        np.testing.assert_array_equal(own, other)
        assert not np.array_equal(tasks[f"filters.log_belief_{name}"], own)
    moved = [found[share]["movement.any_moved"] for share in found]
    assert moved == [pytest.approx(moved[0] * part) for part in (1, 0.5, 0)]
    changed = {name for name in tasks if not np.array_equal(tasks[name], people[name])}
    assert {name.partition(".")[0] for name in changed} == {
        "elsewhere",
        "filters",
        "lately",
        "movement",
        "object",
    }


def at(**values):
    """Zero but at some places."""
    row = np.zeros(6)
    for name, value in values.items():
        row[{"table": TABLE, "desk": DESK}[name]] = value
    return pytest.approx(row, abs=1e-6)


def test_sightings_by_hand(columns):
    assert columns["sightings.num_true"] == at(table=math.log(3), desk=math.log(2))
    assert columns["sightings.share"] == at(table=2 / 3, desk=1 / 3)
    assert columns["sightings.per_look"] == at(table=2 / 3, desk=1 / 3)
    assert columns["sightings.is_last"] == at(desk=1)
    assert columns["sightings.is_usual_and_away"] == at(table=1)
    assert columns["sightings.recency_rank"] == at(desk=1, table=1 / 2)


def test_looks_by_hand(columns):
    assert columns["looks.absent_since_seen"] == at(desk=math.log(2))  # missed once, at 4
    assert columns["looks.is_looked_at_since"] == at(desk=1)
    assert columns["looks.looks_share"] == at(table=2 / 4 * 6 / 4, desk=2 / 4 * 6 / 4)


def test_times_by_hand(columns):
    """Now is 5. One move in 2 + 0 steps of following: 1 -> 2 and 2 -> 3, so 1.5 / 17 a step."""
    rate = 1.5 / 17
    assert columns["times.hours_since_seen"] == at(table=math.log1p(3), desk=math.log1p(2))
    moved = {"table": 1 - math.exp(-3 * rate), "desk": 1 - math.exp(-2 * rate)}
    assert columns["times.home_moves_since_seen"] == at(**moved)
    assert columns["movement.log_home_rate"] == pytest.approx(math.log(rate))
    assert columns["movement.own_moves"] == pytest.approx(math.log(2))


def test_stays_by_hand(columns):
    """On the table for a step, as far as is known, on the desk for another, and gone from there.

    So is the plate, after a step on the table: two of three, so 2.5 / 18 a step on average.
    """
    of_home = 2.5 / 18
    rate = (1 + 1.5) / (2 + 1.5 / of_home)
    assert columns["stays.log_home_left_rate"] == pytest.approx(math.log(of_home))
    assert columns["stays.log_left_rate"] == pytest.approx(math.log(rate))
    assert columns["stays.num_left"][DESK] == pytest.approx(math.log(2))
    assert columns["stays.per_known_look"] == at(table=1, desk=1 / 2)
    table, desk = 1 / (1 + 1 / rate), 2 / (1 + 1 / rate)
    gone = {"table": 1 - math.exp(-3 * table), "desk": 1 - math.exp(-2 * desk)}
    assert columns["stays.left_since_seen"] == at(**gone)
    presence = columns["stays.presence"]
    assert presence.argmax() == TABLE
    assert (presence[[TABLE, DESK]] < [1, 1 / 2]).all()


def test_presence_is_what_looks_show_at_first_and_in_the_end(make_tiny_memory):
    """Looks find the mug and miss it in turn: it is there right after one, then (20 + 1) / 41."""
    memory = make_tiny_memory()
    for turn in range(40):
        see(memory, TABLE, *([MUG] if turn % 2 else []))
    found = []
    for steps in (0, 10**4):
        memory.time += steps
        columns = compute_features(memory, ask(memory)).place[0]
        found.append(columns[TABLE, PLACE_COLUMNS.index("stays.presence")])
    assert found == pytest.approx([0.999, 21 / 41], abs=0.02)


def test_the_smallest_homes_are_read_as_ones_that_were_learnt_from(columns):
    """The tiny home has six places in two rooms, which are read as three."""
    assert columns["size.log_num_places"] == pytest.approx(math.log(6))
    assert columns["size.log_num_rooms"] == pytest.approx(math.log(3))


def test_places_and_others_by_hand(columns):
    """Of two known objects the plate was last on the table, the mug on the desk.

    A third, that may be anywhere, is counted beside them. The plate is the mug's companion: cosine
    of (2, 1) and (1, 0) is 2 / sqrt(5).
    """
    popularity = np.full(6, 1 / 6 / 3)
    popularity[[TABLE, DESK]] += 1 / 3
    assert columns["places.popularity"] == pytest.approx(popularity)
    assert columns["places.arrivals"] == at(desk=1)
    assert columns["places.log_back"] == at(table=math.log(2))  # went from there to the desk
    fresh = 2 / math.sqrt(5) * math.exp(-4 * 1.5 / 17)
    assert columns["others.companions_now"] == at(table=fresh / max(fresh, 1.0))
    assert columns["others.same_name"] == at()


def test_shares_of_places_by_hand(columns):
    """The prior of a mug, by what all types have there: every place has as much room.

    On the kitchen's shelf .4 of .4 mug + .2 book + .7 plate + .2 phone, on the table .4 of 1.75
    (the same mug, and .2 milk, .3 plate, .4 apple, .25 pen, .2 phone), on the desk .2 of 2.25.
    """
    own = np.zeros(6)
    own[[SHELF, TABLE, DESK]] = 0.4 / 1.5, 0.4 / 1.75, 0.2 / 2.25
    assert columns["prior.prior"] == pytest.approx([0, 0.4, 0.4, 0, 0, 0.2])
    assert columns["prior.place_share"] == pytest.approx(own / own.sum(), abs=1e-6)
    assert columns["prior.place_share_rank"][[SHELF, TABLE, DESK]] == pytest.approx(
        [1, 1 / 2, 1 / 3]
    )


def test_words_by_hand(columns):
    """The plate, on the table, is the only other thing; mugs and plates have alike names."""
    cosine = float(Alike(["plate"]).cosines(["mug"])[0, 0])
    likeness = math.exp((cosine - 1) / 0.1)
    assert columns["words.most_similar"] == pytest.approx(likeness)
    assert columns["words.similar_here"] == at(table=likeness / (likeness + 0.1))
    assert columns["words.is_known"] == 1
    assert columns["words.furniture_cosine"] == pytest.approx(np.ones(6))


def test_what_is_out_of_its_place_by_hand(make_tiny_memory):
    """The plate: twice on the table, then on the desk; a tenth of the time counts as ten."""
    memory = make_tiny_memory()
    for furniture in (TABLE, TABLE, DESK):
        see(memory, furniture, PLATE)
    memory.step()
    columns = compute_features(memory, ask(memory)).place[0]
    rate = (1 + 0.5) / (2 + 15)  # one move in two steps of following
    worth = math.exp(-10 * rate)  # seen a step ago
    strays = columns[:, PLACE_COLUMNS.index("others.strays")]
    assert strays == at(desk=math.log1p(worth))
    share = columns[:, PLACE_COLUMNS.index("others.strays_share")]
    assert share == at(desk=worth / (worth + 0.5))


def test_trust_by_hand(columns):
    """Asked once, never found; three edges were true, and the prior knows both types."""
    assert columns["trust.found"] == pytest.approx(0.5 / 2)
    assert columns["trust.last_right"] == pytest.approx(0.5)
    assert columns["trust.num_placed"] == pytest.approx(math.log(4))
    # P(table | mug) 0.4, P(desk | mug) 0.2, P(table | plate) 0.3; six places
    lift = sum(math.log(p * 6 * 0.9 + 0.1) for p in (0.4, 0.2, 0.3)) / 6
    assert columns["trust.prior_lift"] == pytest.approx(lift, abs=1e-5)


def test_beliefs_are_those_of_the_policy(memory, columns):
    expected = Adaptive().follow(memory, ask(memory))[0]
    np.testing.assert_allclose(columns["filters.belief_asked"], expected[:-1], rtol=1e-5)
    assert columns["object.elsewhere"] == pytest.approx(expected[-1], rel=1e-5)


@pytest.fixture(scope="module")
def rollout(make_tiny_homes):
    rollout = Rollout(make_tiny_homes(3), Adaptive())
    for _ in range(30):
        rollout.ask()
        rollout.look(np.arange(3) + 1)
    return rollout


def test_every_group_has_its_columns(make_tiny_memory, memory):
    """All of them, at every place; those of the hours where it is known what time it is."""
    with_clock = make_tiny_memory()
    with_clock.clock = np.array([[0.0, 3600.0]])  # seconds of the week at step 0, and of a step
    for own, without in ((with_clock, set()), (memory, set(CLOCK_GROUPS))):
        _, of_places, of_question = compute_groups(own, ask(own), 0.5)
        for groups, names, shape in (
            (of_places, PLACE_GROUP_COLUMNS, (1, 6)),
            (of_question, QUESTION_GROUP_COLUMNS, (1,)),
        ):
            assert set(groups) == set(names)
            for group, columns in groups.items():
                assert set(columns) == set(() if group in without else names[group])
                assert {np.shape(column) for column in columns.values()} <= {shape}
    assert len(set(PLACE_COLUMNS)) == len(PLACE_COLUMNS)


def test_every_column_says_what_it_is_in_a_unit_of_the_table():
    columns = [*COLUMNS_OF_PLACES, *COLUMNS_OF_QUESTIONS]
    assert {column.unit for column in columns} == set(UNITS)
    assert all(len(column.text.split()) > 1 for column in columns)


def test_columns_lie_where_their_unit_says(make_tiny_homes):
    """Over a day by the clock, of things that move, stay and are missed: what is a share is one."""
    rollout = Rollout(make_tiny_homes(3), Adaptive())
    rollout.memory.clock = np.tile([0.0, 3600.0], (3, 1))
    of_places, of_questions = [], []
    for step in range(24):
        rollout.ask()
        rollout.look(np.arange(3) + step % 4)
        for home, thing in ((0, MUG), (1, PLATE), (2, MUG)):
            found = compute_features(rollout.memory, ask(rollout.memory, thing, home))
            of_places.append(found.place[0])
            of_questions.append(found.question)
    for values, columns in ((of_places, COLUMNS_OF_PLACES), (of_questions, COLUMNS_OF_QUESTIONS)):
        for column, of_column in zip(columns, np.concatenate(values).T, strict=True):
            low, high = BOUNDS[column.unit]
            assert of_column.min() >= low - 1e-6, column
            assert of_column.max() <= high + 1e-6, column
            if column.unit == "0 or 1":
                assert set(of_column) <= {0, 1}, column


def test_a_question_is_the_same_among_others(make_tiny_homes, rollout):
    alone = Rollout(make_tiny_homes(homes=[2]), Adaptive())
    for _ in range(30):
        alone.ask()
        alone.look(np.array([3]))
    together, single = (
        compute_features(*pair)
        for pair in (
            (rollout.memory, ask(rollout.memory, home=2)),
            (alone.memory, ask(alone.memory)),
        )
    )
    np.testing.assert_array_equal(together.place, single.place)
    np.testing.assert_array_equal(together.question, single.question)


def test_all_are_finite_from_the_first_question_on(make_tiny_memory):
    memory = make_tiny_memory(2)
    for _ in range(3):
        found = compute_features(memory, ask(memory, PLATE, home=1))
        assert np.isfinite(found.place).all()
        assert np.isfinite(found.question).all()
        see(memory, DESK, PLATE, home=1)
