"""Looks of a time step, summed up by place as they come."""

import numpy as np

from sgm.memory.look import StepLog, StepLook
from sgm.memory.seen_places import sum_negative
from sgm.memory.sighting import Sighting
from sgm.names.name import Name


def test_sums_are_those_of_all_looks_one_by_one():
    rng = np.random.default_rng(0)
    share, position = rng.random((3, 2)), {7: 0, 8: 1, 9: 2}
    for trial in range(40):
        step, shown, is_plain = StepLog(), {}, trial % 2 == 0
        for number in range(int(rng.integers(1, 12))):
            place = int(rng.choice([7, 8, 9]))
            both = tuple(rng.random(2).tolist())
            coverage = both if rng.random() < 0.2 and not is_plain else float(rng.random())
            hidden = (Name.read("mug"),) if rng.random() < 0.2 and not is_plain else ()
            seen = {5: 1} if rng.random() < 0.2 else {}
            step.add(StepLook(place, (Sighting("mug"),) * len(seen), coverage, hidden), seen)
            if seen:
                shown[place] = number + 1
        for row, since in ((5, shown), (6, {})):
            expected, counted = {}, dict.fromkeys(position, 0.0)
            for number, look in enumerate(step.looks):
                one = look.coverage
                mean = sum(one) / 2 if isinstance(one, tuple) else one
                counted[look.furniture] += mean
                if number < since.get(look.furniture, 0) or look.hidden:
                    continue
                if isinstance(one, tuple):
                    one = float(share[position[look.furniture]] @ one)
                expected[look.furniture] = expected.get(look.furniture, 0.0) + one
            found = sum_negative(step, row, Name.read("mug"), share, position)
            assert found.keys() == expected.keys()
            np.testing.assert_allclose([found[own] for own in expected], [*expected.values()])
            num_looks = [step.num_looks.get(place, 0.0) for place in position]
            np.testing.assert_allclose(num_looks, [*counted.values()])
