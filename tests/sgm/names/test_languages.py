"""Another language is a folder of tables: German, and what every folder has to have."""

import re
from datetime import datetime

import pytest

from sgm.finder.finder import Finder
from sgm.finder.service import MemoryService
from sgm.memory.clock import Clock
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.names.aliases import AliasTable
from sgm.names.asking import make_asking
from sgm.names.language import list_languages, load_answers, load_language
from sgm.names.sentence import make_sentence_reader
from sgm.policies import Adaptive

PLACES = {"counter": 0, "drawer": 0, "sink": 0, "fridge": 0, "desk": 1, "sofa": 2}
SEEN = {
    "counter": ("red mug", "blue mug", "wallet"),
    "fridge": ("milk",),
    "desk": ("anna's phone", "tom's phone", "eyeglasses", "keys"),
    "sofa": ("remote control", "cat"),
}


@pytest.fixture(scope="module")
def service():
    memory = SceneGraphMemory(clock=Clock(datetime(2026, 11, 18, 7, 30), 600), language="de")
    for room in ("kitchen", "study", "living room"):
        memory.add_room(room)
    for label, room in PLACES.items():
        place = memory.add_furniture(label, room)
        memory.observe(place, [Sighting(name) for name in SEEN.get(label, ())])
    memory.step(100)
    memory.note_moved("wallet", 1, "anna")
    return MemoryService(memory, Finder(Adaptive()), None)


@pytest.mark.parametrize(
    ("asked", "kind", "said"),
    [
        ("Wo ist der rote Becher?", "where", "Der rote Becher ist"),
        ("Ich finde meine Brille nicht", "where", "Die Brille ist"),
        ("Ich suche die Schlüssel.", "where", "Die Schlüssel sind"),
        ("nicht der rote Becher", "where", "Der blaue Becher ist"),
        ("beide Becher", "where", "Der rote Becher ist"),
        ("die Schlüssel und der Geldbeutel", "where", "Der Geldbeutel ist"),
        ("das Telefon von Anna", "where", "Annas Telefon ist"),
        ("Wo ist die Fernbedienung?", "where", "Sofa, Wohnzimmer"),
        ("Kannst du mir bitte sagen, wo die Brille ist?", "where", "Schreibtisch, Arbeitszimmer"),
        ("Wo waren die Schlüssel gestern Morgen?", "past", "Die Schlüssel waren"),
        ("Wo habe ich die Brille gestern hingelegt?", "past", "Die Brille war"),
        ("Wo wird die Brille morgen sein?", "future", "Die Brille"),
        ("Ist die Katze auf dem Sofa?", "is_at", "Ja, die Katze ist"),
        ("Ist die Katze in der Küche?", "is_at", "Wahrscheinlich nicht"),
        ("Was ist im Kühlschrank?", "what_at", "Milch"),
        ("In welchem Zimmer ist die Katze?", "room", "Wohnzimmer"),
        ("Hat jemand meinen Geldbeutel bewegt?", "moved", "Ja."),
        ("Wie viele Becher gibt es?", "count", "Ich kenne 2"),
        ("Wann hast du zuletzt die Katze gesehen?", "when", "gestern um 7:30 Uhr"),
        ("Wo ist das Getränk?", "where", "Kühlschrank"),
        ("der Becher, der nicht rot ist", "where", "Der blaue Becher"),
        ("nicht Annas Telefon, das andere", "where", "Toms Telefon"),
        ("etwas Rotes", "where", "Der rote Becher"),
        ("Was war gestern im Kühlschrank?", "what_at", "Milch"),
        ("Ist die Katze auf dem Sofa oder in der Spüle?", "is_at", "Sofa"),
        ("Wann lagen die Schlüssel auf dem Schreibtisch?", "when_at", "Schreibtisch"),
        ("War die Katze schon mal in der Spüle?", "when_at", "nie"),
        ("Die Katze ist nicht in der Spüle, wo ist sie dann?", "where", "Sofa"),
    ],
)
def test_a_german_sentence_is_answered_in_german(service, asked, kind, said):
    answer = service.ask(asked)
    assert (answer.status, answer.kind) == ("ok", kind), answer.said
    assert said in answer.said


@pytest.mark.parametrize(
    ("asked", "ask"),
    [
        ("mein Telefon", "Meinst du: Annas Telefon oder Toms Telefon?"),
        ("Wo ist es?", "Was meinst du mit 'es'?"),
        ("Zorb", "Nichts ist bekannt als 'Zorb'."),
        ("der Becher in der Spüle", "Dort ist keiner bekannt"),
        ("Wo ist der Becher auf dem Mond?", "Das verstehe ich nicht"),
        ("Was liegt unter dem Sofa?", "Ich weiß, was in, auf oder an einem Platz ist"),
        ("der Geldbeutel von Peter", "Das verstehe ich nicht"),
        ("Ich habe die Schlüssel in die Schublade gelegt", "Ich kann nur sagen"),
    ],
)
def test_what_was_not_understood_is_asked_in_german(service, asked, ask):
    answer = service.ask(asked)
    assert answer.status != "ok"
    assert ask in answer.ask


def test_calls_that_write_know_german_names():
    memory = SceneGraphMemory(language="de")
    kitchen = memory.add_room("kitchen")
    counter = memory.add_furniture("counter", kitchen)
    drawer = memory.add_furniture("drawer", kitchen)
    memory.observe(counter, [Sighting("red mug"), Sighting("Zahnbürste")])
    service = MemoryService(memory, Finder(Adaptive()), None)
    noted = service.note_moved("den roten Becher", "die Schublade", "anna")
    assert (noted.status, noted.thing, noted.place) == ("ok", "red mug", drawer)
    assert service.where_is("toothbrush").taken_for == ("Zahnbürste",)
    assert memory.copy().language == "de"
    assert service.where_is("mein Becher", speaker="Anna").taken_for == ("red mug",)


@pytest.mark.parametrize("code", list_languages())
def test_a_folder_has_all_that_is_said(code):
    english, answers = load_answers("en"), load_answers(code)
    for sentence, text in english["ask"].items():
        if sentence in answers["ask"]:
            names = set(re.findall(r"{(\w+)}", answers["ask"][sentence]))
            assert names <= set(re.findall(r"{(\w+)}", text)) | {"is", "was", "has", "thing"}
    assert set(english["ask"]) <= set(answers["ask"])
    assert {"the", "or", "and", "is", "was", "has"} <= set(answers["names"])
    language = load_language(code)
    assert {kind for kind, _ in language.questions} <= {k for k, _ in load_language("en").questions}
    make_sentence_reader(code)
    make_asking(code)


def test_german_names_are_of_things_of_the_table():
    rows = load_language("de").names
    assert len(rows) >= 250
    table = AliasTable.household(language="de")
    for name, gender, words in rows:
        assert gender in "mfnp", name
        for word in words:
            assert word
    assert table.find(["tasse"])
    assert table.language == "de"
    assert AliasTable.household().language == "en"


def test_a_language_that_there_is_not():
    with pytest.raises(ValueError, match=r"language must be one of de, en, got 'xx'\."):
        SceneGraphMemory(language="xx")
