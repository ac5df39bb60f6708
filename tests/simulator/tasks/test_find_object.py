"""Find Object, with the small prior of conftest.py: furniture 0-5, three per room."""

from itertools import pairwise

import numpy as np
import pytest

from sgm.policies.policy import Policy
from simulator.policies import make_policy
from simulator.tasks.find_object import FindObject
from simulator.tasks.search import ByScore


class Fixed(Policy):
    """The same scores whatever is asked."""

    def __init__(self, scores):
        self._scores = np.array(scores, dtype=float)

    def scores(self, memory, queries):
        return np.tile(self._scores, (len(queries.home), 1))


def play(homes, policy, num_episodes, **options):
    """Finished searches, and the looks of each as {home: [furniture, ...]}."""
    task = FindObject(homes, policy, **options)
    looks, episodes, order = [], [], []
    task.on_answer = looks.append
    for episode in task.search(num_episodes):
        episodes.append(episode)
        order.append({})
        for look in looks:
            for home, furniture in zip(look.queries.home, look.choice, strict=True):
                order[-1].setdefault(int(home), []).append(int(furniture))
        looks.clear()
    return task, episodes, order


def test_looks_follow_the_scores_until_found(make_tiny_homes):
    # Scores say 3, 1, 0, 2, 5, 4: an object at 0 alone takes three looks, one at 3 a single one.
    policy = Fixed([4.0, 5.0, 3.0, 6.0, 1.0, 2.0])
    _, episodes, order = play(make_tiny_homes(4, dynamic_nodes=False), policy, 30)
    ranks = {3: 1, 1: 2, 0: 3, 2: 4, 5: 5, 4: 6}
    for episode, looks in zip(episodes, order, strict=True):
        for home in range(4):
            expected = min(ranks[f] for f in np.flatnonzero(episode.answers[home]))
            assert episode.num_looks[home] == expected
            assert looks[home] == [3, 1, 0, 2, 5, 4][:expected]
            assert episode.is_found[home]


def test_no_place_is_offered_twice_and_a_search_ends_when_found(make_tiny_homes):
    for name in ("random", "myopic", "bayesian", "prior_filter", "ceiling"):
        homes = make_tiny_homes(6, seed=3)
        _, episodes, order = play(homes, make_policy(name, homes), 20, max_looks=4)
        for episode, looks in zip(episodes, order, strict=True):
            for home, places in looks.items():
                assert len(set(places)) == len(places) == episode.num_looks[home] <= 4
                hits = episode.answers[home][places]
                assert not hits[:-1].any()
                assert hits[-1] == episode.is_found[home]
                assert episode.is_found[home] or len(places) == 4


def test_the_home_is_static_within_an_episode_and_evolves_between(make_tiny_homes):
    homes = make_tiny_homes(3, seed=1, dynamic_nodes=False)
    task = FindObject(homes, make_policy("random", homes))
    places = []
    task.on_answer = lambda looks: places.append(homes.object_place.copy())
    seen = []
    for _ in task.run(10):
        assert all((place == places[0]).all() for place in places)
        seen.append(places[0])
        places.clear()
    assert all((a != b).any() for a, b in pairwise(seen))


def test_every_look_enters_the_memory_with_the_time_of_its_episode(make_tiny_homes):
    homes = make_tiny_homes(2, seed=5)
    task = FindObject(homes, make_policy("random", homes))
    memory = task.rollout.memory
    total = np.zeros(2, dtype=int)
    for time, episode in enumerate(task.search(15), start=1):
        total += episode.num_looks
        assert memory.time == time
        assert (memory.furniture_num_observed.sum(axis=1) == total).all()
        # as many furniture nodes as looks were last seen in this very step
        assert ((memory.furniture_last_observed == time).sum(axis=1) == episode.num_looks).all()


def test_success_is_by_truth_although_detection_misses_the_object(make_tiny_homes):
    blind = make_tiny_homes(3, detection_error=1.0, dynamic_nodes=False)
    task, episodes, _ = play(blind, make_policy("priors", blind), 10)
    assert all(episode.is_found.all() for episode in episodes)
    assert not task.rollout.memory.edges["is_true"].any()


def test_a_home_does_not_depend_on_its_neighbours(make_tiny_homes):
    for name in ("random", "prior_filter"):
        together = make_tiny_homes(5, seed=2)
        alone = make_tiny_homes(homes=[3], seed=2)
        _, both, _ = play(together, make_policy(name, together), 25)
        _, single, _ = play(alone, make_policy(name, alone), 25)
        assert [e.num_looks[3] for e in both] == [e.num_looks[0] for e in single]
        assert [e.codes[3] for e in both] == [e.codes[0] for e in single]


def test_queries_are_the_same_for_every_policy(make_tiny_homes):
    codes = []
    for name in ("random", "oracle", "bayesian"):
        homes = make_tiny_homes(4, seed=9)
        _, episodes, _ = play(homes, make_policy(name, homes), 20)
        codes.append(np.stack([episode.codes for episode in episodes]))
    assert (codes[0] == codes[1]).all()
    assert (codes[0] == codes[2]).all()


def test_random_needs_as_many_looks_as_combinatorics_say(make_tiny_homes):
    # m of F = 6 places hold the object, looks in random order without repetition: the first hit
    # comes at look (F + 1) / (m + 1) on average, 7 / 2 for one place.
    homes = make_tiny_homes(50, seed=4, dynamic_nodes=False)
    _, episodes, _ = play(homes, make_policy("random", homes), 60)
    looks = np.stack([episode.num_looks for episode in episodes])
    expected = np.stack([7 / (episode.answers.sum(axis=1) + 1) for episode in episodes])
    error = 2.0 / np.sqrt(looks.size)  # the standard deviation of one search is below 2
    assert abs((looks - expected).mean()) < 4 * error


def test_by_score_breaks_ties_with_the_number_given_and_skips_closed_places():
    scores = np.array([[1.0, 3.0, 3.0, -np.inf]] * 4)
    is_open = np.ones((4, 4), dtype=bool)
    homes, uniform = np.arange(4), np.array([0.1, 0.4, 0.6, 0.9])
    assert ByScore().choose(homes, scores, is_open, uniform).tolist() == [1, 1, 2, 2]
    is_open[:, 1:3] = False
    assert ByScore().choose(homes, scores, is_open, uniform).tolist() == [0, 0, 0, 0]
    is_open[:, 0] = False  # only a place without opinion is left
    assert ByScore().choose(homes, scores, is_open, uniform).tolist() == [3, 3, 3, 3]


@pytest.mark.parametrize("max_looks", [0, 7])
def test_more_looks_than_places_are_refused(make_tiny_homes, max_looks):
    with pytest.raises(ValueError, match=f"6 furniture nodes of a home, got {max_looks}"):
        FindObject(make_tiny_homes(), Fixed(np.zeros(6)), max_looks=max_looks)
