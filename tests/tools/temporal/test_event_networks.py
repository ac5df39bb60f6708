"""Temporal networks: the stream by hand, laws of every network, files, and the policy."""

from __future__ import annotations

import copy
from dataclasses import replace

import numpy as np
import pytest
import torch
from torch_geometric.nn.models.tgn import TGNMemory

from simulator.policies import make_policy
from simulator.tasks.evaluation import evaluate_policy
from simulator.testing import check_policy
from simulator.world.config import HomeConfig
from simulator.world.source import SampledSource
from simulator.world.streams import Streams
from tools.temporal.episodes import EpisodeQuestions, LookEvents, record_episodes
from tools.temporal.policy import EventPolicy
from tools.temporal.registry import NETWORKS, TrainedNetwork, make_network
from tools.temporal.stream import NUM_KEPT, EventStream, NewEvents, StreamQuestions
from tools.temporal.tgn import MessageStore
from tools.temporal.training import play_episode, train_network, tune, validate

SOURCE = SampledSource(home=HomeConfig(furniture_per_room=2, objects_per_furniture=3))
SMALL = {"units": 8, "num_events": 4}
NAMES = list(NETWORKS)


@pytest.fixture(scope="module")
def episodes():
    return record_episodes(SOURCE, Streams(0, "train", range(3)), 6)


def make(name, **more):
    torch.manual_seed(0)
    return make_network(name, {**SMALL, **more})


def answer(network, episodes, sightings_alone=False):
    """Logits of every question, one after the other."""
    found = []

    def keep(logits, is_place, answers):
        found.append(logits.detach().numpy().copy())

    network.eval()
    with torch.no_grad():
        for episode in episodes:
            play_episode(network, episode, sightings_alone, keep)
    return found


def make_events(*rows):
    """(home, thing, furniture, is_seen) of each event."""
    home, thing, furniture, seen = np.array(rows).T
    ones = np.ones(len(rows))
    return NewEvents(
        home,
        thing,
        furniture,
        np.zeros(len(rows), int),
        seen.astype(bool),
        ones,
        seen.astype(float),
    )


def test_the_latest_events_of_a_node_by_hand():
    """Two homes of two places: nodes 0, 1 and 2, 3; things follow, the first is node 4."""
    stream = EventStream(np.array([[5, 6], [7, -1]]), sightings_alone=False)
    stream.know_things(np.array([0, 1]), np.array([8, 9]))
    assert stream.append(make_events((0, 0, 1, 1), (1, 1, 0, 0)), time=1).tolist() == [0, 1]
    stream.know_things(np.array([0, 1, 0]), np.array([8, 9, 8]))
    assert stream.append(make_events((0, 0, 0, 1), (0, 2, 0, 0)), time=2).tolist() == [2, 3]
    assert stream.node_label.tolist() == [5, 6, 7, 0, 8, 9, 8]
    assert stream.node_number.tolist() == [0, 1, 0, 1, -1, -1, -2]  # things per home
    assert stream.src.tolist() == [4, 5, 4, 6]
    assert stream.dst.tolist() == [1, 2, 0, 0]
    assert stream.time.tolist() == [1, 1, 2, 2]
    assert stream.message[1].tolist() == [0, 0, 1, 0]
    latest = stream.find_latest(np.array([4, 0, 1, 3]), 3)
    assert latest.tolist() == [[-1, 0, 2], [-1, 2, 3], [-1, -1, 0], [-1, -1, -1]]
    assert stream.find_places(np.array([1])).tolist() == [[2, 3]]


def test_only_the_last_events_are_kept():
    stream = EventStream(np.array([[0]]), sightings_alone=False)
    stream.know_things(np.zeros(1, int), np.zeros(1, int))
    stream.append(make_events(*[(0, 0, 0, 1)] * (NUM_KEPT + 5)), time=1)
    assert stream.find_latest(np.array([0]), 3).tolist() == [
        [NUM_KEPT + 2, NUM_KEPT + 3, NUM_KEPT + 4]
    ]
    stream.append(make_events((0, 0, 0, 1)), time=2)
    kept = stream.find_latest(np.array([1]), NUM_KEPT)[0]
    assert kept.tolist() == list(range(6, NUM_KEPT + 6))


