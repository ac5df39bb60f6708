import numpy as np
import pytest

from sgm.schema import COUNTERS, SNAPSHOT_TABLES
from simulator.policies import make_policy
from simulator.snapshots.nodes_and_edges import propose_edges
from simulator.snapshots.recorder import Recorder
from simulator.snapshots.snapshots import Snapshots
from simulator.snapshots.taken import take_snapshots
from simulator.tasks.predict_location import predict_locations
from simulator.tasks.rollout import Rollout

STEPS = 25
TABLES = {"furniture": "furniture", "object": "objects", "edge": "edges"}


def list_valid(shard, kind, number):
    """List the counters of each row that has a version valid in a snapshot."""
    rows = {}
    for version in range(len(shard[f"{kind}_version_of"])):
        first = shard[f"{kind}_version_valid_from"][version]
        end = shard[f"{kind}_version_valid_to"][version]
        if first <= number < end:
            row = int(shard[f"{kind}_version_of"][version])
            assert row not in rows, "two versions are valid at once"
            rows[row] = tuple(
                int(shard[f"{kind}_version_{name}"][version]) for name in COUNTERS[TABLES[kind]]
            )
    return rows


def rebuild(shard, number):
    """Read one snapshot of a shard with plain loops."""
    query = int(shard["snapshot_query"][number])
    counters = {query: (0, -1, 0, -1)} | list_valid(shard, "object", number)
    nodes = {row: (int(shard["object_label"][row]), *values) for row, values in counters.items()}
    edges = []
    for row, values in list_valid(shard, "edge", number).items():
        place = (int(shard["edge_furniture"][row]), int(shard["edge_relation"][row]))
        prior = float(shard["edge_prior"][row])
        edges.append((int(shard["edge_object"][row]), *place, prior, *values))
    furniture = list_valid(shard, "furniture", number)
    return {
        "time": int(shard["snapshot_time"][number]),
        "furniture": [furniture.get(row, (0, -1)) for row in range(len(shard["furniture_label"]))],
        "query_prior": shard["snapshot_furniture_prior"][number].tolist(),
        "answers": shard["snapshot_furniture_answers"][number].tolist(),
        **describe_graph(nodes, edges, query),
    }


def read_live(live: Snapshots, home: int, answers: np.ndarray):
    """Read one home of snapshots that were taken live, in the same form."""
    nodes = {}
    for node in np.flatnonzero(live.objects["snapshot"] == home).tolist():
        values = (int(live.objects[name][node]) for name in COUNTERS["objects"])
        nodes[node] = (int(live.objects["label"][node]), *values)
    edges = []
    for edge in range(len(live.edges["object"])):
        if int(live.edges["object"][edge]) in nodes:
            column = int(live.edges["furniture"][edge] - live.find_first("furniture")[home])
            place = (column, int(live.edges["relation"][edge]))
            values = (int(live.edges[name][edge]) for name in COUNTERS["edges"])
            prior = float(live.edges["prior"][edge])
            edges.append((int(live.edges["object"][edge]), *place, prior, *values))
    rows = slice(*live.find_first("furniture")[home : home + 2])
    columns = [live.furniture[name][rows].tolist() for name in COUNTERS["furniture"]]
    return {
        "time": int(live.time[home]),
        "furniture": list(zip(*columns, strict=True)),
        "query_prior": live.query_prior[rows].tolist(),
        "answers": answers[home].tolist(),
        **describe_graph(nodes, edges, int(live.query_object[home])),
    }


def describe_graph(nodes, edges, query):
    """Describe a graph without the numbers of its nodes: each by its own edges."""
    stars = {
        node: (values, sorted(rest for row, *rest in edges if row == node))
        for node, values in nodes.items()
    }
    return {"nodes": sorted(stars.values()), "query": stars[query], "num_edges": len(edges)}


