import pytest

from sgm.prior.prior_graph import PriorGraph
from simulator.box_world.sizes import (
    SHAPES,
    USUAL_THING,
    _load_furniture,
    find_furniture_size,
    find_thing_size,
)


@pytest.mark.parametrize("prior", [PriorGraph.default(), PriorGraph.household()])
def test_all_furniture_of_the_shipped_priors_has_a_size(prior):
    table = _load_furniture()
    assert {row.label for row in prior.furniture} <= table.keys()
    for size in table.values():
        assert size.shape in SHAPES
        assert 0.02 <= size.height <= 2.0
        assert 0.1 <= size.depth <= 2.0 <= 2 * size.width + 2


def test_what_things_are_in_has_an_inside():
    for prior in (PriorGraph.default(), PriorGraph.household()):
        inside = {row.furniture for row in prior.placements if row.relation == "in"}
        assert inside
        for label in inside:
            assert find_furniture_size(label).interior != "none", label


def test_furniture_is_found_by_its_other_names():
    assert find_furniture_size("refrigerator") == find_furniture_size("fridge")
    assert find_furniture_size("Fridge").interior == "door"
    assert find_furniture_size("bookcase").interior == "open"
    assert find_furniture_size("throne") == find_furniture_size("cabinet")


def test_things_are_found_by_their_last_known_word():
    assert find_thing_size("remote control") == (0.15, 0.08, 0.02)
    assert find_thing_size("butter knife") == (0.20, 0.03, 0.02)
    assert find_thing_size("box of tissues") == (0.12, 0.12, 0.11)  # tissues, not box
    assert find_thing_size("gizmo") == USUAL_THING


def test_most_things_of_the_default_prior_have_a_size_of_their_own():
    objects = [row.label for row in PriorGraph.default().objects]
    usual = [label for label in objects if find_thing_size(label) == USUAL_THING]
    assert len(usual) <= len(objects) / 10, usual
