"""Mixed homes: what is drawn for each, what their agents know, and what is kept of them."""

import json
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from sgm.prior.prior_graph import PriorGraph
from simulator.collect.folder import collect
from simulator.collect.settings import CollectConfig
from simulator.policies import make_policy
from simulator.snapshots.shards import get_shard_name, load_manifest, load_shard
from simulator.tasks.registry import TASKS
from simulator.tasks.rollout import Rollout, make_memory
from simulator.testing import check_homes
from simulator.world.config import HomeConfig
from simulator.world.mixture.source import Mixture, MixtureSource
from simulator.world.mixture.views import (
    BLENDED,
    NOISY,
    NONE,
    OTHER_HOME,
    TRUE,
    UNKNOWN_WORDS,
    draw_views,
    list_words,
    load_words,
)
from simulator.world.routine.dynamics import RoutineDynamics
from simulator.world.streams import Streams


@pytest.fixture(scope="module")
def source():
    return MixtureSource()


@pytest.fixture(scope="module")
def homes(source):
    return source.make(Streams(0, "train", range(80)))


def make_with_view(view, split="train", num_homes=3):
    mixture = Mixture(views={view: 1.0}, max_places=20, max_objects=40)
    return MixtureSource(mixture=mixture).make(Streams(0, split, range(num_homes)))


def test_homes_lie_within_the_bounds_and_fill_them():
    mixture, rules = Mixture(), HomeConfig()
    drawn = [mixture.draw_home(np.random.default_rng(i), rules) for i in range(600)]
    configs = [config for config, _ in drawn]
    rooms = np.array([len(config.rooms) for config in configs])
    places = np.array([sum(config.room_sizes) for config in configs])
    objects = places * [config.objects_per_furniture for config in configs]
    assert rooms.min() == 1
    assert rooms.max() == 8
    assert 4 <= places.min() < 6
    assert 50 < places.max() <= 60
    assert 5 <= objects.min() < 10
    assert 200 < objects.max() <= 300
    assert any(len(set(config.rooms)) < len(config.rooms) for config in configs)
    assert {config.sensing.__class__.__name__ for config in configs} == {
        "ConstantMisses",
        "PartialViews",
    }
    misses = np.array([config.detection_error for config in configs])
    assert misses.mean() == pytest.approx(0.2, abs=4 * 0.4 / np.sqrt(12 * 600))
    # Log-uniform: half of them lie below the geometric mean of the bounds, 0.02.
    moves = np.array([config.move_share for config in configs])
    assert (moves.min(), moves.max()) == pytest.approx((0.002, 0.2), rel=0.05)
    assert (moves < 0.02).mean() == pytest.approx(0.5, abs=4 * 0.5 / np.sqrt(600))
    is_routine = np.array([isinstance(config.dynamics, RoutineDynamics) for config in configs])
    assert is_routine.mean() == pytest.approx(0.5, abs=4 * 0.5 / np.sqrt(600))
    assert all(clock is not None for (_, clock), own in zip(drawn, is_routine, strict=True) if own)
    steps = Counter(clock.step_seconds for _, clock in drawn if clock is not None)
    assert set(steps) == set(mixture.step_seconds)


def test_people_carry_things_out_in_a_share_of_the_homes():
    """All else is as without, and homes in which nobody does are called what they were."""
    rules, share = HomeConfig(), 0.5
    carrying = Mixture(routine_share=1.0, carrying_share=share)
    drawn = [
        [
            own.draw_home(np.random.default_rng(i), rules)[0]
            for own in (carrying, Mixture(routine_share=1.0))
        ]
        for i in range(200)
    ]
    carried = np.array([config.dynamics.carry_share for config, _ in drawn])
    assert stats.binomtest(int((carried > 0).sum()), 200, share).pvalue > 0.01
    assert 0.5 <= carried[carried > 0].min() < carried.max() <= 1
    anything = [config.dynamics.carries_anything for config, _ in drawn]
    assert stats.binomtest(sum(anything), int((carried > 0).sum()), 0.5).pvalue > 0.01
    for config, other in drawn:
        stays = replace(config.dynamics, carry_share=0.0, carries_anything=False)
        assert replace(config, dynamics=stays) == other
    assert "carrying_share" not in MixtureSource().describe()["mixture"]
    own = MixtureSource(mixture=carrying).describe()["mixture"]
    assert own["carrying_share"] == share