def test_sightings_alone_drop_what_was_not_seen():
    stream = EventStream(np.array([[0, 0]]), sightings_alone=True)
    stream.know_things(np.zeros(2, int), np.zeros(2, int))
    assert stream.append(make_events((0, 0, 1, 0), (0, 1, 1, 1)), time=1).tolist() == [0]
    assert stream.src.tolist() == [3]
    assert stream.append(make_events((0, 0, 0, 0)), time=2).tolist() == []


def test_episodes_hold_what_happened_in_order(episodes):
    (episode,) = episodes
    kinds = [type(happened) for happened in episode.happened]
    assert kinds == [EpisodeQuestions, LookEvents] * 6
    times = [h.time if isinstance(h, LookEvents) else h.asked.time for h in episode.happened]
    assert times == sorted(times)
    question = episode.happened[0]
    assert question.answers.shape == (3, 8)
    assert question.answers.any(axis=1).all()
    assert question.asked.prior.shape == (3, 8)


def test_episodes_have_at_most_so_many_homes(episodes):
    """What happened is the same, in two episodes in place of one."""
    parts = record_episodes(SOURCE, Streams(0, "train", range(3)), 6, most_homes=2)
    assert [len(own.furniture_label) for own in parts] == [2, 1]
    answers = np.concatenate([own.happened[0].answers for own in parts])
    np.testing.assert_array_equal(answers, episodes[0].happened[0].answers)
    with pytest.raises(ValueError, match="most_homes must be at least 1, got 0"):
        record_episodes(SOURCE, Streams(0, "train", range(3)), 6, most_homes=0)


def test_pairs_leave_out_columns_that_are_no_place():
    """Homes of two places and of one: nodes 0, 1 and 2, (3 is none); things follow."""
    stream = EventStream(np.array([[5, 6], [7, -1]]), sightings_alone=False)
    prior, is_place = np.ones((2, 2), np.float32), np.array([[True, True], [True, False]])
    pairs = stream.find_pairs(StreamQuestions(np.arange(2), np.array([0, 1]), prior, is_place, 1))
    assert pairs.things.tolist() == [4, 5]
    assert (pairs.query.tolist(), pairs.places.tolist()) == ([0, 0, 1], [0, 1, 2])
    assert pairs.spread(torch.tensor([1.0, 2.0, 3.0])).tolist() == [[1, 2], [3, 0]]


def test_messages_of_a_later_look_replace_those_of_an_earlier_one():
    """As PyG's dictionary does; in the order of nodes, and of their messages."""
    store = MessageStore(3, 1, torch.float32)
    put = [([1, 0, 1], [8, 8, 9], 1), ([1], [7], 2), ([2, 2], [6, 5], 3)]
    for number, (src, dst, time) in enumerate(put):
        raw = 10.0 * number + torch.arange(len(src)).unsqueeze(1)
        store.put(torch.tensor(src), torch.tensor(dst), torch.full((len(src),), time), raw)
    store.grow(4)
    src, dst, time, raw = store.take(torch.tensor([2, 3, 0, 1]))
    assert src.tolist() == [2, 2, 0, 1]
    assert dst.tolist() == [6, 5, 8, 7]
    assert time.tolist() == [3, 3, 1, 2]
    assert raw.ravel().tolist() == [20, 21, 1, 10]


def test_the_memory_is_that_of_pyg(episodes):
    """Tables of messages in place of PyG's dictionary change no memory, while training or not."""
    network = make("tgn", dropout=0.0)
    kept = {}
    for methods in ("ours", "pyg"):
        own = copy.deepcopy(network)
        if methods == "pyg":
            own.memory.__class__ = _DictionaryMemory
        for mode in (True, False):
            with torch.no_grad():
                play_episode(own.train(mode), episodes[0], False, lambda *_: None)
            kept[methods, mode] = own.memory.memory.clone()
    for mode in (True, False):
        assert kept["ours", mode].abs().max() > 0.01
        torch.testing.assert_close(kept["ours", mode], kept["pyg", mode])


