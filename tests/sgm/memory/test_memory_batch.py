from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest

from sgm.arrays.table import Table
from sgm.layout.layout import LayoutArrays
from sgm.memory.queries import propose_places, propose_rows, sample_places
from sgm.prior.place_prior import PlacePrior
from sgm.schema import NEVER
from tests.candidates import list_candidates

FRIDGE, SHELF, TABLE, BED, BEDROOM_SHELF, DESK = range(6)
IN, ON = 0, 1
MUG, MILK, PHONE = 0, 1, 8


def ask(memory, key, object_type, home=0):
    return memory.query(*(np.array([value]) for value in (home, key, 4 + key, object_type)))


def look(memory, furniture, seen=(), home=0):
    """Look once; `seen` lists (key, type, relation)."""
    keys, types, relations = np.array(seen, dtype=np.int64).reshape(-1, 3).T
    rows = memory.ensure_objects(np.full(len(keys), home), keys, 4 + keys, types)
    return memory.observe(np.array([home]), np.array([furniture]), rows, relations)


def read_edges(memory, *columns):
    """Read edges as {(key, furniture, relation): values of the columns}."""
    edges, keys = memory.edges, memory.objects["key"]
    return {
        (int(keys[edges["object"][i]]), int(edges["furniture"][i]), int(edges["relation"][i])): (
            tuple(edges[column][i].item() for column in columns)
        )
        for i in range(edges.num_rows)
    }


def test_counters_over_a_sequence_of_looks(make_tiny_memory):
    """One mug (key 7), the kitchen shelf and table.

    t=1 seen on the table | t=2 not seen on the table | t=3 seen on the table
    t=4 seen in the shelf | t=5 not seen on the table
    """
    memory = make_tiny_memory()
    mug = (7, MUG, ON)
    for furniture, seen in [
        (TABLE, [mug]),
        (TABLE, []),
        (TABLE, [mug]),
        (SHELF, [(7, MUG, IN)]),
        (TABLE, []),
    ]:
        memory.step()
        look(memory, furniture, seen)
    counters = (
        "num_observed num_true num_changed last_observed last_changed last_true is_true".split()
    )
    assert read_edges(memory, *counters) == {
        # looked at 4 times, true twice; true -> false -> true -> false: 3 changes, last at 5
        (7, TABLE, ON): (4, 2, 3, 5, 5, 3, False),
        (7, SHELF, IN): (1, 1, 0, 4, NEVER, 4, True),
    }
    node = {name: memory.objects[name][0].item() for name in memory.objects}
    assert node["num_observed"] == 3
    assert node["last_observed"] == 4
    assert (node["num_moved"], node["last_moved"]) == (1, 4)  # table -> shelf, seen at t=4
    assert node["last_furniture"] == SHELF
    assert memory.furniture_num_observed[0].tolist() == [0, 1, 4, 0, 0, 0]
    assert memory.furniture_last_observed[0].tolist() == [NEVER, 4, 5, NEVER, NEVER, NEVER]


def test_an_edge_carries_its_prior(make_tiny_memory):
    memory = make_tiny_memory()
    look(memory, TABLE, [(7, MUG, ON), (8, MILK, ON), (9, -1, ON)])
    look(memory, BED, [(7, MUG, ON)])  # the prior excludes it
    prior = read_edges(memory, "prior")
    assert prior[7, TABLE, ON] == pytest.approx((0.4,))
    assert prior[8, TABLE, ON] == pytest.approx((0.2,))
    assert prior[9, TABLE, ON] == prior[7, BED, ON] == (0,)