def test_people_keep_things_at_new_places_in_a_share_of_the_homes():
    """All else is as without, and homes in which people seldom do are called what they were."""
    rules, share = HomeConfig(), 0.5
    resettling, usual = (
        Mixture(routine_share=1.0, carrying_share=0.5, resettling_share=own) for own in (share, 0.0)
    )
    drawn = [
        [own.draw_home(np.random.default_rng(i), rules)[0] for own in (resettling, usual)]
        for i in range(200)
    ]
    default = RoutineDynamics()
    new = np.array([config.dynamics.new_share for config, _ in drawn])
    is_other = new != default.new_share
    assert stats.binomtest(int(is_other.sum()), 200, share).pvalue > 0.01
    assert 0.02 <= new[is_other].min() < new[is_other].max() <= 0.5
    # Log-uniform: half of them lie below the geometric mean of the bounds, 0.1.
    assert stats.binomtest(int((new[is_other] < 0.1).sum()), int(is_other.sum())).pvalue > 0.01
    tidied = np.array([config.dynamics.tidy_share for config, _ in drawn])[is_other]
    assert tidied.max() <= default.tidy_share
    for config, other in drawn:
        seldom = {"new_share": default.new_share, "tidy_share": default.tidy_share}
        assert replace(config, dynamics=replace(config.dynamics, **seldom)) == other
    assert "resettling_share" not in MixtureSource().describe()["mixture"]
    own = MixtureSource(mixture=resettling).describe()["mixture"]
    assert own["resettling_share"] == share


@pytest.mark.slow
def test_a_home_does_not_depend_on_those_beside_it(source, homes):
    alone = source.make(Streams(0, "train", [37]))
    assert homes.configs[37] == alone.configs[0]
    num_place_codes, num_slots = alone.num_place_codes, alone.num_slots
    memory, own = make_memory(homes), make_memory(alone)
    np.testing.assert_array_equal(
        memory.place_prior.weights[37, :, : alone.num_furniture], own.place_prior.weights[0]
    )
    np.testing.assert_array_equal(homes.type_labels[37], alone.type_labels[0])
    again = source.make(Streams(0, "train", range(80)))
    for _ in range(30):
        again.evolve()
        alone.evolve()
    np.testing.assert_array_equal(again.object_place[37, :num_slots], alone.object_place[0])
    codes = alone.object_code[0]
    np.testing.assert_allclose(
        again.transition_rows(np.full(num_slots, 37), codes)[:, :num_place_codes],
        alone.transition_rows(np.zeros(num_slots, dtype=int), codes),
    )


def test_mixed_homes_pass_the_check_of_homes(source):
    check_homes(source.make, num_homes=8)


def test_splits_share_no_home(source):
    found = [source.make(Streams(0, split, range(5))).configs for split in ("train", "val", "test")]
    assert len(set(map(str, [config for configs in found for config in configs]))) == 15


def test_labels_are_the_same_whatever_homes_are_there(source, homes):
    assert homes.labels == list(source.labels)
    assert homes.labels == source.make(Streams(5, "test", [3])).labels
    used = set(homes.type_labels.ravel()) | set(homes.furniture_labels.ravel()) - {""}
    assert used <= set(homes.labels)
    assert used & set(list_words())


def test_words_of_the_test_homes_are_new_and_no_word_is_the_priors():
    prior = PriorGraph.default()
    known = {row.label for row in (*prior.furniture, *prior.objects)} | set(prior.rooms)
    words = {}
    for split in ("train", "test"):
        found = load_words(split)
        words[split] = {*found.strangers, *(w for own in found.synonyms.values() for w in own)}
        assert not words[split] & known
        assert set(found.synonyms) <= known
        assert len(found.strangers) > 40
    assert not words["train"] & words["test"]
    assert load_words("val") == load_words("train")


def test_views_are_drawn_with_their_weights():
    shares = {TRUE: 1.0, NOISY: 2.0, NONE: 1.0}
    for split in ("train", "test"):
        views = Counter(draw_views(Streams(0, split, range(2000)), shares))
        expected = {TRUE: 0.25, NOISY: 0.5, NONE: 0.25}
        if split == "test":
            expected |= {NOISY: 0.25, BLENDED: 0.25}
        assert {v: n / 2000 for v, n in views.items()} == pytest.approx(expected, abs=0.045)


def test_the_true_view_is_the_prior_and_none_is_nothing():
    homes = make_with_view(TRUE)
    weights = make_memory(homes).place_prior.weights
    assert np.array_equal(weights, homes.view_prior(weights))
    own = homes.place_weights.sum(axis=2) > 0
    assert (weights.sum(axis=(2, 3))[own] > 0.99).all()
    assert not make_memory(make_with_view(NONE)).place_prior.weights.any()


@pytest.mark.parametrize("view", [NOISY, OTHER_HOME, BLENDED])
def test_changed_views_are_distributions_that_differ_from_the_prior(view):
    true = make_memory(make_with_view(TRUE)).place_prior.weights
    seen = make_memory(make_with_view(view)).place_prior.weights
    totals = seen.sum(axis=(2, 3))
    assert (np.isclose(totals, 1, atol=1e-5) | (totals == 0)).all()
    both = (totals > 0) & (true.sum(axis=(2, 3)) > 0)
    distance = np.abs(seen - true).sum(axis=(2, 3))[both].mean() / 2
    assert {NOISY: (0.1, 0.5), BLENDED: (0.2, 0.5), OTHER_HOME: (0.5, 1.0)}[view][0] < distance
    assert distance < {NOISY: 0.5, BLENDED: 0.5, OTHER_HOME: 1.0}[view]
    if view == NOISY:  # what the prior excludes stays excluded
        assert not (seen[true == 0]).any()


