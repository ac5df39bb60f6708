"""How names are read, and what a question is taken for with the shipped aliases."""

import zlib

import numpy as np
import pytest

from sgm.finder.finder import Finder
from sgm.names.aliases import AliasTable
from sgm.names.name_grammar import NameReader, make_reader
from sgm.names.phrase import strip_question
from simulator import Bayesian, SceneGraphMemory, Sighting


@pytest.mark.parametrize(
    ("name", "things", "owner"),
    [
        ("coffee mug with blue stripes", {"mug"}, ""),
        ("pair of scissors", {"scissors"}, ""),
        ("box of cereal", {"cereal"}, ""),
        ("cup of coffee", {"coffee cup"}, ""),
        ("food for the dog", {"dog food"}, ""),
        ("dad's phone", {"phone"}, "father"),
        ("my daddy's old phone", {"phone"}, "father"),
        ("children's book", {"picture book"}, ""),
        ("men's shoes", {"shoe"}, ""),
        ("tuna in a tin", {"tuna"}, ""),
        ("crisp (potato chip)", {"potato chips"}, ""),
        ("mouse (computer equipment)", {"mouse"}, ""),
    ],
)
def test_the_thing_and_its_owner(name, things, owner):
    table = AliasTable.household()
    reading = make_reader(table).read(name)[0]
    assert {table.names[thing] for thing in reading.things} == things
    assert reading.owner == owner


def test_a_cereal_box_is_both():
    table = AliasTable.household()
    for name in ("cereal box", "box of cereal"):
        found = [table.names[one.things[0]] for one in make_reader(table).read(name)]
        assert found == ["cereal", "box"]


@pytest.mark.parametrize(
    ("question", "name"),
    [
        ("where is the red mug?", "the red mug"),
        ("the remote please", "the remote"),
        ("Can you find my keys?", "my keys"),
        ("I can't find my glasses", "my glasses"),
        ("the book that I was reading", "the book"),
        ("can opener", "can opener"),
        ("do you know where dad's phone is", "dad's phone"),
        ("where", "where"),
        ("?", "?"),
    ],
)
def test_what_people_say_around_a_name(question, name):
    assert strip_question(question) in (name, "")


def make_memory(*seen):
    memory = SceneGraphMemory()
    room = memory.add_room("kitchen")
    table = memory.add_furniture("table", room)
    memory.add_furniture("shelf", room)
    memory.add_furniture("counter", room)
    memory.observe(table, [Sighting(name) for name in seen])
    memory.step()
    return memory


def test_any_words_are_read():
    """Every name has a reading, whatever words of the grammar it is made of."""
    words = (
        "of with in for on box glass pair dog's dad's cup a the ( ) / ' ?! - red where i".split()
    )
    rng = np.random.default_rng(0)
    memory = make_memory("box of cereal", "?", "/", "( )", "red cup for the dog")
    for _ in range(300):
        question = " ".join(rng.choice(words, size=rng.integers(1, 12)).tolist())
        found = memory.resolve(question)
        assert (found.how in ("unknown", "several things")) == (found.matches == ()), question
        assert memory.resolve("question", among=[question]).question == "question"


def test_a_phone_is_no_typo_of_one_iphone():
    memory = make_memory("black iphone", "samsung phone")
    found = memory.resolve("phone")
    assert found.matches == ("black iphone", "samsung phone")
    assert found.how == "any of the kind"


def test_two_things_of_one_name_are_asked_back():
    memory = make_memory("spectacles", "wine glass")
    found = memory.resolve("the glasses")
    assert found.is_ambiguous
    assert found.ask_back == "Do you mean the spectacles or the wine glass?"
    assert found.ask_back in str(found)
    places = Finder(Bayesian()).rank(memory, "the glasses")
    assert places.resolution.matches == ("spectacles", "wine glass")
    one = memory.resolve("spectacles")
    assert not one.is_ambiguous
    assert one.ask_back == ""


def test_owners():
    memory = make_memory("mum's phone", "dad's phone", "wallet")
    assert memory.resolve("my father's phone").matches == ("dad's phone",)
    assert memory.resolve("my father's phone").owner == "father"
    assert memory.resolve("phone").matches == ("mum's phone", "dad's phone")
    assert memory.resolve("grandma's phone").matches == ()
    assert memory.resolve("dad's wallet").matches == ("wallet",)


