"""Questions about anything: of what people have, there or not, and of what has just moved."""

from dataclasses import replace

import numpy as np
import pytest

from datamodules.sgm_datamodule import SGMDataModule
from sgm.evidence.columns import PLACE_COLUMNS, QUESTION_COLUMNS
from sgm.policies import Bayesian
from simulator.collect.folder import collect
from simulator.collect.settings import CollectConfig
from simulator.snapshots.shards import check_shard, get_shard_name, load_manifest, load_shard
from simulator.tasks.ask_anything import AskAnything
from simulator.tasks.question_shares import QuestionShares
from simulator.tasks.registry import find_task
from simulator.tasks.rollout import sample_query
from simulator.world.config import HomeConfig
from simulator.world.routine.dynamics import RoutineDynamics
from simulator.world.source import SampledSource
from simulator.world.streams import Streams

TASK = "simulator.tasks.ask_anything:AskAnything"
HOUSE = HomeConfig(furniture_per_room=3, objects_per_furniture=4, move_share=0.2)
PEOPLE = replace(HOUSE, looks="random", dynamics=RoutineDynamics(carry_share=1.0))


def test_things_are_asked_for_by_how_often_they_move(make_default_homes):
    """P(a query is about a mover) = sum of the weights of the movers / sum of all."""
    homes = make_default_homes(40, seed=1)
    found = expected = variance = 0.0
    for _ in range(20):
        homes.evolve()
        weight = np.where(homes.is_present, homes.move_freq[homes.object_type], 0.0)
        share = (weight * homes.object_moved).sum(axis=1) / weight.sum(axis=1)
        slot = sample_query(homes, asks_moved=0.0)
        found += homes.object_moved[np.arange(40), slot].sum()
        expected += share.sum()
        variance += (share * (1 - share)).sum()
    assert abs(found - expected) < 3 * np.sqrt(variance)


def test_a_collection_says_which_questions_it_has(tmp_path):
    """The filters that reckon with moves are those of any question, and no other task's are."""
    sizes = []
    for task in (TASK, "predict_location"):
        config = CollectConfig(
            homes=SampledSource(home=HOUSE),
            num_homes=2,
            steps=6,
            policy="adaptive",
            task=task,
            evidence=True,
        )
        out = tmp_path / task.rpartition(":")[2]
        collect(config, out, progress=False)
        shards = load_manifest(out)["shards"]
        arrays = [
            load_shard(out / get_shard_name(home), shards[get_shard_name(home)])
            for home in range(2)
        ]
        moved = np.concatenate([own["snapshot_question_evidence"] for own in arrays])
        moved = moved[:, QUESTION_COLUMNS.index("movement.any_moved")]
        beliefs = [
            np.concatenate(
                [
                    own["snapshot_furniture_extra_evidence"].reshape(-1, len(PLACE_COLUMNS))
                    for own in arrays
                ]
            )[:, PLACE_COLUMNS.index(f"filters.belief_{name}")]
            for name in ("asked", "learnt")
        ]
        sizes.append((moved.max(), np.abs(beliefs[0] - beliefs[1]).max()))
    assert sizes[0] == (0, 0)
    assert min(sizes[1]) > 0.05


def test_it_is_a_task_by_its_import_path():
    task = find_task(TASK)
    assert (task.asks_moved, task.metric) == (0, "accuracy")
    assert find_task("predict_location").asks_moved == 0.5


def ask(shares, homes=range(12), num_steps=30, rules=PEOPLE):
    """Play, and return every answer with its description codes, and the task."""
    state = SampledSource(home=rules).make(Streams(1, "train", homes))
    task = AskAnything(state, Bayesian())
    task.shares = shares
    asked = []

    def keep(answer):
        key = task.rollout.memory.objects["key"][answer.queries.object]
        seen = task.rollout.memory.objects["num_observed"][answer.queries.object] > 0
        asked.append((key, seen, answer.answers.any(axis=1), answer.asks_moved))

    task.on_answer = keep
    list(task.run(num_steps))
    return [np.stack(column) for column in zip(*asked, strict=True)], task


def test_what_was_seen_is_asked_for_whether_it_is_there_or_not():
    """Of 90 things that were seen some are out, with the share of things that are."""
    (_, seen, is_there, of_task), _ = ask(QuestionShares(owned=0, unknown=0))
    assert seen[5:].mean() > 0.95  # until then a robot may have seen nothing
    assert 0.5 < is_there[5:].mean() < 1
    assert not of_task.any()


