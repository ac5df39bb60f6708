"""The table of aliases: look-ups, rows of one's own, and bad ones."""

import csv
from itertools import product
from pathlib import Path

import pytest

import sgm.names
from sgm import PriorGraph, SceneGraphMemory, Sighting
from sgm.names.aliases import AliasTable, read_rows
from sgm.names.name_index import NameIndex
from sgm.names.vocabulary import Vocabulary
from sgm.names.words import split_words

TABLE = Path(sgm.names.__file__).parent / "data" / "en" / "aliases.csv"


def find(table, name):
    return {table.names[thing] for thing in table.find(split_words(name))}


def test_names_by_hand():
    table = AliasTable.household()
    assert find(table, "skillet") == {"frying pan"}
    assert find(table, "tooth brush") == find(table, "toothbrushes") == {"toothbrush"}
    assert find(table, "glasses") == {"eyeglasses", "drinking glass"}
    assert find(table, "glass") == {"drinking glass"}
    assert find(table, "gizmo") == set()
    (iphone,) = table.find(["iphone"])
    assert [table.names[kind] for kind in table.list_above(iphone)] == ["cell phone", "phone"]


def test_the_shipped_table_is_sorted_and_large_enough():
    rows = list(csv.DictReader(TABLE.read_text("utf-8").splitlines()))
    names = [row["name"] for row in rows]
    assert names == sorted(set(names))
    assert len(names) > 800
    assert sum(len(row["aliases"].split(";")) for row in rows if row["aliases"]) > 2000


def test_most_things_of_the_household_prior_are_in_the_table():
    table = AliasTable.household()
    labels = [row.label for row in PriorGraph.household().objects]
    known = [label for label in labels if table.find(split_words(label))]
    assert len(known) / len(labels) > 0.85


@pytest.mark.parametrize("is_file", [False, True])
def test_a_table_of_ones_own_is_added(tmp_path, is_file):
    aliases = {"beagle": {"kind": "dog", "aliases": ["rex", "snoopy"]}, "thermos": ["brew flask"]}
    if is_file:
        aliases = tmp_path / "own.csv"
        aliases.write_text("name,kind,aliases\nbeagle,dog,rex;snoopy\nthermos,,brew flask\n")
    memory = SceneGraphMemory(aliases=aliases)
    shelf = memory.add_furniture("shelf", memory.add_room("kitchen"))
    memory.observe(shelf, [Sighting("beagle"), Sighting("vacuum flask")])
    for one in (memory, memory.copy()):
        assert one.resolve("snoopy").matches == one.resolve("dog").matches == ("beagle",)
        assert one.resolve("brew flask").matches == ("vacuum flask",)
    memory.save(tmp_path / "home.sgm")
    assert SceneGraphMemory.load(tmp_path / "home.sgm").resolve("snoopy").matches == ()
    again = SceneGraphMemory.load(tmp_path / "home.sgm", aliases=aliases)
    assert again.resolve("snoopy").matches == ("beagle",)


def test_rows_that_are_added_say_what_they_say_in_one_table():
    """The shipped table is not read again for rows of one's own, and does not change by them."""
    shipped = AliasTable.household()
    before = list_all(shipped)
    extra = {
        "thermos": ["vacuum flask", "mug"],
        "beagle": {"kind": ["dog", "hound"], "aliases": ["scissors"]},
        "dog": {"kind": "companion"},
    }
    added = AliasTable.household(extra).with_names(["zorb", "mug"])
    whole = AliasTable([*shipped.rows, *read_rows(extra), ("zorb", (), ())])
    assert list_all(added) == list_all(whole)
    assert list_all(shipped) == before
    with pytest.raises(ValueError, match=r"circle of .*cell phone"):
        AliasTable.household({"phone": {"kind": "iphone"}})  # of a row that ships


def list_all(table):
    """Everything that a table answers."""
    things = range(len(table.names))
    return (
        table.rows,
        table.names,
        table.longest,
        table.words,
        [table.list_names(thing) for thing in things],
        [table.list_above(thing) for thing in things],
        [table.list_below(thing) for thing in things],
        [table.list_siblings(thing, 9) for thing in things],
        [table.find(split_words(name)) for thing in things for name in table.list_names(thing)],
    )


