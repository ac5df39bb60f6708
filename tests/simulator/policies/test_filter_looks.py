import numpy as np
import pytest

from simulator.policies.filter_kernel import list_entries
from simulator.policies.filter_looks import Chains, FilterLooks

NUM_TYPES = 3


def list_values(chains, key, since=0):
    arrays = chains.arrays
    return arrays[3][list_entries(arrays, key, since)].tolist()


def test_chains_list_the_entries_of_a_key_in_order():
    chains = Chains(1)
    chains.fit(5)
    chains.append(np.array([3, 1]), 0, np.array([10, 20]))
    chains.append(np.array([1]), 2, np.array([30]))
    chains.append(np.array([1, 3]), 5, np.array([40, 50]))
    assert list_values(chains, 1) == [20, 30, 40]
    assert list_values(chains, 1, since=1) == [30, 40]
    assert list_values(chains, 3, since=1) == [50]
    assert list_values(chains, 4) == list_values(chains, -1) == []
    chains.drop(2)
    assert list_values(chains, 1) == [30, 40]
    assert list_values(chains, 3) == [50]
    chains.append(np.array([3]), 6, np.array([60]))
    assert list_values(chains, 3) == [50, 60]
    chains.drop(9)
    assert list_values(chains, 3) == []
    assert len(chains) == 0


@pytest.mark.parametrize("seed", range(5))
def test_chains_agree_with_lists(seed):
    rng = np.random.default_rng(seed)
    chains, lists, dropped = Chains(8), {key: [] for key in range(8)}, 0
    for at in range(60):
        keys = rng.choice(8, rng.integers(0, 5), replace=False)
        chains.append(keys, at, keys + 100 * at)
        for key in keys:
            lists[key].append((at, key + 100 * at))
        if rng.random() < 0.1:
            dropped = max(dropped, at - int(rng.integers(0, 5)))
            chains.drop(dropped)
        key, since = int(rng.integers(8)), int(rng.integers(at + 1))
        kept = [value for when, value in lists[key] if when >= max(since, dropped)]
        assert list_values(chains, key, since) == kept


def look(log, time, home, furniture, objects=()):
    objects = np.array(objects, dtype=int)
    keys = np.full(len(objects), home * NUM_TYPES)
    log.add_looks(time, np.array([home]), np.array([furniture]), np.ones(1), objects, keys)


def test_the_log_is_cut_before_the_newest_step():
    log = FilterLooks(2, NUM_TYPES)
    log.max_length = 8
    for time in range(1, 8):
        assert log.find_cutoff(time) is None
        log.add_questions(time, np.array([5]))
        look(log, time, time % 2, 10 * time, objects=[5])
    assert log.find_cutoff(7) is None
    assert log.find_cutoff(8) == 4  # eight steps, of which four stay
    log.drop(4)
    assert log.start == 4
    assert (log.first_round, log.num_rounds) == (4, 7)
    assert log.round_time.tolist() == [5, 6, 7]
    assert list_values(log.looks, 0) == [60]
    assert list_values(log.looks, 1) == [50, 70]
    assert log.questions.arrays.moment[list_entries(log.questions.arrays, 5, 0)].tolist() == [
        5,
        6,
        7,
    ]
    assert log.count_rounds(4) == 4
    assert log.count_rounds(6) == 6


def test_many_looks_in_a_step_stay_until_it_has_passed():
    log = FilterLooks(1, NUM_TYPES)
    log.max_length = 8
    look(log, 1, 0, 0)
    for number in range(20):
        look(log, 2, 0, number)
    assert log.find_cutoff(2) == 1
    log.drop(1)
    assert log.find_cutoff(2) is None
    assert len(log.looks) == 20
    assert log.find_cutoff(3) == 2


def test_a_question_counts_once_a_step():
    log = FilterLooks(1, NUM_TYPES)
    for time, objects in ((1, [0, 4]), (1, [4, 70]), (2, [4])):
        log.add_questions(time, np.array(objects))
    times = log.questions.arrays.moment
    assert times[list_entries(log.questions.arrays, 4, 0)].tolist() == [1, 2]
    assert times[list_entries(log.questions.arrays, 70, 0)].tolist() == [1]
