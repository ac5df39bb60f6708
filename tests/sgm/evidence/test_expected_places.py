"""What is expected of an object before it is seen: by the prior, or by words."""

import numpy as np
import pytest

from sgm.evidence.expected_places import Expected, compute_trust
from sgm.evidence.question import Question
from sgm.memory.sighting import Sighting
from sgm.prior.place_prior import PlacePrior
from sgm.prior.prior_graph import PriorGraph
from sgm.text.vectors import WORD_WIDTH, Alike, weigh
from simulator import SceneGraphMemory
from simulator.tasks.rollout import make_memory
from simulator.world.mixture.source import MixtureSource
from simulator.world.streams import Streams

KITCHEN = ("fridge", "cooktop", "sink", "counter")


def ask(name: str, furniture=KITCHEN, room="kitchen") -> Expected:
    memory = SceneGraphMemory(PriorGraph.default())
    place = memory.add_room(room)
    for label in furniture:
        memory.add_furniture(label, place)
    return Expected.by_words(Question.gather(memory.batch, memory.query(name)))


def test_weights_of_words_by_hand():
    cosines = np.array([[0.9, 0.9 - WORD_WIDTH, -1.0], [0.5, 0.4, 0.3]])
    assert weigh(cosines)[0] == pytest.approx([1 / (1 + np.exp(-1)), 1 / (1 + np.e), 0], abs=1e-9)
    only = weigh(cosines, np.array([[False, True, False], [False, False, False]]))
    assert only.tolist() == [[0, 1, 0], [0, 0, 0]]


def test_a_word_is_not_like_itself():
    cosines = Alike(["mug", "cup", "bed"]).cosines(["mug", "beaker"])
    assert cosines[0, 0] == -1
    assert cosines[0, 1] > cosines[0, 2]
    assert cosines.shape == (2, 3)
    assert np.abs(cosines[1]).max() < 1


def test_what_the_prior_knows_is_expected_as_it_says():
    memory = SceneGraphMemory()
    room = memory.add_room("kitchen")
    for label in KITCHEN:
        memory.add_furniture(label, room)
    asked = Question.gather(memory.batch, memory.query("mug"))
    by_prior, by_words = Expected.by_prior(asked), Expected.by_words(asked)
    np.testing.assert_array_equal(by_words.share, by_prior.share)
    assert by_words.trust == by_prior.trust == [1]
    assert by_words.furniture_cosine.tolist() == [[1] * 4]
    assert not by_prior.by_name.any()


def test_an_unknown_thing_is_expected_where_things_of_such_names_are():
    cheese = ask("cheese")
    assert cheese.trust == [0.5]
    assert KITCHEN[int(cheese.share.argmax())] == "fridge"
    assert cheese.share.sum() == pytest.approx(1)
    assert cheese.name_cosine[0] > 0.8
    np.testing.assert_array_equal(cheese.share, cheese.by_name)


def test_unknown_furniture_takes_after_what_it_is_called_like():
    prior = PriorGraph.default()
    assert "ice box" not in {row.label for row in prior.furniture}
    known, unknown = ask("milk"), ask("milk", ("cupboard", *KITCHEN[1:]))
    assert known.furniture_cosine[0, 0] == 1
    assert 0 < unknown.furniture_cosine[0, 0] < 1
    plate = ask("plate", ("cupboard", *KITCHEN[1:]))
    assert plate.share[0, 0] > 0
    assert not Expected.by_prior(_ask_with_cupboard("plate")).share[0, 0]


def _ask_with_cupboard(name):
    memory = SceneGraphMemory(PriorGraph.default())
    room = memory.add_room("kitchen")
    for label in ("cupboard", *KITCHEN[1:]):
        memory.add_furniture(label, room)
    return Question.gather(memory.batch, memory.query(name))


def test_without_a_prior_words_say_nothing():
    prior = PlacePrior(
        PriorGraph.default(),
        [["kitchen"]],
        [list(KITCHEN)],
        np.zeros((1, 4), dtype=int),
        view=np.zeros_like,
    )
    share, cosine = prior.find_by_words(np.zeros(1, dtype=int), ["mug"])
    assert not share.any()
    assert cosine.tolist() == [0]


def test_what_was_asked_before_is_answered_the_same():
    homes = MixtureSource().make(Streams(5, "train", range(6)))
    prior, fresh = (make_memory(homes).place_prior for _ in range(2))
    home, labels = np.array([3, 0, 3, 5]), ["mug", "beaker", "cheese", "mug"]
    before = [prior.find_by_words(home[:2], labels[:2]), prior.find_by_words(home, labels)]
    for number, (share, cosine) in enumerate(before):
        rows = slice(0, 2 * number + 2)
        again = [prior.find_by_words(home[[i]], [labels[i]]) for i in range(4)[rows]]
        other = fresh.find_by_words(home[rows], labels[rows])
        for found, each, expected in zip(
            (share, cosine), zip(*again, strict=True), other, strict=True
        ):
            np.testing.assert_array_equal(found, np.concatenate(each))
            np.testing.assert_allclose(found, expected, rtol=1e-12)
    assert before[1][0].any()
    share, cosine = prior.find_by_words(home[:0], [])
    assert share.shape == (0, prior.weights.shape[2])
    assert cosine.shape == (0,)


def test_homes_are_expected_of_alone_as_among_others():
    """Unknown furniture, unknown objects and blurred priors in homes of different sizes."""
    source = MixtureSource()
    together = source.make(Streams(5, "train", range(30)))
    alone = source.make(Streams(5, "train", [7]))
    asked = []
    for homes, home in ((together, 7), (alone, 0)):
        prior = make_memory(homes).place_prior
        size = homes.home_num_furniture[home]
        labels = homes.type_labels[home].tolist()
        share, cosine = prior.find_by_words(np.full(len(labels), home), labels)
        asked.append((share[:, :size], cosine, prior.weights_by_words[home, :, :size]))
    for one, other in zip(*asked, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-6)
    assert asked[0][0].any()


def test_the_share_of_known_types_is_of_the_home_and_five_things_more():
    memory = SceneGraphMemory(PriorGraph.default())
    table = memory.add_furniture("table", memory.add_room("kitchen"))
    shares = []
    for seen in ([], ["mug", "knife", "plate"], ["garden gnome"], ["zorb", "quib"]):
        memory.observe(table, [Sighting(name) for name in seen])
        asked = Question.gather(memory.batch, memory.query("mug"))
        shares.append(compute_trust(asked, Expected.by_prior(asked))["known_share"].item())
    # 5 / 5; 8 / 8; of four things one has no known type, 8 / 9; of six three, 8 / 11.
    assert shares == pytest.approx([1, 1, 8 / 9, 8 / 11])
