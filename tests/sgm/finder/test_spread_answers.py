"""An answer for which no place is likely has more places, and less about each."""

import pytest

from sgm import Adaptive, Finder, SceneGraphMemory, Sighting
from sgm.finder.answers import MOST_BYTES, write_json
from sgm.finder.service import MemoryService

LONG = "{} beside the very large window"


@pytest.mark.parametrize("num_places", [3, 6, 12])
@pytest.mark.parametrize("form", ["{}", LONG])
def test_a_thing_that_is_anywhere_has_more_than_one_place(num_places, form):
    memory = SceneGraphMemory()
    kitchen = memory.add_room("kitchen")
    for number in range(num_places):
        place = memory.add_furniture("shelf", kitchen, form.format(f"shelf {number}"))
        memory.observe(place, [Sighting("bowl")])
    memory.step(3)
    answer = MemoryService(memory, Finder(Adaptive())).where_is("passport")
    assert answer.places[0].probability < 0.5
    assert len(answer.places) >= (2 if form == LONG else 3)
    assert len(answer.places) + answer.left_out == num_places
    assert len(write_json(answer)) <= MOST_BYTES
