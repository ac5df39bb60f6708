"""Questions about anything: what has just moved is asked for no more than other things."""

import numpy as np

from sgm.evidence.columns import PLACE_COLUMNS, QUESTION_COLUMNS
from simulator.collect import CollectConfig, collect
from simulator.snapshots.shards import get_shard_name, load_manifest, load_shard
from simulator.tasks.registry import find_task
from simulator.tasks.rollout import sample_query
from simulator.world.config import HomeConfig
from simulator.world.source import SampledSource

TASK = "simulator.tasks.ask_anything:AskAnything"
HOUSE = HomeConfig(furniture_per_room=3, objects_per_furniture=4, move_share=0.2)


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
            homes=SampledSource(home=HOUSE), num_homes=2, steps=6, policy="adaptive", task=task,
            evidence=True,
        )  # fmt: skip
        out = tmp_path / task.rpartition(":")[2]
        collect(config, out, progress=False)
        shards = load_manifest(out)["shards"]
        arrays = [load_shard(out / get_shard_name(home), shards[get_shard_name(home)])
                  for home in range(2)]  # fmt: skip
        moved = np.concatenate([own["snapshot_question_evidence"] for own in arrays])
        moved = moved[:, QUESTION_COLUMNS.index("movement.any_moved")]
        beliefs = [
            np.concatenate([
                own["snapshot_furniture_extra_evidence"].reshape(-1, len(PLACE_COLUMNS))
                for own in arrays
            ])[:, PLACE_COLUMNS.index(f"filters.belief_{name}")]
            for name in ("asked", "learnt")
        ]  # fmt: skip
        sizes.append((moved.max(), np.abs(beliefs[0] - beliefs[1]).max()))
    assert sizes[0] == (0, 0)
    assert min(sizes[1]) > 0.05


def test_it_is_a_task_by_its_import_path():
    task = find_task(TASK)
    assert (task.asks_moved, task.metric) == (0, "accuracy")
    assert find_task("predict_location").asks_moved == 0.5
