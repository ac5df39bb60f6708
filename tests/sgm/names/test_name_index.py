"""An index of names that follows the names of a memory."""

import unittest.mock

import numpy as np

from sgm.finder.said_places import find_said_places
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.names import name_matching
from sgm.names.aliases import AliasTable
from sgm.names.comparison import ALL_SAID, compare
from sgm.names.name_index import NameIndex
from sgm.names.name_matching import RELATED, SYNONYM
from sgm.names.spelling import TypoIndex, is_typo

WORDS = "red blue mug cup box of soap bottle piano bench dad's phone glasses keys zorb 1 2".split()
TABLES = "descriptions readings written words things contents endings same spelled texts".split()


def sample_names(rng, number):
    found = {}
    while len(found) < number:
        found[" ".join(rng.choice(WORDS, rng.integers(1, 5)))] = None
    return list(found)


def test_names_that_change_one_by_one_are_as_if_read_anew():
    """After a rename all names of the memory were read again."""
    rng = np.random.default_rng(0)
    table = AliasTable.household(None)
    for _ in range(20):
        names = sample_names(rng, 60)
        index = NameIndex((), table)
        index.update(names[:30])
        for fresh in names[40:50]:
            names[int(rng.integers(30))] = fresh
        index.update(names[:40])  # some were renamed, and some are new
        whole = NameIndex((), table)
        whole.update(names[:40])
        for part in TABLES:
            assert getattr(index._tables, part) == getattr(whole._tables, part), part
        for question in sample_names(rng, 20):
            assert index.resolve(question) == whole.resolve(question), question


def test_names_that_were_removed_are_not_found():
    index = NameIndex((), AliasTable.household(None))
    index.update(["red mug", "keys"])
    index.update(["keys"])
    assert index.resolve("red mug").matches == ()
    assert index.resolve("keys").matches == ("keys",)


def rate(name, others):
    """How alike names are by their letters: any measure will do."""
    return [len(set(name) & set(other)) / len(set(name) | set(other)) for other in others]


def find_similar(index, readings, least):
    """Groups of descriptions, each compared with the question, the most similar first."""
    groups = {}
    for reading in readings:
        for number, (one, *_) in enumerate(index._tables.readings):
            if not (reading.things and one.things) and compare(reading, one) == ALL_SAID:
                value = rate(" ".join(reading.head), [" ".join(one.head)])[0]
                if value >= least:
                    groups.setdefault(value, []).append(number)
    seen, found = set(), []
    for value in sorted(groups, reverse=True):
        found.append([n for n in dict.fromkeys(groups[value]) if n not in seen])
        seen.update(groups[value])
    return [group for group in found if group]


def test_similar_names_are_those_that_each_name_alone_is_compared_for(monkeypatch):
    monkeypatch.setattr(name_matching, "SYNONYM", 0.6)
    monkeypatch.setattr(name_matching, "RELATED", 0.3)
    rng = np.random.default_rng(0)
    index = NameIndex((), AliasTable.household(None))
    words = [*WORDS, "zork", "bozr", "gumz", "zorbs 3"]
    index.update(list(dict.fromkeys(" ".join(rng.choice(words, 2)) for _ in range(200))))
    for text in (*words, "red zorg", "zorg 1", "zorg 2", "dad's zorg", "blue mugz of soap"):
        readings = index._matcher.read_main(text)
        synonyms, related = index._matcher.find_similar(readings, rate)
        for found, least in ((synonyms, 0.6), (related, 0.3)):
            expected = find_similar(index, readings, least)
            assert list(map(sorted, found)) == list(map(sorted, expected)), text
    assert (SYNONYM, RELATED) == (0.9, 0.8)


def test_names_that_differ_in_their_number_are_compared_with_a_question_once(monkeypatch):
    """They were compared twice each, for what means the same, and for what is related."""
    compared = []
    monkeypatch.setattr(
        name_matching, "compare", lambda *pair: compared.append(pair) or compare(*pair)
    )
    index = NameIndex((), AliasTable.household(None))
    index.update([f"gizmo {number}" for number in range(50)])
    assert not index.resolve("brzk", rate).matches
    assert len(compared) < 5


def test_an_index_of_names_to_choose_from_is_kept_and_renewed_with_them():
    memory = SceneGraphMemory()
    kitchen = memory.add_room("kitchen")
    desk = memory.add_furniture("desk", kitchen)
    assert find_said_places(memory, "on the work desk") == [desk]
    with unittest.mock.patch.object(NameIndex, "update") as update:
        assert find_said_places(memory, "on the wooden desk") == [desk]
    assert len(update.call_args_list) == 0
    sofa = memory.add_furniture("couch", kitchen)
    assert find_said_places(memory, "on the big sofa") == [sofa]
    memory.remove_furniture(desk)
    assert find_said_places(memory, "on the wooden desk") == []


def test_what_no_words_said_is_kept_for_each_way_to_compare_names():
    index = NameIndex()
    index.update(["zorb"])
    assert index.resolve("quux").matches == ()
    assert index.resolve("quux", lambda name, others: [0.99 for _ in others]).matches == ("zorb",)
    assert index.resolve("quux").matches == ()
    index.update(["zorb", "quux"])
    assert index.resolve("quux").matches == ("quux",)


def test_an_index_of_typing_errors_finds_what_each_comparison_finds():
    words = sorted({"kettle", "kettles", "cattle", "ketle", "remote", "promote", "tablecloth"})
    for word in ("kettel", "kettl", "remot", "remoet", "tablecloht", "tablecluth", "k", ""):
        found = sorted(TypoIndex(words).find(word))
        assert found == [other for other in words if word and is_typo(word, other)]
