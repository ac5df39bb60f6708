"""How many things of a type and of a description homes have."""

import numpy as np

from sgm.prior.copies import get_copies
from simulator.world.mixture.lived_in_homes import LivedInSource
from simulator.world.streams import Streams


def test_a_row_is_found_by_the_label_or_its_last_words():
    assert get_copies("mug") == get_copies("coffee mug") == (10, 4)
    assert get_copies("car keys") == (1, 1)
    assert get_copies("harp") == (3, 2)


def test_no_home_has_more_of_a_type_than_the_table_says_while_it_has_others():
    homes = LivedInSource(session_share=1.0).make(Streams(0, "train", range(60)))
    most, kinds = np.array([get_copies(label) for label in homes.object_labels]).T
    num_homes = 0
    for home in range(60):
        own = homes.lives[0].state.own_place[home, :, 0] >= 0  # all that it ever has
        counts = np.bincount(homes.object_type[home, own], minlength=len(most))
        if own.sum() > 100:
            continue  # may be more than there are things for
        num_homes += 1
        assert (counts <= most).all()
        for one in np.flatnonzero(counts > 1):
            codes = homes.object_code[home, own & (homes.object_type[home] == one)]
            if kinds[one] < most[one]:
                assert len(np.unique(codes)) <= kinds[one]
    assert num_homes > 20


def test_there_are_many_mugs_of_one_description_and_no_two_phones():
    homes = LivedInSource(session_share=1.0).make(Streams(1, "train", range(60)))
    labels = np.array(homes.object_labels, dtype=object)
    shared = {}
    for name in ("mug", "plate", "phone", "remote control"):
        one = int(np.flatnonzero(labels == name)[0])
        pairs = [0, 0]
        for home in range(60):
            own = (homes.lives[0].state.own_place[home, :, 0] >= 0) & (
                homes.object_type[home] == one
            )
            codes = homes.object_code[home, own]
            pairs[0] += len(codes) - len(np.unique(codes))
            pairs[1] += len(codes)
        shared[name] = pairs[0] / max(pairs[1], 1)
    assert min(shared["mug"], shared["plate"]) > 0.2
    assert max(shared["phone"], shared["remote control"]) < 0.1
