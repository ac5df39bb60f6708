import numpy as np
import pytest
from scipy import stats

from simulator.world.paper_dynamics import choose_below, run_race
from simulator.world.sampled_homes import SampledHomes

STATE = ("object_type", "object_code", "object_place", "object_moved", "object_move_weight")


def test_rules_of_a_step_over_many_steps_and_seeds(make_default_homes):
    for seed in range(3):
        homes = make_default_homes(6, seed=seed)
        low, high = 183, 201  # 95 % of 192 = 182.4, 105 % = 201.6
        for _ in range(25):
            place_before = homes.object_place.copy()
            code_before = homes.object_code.copy()
            homes.evolve()
            present, moved = homes.is_present, homes.object_moved
            count = present.sum(axis=1)
            assert ((count >= low) & (count <= high)).all()
            assert (homes.object_place < homes.num_place_codes).all()
            assert present[moved].all()
            # A mover was there before, keeps its description, and changes furniture, not room.
            before, after = place_before[moved], homes.object_place[moved]
            assert (before >= 0).all()
            assert (homes.object_code[moved] == code_before[moved]).all()
            assert (before // 2 != after // 2).all()
            assert (homes.place_room[0, before] == homes.place_room[0, after]).all()
            # Whatever neither moved nor is new or gone is where it was.
            same = ~moved & present & (place_before >= 0) & (homes.object_code == code_before)
            kept = homes.object_place[same] == place_before[same]
            assert kept.mean() > 0.995  # a slot may be emptied and filled with an equal object
            # Movers and newcomers are where T^i leads.
            home, slot = np.nonzero(moved | (present & (place_before < 0)))
            rows = homes.transition_rows(home, homes.object_code[home, slot])
            assert (rows[np.arange(len(home)), homes.object_place[home, slot]] > 0).all()


def test_five_percent_of_the_present_objects_move(make_default_homes):
    homes = make_default_homes(8)
    for _ in range(30):
        evolve_without_newcomers(homes)
        # 5 % of 183 to 201 objects, rounded half up: 9.15 -> 9, 9.5 -> 10, 10.05 -> 10
        expected = np.floor(0.05 * homes.is_present.sum(axis=1) + 0.5)
        np.testing.assert_array_equal(homes.object_moved.sum(axis=1), expected)
        homes.lives[0].add_objects()


def evolve_without_newcomers(homes: SampledHomes) -> None:
    homes.object_moved[:] = False
    homes.lives[0].remove_objects()
    homes.lives[0].move_objects()


def test_static_nodes_only_move(make_default_homes):
    homes = make_default_homes(3, dynamic_nodes=False)
    code, present = homes.object_code.copy(), homes.is_present.copy()
    for _ in range(10):
        homes.evolve()
        np.testing.assert_array_equal(homes.object_code, code)
        np.testing.assert_array_equal(homes.is_present, present)
        assert (homes.object_moved.sum(axis=1) == 10).all()  # 9.6 rounded


def test_rooms_are_left_only_where_the_rules_say_so(make_default_homes):
    homes = make_default_homes(4, cross_room_moves=True)
    crossed = 0
    for _ in range(10):
        before = homes.object_place.copy()
        homes.evolve()
        moved = homes.object_moved
        assert (before[moved] // 2 != homes.object_place[moved] // 2).all()
        rooms = homes.place_room[0]  # the same in all of them
        crossed += (rooms[before[moved]] != rooms[homes.object_place[moved]]).sum()
    assert crossed > 50


def test_a_home_changes_the_same_way_whatever_is_beside_it(make_default_homes):
    many, few = make_default_homes(7, seed=1), make_default_homes(homes=[5, 2], seed=1)
    for step in range(40):
        many.evolve()
        few.evolve()
        for name in STATE:
            for position, number in enumerate([5, 2]):
                np.testing.assert_array_equal(
                    getattr(few, name)[position],
                    getattr(many, name)[number],
                    err_msg=f"{name} of house {number} in step {step}",
                )


def test_what_cannot_go_anywhere_does_not_move(make_tiny_homes):
    """With one furniture node per room there is nowhere to go."""
    layout = [("kitchen", "fridge"), ("bedroom", "bed")]
    homes = make_tiny_homes(3, layout=layout, dynamic_nodes=False)
    before = homes.object_place.copy()
    homes.evolve()
    np.testing.assert_array_equal(homes.object_place, before)
    assert not homes.object_moved.any()


def test_objects_that_never_move_stay(make_tiny_homes, tiny_prior):
    homes = make_tiny_homes(10, dynamic_nodes=False)
    lamp = homes.is_present & (homes.object_type == 3)  # move_freq 0
    assert lamp.any()
    for _ in range(30):
        homes.evolve()
        assert not homes.object_moved[lamp].any()


def test_moves_follow_T(make_default_homes):
    """Each move's destination, as a quantile of its own row of T^i, is uniform on [0, 1]."""
    rng = np.random.default_rng(0)
    for rules in ({}, {"cross_room_moves": True}):
        homes = make_default_homes(20, seed=4, **rules)
        quantiles = []
        for _ in range(12):
            before = homes.object_place.copy()
            homes.evolve()
            for home, slot in np.argwhere(homes.object_moved):
                code = homes.object_code[home, slot]
                row = homes.transition_rows(np.array([home]), np.array([code]))[0].astype(float)
                source, target = before[home, slot], homes.object_place[home, slot]
                allowed = np.arange(homes.num_place_codes) // 2 != source // 2
                if not rules:
                    allowed &= homes.place_room[home] == homes.place_room[home, source]
                row = np.where(allowed, row, 0) / row[allowed].sum()
                quantiles.append(row[:target].sum() + rng.random() * row[target])
        assert len(quantiles) > 2000
        assert stats.kstest(quantiles, "uniform").pvalue > 0.01


def test_moves_of_one_object_by_hand(make_tiny_homes):
    """A mug without noise in the kitchen shelf has one other place in its room: the table.

    With moves between rooms, from the table: shelf 0.4 and desk 0.2, so 2 to 1.
    """
    rules = {"noise_zero_prob": 0, "noise_scale": 0, "dynamic_nodes": False, "move_share": 1}
    targets = {False: [], True: []}
    for cross in targets:
        homes = make_tiny_homes(200, cross_room_moves=cross, **rules)
        is_source = homes.object_place == (5 if cross else 2)
        home, slot = np.nonzero((homes.object_type == 0) & is_source)
        homes.evolve()
        targets[cross] = homes.object_place[home, slot]
    assert set(targets[False]) == {5}
    counts = np.bincount(targets[True], minlength=12)
    assert counts.sum() == counts[[2, 11]].sum() > 300
    expected = counts.sum() * np.array([2 / 3, 1 / 3])
    assert stats.chisquare(counts[[2, 11]], expected).pvalue > 0.01


def test_movers_follow_their_move_frequency(make_tiny_homes):
    """One mover a step (5 % of 24 = 1.2): object i is it with probability w_i / sum of w."""
    homes = make_tiny_homes(300, objects_per_furniture=4, dynamic_nodes=False, seed=1)
    found, expected = np.zeros(10), np.zeros(10)
    for _ in range(10):
        weight = homes.object_move_weight.copy()
        share = weight / weight.sum(axis=1, keepdims=True)
        expected += np.bincount(homes.object_type.ravel(), share.ravel(), minlength=10)
        homes.evolve()
        assert (homes.object_moved.sum(axis=1) == 1).all()
        found += np.bincount(homes.object_type[homes.object_moved], minlength=10)
    assert found[3] == expected[3] == 0  # lamps
    used = expected > 0
    assert stats.chisquare(found[used], expected[used]).pvalue > 0.01


def test_move_weight_is_the_frequency_of_the_type_or_zero_where_it_is_stuck(make_default_homes):
    homes = make_default_homes(3)
    for _ in range(5):
        homes.evolve()
    for home, slot in np.argwhere(homes.is_present):
        code, place = homes.object_code[home, slot], homes.object_place[home, slot]
        row = homes.transition_rows(np.array([home]), np.array([code]))[0]
        elsewhere = (np.arange(homes.num_place_codes) // 2 != place // 2) & (
            homes.place_room[home] == homes.place_room[home, place]
        )
        frequency = homes.prior.objects[homes.object_type[home, slot]].move_freq
        expected = frequency if row[elsewhere].any() else 0
        assert homes.object_move_weight[home, slot] == expected
    assert not homes.object_move_weight[~homes.is_present].any()
    assert not homes.object_remove_prob[~homes.is_present].any()
    np.testing.assert_array_equal(homes.num_objects, homes.is_present.sum(axis=1))


def test_each_object_leaves_with_its_remove_probability(make_tiny_homes, tiny_prior):
    homes = make_tiny_homes(400, count_slack=1)  # the bound never binds
    before = np.bincount(homes.object_type[homes.is_present], minlength=10)
    homes.lives[0].remove_objects()
    after = np.bincount(homes.object_type[homes.is_present], minlength=10)
    for row, count, left in zip(tiny_prior.objects, before, before - after, strict=True):
        assert stats.binomtest(int(left), int(count), row.add_remove_prob).pvalue > 0.001, row


def test_each_type_appears_with_its_add_probability(make_tiny_homes, tiny_prior):
    homes = make_tiny_homes(500, count_slack=1)
    before = np.bincount(homes.object_type[homes.is_present], minlength=10)
    homes.lives[0].add_objects()
    after = np.bincount(homes.object_type[homes.is_present], minlength=10)
    for row, came in zip(tiny_prior.objects, after - before, strict=True):
        assert stats.binomtest(int(came), 500, row.add_remove_prob).pvalue > 0.001, row


def test_newcomers_follow_T_over_the_whole_home(make_tiny_homes):
    """Apples, without noise: fridge 0.4, table 0.4, desk 0.2, whatever the room."""
    homes = make_tiny_homes(500, count_slack=1, noise_zero_prob=0, noise_scale=0)
    was_empty = ~homes.is_present
    homes.lives[0].add_objects()
    is_new = was_empty & homes.is_present & (homes.object_type == 5)
    counts = np.bincount(homes.object_place[is_new], minlength=12)
    assert counts.sum() == counts[[0, 5, 11]].sum() > 100
    expected = counts.sum() * np.array([0.4, 0.4, 0.2])
    assert stats.chisquare(counts[[0, 5, 11]], expected).pvalue > 0.01


def test_the_bounds_choose_whom_they_stop_at_random(make_tiny_homes):
    """With room for one more and two types eager to come, each comes half of the time."""
    homes = make_tiny_homes(600, objects_per_furniture=4, count_slack=0.05, seed=2)
    assert homes.num_slots == 25  # 24 x 1.05 = 25.2: one free slot
    homes.type_add_prob[:] = np.isin(np.arange(10), [0, 9])
    remove = homes.object_place.copy()
    homes.lives[0].add_objects()
    newcomers = homes.object_type[homes.is_present & (remove < 0)]
    counts = np.bincount(newcomers, minlength=10)
    assert counts.sum() == counts[[0, 9]].sum() == 600
    assert stats.binomtest(int(counts[0]), 600, 0.5).pvalue > 0.01
    # And with all 25 objects eager to leave, any two of them go: 24 x 0.95 = 22.8 -> 23 stay.
    homes.object_remove_prob[homes.is_present] = 1
    homes.lives[0].remove_objects()
    assert (homes.is_present.sum(axis=1) == 23).all()
    assert stats.chisquare((~homes.is_present).sum(axis=0)).pvalue > 0.01


def test_the_last_object_never_leaves(make_tiny_homes):
    homes = make_tiny_homes(
        20,
        layout=[("kitchen", "table"), ("bedroom", "desk")],
        objects_per_furniture=1,
        count_slack=1,
    )
    homes.object_remove_prob[homes.is_present] = 1
    homes.lives[0].remove_objects()
    assert (homes.is_present.sum(axis=1) == 1).all()


@pytest.mark.parametrize("share", [0.0, 1.0])
def test_none_or_all_may_move(make_tiny_homes, share):
    homes = make_tiny_homes(5, move_share=share, dynamic_nodes=False)
    can_move = homes.object_move_weight > 0
    homes.evolve()
    np.testing.assert_array_equal(homes.object_moved, can_move if share else can_move & False)


def test_the_chosen_of_every_home_by_hand():
    # Below their thresholds: columns 0, 1, 2 of house 0, none of house 1, columns 1, 2 of house 2.
    uniform = np.array([[0.4, 0.2, 0.3, 0.9], [0.9, 0.9, 0.9, 0.9], [0.5, 0.1, 0.2, 0.3]])
    threshold = np.array([[0.5, 0.5, 0.4, 0.5], [0.5, 0.5, 0.5, 0.5], [0.0, 0.2, 0.4, 0.3]])
    home, column = choose_below(uniform, threshold, np.array([3, 9, 9]))
    assert home.tolist() == [0, 0, 0, 2, 2]
    assert column.tolist() == [0, 1, 2, 1, 2]
    # uniform / threshold: 0.8, 0.4, 0.75 in home 0; 0.5 twice in home 2: the first of them stays.
    home, column = choose_below(uniform, threshold, np.array([2, 4, 1]))
    assert home.tolist() == [0, 0, 2]
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
        for home in range(40):
            runners = np.flatnonzero(weight[home])
            keys = np.log(uniform[home, runners]) / weight[home, runners]
            first = runners[np.argsort(-keys)][: num_winners[home]]
            expected += [(home, slot, rank) for rank, slot in enumerate(first)]
        assert list(zip(*found, strict=True)) == expected