def test_noise_of_a_prior_is_shared_by_a_place_and_by_things_that_are_kept_alike():
    homes = make_with_view(NOISY, num_homes=1)
    types = [row.label for row in homes.prior.objects]
    noise = homes._draw_noise(np.random.default_rng(0), (len(types), 400, 2))
    assert noise.std() == pytest.approx(1, abs=0.05)
    alike, unlike = (
        np.corrcoef(noise[types.index(one)].ravel(), noise[types.index(other)].ravel())[0, 1]
        for one, other in (("spoon", "fork"), ("spoon", "soap bar"))
    )
    assert unlike == pytest.approx(1 / 3, abs=0.1)  # that of the place
    assert alike > unlike + 0.1


def test_unknown_words_have_no_prior_and_the_home_stays_what_it_was():
    homes, plain = make_with_view(UNKNOWN_WORDS, num_homes=20), make_with_view(TRUE, num_homes=20)
    np.testing.assert_array_equal(homes.object_place, plain.object_place)
    is_new = homes.prior_types < 0
    assert is_new.mean() == pytest.approx(0.4, abs=0.06)
    words = load_words("train")
    is_called_otherwise = homes.type_labels != np.array(homes.object_labels, dtype=object)
    assert (is_new | ~is_called_otherwise).all()
    for home, number in np.argwhere(is_called_otherwise):
        label, new = homes.object_labels[number], homes.type_labels[home, number]
        assert new in words.synonyms.get(label, ()) or new in words.strangers
    # 25 % strangers; of the others, 47 % take one of their synonyms if they have any.
    is_stranger = np.isin(homes.type_labels[is_new], words.strangers)
    assert is_stranger.mean() == pytest.approx(0.25, abs=0.04)
    has_synonym = np.array([label in words.synonyms for label in homes.object_labels])
    expected = 0.25 + 0.35 * has_synonym.mean()
    assert is_called_otherwise[is_new].mean() == pytest.approx(expected, abs=0.04)
    weights = make_memory(homes).place_prior.weights  # nor may similar words lead there
    assert not weights[is_new].any()
    assert weights[~is_new].any()
    rollout = Rollout(homes, make_policy("bayesian", homes))
    codes, queries = rollout.ask()
    types = homes.object_descriptions.type_of_code[codes]
    is_asked_new = is_new[np.arange(20), types]
    assert is_asked_new.any()
    assert not queries.prior[is_asked_new].any()
    labels = np.array(rollout.memory.labels)[rollout.memory.objects["label"][queries.object]]
    assert labels.tolist() == homes.type_labels[np.arange(20), types].tolist()


@pytest.mark.parametrize("task", TASKS)
def test_every_task_can_be_played(homes, source, task):
    few = source.make(Streams(1, "test", range(12)))
    scores = np.array(list(TASKS[task](few, make_policy("bayesian", few)).run(5)))
    assert scores.shape == (5, 12)
    assert np.isfinite(scores).all()


def test_the_exact_filter_cannot_play(source):
    from simulator.policies import check_policies

    with pytest.raises(ValueError, match="ceiling"):
        check_policies(["ceiling"], source)
    check_policies(["oracle", "bayesian"], source)


@pytest.mark.slow
def test_a_collection_is_spread_over_lives_and_the_same_for_any_workers(tmp_path):
    mixture = Mixture(lives=(4, 40), max_places=12, max_objects=30)
    config = CollectConfig(homes=MixtureSource(mixture=mixture), num_homes=8, steps=8, seed=3)
    for workers in (1, 2):
        collect(config, tmp_path / str(workers), workers=workers, progress=False)
    one, two = (load_manifest(tmp_path / name) for name in "12")
    assert one == two
    assert json.loads(json.dumps(config.homes.describe())) == config.homes.describe()
    lives = {
        home: group.play_steps
        for group in config.homes.list_groups(range(8))
        for home in group.homes
    }
    assert set(lives.values()) == {4, 40}
    for home, life in lives.items():
        name = get_shard_name(home)
        times = load_shard(tmp_path / "1" / name, one["shards"][name])["snapshot_time"]
        # 8 of 40 steps, the first and the last among them; all of 4.
        expected = np.arange(1, 5) if life == 4 else np.linspace(0, 39, 8).round() + 1
        assert times.tolist() == expected.tolist()


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"min_places": 70}, "min_places must be above 0 and at most max_places, got 70 and 60"),
        ({"max_rooms": 0}, "max_rooms must be at least 1"),
        ({"routine_share": 2.0}, r"routine_share must lie in \[0, 1\], got 2.0"),
        ({"step_seconds": ()}, "step_seconds must be one or more lengths"),
        ({"lives": (0,)}, "lives must be one or more numbers of steps"),
        ({"views": {"rosy": 1.0}}, "views must have weights for some of .*rosy"),
        ({"views": {TRUE: 0.0}}, "give one a weight above 0"),
    ],
)
def test_bad_mixtures_are_refused(fields, message):
    with pytest.raises(ValueError, match=message):
        replace(Mixture(), **fields)