def test_a_sighting_may_have_an_owner():
    own = Sighting("phone", owner="dad")
    assert own.description == "dad's phone"
    assert Sighting("dad's phone", owner="dad").description == "dad's phone"
    memory = make_memory("phone")
    memory.observe(memory.furniture_ids[1], [own])
    assert memory.resolve("dad's phone").matches == ("dad's phone",)
    with pytest.raises(ValueError, match="owner must be a non-empty text"):
        Sighting("phone", owner=" ")


def test_offers_are_of_the_kind():
    memory = make_memory("umbrella", "backpack", "green mug", "phone charger")
    assert memory.resolve("purse").alternatives == ()
    assert memory.resolve("red mug").alternatives == ("green mug",)


@pytest.mark.parametrize(
    ("remembered", "asked", "shown"),
    [
        ("frying pan", "skillet", "frying pan"),
        ("frying pan", "frying pan", "black cast iron skillet"),
        ("large red mug", "large red mug", "mug"),
        ("cell phone", "phone", "iphone"),
        (None, "scissors", "pair of scissors"),
        (None, "tooth brush", "toothbrush"),
    ],
)
def test_a_search_knows_the_thing_under_any_wording(remembered, asked, shown):
    memory = make_memory(*([remembered] if remembered else []), "lamp")
    search = Finder(Bayesian()).search(memory, asked)
    assert search.next() is not None
    assert not search.seen([Sighting("lamp"), Sighting("blue bowl")])
    assert search.next() is not None
    assert search.seen([Sighting("lamp"), Sighting(shown)])
    assert search.is_found


def test_what_is_known_to_be_another_thing_is_no_find():
    memory = make_memory("large red mug", "mug")
    search = Finder(Bayesian()).search(memory, "large red mug")
    search.next()
    assert not search.seen([Sighting("mug"), Sighting("blue mug")])


def encode(names):
    """Vectors at random by the letters of a name, but for two that are nearly the same."""
    seeds = [zlib.crc32(name.replace("zorb", "glimmer").encode()) for name in names]
    vectors = np.array([np.random.default_rng(seed).normal(size=64) for seed in seeds])
    return vectors + 0.01 * np.array([[name == "zorb"] for name in names])


def test_an_encoder_of_ones_own_decides_what_is_in_no_table():
    memory = SceneGraphMemory(encoder=encode)
    table = memory.add_furniture("table", memory.add_room("kitchen"))
    memory.observe(table, [Sighting("red glimmer"), Sighting("lamp"), Sighting("fleeb")])
    found = memory.resolve("zorb")
    assert (found.matches, found.how) == (("red glimmer",), "similar meaning")
    assert memory.copy().resolve("zorb").matches == ("red glimmer",)
    assert memory.resolve("blue zorb").matches == ()
    assert memory.resolve("hammer").matches == ()


def test_an_encoder_that_gives_something_else():
    with pytest.raises(TypeError, match="encoder must be a function"):
        SceneGraphMemory(encoder=3)
    broken = SceneGraphMemory(encoder=lambda names: [[1.0]])
    table = broken.add_furniture("table", broken.add_room("kitchen"))
    broken.observe(table, [Sighting("glimmer"), Sighting("zorg")])
    with pytest.raises(ValueError, match=r"encoder must give .* finite vectors"):
        broken.resolve("blarf")


@pytest.mark.slow
def test_words_and_things_are_those_of_the_first_reading():
    table = AliasTable.household(None)
    reader = make_reader(table)
    rng = np.random.default_rng(0)
    names = [name for row in table.rows for name in (row[0], *row[2])]
    words = [*names, *"red the dad's box of with in set mug3 ps5 10 case / (old) one".split()]
    mixed = [" ".join(rng.choice(words, rng.integers(1, 5))) for _ in range(1000)]
    for name in [*names, *mixed]:
        reading = reader.read(name)[0]
        text, _ = reader.split_number(name)
        assert reader.read_words(text) == reading.words, name
        assert reader.find_things(text) == reading.things, name


def test_names_that_differ_in_their_number_alone_are_read_once():
    reader = NameReader(AliasTable.household(None))
    one, two = reader.read("red coffee mug 17")[0], reader.read("red coffee mug 18")[0]
    assert (one.instance, two.instance) == ("17", "18")
    assert one._replace(instance="18") == two
    assert one.endings is two.endings
    assert reader._read_text.cache_info().misses == 1
