import numpy as np
import pytest
from scipy import stats

from simulator.compiled.dynamics import choose_below, run_race
from simulator.dynamics import add_objects, evolve, move_objects, remove_objects
from simulator.houses import Houses

STATE = ("object_type", "object_code", "object_place", "object_moved", "object_move_weight")


def test_rules_of_a_step_over_many_steps_and_seeds(make_default_houses):
    for seed in range(3):
        houses = make_default_houses(6, seed=seed)
        low, high = 183, 201  # 95 % of 192 = 182.4, 105 % = 201.6
        for _ in range(25):
            place_before = houses.object_place.copy()
            code_before = houses.object_code.copy()
            evolve(houses)
            present, moved = houses.is_present, houses.object_moved
            count = present.sum(axis=1)
            assert ((count >= low) & (count <= high)).all()
            assert (houses.object_place < houses.num_places).all()
            assert present[moved].all()
            # A mover was there before, keeps its description, and changes furniture, not room.
            before, after = place_before[moved], houses.object_place[moved]
            assert (before >= 0).all()
            assert (houses.object_code[moved] == code_before[moved]).all()
            assert (before // 2 != after // 2).all()
            assert (houses.place_room[before] == houses.place_room[after]).all()
            # Whatever neither moved nor is new or gone is where it was.
            same = ~moved & present & (place_before >= 0) & (houses.object_code == code_before)
            kept = houses.object_place[same] == place_before[same]
            assert kept.mean() > 0.995  # a slot may be emptied and filled with an equal object
            # Movers and newcomers are where T^i leads.
            house, slot = np.nonzero(moved | (present & (place_before < 0)))
            rows = houses.transition_rows(house, houses.object_code[house, slot])
            assert (rows[np.arange(len(house)), houses.object_place[house, slot]] > 0).all()


def test_five_percent_of_the_present_objects_move(make_default_houses):
    houses = make_default_houses(8)
    for _ in range(30):
        evolve_without_newcomers(houses)
        # 5 % of 183 to 201 objects, rounded half up: 9.15 -> 9, 9.5 -> 10, 10.05 -> 10
        expected = np.floor(0.05 * houses.is_present.sum(axis=1) + 0.5)
        np.testing.assert_array_equal(houses.object_moved.sum(axis=1), expected)
        add_objects(houses)


def evolve_without_newcomers(houses: Houses) -> None:
    houses.object_moved[:] = False
    remove_objects(houses)
    move_objects(houses)


def test_static_nodes_only_move(make_default_houses):
    houses = make_default_houses(3, dynamic_nodes=False)
    code, present = houses.object_code.copy(), houses.is_present.copy()
    for _ in range(10):
        evolve(houses)
        np.testing.assert_array_equal(houses.object_code, code)
        np.testing.assert_array_equal(houses.is_present, present)
        assert (houses.object_moved.sum(axis=1) == 10).all()  # 9.6 rounded


def test_rooms_are_left_only_where_the_rules_say_so(make_default_houses):
    houses = make_default_houses(4, cross_room_moves=True)
    crossed = 0
    for _ in range(10):
        before = houses.object_place.copy()
        evolve(houses)
        moved = houses.object_moved
        assert (before[moved] // 2 != houses.object_place[moved] // 2).all()
        rooms = houses.place_room
        crossed += (rooms[before[moved]] != rooms[houses.object_place[moved]]).sum()
    assert crossed > 50


def test_a_home_changes_the_same_way_whatever_is_beside_it(make_default_houses):
    many, few = make_default_houses(7, seed=1), make_default_houses(houses=[5, 2], seed=1)
    for step in range(40):
        evolve(many)
        evolve(few)
        for name in STATE:
            for position, number in enumerate([5, 2]):
                np.testing.assert_array_equal(
                    getattr(few, name)[position],
                    getattr(many, name)[number],
                    err_msg=f"{name} of house {number} in step {step}",
                )


def test_what_cannot_go_anywhere_does_not_move(make_tiny_houses):
    """With one furniture node per room there is nowhere to go."""
    layout = [("kitchen", "fridge"), ("bedroom", "bed")]
    houses = make_tiny_houses(3, layout=layout, dynamic_nodes=False)
    before = houses.object_place.copy()
    evolve(houses)
    np.testing.assert_array_equal(houses.object_place, before)
    assert not houses.object_moved.any()


def test_objects_that_never_move_stay(make_tiny_houses, tiny_prior):
    houses = make_tiny_houses(10, dynamic_nodes=False)
    lamp = houses.is_present & (houses.object_type == 3)  # move_freq 0
    assert lamp.any()
    for _ in range(30):
        evolve(houses)
        assert not houses.object_moved[lamp].any()


def test_moves_follow_T(make_default_houses):
    """Each move's destination, as a quantile of its own row of T^i, is uniform on [0, 1]."""
    rng = np.random.default_rng(0)
    for rules in ({}, {"cross_room_moves": True}):
        houses = make_default_houses(20, seed=4, **rules)
        quantiles = []
        for _ in range(12):
            before = houses.object_place.copy()
            evolve(houses)
            for house, slot in np.argwhere(houses.object_moved):
                code = houses.object_code[house, slot]
                row = houses.transition_rows(np.array([house]), np.array([code]))[0].astype(float)
                source, target = before[house, slot], houses.object_place[house, slot]
                allowed = np.arange(houses.num_places) // 2 != source // 2
                if not rules:
                    allowed &= houses.place_room == houses.place_room[source]
                row = np.where(allowed, row, 0) / row[allowed].sum()
                quantiles.append(row[:target].sum() + rng.random() * row[target])
        assert len(quantiles) > 2000
        assert stats.kstest(quantiles, "uniform").pvalue > 0.01


def test_moves_of_one_object_by_hand(make_tiny_houses):
    """A mug without noise in the kitchen shelf has one other place in its room: the table.

    With moves between rooms, from the table: shelf 0.4 and desk 0.2, so 2 to 1.
    """
    rules = {"noise_zero_prob": 0, "noise_scale": 0, "dynamic_nodes": False, "move_share": 1}
    targets = {False: [], True: []}
    for cross in targets:
        houses = make_tiny_houses(200, cross_room_moves=cross, **rules)
        is_source = houses.object_place == (5 if cross else 2)
        house, slot = np.nonzero((houses.object_type == 0) & is_source)
        evolve(houses)
        targets[cross] = houses.object_place[house, slot]
    assert set(targets[False]) == {5}
    counts = np.bincount(targets[True], minlength=12)
    assert counts.sum() == counts[[2, 11]].sum() > 300
    expected = counts.sum() * np.array([2 / 3, 1 / 3])
    assert stats.chisquare(counts[[2, 11]], expected).pvalue > 0.01


def test_movers_follow_their_move_frequency(make_tiny_houses):
    """One mover a step (5 % of 24 = 1.2): object i is it with probability w_i / sum of w."""
    houses = make_tiny_houses(300, objects_per_furniture=4, dynamic_nodes=False, seed=1)
    found, expected = np.zeros(10), np.zeros(10)
    for _ in range(10):
        weight = houses.object_move_weight.copy()
        share = weight / weight.sum(axis=1, keepdims=True)
        expected += np.bincount(houses.object_type.ravel(), share.ravel(), minlength=10)
        evolve(houses)
        assert (houses.object_moved.sum(axis=1) == 1).all()
        found += np.bincount(houses.object_type[houses.object_moved], minlength=10)
    assert found[3] == expected[3] == 0  # lamps
    used = expected > 0
    assert stats.chisquare(found[used], expected[used]).pvalue > 0.01


def test_move_weight_is_the_frequency_of_the_type_or_zero_where_it_is_stuck(make_default_houses):
    houses = make_default_houses(3)
    for _ in range(5):
        evolve(houses)
    for house, slot in np.argwhere(houses.is_present):
        code, place = houses.object_code[house, slot], houses.object_place[house, slot]
        row = houses.transition_rows(np.array([house]), np.array([code]))[0]
        elsewhere = (np.arange(houses.num_places) // 2 != place // 2) & (
            houses.place_room == houses.place_room[place]
        )
        frequency = houses.prior.objects[houses.object_type[house, slot]].move_freq
        expected = frequency if row[elsewhere].any() else 0
        assert houses.object_move_weight[house, slot] == expected
    assert not houses.object_move_weight[~houses.is_present].any()
    assert not houses.object_remove_prob[~houses.is_present].any()
    np.testing.assert_array_equal(houses.num_objects, houses.is_present.sum(axis=1))


def test_each_object_leaves_with_its_remove_probability(make_tiny_houses, tiny_prior):
    houses = make_tiny_houses(400, count_slack=1)  # the bound never binds
    before = np.bincount(houses.object_type[houses.is_present], minlength=10)
    remove_objects(houses)
    after = np.bincount(houses.object_type[houses.is_present], minlength=10)
    for row, count, left in zip(tiny_prior.objects, before, before - after, strict=True):
        assert stats.binomtest(int(left), int(count), row.add_remove_prob).pvalue > 0.001, row


def test_each_type_appears_with_its_add_probability(make_tiny_houses, tiny_prior):
    houses = make_tiny_houses(500, count_slack=1)
    before = np.bincount(houses.object_type[houses.is_present], minlength=10)
    add_objects(houses)
    after = np.bincount(houses.object_type[houses.is_present], minlength=10)
    for row, came in zip(tiny_prior.objects, after - before, strict=True):
        assert stats.binomtest(int(came), 500, row.add_remove_prob).pvalue > 0.001, row


def test_newcomers_follow_T_over_the_whole_home(make_tiny_houses):
    """Apples, without noise: fridge 0.4, table 0.4, desk 0.2, whatever the room."""
    houses = make_tiny_houses(500, count_slack=1, noise_zero_prob=0, noise_scale=0)
    was_empty = ~houses.is_present
    add_objects(houses)
    is_new = was_empty & houses.is_present & (houses.object_type == 5)
    counts = np.bincount(houses.object_place[is_new], minlength=12)
    assert counts.sum() == counts[[0, 5, 11]].sum() > 100
    expected = counts.sum() * np.array([0.4, 0.4, 0.2])
    assert stats.chisquare(counts[[0, 5, 11]], expected).pvalue > 0.01


def test_the_bounds_choose_whom_they_stop_at_random(make_tiny_houses):
    """With room for one more and two types eager to come, each comes half of the time."""
    houses = make_tiny_houses(600, objects_per_furniture=4, count_slack=0.05, seed=2)
    assert houses.num_slots == 25  # 24 x 1.05 = 25.2: one free slot
    houses.type_add_prob[:] = np.isin(np.arange(10), [0, 9])
    remove = houses.object_place.copy()
    add_objects(houses)
    newcomers = houses.object_type[houses.is_present & (remove < 0)]
    counts = np.bincount(newcomers, minlength=10)
    assert counts.sum() == counts[[0, 9]].sum() == 600
    assert stats.binomtest(int(counts[0]), 600, 0.5).pvalue > 0.01
    # And with all 25 objects eager to leave, any two of them go: 24 x 0.95 = 22.8 -> 23 stay.
    houses.object_remove_prob[houses.is_present] = 1
    remove_objects(houses)
    assert (houses.is_present.sum(axis=1) == 23).all()
    assert stats.chisquare((~houses.is_present).sum(axis=0)).pvalue > 0.01


def test_the_last_object_never_leaves(make_tiny_houses):
    houses = make_tiny_houses(20, layout=[("kitchen", "table"), ("bedroom", "desk")],
                              objects_per_furniture=1, count_slack=1)  # fmt: skip
    houses.object_remove_prob[houses.is_present] = 1
    remove_objects(houses)
    assert (houses.is_present.sum(axis=1) == 1).all()


@pytest.mark.parametrize("share", [0.0, 1.0])
def test_none_or_all_may_move(make_tiny_houses, share):
    houses = make_tiny_houses(5, move_share=share, dynamic_nodes=False)
    can_move = houses.object_move_weight > 0
    evolve(houses)
    np.testing.assert_array_equal(houses.object_moved, can_move if share else can_move & False)


def test_the_chosen_of_every_house_by_hand():
    # Below their thresholds: columns 0, 1, 2 of house 0, none of house 1, columns 1, 2 of house 2.
    uniform = np.array([[0.4, 0.2, 0.3, 0.9], [0.9, 0.9, 0.9, 0.9], [0.5, 0.1, 0.2, 0.3]])
    threshold = np.array([[0.5, 0.5, 0.4, 0.5], [0.5, 0.5, 0.5, 0.5], [0.0, 0.2, 0.4, 0.3]])
    house, column = choose_below(uniform, threshold, np.array([3, 9, 9]))
    assert house.tolist() == [0, 0, 0, 2, 2]
    assert column.tolist() == [0, 1, 2, 1, 2]
    # uniform / threshold: 0.8, 0.4, 0.75 in house 0; 0.5 twice in house 2: the first of them stays.
    house, column = choose_below(uniform, threshold, np.array([2, 4, 1]))
    assert house.tolist() == [0, 0, 2]
    assert column.tolist() == [1, 2, 1]
    assert [len(found) for found in choose_below(uniform, threshold, np.zeros(3, int))] == [0, 0]


@pytest.mark.parametrize("scale", [1.0, 1e-9, 1e6])
def test_the_race_is_won_by_the_largest_keys_of_all(scale):
    """Looking at the objects near to winning alone gives what looking at all of them gives."""
    rng = np.random.default_rng(0)
    weight = rng.random((40, 60)) ** 8 * (rng.random((40, 60)) < 0.8) * scale
    weight[7] = 0
    weight[8, 3:] = 0  # three can move, more are asked for
    num_winners = rng.integers(0, 12, 40)
    for _ in range(20):
        uniform = rng.random((40, 60))
        found = run_race(uniform, weight, weight.sum(axis=1), num_winners)
        expected = []
        for house in range(40):
            runners = np.flatnonzero(weight[house])
            keys = np.log(uniform[house, runners]) / weight[house, runners]
            first = runners[np.argsort(-keys)][: num_winners[house]]
            expected += [(house, slot, rank) for rank, slot in enumerate(first)]
        assert list(zip(*found, strict=True)) == expected