def test_a_hypothetical_edge_that_is_looked_at_and_false_is_remembered(make_tiny_memory):
    memory = make_tiny_memory()
    memory.step()
    ask(memory, 7, MUG)  # may be in the kitchen shelf, on the table, on the desk
    look(memory, TABLE)
    assert read_edges(memory, "num_observed", "num_true", "is_true") == {
        (7, TABLE, ON): (1, 0, False)
    }
    # A place that is no candidate leaves nothing, nor does a candidate of the last step's query.
    look(memory, FRIDGE)
    memory.step()
    look(memory, DESK)
    assert list(read_edges(memory)) == [(7, TABLE, ON)]
    # The node was never seen.
    assert memory.objects["num_observed"].tolist() == [0]
    assert memory.objects["last_observed"].tolist() == [NEVER]


def test_a_hypothetical_edge_that_is_true_is_one_edge(make_tiny_memory):
    memory = make_tiny_memory()
    ask(memory, 7, MUG)
    look(memory, SHELF, [(7, MUG, ON)])  # not "in", as the prior has it
    assert read_edges(memory, "num_observed", "num_true") == {
        (7, SHELF, ON): (1, 1),
        (7, SHELF, IN): (1, 0),
    }


def test_two_instances_of_one_description_are_one_node_with_two_true_edges(make_tiny_memory):
    memory = make_tiny_memory()
    look(memory, TABLE, [(7, MUG, ON), (7, MUG, ON)])
    look(memory, SHELF, [(7, MUG, IN)])
    assert memory.objects.num_rows == 1
    assert read_edges(memory, "num_true", "is_true") == {
        (7, TABLE, ON): (1, True),
        (7, SHELF, IN): (1, True),
    }
    assert memory.objects["num_observed"].tolist() == [2]  # looks that saw it, not instances


def test_homes_do_not_mix(make_tiny_memory):
    memory = make_tiny_memory(2)
    look(memory, TABLE, [(7, MUG, ON)], home=0)
    look(memory, TABLE, [(7, MUG, ON)], home=1)
    look(memory, TABLE, [], home=1)
    assert memory.objects["home"].tolist() == [0, 1]
    assert memory.edges["num_observed"].tolist() == [1, 2]
    assert memory.edges["is_true"].tolist() == [True, False]


def test_a_look_reports_the_rows_that_it_changed(make_tiny_memory):
    memory = make_tiny_memory()
    look(memory, TABLE, [(7, MUG, ON), (8, MILK, ON)])
    look(memory, FRIDGE, [(9, MILK, IN)])
    ask(memory, 10, PHONE)
    change = look(memory, TABLE, [(7, MUG, ON)])
    # Edges: 7 and 8 at the table (0, 1), 9 in the fridge (2), the phone's false one (3).
    assert change.edges.tolist() == [0, 1, 3]
    assert change.objects.tolist() == [0, 3]  # 8 was not seen: only its edge has changed
    assert (change.home.tolist(), change.furniture.tolist()) == ([0], [TABLE])


def test_candidates_are_the_prior_s_places_and_the_remembered_edges(make_tiny_memory):
    memory = make_tiny_memory()
    look(memory, BED, [(7, MUG, ON)])
    candidates = list_candidates(memory, ask(memory, 7, MUG))[0]
    assert [tuple(place) for place in np.argwhere(candidates)] == [
        (SHELF, IN),
        (TABLE, ON),
        (BED, ON),
        (DESK, ON),
    ]
    memory = make_tiny_memory(threshold=0.3)  # mug: shelf 0.4, table 0.4, desk 0.2
    candidates = list_candidates(memory, ask(memory, 7, MUG))[0]
    assert [tuple(place) for place in np.argwhere(candidates)] == [(SHELF, IN), (TABLE, ON)]


def test_an_unknown_object_may_be_on_all_furniture(make_tiny_memory):
    memory = make_tiny_memory()
    candidates = list_candidates(memory, ask(memory, 7, -1))[0]
    assert candidates.tolist() == [[False, True]] * 6