class _DictionaryMemory(TGNMemory):
    """PyG's own memory, which grows as ours does."""

    def start(self, num_nodes):
        self.num_nodes = num_nodes
        self.memory = torch.zeros(num_nodes, self.memory_dim)
        self.last_update = torch.zeros(num_nodes, dtype=torch.long)
        self._assoc = torch.zeros(num_nodes, dtype=torch.long)
        self._reset_message_store()

    def grow(self, num_nodes):
        added = num_nodes - self.num_nodes
        self.memory = torch.cat([self.memory, torch.zeros(added, self.memory_dim)])
        self.last_update = torch.cat([self.last_update, torch.zeros(added, dtype=torch.long)])
        self._assoc = torch.zeros(num_nodes, dtype=torch.long)
        old = self.msg_s_store, self.msg_d_store
        self.num_nodes = num_nodes
        self._reset_message_store()
        self.msg_s_store |= old[0]
        self.msg_d_store |= old[1]


def test_questions_without_an_event_between_them_can_be_learnt_from(episodes):
    """A look that showed nothing leaves sightings alone without an event."""
    (episode,) = episodes
    asked = [own for own in episode.happened if isinstance(own, EpisodeQuestions)]
    looks = [own for own in episode.happened if isinstance(own, LookEvents)]
    nothing = replace(looks[1], events=looks[1].events.take(np.zeros(0, dtype=int)))
    happened = (looks[0], asked[1], nothing, asked[2])
    for name in NAMES:
        own = replace(episode, happened=happened)
        train_network(make(name), [own], sightings_alone=True, epochs=1, learning_rate=1e-3)


@pytest.mark.parametrize("name", NAMES)
def test_gradients_reach_every_parameter(name, episodes):
    network = make(name, dropout=0.0)
    total = []

    def keep(logits, is_place, answers):
        total.append((logits * torch.randn_like(logits)).sum())

    (episode,) = episodes
    play_episode(network.train(), episode, False, keep)
    total[-1].backward()  # events have been by then
    for key, parameter in network.named_parameters():
        assert parameter.grad is not None, key
        assert parameter.grad.isfinite().all(), key
        # TGN's messages from places to things and back have modules without weights
        assert (parameter.grad != 0).any(), key


@pytest.mark.parametrize("name", NAMES)
def test_what_is_not_seen_reaches_the_answer_where_it_is_told(name, episodes):
    """Without negative looks the same events without them give the same answers."""
    network = make(name)
    told, alone = answer(network, episodes), answer(network, episodes, sightings_alone=True)
    assert any(not np.allclose(one, other) for one, other in zip(told, alone, strict=True))


@pytest.mark.parametrize("name", NAMES)
def test_an_answer_depends_on_no_later_event(name, episodes):
    network = make(name)
    (episode,) = episodes
    whole = answer(network, [episode])
    half = replace(episode, happened=episode.happened[:7])
    for one, other in zip(answer(network, [half]), whole, strict=False):
        np.testing.assert_allclose(one, other, rtol=1e-5, atol=1e-5)


def test_the_mixer_gets_the_latest_link_first(monkeypatch):
    """PyG fills up with zeros at the end, so that the latest would else stand anywhere."""
    network = make("graph_mixer")
    stream = EventStream(np.array([[0, 0]]), sightings_alone=False)
    network.reset(stream, np.zeros((1, 96)))
    stream.know_things(np.zeros(1, int), np.zeros(1, int))
    for time in (1, 2, 3):
        stream.append(make_events((0, 0, time % 2, 1)), time)
    heard = []
    forward = type(network.link).forward

    def listen(self, edge_index, edge_attr, edge_time, seed_time):
        heard.append((edge_index[1].tolist(), edge_time.tolist()))
        return forward(self, edge_index, edge_attr, edge_time, seed_time)

    monkeypatch.setattr(type(network.link), "forward", listen)
    prior = np.full((1, 2), 0.5, np.float32)
    network(StreamQuestions(np.zeros(1, int), np.zeros(1, int), prior, np.ones((1, 2), bool), 4))
    # places 0 (looked at in step 2) and 1 (in 1 and 3), then the thing
    assert heard == [([0, 1, 1, 2, 2, 2], [2, 3, 1, 3, 2, 1])]


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_a_training_is_repeated_to_the_bit_and_learns(name, episodes):
    """The loss of what it was trained on falls; how far is no matter of a test."""
    before = validate(make(name), episodes, False)
    found = []
    for _ in range(2):
        network = make(name)
        train_network(network, episodes, sightings_alone=False, epochs=6, learning_rate=5e-3)
        found.append(validate(network, episodes, False))
    assert found[0] == found[1]
    assert found[0].nll < before.nll


