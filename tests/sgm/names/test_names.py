"""What a question is taken for: the table of docs/robot/names.md, rule by rule."""

import re
from itertools import product
from pathlib import Path

import pytest

from sgm.names.name_index import NameIndex
from sgm.names.spelling import count_mistakes
from sgm.names.words import compute_singular, read_name

SEEN = (
    "kettle",
    "large red mug",
    "blue mug",
    "remote control",
    "umbrella",
    "cell phone",
    "salt shaker",
    "sneakers",
    "Anna's keys",
    "knife",
    "scissors",
    "desk lamp",
)
TYPES = ("mug", "remote control", "cell phone", "salt shaker", "kettle", "desk lamp", "knife")
PAGE = Path(__file__).resolve().parents[3].joinpath("docs", "robot", "names.md").read_text("utf-8")


@pytest.fixture
def index():
    names = NameIndex(TYPES)
    names.update(SEEN)
    return names


@pytest.mark.parametrize(
    ("question", "matches", "how"),
    [
        ("kettle", ["kettle"], "exact"),
        ("Anna's keys", ["Anna's keys"], "exact"),
        ("the kettle", ["kettle"], "same words"),
        ("Where is my kettle?", ["kettle"], "same words"),
        ("red large mug", ["large red mug"], "same words"),
        ("RED_LARGE_MUG", ["large red mug"], "same words"),
        ("salt shakers", ["salt shaker"], "same words"),
        ("knives", ["knife"], "same words"),
        ("scissor", ["scissors"], "same words"),
        ("mug", ["large red mug", "blue mug"], "any of the kind"),
        ("red mugs", ["large red mug"], "any of the kind"),
        ("keys", ["Anna's keys"], "any of the kind"),
        ("remote", [], "unknown"),  # a table knows better
        ("my phone", ["cell phone"], "any of the kind"),
        ("umbrela", ["umbrella"], "typo"),
        ("umbrealla", ["umbrella"], "typo"),
        ("larg red mug", ["large red mug"], "fewer words"),  # too short to be mended
        ("green mug", [], "unknown"),
        ("mig", [], "unknown"),
        ("lamp desk", [], "unknown"),
        ("wrench", [], "unknown"),
    ],
)
def test_a_question_is_taken_for(index, question, matches, how):
    resolution = index.resolve(question)
    assert (list(resolution.matches), resolution.how) == (matches, how)


def test_other_things_of_the_kind_are_offered(index):
    assert index.resolve("green mug").alternatives == ("large red mug", "blue mug")
    assert index.resolve("red mug").alternatives == ("blue mug",)
    line = str(index.resolve("red mug"))
    assert line == "red mug (taken for large red mug: any of the kind) (did you mean blue mug?)"
    assert str(index.resolve("kettle")) == "kettle"


def test_kinds_that_mean_the_same_by_their_vectors(index):
    alike = {("cup", "mug"): 0.96, ("plate", "knife"): 0.85}

    def compare(label, others):
        return [alike.get((label, other), 0.0) for other in others]

    assert index.resolve("red cup", compare).matches == ("large red mug",)
    assert index.resolve("cup", compare).how == "similar meaning"
    assert index.resolve("green cup", compare).matches == ()
    plate = index.resolve("plate", compare)
    assert (plate.matches, plate.alternatives) == ((), ("knife",))


def test_removed_and_new_descriptions_are_noticed(index):
    index.update([*SEEN[1:], "red kettle"])
    assert index.resolve("kettle").matches == ("red kettle",)
    index.update([])
    assert index.resolve("kettle").how == "unknown"


def test_what_tells_one_thing_from_another():
    assert read_name("The large, red mug!") == read_name("red large MUG")
    assert read_name("desk lamp") != read_name("lamp desk")
    assert read_name("plates") != read_name("plate")
    assert read_name("my") == ("my",)
    assert read_name("?!") == ("?!",)


@pytest.mark.parametrize(
    ("plural", "singular"),
    [
        ("mugs", "mug"),
        ("dishes", "dish"),
        ("boxes", "box"),
        ("glasses", "glass"),
        ("cherries", "cherry"),
        ("shelves", "shelf"),
        ("bus", "bus"),
        ("glass", "glass"),
        ("chassis", "chassis"),
        ("watches", "watch"),
    ],
)
def test_plurals(plural, singular):
    assert compute_singular(plural) == singular


@pytest.mark.parametrize(
    ("one", "other", "mistakes"),
    [("mug", "mug", 0), ("umbrela", "umbrella", 1), ("kettel", "kettle", 1), ("abc", "", 3)],
)
def test_mistakes_counted_by_hand(one, other, mistakes):
    assert count_mistakes(one, other) == count_mistakes(other, one) == mistakes


def test_more_mistakes_than_are_asked_for_are_more():
    """A comparison that stops early says of no pair that it is nearer, or farther, than it is."""
    words = ["".join(letters) for length in range(5) for letters in product("ab", repeat=length)]
    for one, other in product(words, repeat=2):
        mistakes = count_mistakes(one, other)
        for most in range(4):
            found = count_mistakes(one, other, most)
            assert found == mistakes if mistakes <= most else found > most, (one, other, most)


def test_the_examples_of_the_page_hold():
    """Rows of the table of names: question, what was seen, how it is taken."""
    rows = re.findall(r"^\| `([^`]+)` \| `([^`]+)` \| ([^|]+) \|$", PAGE, re.MULTILINE)
    assert len(rows) >= 8
    for question, seen, how in rows:
        names = NameIndex(TYPES)
        names.update([seen])
        resolution = names.resolve(question, lambda label, others: [0.96] * len(others))
        assert (resolution.matches, resolution.how) == ((seen,), how.strip()), question


def test_names_are_checked():
    with pytest.raises(ValueError, match="description must be a non-empty text, got ' '"):
        NameIndex().resolve(" ")