def test_one_object_may_be_asked_for_twice(make_tiny_memory):
    memory = make_tiny_memory()
    look(memory, BED, [(7, MUG, ON)])
    look(memory, FRIDGE, [(8, MILK, IN)])
    queries = memory.query(
        np.zeros(3, dtype=int), np.array([7, 8, 7]), np.array([11, 12, 11]), np.array([0, 1, 0])
    )
    query, edge = memory.edges_of(queries)
    assert sorted(zip(query.tolist(), edge.tolist(), strict=True)) == [(0, 0), (1, 1), (2, 0)]
    candidates = list_candidates(memory, queries)
    np.testing.assert_array_equal(candidates[0], candidates[2])
    assert candidates[0, BED, ON]


def test_keys_may_be_any_number(make_tiny_memory):
    memory = make_tiny_memory()
    zeros = np.zeros(4, dtype=int)
    keys = np.array([70_000, 3, 64, 3])
    assert memory.ensure_objects(zeros, keys, keys, zeros).tolist() == [2, 0, 1, 0]
    assert memory.ensure_objects(zeros, keys, keys, zeros).tolist() == [2, 0, 1, 0]
    assert memory.objects["key"].tolist() == [3, 64, 70_000]


class PlainMemory:
    """The same memory in plain loops over dictionaries."""

    def __init__(self):
        self.time = 0
        self.nodes, self.edges, self.asked = {}, {}, None

    def look(self, furniture, seen, candidates):
        seen = set(seen)
        for (key, place, relation), edge in self.edges.items():
            if place == furniture:
                now = (key, relation) in seen
                edge["num_observed"] += 1
                edge["last_observed"] = self.time
                if now:
                    edge["num_true"] += 1
                    edge["last_true"] = self.time
                if now != edge["is_true"]:
                    edge["num_changed"] += 1
                    edge["last_changed"] = self.time
                edge["is_true"] = now
        hypothetical = (
            set()
            if self.asked is None
            else {
                (self.asked, relation) for relation in (IN, ON) if candidates[furniture][relation]
            }
        )
        for key, relation in seen | hypothetical:
            now = (key, relation) in seen
            self.edges.setdefault(
                (key, furniture, relation),
                {
                    "num_observed": 1,
                    "num_true": int(now),
                    "num_changed": 0,
                    "is_true": now,
                    "last_observed": self.time,
                    "last_changed": NEVER,
                    "last_true": self.time if now else NEVER,
                },
            )
        for key in {key for key, _ in seen}:
            node = self.nodes.setdefault(
                key, {"num_observed": 0, "num_moved": 0, "last_moved": NEVER, "at": furniture}
            )
            if node["at"] != furniture:
                node["num_moved"] += 1
                node["last_moved"] = self.time
            node["num_observed"] += 1
            node["last_observed"] = self.time
            node["at"] = furniture


@pytest.mark.parametrize("seed", range(4))
def test_equal_to_plain_loops(make_tiny_memory, tiny_prior, seed):
    rng = np.random.default_rng(seed)
    memory, plain = make_tiny_memory(3), [PlainMemory() for _ in range(3)]
    for _ in range(40):
        memory.step()
        for home in plain:
            home.time += 1
            home.asked = None
        asked = np.flatnonzero(rng.random(3) < 0.7)  # some homes are not asked
        candidates = None
        if len(asked):
            keys = rng.integers(0, 10, len(asked))
            queries = memory.query(asked, keys, keys + 4, keys)
            candidates = dict(zip(asked, queries.prior > 0, strict=True))
            for home, key in zip(asked, keys, strict=True):
                plain[home].asked = int(key)
        for _ in range(rng.integers(1, 4)):  # several looks between two steps
            homes = np.flatnonzero(rng.random(3) < 0.8)
            furniture = rng.integers(0, 6, len(homes))
            pairs = [
                (home, int(key), int(relation))
                for home in homes
                for key, relation in rng.integers(0, [10, 2], (rng.integers(0, 5), 2))
            ]
            home_of, key_of, relation_of = np.array(pairs, dtype=int).reshape(-1, 3).T
            rows = memory.ensure_objects(home_of, key_of, key_of + 4, key_of)
            memory.observe(homes, furniture, rows, relation_of)
            for home, place in zip(homes, furniture, strict=True):
                seen = [(key, relation) for other, key, relation in pairs if other == home]
                plain[home].look(int(place), seen, (candidates or {}).get(home))
    for home in range(3):
        found = {}
        for i in np.flatnonzero(memory.edges["home"] == home):
            row = memory.edges["object"][i]
            key = (
                memory.objects["key"][row],
                memory.edges["furniture"][i],
                memory.edges["relation"][i],
            )
            assert memory.objects["home"][row] == home
            assert key not in found
            found[key] = {
                name: memory.edges[name][i].item()
                for name in next(iter(plain[home].edges.values()))
            }
        assert found == plain[home].edges
        for i in np.flatnonzero(memory.objects["home"] == home):
            node = plain[home].nodes.get(memory.objects["key"][i])
            if node is None:
                assert memory.objects["num_observed"][i] == 0
                continue
            for name in ("num_observed", "num_moved", "last_moved", "last_observed"):
                assert memory.objects[name][i] == node[name]
            assert memory.objects["last_furniture"][i] == node["at"]


