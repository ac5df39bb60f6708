"""What residents carry out of the home and back: keys, phones, bags."""

from dataclasses import replace

import numpy as np
import pytest

from sgm.prior.prior_graph import PriorGraph
from simulator.testing import check_dynamics
from simulator.world.config import HomeConfig
from simulator.world.routine.carried import load_carried
from simulator.world.routine.dynamics import RoutineDynamics
from simulator.world.routine.rules import Occasion
from simulator.world.sampled_homes import SampledHomes
from simulator.world.streams import Streams
from tests.homes import make_strict_life

OUT = Occasion("job", "leaving", 9.0, 9.0, 480, 1.0, 1.0)
STRICT = replace(make_strict_life(minutes=60), occasions=(OUT,), step_seconds=3600)
SMALL = HomeConfig(furniture_per_room=4, objects_per_furniture=4)


def make(rules, num_homes=6, config=SMALL):
    configs = [replace(config, dynamics=rules)] * num_homes
    return SampledHomes(PriorGraph.household(), configs, Streams(0, "test", range(num_homes)))


def find_carried(homes):
    """Mark objects of types that people carry, bool (H, C)."""
    table = load_carried()
    is_named = np.array([label in table for label in homes.object_labels])
    return is_named[homes.object_type] & (homes.object_place >= 0)


def count_out(homes, num_steps):
    """Return at how many of some steps each object is out, (H, C)."""
    out = np.zeros(homes.object_place.shape, dtype=int)
    for _ in range(num_steps):
        homes.evolve()
        out += homes.object_place < 0
    return out


def test_what_people_carry_leaves_with_them_and_comes_back():
    homes = make(replace(STRICT, carry_share=1.0), num_homes=12)
    is_carried, is_thing = find_carried(homes), homes.object_place >= 0
    table = load_carried()
    always = np.array([table.get(label, (0, 0))[1] == 1 for label in homes.object_labels])
    # In steps of an hour: out from nine for 336 to 624 minutes, so at noon and not at eight.
    for hour in range(1, 49):
        homes.evolve()
        is_out = homes.object_place < 0
        if hour % 24 == 12:
            assert is_out[always[homes.object_type] & is_carried].all()
        if hour % 24 == 8:
            assert not is_out[is_thing].any()
    assert is_carried.any(axis=1).sum() > 6


def test_more_leaves_with_a_share_and_nothing_else_changes_without():
    rules = RoutineDynamics()
    without, same = make(rules), make(replace(rules, carry_share=0.0))
    carrying = make(replace(rules, carry_share=0.9))
    is_carried = find_carried(carrying)
    np.testing.assert_array_equal(count_out(without, 72), count_out(same, 72))
    np.testing.assert_array_equal(without.object_place, same.object_place)
    more = count_out(carrying, 72)
    assert more[is_carried].mean() > 3 * count_out(make(rules), 72)[is_carried].mean()


def test_things_that_no_name_tells_may_be_carried():
    rules = replace(STRICT, carry_share=1.0, max_things_share=0.0)
    homes = make(replace(rules, carries_anything=True))
    is_carried, is_there = find_carried(homes), homes.object_place >= 0
    is_out = (count_out(homes, 24) > 0) & is_there
    # One thing at most is taken for the errand itself; the others are as many as have a name.
    assert (is_out & is_carried).sum(axis=1).max() <= 4
    assert (is_out & ~is_carried).sum() > 3 * (is_out & is_carried).sum()


def test_homes_that_carry_nothing_are_described_as_before_there_was_carrying():
    assert "carry_share" not in RoutineDynamics().describe()
    carrying = RoutineDynamics(carry_share=0.5, carries_anything=True)
    assert carrying.describe()["carry_share"] == 0.5
    assert RoutineDynamics.from_json(carrying.describe()) == carrying
    assert RoutineDynamics.from_json(RoutineDynamics().describe()) == RoutineDynamics()


def test_a_share_is_a_share():
    with pytest.raises(ValueError, match="carry_share"):
        RoutineDynamics(carry_share=1.5)


@pytest.mark.slow
def test_homes_that_carry_keep_the_contract_of_dynamics():
    check_dynamics(RoutineDynamics(carry_share=0.9))


def test_the_table_names_each_type_once_with_shares():
    table = load_carried()
    assert len(table) > 30
    assert all(0 <= share <= 1 for shares in table.values() for share in shares)
    labels = {row.label for row in PriorGraph.household().objects}
    assert len(labels & set(table)) > 30