def test_a_thing_by_another_name_has_the_prior_of_the_thing():
    memory = SceneGraphMemory()
    kitchen = memory.add_room("kitchen")
    for label in ("cabinet", "stove", "drawer"):
        memory.add_furniture(label, kitchen)
    for name in ("fry pan", "frying pan with a red handle", "pair of frying pans"):
        asked = memory.ask([name]).queries.prior
        assert asked.tolist() == memory.ask(["frying pan"]).queries.prior.tolist(), name


@pytest.mark.parametrize(
    ("aliases", "message"),
    [
        ({"a": {"kind": "b"}, "b": {"kind": "a"}}, r"kind must not lead back .* \['a', 'b'\]"),
        ({"a": {"kind": "a"}}, r"circle of \['a'\]"),
        ({"a": "b"}, "aliases must be a list of names, got 'b' for 'a'"),
        ({"a": {"brand": "b"}}, r"fields kind and aliases alone, got \['brand'\]"),
        ({"a": [" "]}, "name must be a non-empty text"),
        ({"a": ["b" * 201]}, "at most 200 characters, got 201"),
        ({"a": [f"b {number}" for number in range(101)]}, "aliases must be at most 100, got 101"),
    ],
)
def test_bad_mappings(aliases, message):
    with pytest.raises(ValueError, match=message):
        AliasTable.household(aliases)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("name,brand\na,b\n", r"columns must be among .*, got \['name', 'brand'\]"),
        ("", "columns must be among"),
        ("name,kind\na,b,c\n", "a row must have 2 cells, got 3 in line 2"),
        ('name\n"a\n', "must be a CSV file"),
        ("name,aliases\n,b\n", "name must be a non-empty text"),
    ],
)
def test_bad_files(tmp_path, text, message):
    path = tmp_path / "own.csv"
    path.write_text(text)
    with pytest.raises(ValueError, match=message):
        list(read_rows(path))


def test_too_long_missing_and_other_things(tmp_path):
    path = tmp_path / "own.csv"
    path.write_text("name\n" + "a\n" * 20_001)
    with pytest.raises(ValueError, match="rows must be at most 20000, got 20001"):
        SceneGraphMemory(aliases=path)
    path.write_bytes(b"name\n\xff\xfe\n")
    with pytest.raises(ValueError, match="text in UTF-8"):
        SceneGraphMemory(aliases=path)
    with pytest.raises(FileNotFoundError, match="CSV file that exists"):
        SceneGraphMemory(aliases=tmp_path / "none.csv")
    with pytest.raises(TypeError, match="mapping or the path of a CSV file, got 3"):
        SceneGraphMemory(aliases=3)


@pytest.mark.parametrize("prior", [PriorGraph.default(), PriorGraph.household()])
def test_descriptions_of_the_shipped_priors_keep_their_types(prior):
    """Whatever adjectives stand before it, a type of several words is not read in parts."""
    vocabulary = Vocabulary(prior, (), AliasTable.household(None))
    for number, row in enumerate(prior.objects):
        for adjectives in product(*row.adjectives):
            description = " ".join([*adjectives, row.label])
            assert vocabulary.find_type(description)[1] == number, description


@pytest.mark.parametrize(
    ("kind", "things"),
    [
        ("drink", ("fanta", "coke", "milk", "coffee")),
        ("cutlery", ("fork", "knife")),
        ("snacks", ("potato chips",)),
        ("food", ("milk", "potato chips", "apple")),
        ("cleaning supplies", ("broom", "dish soap")),
        ("fruit", ("apple",)),
        ("tool", ("hammer",)),
        ("toys", ("teddy bear",)),
        ("clothes", ("wool jacket", "sock")),
    ],
)
def test_a_kind_is_all_things_of_it(kind, things):
    seen = (
        "fanta, coke, milk, coffee, fork, knife, potato chips, apple, broom, dish soap, hammer, "
        "teddy bear, wool jacket, sock, zorb"
    )
    index = NameIndex((), AliasTable.household())
    index.update(seen.split(", "))
    assert index.resolve(kind).matches == things


def test_a_kind_of_ones_own_is_a_row():
    table = AliasTable.household({"tin opener": {"kind": "gadget zoo"}, "zorb": {"kind": "toy"}})
    index = NameIndex((), table)
    index.update(["tin opener", "zorb"])
    assert index.resolve("gadget zoo").matches == ("tin opener",)
    assert index.resolve("toys").matches == ("zorb",)