def test_the_prior_of_a_layout_by_hand(tiny_prior):
    """Two tables, a desk where the prior has none, and a piano."""
    prior = PlacePrior(
        tiny_prior,
        [["kitchen"]],
        [["table", "table", "desk", "piano"]],
        np.zeros((1, 4), dtype=int),
    )
    # mug: table 0.4 twice, desk 0.2 (from the bedroom), piano 0; sum 1.0
    np.testing.assert_allclose(prior.weights[0, MUG, :, ON], [0.4, 0.4, 0.2, 0])
    # milk: table 0.2 twice and nothing else -> one half each
    np.testing.assert_allclose(prior.weights[0, MILK, :, ON], [0.5, 0.5, 0, 0])
    assert not prior.weights[0, 9].any()  # no pillow in a home without bed and shelf
    # P(table | kitchen) = 1 / (1 + 2 + 1); P(desk | bedroom) = 2 / (1 + 1 + 2)
    np.testing.assert_allclose(prior.furniture_prob[0], [0.25, 0.25, 0.5, 0])
    rows = prior.rows(np.array([0, 0]), np.array([MUG, -1]))
    np.testing.assert_allclose(rows[0], prior.weights[0, MUG])
    assert not rows[1].any()


def test_furniture_in_a_strange_room_takes_the_mean_over_the_rooms_that_have_it(tiny_prior):
    prior = PlacePrior(tiny_prior, [["garage"]], [["shelf", "table"]], np.zeros((1, 2), dtype=int))
    # mug in shelf: kitchen 0.4, bedroom 0 -> 0.2; on the table 0.4. Shares 1/3 and 2/3.
    np.testing.assert_allclose(prior.weights[0, MUG, 0, IN], 1 / 3, rtol=1e-6)
    np.testing.assert_allclose(prior.weights[0, MUG, 1, ON], 2 / 3, rtol=1e-6)
    # P(shelf | room): kitchen 2/4, bedroom 1/4
    np.testing.assert_allclose(prior.furniture_prob[0], [0.375, 0.25])


def test_places_without_a_prior_are_drawn_at_random():
    chosen = sample_places(np.full(5000, 6), 2, rng=np.random.default_rng(0)).reshape(5000, 6, 2)
    assert not chosen[..., IN].any()
    assert (chosen[..., ON].sum(axis=1) == 2).all()
    share = chosen[..., ON].mean(axis=0)  # 1/3 each, standard deviation 0.0067
    np.testing.assert_allclose(share, 1 / 3, atol=0.03)


def test_homes_of_any_size_get_so_many_random_places_or_all():
    chosen = sample_places(np.array([4, 0, 1, 3]), 2, rng=np.random.default_rng(0))
    assert chosen.shape == (8, 2)
    assert [part.sum() for part in np.split(chosen[:, ON], [4, 4, 5])] == [2, 0, 1, 2]