def test_absent_and_unknown_things_are_nowhere():
    (code, seen, is_there, _), task = ask(QuestionShares(owned=0, unknown=1))
    assert not is_there.any()
    assert not seen.any()
    had = np.zeros((12, task.rollout.homes.object_descriptions.num_descriptions), dtype=bool)
    had[np.nonzero(task._was_there)[0], task.rollout.homes.object_code[task._was_there]] = True
    assert not np.take_along_axis(had, code.T, axis=1).any()
    (_, seen, is_there, _), _ = ask(QuestionShares(owned=0, unknown=0, absent=1), num_steps=60)
    (_, _, usually_there, _), _ = ask(QuestionShares(owned=0, unknown=0), num_steps=60)
    assert is_there[10:].mean() < usually_there[10:].mean() - 0.1


def test_what_people_use_is_asked_for_of_what_was_seen():
    """A thing that moved within five steps, where the robot has seen one: all were seen, and most
    had moved."""
    state = SampledSource(home=replace(HOUSE, looks="random")).make(Streams(1, "train", range(20)))
    task = AskAnything(state, Bayesian())
    task.shares = QuestionShares(owned=0, unknown=0, used=1)
    rows = []

    def keep(answer):
        moved = np.zeros((20, state.object_descriptions.num_descriptions), dtype=bool)
        home, slot = np.nonzero(state.is_present & (task._since_moved < 5))
        moved[home, state.object_code[home, slot]] = True
        asked, objects = answer.queries.object, task.rollout.memory.objects
        known, code = task._list_known()
        has_any = np.bincount(known, moved[known, code], minlength=20) > 0
        is_used = moved[np.arange(20), objects["key"][asked]]
        rows.append((objects["num_observed"][asked] > 0, is_used, has_any))

    task.on_answer = keep
    list(task.run(20))
    seen, is_used, has_any = np.stack(rows[5:], axis=1)
    assert has_any.mean() > 0.5
    assert seen[has_any].all()
    assert is_used[has_any].all()


def test_questions_of_the_paper_are_a_marked_share():
    (code, _, is_there, of_task), _ = ask(QuestionShares(task=0.25), range(40), 25)
    assert abs(of_task.mean() - 0.25) < 4 * np.sqrt(0.25 * 0.75 / of_task.size)
    assert is_there[of_task].all()
    state = SampledSource(home=PEOPLE).make(Streams(1, "train", range(40)))
    for step in range(25):  # those that the paper's task asks at the same steps
        state.evolve()
        own = state.object_code[np.arange(40), sample_query(state)]
        assert np.array_equal(code[step][of_task[step]], own[of_task[step]])


def test_a_home_is_asked_the_same_whatever_is_beside_it():
    shares = QuestionShares(owned=0.3, unknown=0.2, absent=0.2, task=0.1)
    (together, *_), _ = ask(shares, range(5))
    (alone, *_), _ = ask(shares, range(3, 4))
    assert np.array_equal(together[:, 3], alone[:, 0])


def test_shares_of_questions_are_checked():
    with pytest.raises(ValueError, match=r"add up to at most 1, got 1.2.*Lower one"):
        QuestionShares(owned=0.6, unknown=0.6)
    with pytest.raises(ValueError, match=r"unknown must lie in \[0, 1\]"):
        QuestionShares(unknown=-0.1)
    with pytest.raises(ValueError, match=r"asked must be left out .*got find_object"):
        CollectConfig(task="find_object", asked=QuestionShares())
    with pytest.raises(ValueError, match=r"asked must come with a task that takes shares"):
        SGMDataModule(asked=QuestionShares())


def test_a_collection_keeps_the_kind_of_each_question(tmp_path):
    """Evidence of a marked question is that of the paper's task, of the others that of people."""
    config = CollectConfig(
        homes=SampledSource(home=HOUSE),
        num_homes=3,
        steps=12,
        policy="adaptive",
        task=TASK,
        asked=QuestionShares(task=0.5),
        evidence=True,
    )
    collect(config, tmp_path, progress=False)
    shards = load_manifest(tmp_path)
    assert shards["settings"]["asked"]["task"] == 0.5
    for home in range(3):
        name = get_shard_name(home)
        own = load_shard(tmp_path / name, shards["shards"][name])
        check_shard(own, len(shards["settings"]["labels"]), tmp_path / name)
        of_task = own["snapshot_question_asks_moved"][:, 0]
        moved = own["snapshot_question_evidence"][:, QUESTION_COLUMNS.index("movement.any_moved")]
        assert set(of_task) == {0, 1}
        assert np.array_equal(moved > 0, of_task > 0)