@pytest.mark.parametrize("policy", ["bayesian", "random"])
def test_every_snapshot_can_be_rebuilt_from_its_shard(make_default_homes, policy):
    homes = make_default_homes(3, seed=6)
    rollout = Rollout(homes, make_policy(policy, homes))
    recorder = Recorder(rollout.memory)
    rollout.on_change = recorder.add_change
    live = []
    for step in predict_locations(rollout, STEPS):
        recorder.add_snapshot(step.queries, step.answers)
        snapshots = take_snapshots(rollout.memory, step.queries)
        live.append([read_live(snapshots, home, step.answers) for home in range(3)])
    shards = recorder.finish()
    assert len(shards) == 3
    for home, shard in enumerate(shards):
        for number in range(STEPS):
            assert rebuild(shard, number) == live[number][home], (home, number)
        np.testing.assert_array_equal(
            shard["furniture_label"], rollout.memory.furniture_label[home]
        )
        np.testing.assert_array_equal(
            shard["furniture_prob"], rollout.memory.place_prior.furniture_prob[home]
        )
    assert max(row["num_edges"] for row in live[-1]) > 40


def test_several_looks_between_two_snapshots_leave_one_valid_version(make_tiny_homes):
    homes = make_tiny_homes(2, detection_error=0)
    rollout = Rollout(homes, make_policy("random", homes))
    recorder = Recorder(rollout.memory)
    rollout.on_change = recorder.add_change
    live = []
    for step in predict_locations(rollout, 6):
        recorder.add_snapshot(step.queries, step.answers)
        snapshots = take_snapshots(rollout.memory, step.queries)
        live.append([read_live(snapshots, home, step.answers) for home in range(2)])
        change = rollout.memory.observe(
            np.arange(2), np.array([2, 5]), step.queries.object, np.array([1, 1])
        )
        recorder.add_change(change)  # and the rollout's own look follows
    for home, shard in enumerate(recorder.finish()):
        for number in range(6):
            assert rebuild(shard, number) == live[number][home]


def test_a_snapshot_by_hand(make_tiny_memory):
    """A mug seen on the table, a milk that is asked for and was never seen."""
    memory = make_tiny_memory(2)
    label = memory.labels.index
    mug, milk = label("mug"), label("milk")
    memory.step()
    row = memory.ensure_objects(np.array([1]), np.array([7]), np.array([mug]), np.array([0]))
    memory.observe(np.array([1]), np.array([2]), row, np.array([1]))
    memory.step()
    queries = memory.query(np.array([1]), np.array([8]), np.array([milk]), np.array([1]))
    snapshot = take_snapshots(memory, queries)
    assert snapshot.num_snapshots == 1
    assert snapshot.find_first("furniture").tolist() == [0, 6]
    assert snapshot.time.tolist() == [2]
    assert snapshot.objects["label"].tolist() == [mug, milk]
    assert snapshot.objects["last_observed"].tolist() == [1, -1]
    assert snapshot.query_object.tolist() == [1]
    assert snapshot.edges["object"].tolist() == [0]
    assert (snapshot.edges["furniture"].tolist(), snapshot.edges["relation"].tolist()) == ([2], [1])
    assert snapshot.edges["prior"].tolist() == pytest.approx([0.4])
    assert snapshot.furniture["num_observed"].tolist() == [0, 0, 1, 0, 0, 0]
    np.testing.assert_allclose(snapshot.query_prior[[0, 2]], [[0.8, 0], [0, 0.2]])
    assert snapshot.answers is None


def test_two_queries_of_one_home_are_two_snapshots(make_tiny_memory):
    memory = make_tiny_memory(2)
    home, keys = np.array([1, 0, 1]), np.array([7, 7, 8])
    rows = memory.ensure_objects(home, keys, keys, keys * 0)
    memory.observe(np.array([0, 1]), np.array([2, 3]), rows[:2][::-1], np.array([1, 1]))
    snapshots = take_snapshots(memory, memory.query(home, keys, keys, keys * 0))
    # Home 1 has an edge of object 7 to furniture 3, home 0 one to furniture 2.
    assert snapshots.objects["snapshot"].tolist() == [0, 1, 2, 2]
    assert snapshots.find_first("furniture").tolist() == [0, 6, 12, 18]
    assert snapshots.edges["furniture"].tolist() == [3, 6 + 2, 12 + 3]
    assert snapshots.objects["snapshot"][snapshots.query_object].tolist() == [0, 1, 2]
    assert snapshots.objects["snapshot"][snapshots.edges["object"]].tolist() == [0, 1, 2]