def test_places_in_one_row_are_proposed_like_padded_ones():
    """Two homes of three furniture nodes, then the same rows cut to two and one."""
    prior = np.array([[[0, 0.2], [0.5, 0], [0, 0]], [[0, 0], [0, 0], [0, 0]]])
    query = np.array([0, 0, 0, 1, 1, 1])
    for threshold in (0.0, 0.3):
        expected = propose_places(prior, threshold).reshape(6, 2)
        rows = prior.reshape(6, 2)
        np.testing.assert_array_equal(propose_rows(rows, query, 2, threshold), expected)
    cut = propose_rows(rows[[0, 1, 3]], query[[0, 1, 3]], 2)
    assert cut.tolist() == [[False, True], [True, False], [False, True]]


def test_proposals_leave_their_input_alone():
    prior = np.zeros((2, 3, 2), dtype=np.float32)
    prior[0, 1, IN] = 0.5
    proposed = propose_places(prior, 0.1)
    assert np.argwhere(proposed).tolist() == [[0, 1, 0], [1, 0, 1], [1, 1, 1], [1, 2, 1]]
    assert prior.sum() == 0.5


def test_a_table_grows_and_fills_what_is_not_given_with_zeros():
    table = Table({"a": np.int32, "b": np.bool_})
    assert table.append(1, a=5).tolist() == [0]
    assert table.append(100, a=np.arange(100), b=True).tolist() == list(range(1, 101))
    assert table.num_rows == 101
    assert table["a"].tolist() == [5, *range(100)]
    assert table["b"].tolist() == [False] + [True] * 100
    assert (table["a"].dtype, table["b"].dtype) == (np.int32, np.bool_)
    table["a"][0] = 9
    assert table["a"][0] == 9


def test_a_table_may_have_defaults_and_rows_for_every_home():
    table = Table({"a": np.int32, "b": float}, {"a": -1}, shape=(2,), num_rows=3)
    assert table["a"].tolist() == [[-1] * 3] * 2
    table["b"][1] = 5
    copied = deepcopy(table)
    table.append(1, b=np.array([[7], [8]]))
    assert table["a"].tolist() == [[-1] * 4] * 2
    assert table["b"].tolist() == [[0, 0, 0, 7], [5, 5, 5, 8]]
    copied["a"][0, 0] = 4  # of its own, and kept by copies of it
    assert copied.copy()["a"].tolist() == [[4, -1, -1], [-1] * 3]
    assert [name for name, _ in table.items()] == ["a", "b"]


def test_a_layout_may_grow(make_tiny_memory, tiny_prior):
    memory = make_tiny_memory()
    look(memory, TABLE, [(7, MUG, ON)])
    rooms = np.append(memory.furniture_room, [[0]], axis=1)
    labels = np.append(memory.furniture_label, memory.furniture_label[:, [TABLE]], axis=1)
    place_prior = PlacePrior(
        tiny_prior,
        [["kitchen", "bedroom"]],
        [["fridge", "shelf", "table", "bed", "shelf", "desk", "table"]],
        rooms,
    )
    memory.set_layout(LayoutArrays(memory.room_label, labels, rooms, place_prior))
    # mug: shelf 0.4, two tables 0.4 each, desk 0.2: sum 1.4
    assert read_edges(memory, "prior")[7, TABLE, ON] == pytest.approx((0.4 / 1.4,))
    assert memory.num_furniture == 7
    look(memory, 6, [(7, MUG, ON)])
    assert memory.furniture_num_observed.tolist() == [[0, 0, 1, 0, 0, 0, 1]]


def test_a_memory_s_query_can_be_narrowed(make_tiny_memory):
    """Queries are plain data: a task may ask with a prior of its own."""
    memory = make_tiny_memory()
    queries = ask(memory, 7, MUG)
    narrowed = replace(queries, prior=np.where(queries.prior > 0.3, queries.prior, 0))
    assert list_candidates(memory, narrowed).sum() == 2