@pytest.mark.parametrize("name", NAMES)
def test_a_saved_network_plays_as_it_was(name, episodes, tmp_path):
    network = make(name)
    train_network(network, episodes, sightings_alone=True, epochs=1, learning_rate=1e-3)
    path = tmp_path / "net.pt"
    TrainedNetwork(name, network, True, {"seed": 0}).save(path)
    loaded = TrainedNetwork.load(path)
    assert (loaded.name, loaded.sightings_alone, loaded.training) == (name, True, {"seed": 0})
    want, got = answer(network, episodes, True), answer(loaded.network, episodes, True)
    for one, other in zip(got, want, strict=True):
        np.testing.assert_array_equal(one, other)
    policy = f"tools.temporal.policy:EventPolicy={path}"
    homes = SOURCE.make(Streams(1, "val", range(2)))
    assert isinstance(make_policy(policy, homes), EventPolicy)


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_the_policy_keeps_the_contract(name, tmp_path):
    """Homes of any size, and no answer that depends on the homes beside it."""
    path = tmp_path / "net.pt"
    TrainedNetwork(name, make(name), False, {}).save(path)
    check_policy(EventPolicy.load(str(path)).play_in)


def test_the_policy_answers_as_the_recorded_episode_does(episodes):
    """Played online with the looks of `bayesian`, it gets the same events in the same order."""
    network = make("recurrent")
    trained = TrainedNetwork("recurrent", network, False, {})
    own = EventPolicy(trained)
    heard = []

    class Watched(type(make_policy("bayesian", None))):
        def reset(self, memory):
            own.reset(memory)

        def observe(self, memory, change):
            own.observe(memory, change)

        def scores(self, memory, queries):
            heard.append(own.scores(memory, queries))
            return super().scores(memory, queries)

    evaluate_policy(lambda homes: Watched(), SOURCE, Streams(0, "train", range(3)), 6)
    for one, other in zip(heard, answer(network, episodes), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-4, atol=1e-4)


def test_tuning_is_seeded_and_tries_as_often_as_asked(episodes):
    pytest.importorskip("optuna", reason="optuna is not installed")
    found = [tune("recurrent", True, episodes, episodes, 3, 1) for _ in range(2)]
    assert found[0] == found[1]
    assert len(found[0]["trials"]) == 3
    best = min((t for t in found[0]["trials"] if t["nll"] is not None), key=lambda t: t["nll"])
    assert found[0]["settings"] == best["settings"]
    assert tune("recurrent", True, [], [], 0, 1)["trials"] == []


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (lambda c: c | {"format": "x"}, "got ValueError"),
        (lambda c: c | {"name": "gat"}, "'gat' with"),
        (lambda c: c | {"settings": {"units": 10**9}}, "1000000000"),
        (lambda c: c | {"settings": {"width": 4}}, "TypeError"),
        (lambda c: c | {"parameters": {}}, "parameters of other names"),
        (lambda c: {}, "KeyError"),
    ],
)
def test_damaged_files_are_one_line(edit, message, tmp_path):
    path = tmp_path / "net.pt"
    TrainedNetwork("recurrent", make("recurrent"), True, {}).save(path)
    torch.save(edit(torch.load(path, weights_only=True)), path)
    with pytest.raises(
        ValueError, match=rf"(?s)must be one that nep.bench temporal wrote.*{message}"
    ):
        TrainedNetwork.load(path)
    with pytest.raises(ValueError, match="network must be a file that can be read"):
        EventPolicy.load(str(tmp_path / "none.pt"))


def test_unknown_names_and_settings_are_refused():
    with pytest.raises(ValueError, match="network must be one of tgn, graph_mixer"):
        make_network("gat")
    with pytest.raises(ValueError, match="multiples of heads and patch, got 9"):
        make_network("dygformer", {"units": 9})