def test_objects_asked_for_can_be_taken_alone(make_tiny_memory):
    memory = make_tiny_memory(2)
    home, keys = np.array([1, 0, 1, 1]), np.array([8, 7, 9, 7])
    rows = memory.ensure_objects(home, keys, keys, keys * 0)
    for place, seen in ((3, [0, 1, 3]), (4, [0])):  # 8 and 7 in home 1, 7 in home 0; then 8 again
        memory.step()
        memory.observe(
            np.array([0, 1]), np.array([2, place]), rows[seen], np.ones(len(seen), dtype=int)
        )
    queries = memory.query(home[:3], keys[:3], keys[:3], keys[:3] * 0)
    alone, whole = (take_snapshots(memory, queries, asked_alone=alone) for alone in (True, False))
    assert alone.objects["snapshot"].tolist() == [0, 1, 2]
    assert alone.query_object.tolist() == [0, 1, 2]
    assert alone.objects["label"].tolist() == keys[:3].tolist()
    assert alone.edges["object"].tolist() == [0, 0, 1]
    assert alone.edges["furniture"].tolist() == [3, 4, 6 + 2]
    is_asked = (
        whole.query_object[whole.objects["snapshot"][whole.edges["object"]]]
        == whole.edges["object"]
    )
    for name in ("furniture", "prior"):
        np.testing.assert_array_equal(alone.edges[name], whole.edges[name][is_asked])
    for name in COUNTERS["edges"]:
        of_asked = whole.edges[name][is_asked]
        np.testing.assert_array_equal(alone.edges[name], of_asked)


def test_snapshots_do_not_change_with_the_memory(make_tiny_homes):
    homes = make_tiny_homes(2)
    rollout = Rollout(homes, make_policy("random", homes))
    steps = predict_locations(rollout, 10)
    for _ in range(5):
        step = next(steps)
    snapshots = take_snapshots(rollout.memory, step.queries)
    before = [read_live(snapshots, home, step.answers) for home in range(2)]
    for _ in steps:
        pass
    assert [read_live(snapshots, home, step.answers) for home in range(2)] == before


def test_arrays_on_disk_are_small_integers_floats_and_flags(make_tiny_homes):
    homes = make_tiny_homes(1)
    rollout = Rollout(homes, make_policy("bayesian", homes))
    recorder = Recorder(rollout.memory)
    rollout.on_change = recorder.add_change
    for step in predict_locations(rollout, 5):
        recorder.add_snapshot(step.queries, step.answers)
    (shard,) = recorder.finish()
    assert {array.dtype.name for array in shard.values()} == {"int32", "float32", "uint8"}
    assert all(array.flags.c_contiguous for array in shard.values())


def test_a_hypothetical_edge_is_one_that_was_never_observed(make_tiny_memory):
    """The mug was seen on table 2, and is asked for; it may also be in 0 and on 3."""
    memory = make_tiny_memory(1)
    home, label = np.array([0]), np.array([memory.labels.index("mug")])
    memory.step(4)
    mug = memory.ensure_objects(home, np.array([7]), label, np.array([0]))
    memory.observe(home, np.array([2]), mug, np.array([1]))
    memory.step(3)
    snapshots = take_snapshots(memory, memory.query(home, np.array([7]), label, np.array([0])))
    proposed = np.zeros((6, 2), dtype=bool)
    proposed[[0, 2, 3], [0, 1, 1]] = True
    edges = propose_edges(snapshots, proposed)
    assert edges.rows.tolist() == [-1, 0, -1]
    assert edges["furniture"].tolist() == [0, 2, 3]
    assert edges["relation"].tolist() == [0, 1, 1]
    assert edges["is_query"].all()
    priors = [snapshots.query_prior[0, 0], snapshots.edges["prior"][0], snapshots.query_prior[3, 1]]
    assert edges["prior"].tolist() == priors
    for column in SNAPSHOT_TABLES["edges"]:
        if column.is_counter:
            seen = snapshots.edges[column.name][0]
            assert edges[column.name].tolist() == [column.default, seen, column.default]
    assert edges.since("last_true").tolist() == [7, 3, 7]  # since the start, or since time 4
    asked = edges.select(np.array([1, 2]))
    assert asked["num_true"].tolist() == [1, 0]
    with pytest.raises(ValueError, match=r"must hold belief for `features\.belief`, got none"):
        asked.extra("belief")
