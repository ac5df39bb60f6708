"""Names that are nearly alike: what acts on a thing, what answers, and what is another thing."""

import pytest

from sgm import Bayesian, Finder, SceneGraphMemory, Sighting
from sgm.finder.service import MemoryService
from sgm.names.instances import split_instance
from sgm.names.name import Name
from sgm.names.words import read_name, read_words

# Known, and what is named: another thing, however near the name is.
OTHER_THINGS = [
    ("metoprolol", "metoprolone"),
    ("amlodipine", "amlodipin"),
    ("left mitten", "right mitten"),
    ("hdmi-a cable", "hdmi-b cable"),
    ("drill bit 6mm", "drill bit 8mm"),
    ("bolt m4x20", "bolt m5x20"),
    ("saddle", "paddle"),
    ("sickle", "tickle"),
    ("collar", "dollar"),
    ("upper drawer", "lower drawer"),
    ("small funnel", "large funnel"),
    ("gray tarp", "green tarp"),
    ("size 38 ring", "size 39 ring"),
    ("router ax55", "router ax53"),
    ("front wheel", "rear wheel"),
    ("vitamin b", "vitamin d"),
    ("aa battery", "aaa battery"),
    ("tube_1", "tube_2"),
    ("pan", "pen"),
    ("bottle", "battle"),
    ("first notebook", "second notebook"),
    ("fuse 10a", "fuse 16a"),
    ("rook", "book"),
]
# One name, written otherwise.
SAME_NAMES = [
    ("grey tarp", "Gray tarps"),
    ("the tyre lever", "tire lever"),
    ("jewellery tray", "jewelry trays"),
    ("ash-tray", "ashtray"),
    ("Crème brûlée", "creme brulee"),
    ("TapeMeasure", "tape measure"),
    ("\uff26\uff35\uff2e\uff2e\uff25\uff2c", "funnel"),
    ("fun\u200bnel", "funnel"),
    ("long blue tarp", "blue long tarp"),
    ("tube_02", "Tube 2"),
    ("loaves", "loaf"),
    ("tomatoes", "tomato"),
    ("ǆezva", "džezva"),
]
# Seen, asked: what is asked for is less, and the other way round it may be another thing.
BROADER = [
    ("bicycle pump", "pump"),
    ("scrubbing brush", "brush"),
    ("paint roller", "roller"),
    ("window opener", "opener"),
    ("fire hose", "hose"),
]
# Seen, asked: the name of the kind, and how it is.
SAY_NOTHING_NEW = [
    ("doll", "toy doll"),
    ("ale", "ale beer"),
    ("guitar", "guitar musical instrument"),
    ("stapler", "dented stapler"),
    ("stapler", "unsharpened stapler"),
    ("scarf", "scarf knitted"),
    ("beer", "pint of beer"),
]
# Seen, asked, and the word that nothing was made of.
NOT_READ = [
    ("kettle", "broken kettle", "broken"),
    ("mug", "chipped mug", "chipped"),
    ("stapler", "frobnicated stapler", "frobnicated"),
]
# Seen, asked: the last word alone says nothing.
NO_FINDS = [
    ("compost bin", "bread bin"),
    ("petrol can", "watering can"),
    ("hole cutter", "glass cutter"),
    ("drum kit", "sewing kit"),
    ("cake tin", "biscuit tin"),
    ("camera case", "camera"),
    ("violin case", "violin"),
    ("bottle rack", "bottle"),
    ("coat rack", "coat"),
    ("sea otter", "otter"),
    ("hat stand", "hat"),
    ("milk can", "milk"),
    ("honey dipper", "honey"),
    ("plant stand", "plant"),
    ("butter knife block", "butter"),
    ("license plate", "plate"),
    ("cream of tartar", "cream"),
    ("power shovel", "shovel"),
    ("tea towel rail", "tea towel"),
]


# Seen, asked: two sorts of one thing, or a sort of what is more general.
OTHER_SORTS = [
    ("pepsi", "fanta"),
    ("spaghetti", "penne"),
    ("scrabble", "monopoly"),
    ("scotch", "bourbon"),
    ("cat collar", "dog collar"),
    ("dog bowl", "cat bowl"),
    ("xbox", "playstation"),
    ("security camera", "digital camera"),
    ("cowboy hat", "felt hat"),
    ("wool coat", "parka"),
    ("necktie", "bow tie"),
    ("medicine", "tablet"),
    ("swimming trunks", "trunk"),
    ("bottle of rum", "rum jug"),
    ("dust jacket", "jacket"),
    ("bus pass", "train ticket"),
]
# Seen, asked: the same thing, a kind of it, or what it is more generally.
OTHER_WORDS = [
    ("fanta", "soda"),
    ("soda", "fanta"),
    ("snorkel mask", "snorkelling mask"),
    ("alexa", "smart speaker"),
    ("racing helmet", "race helmet"),
    ("leather sofa", "couch"),
    ("airpods case", "earbuds case"),
    ("nintendo switch", "the switch"),
    ("cupboard", "kitchen cabinet"),
    ("cell phone", "mobile phone"),
    ("sports ball", "football"),
]


@pytest.mark.parametrize(("known", "named"), OTHER_THINGS)
def test_what_acts_leaves_a_near_name_alone(make_service, known, named):
    calls = (
        lambda one: one.forget(named, by="anna"),
        lambda one: one.rename(named, "thing of mine"),
        lambda one: one.merge(named, "umbrella"),
        lambda one: one.split(named, "counter", "another"),
        lambda one: one.picked_up(named),
    )
    for call in calls:
        service = make_service(known, "umbrella")
        before = service.memory.to_dict()
        noted = call(service)
        assert noted.status == "ambiguous", noted
        assert noted.candidates == (known,)
        assert known in noted.ask
        assert service.memory.to_dict() == before
        assert service.memory.carried == ()
    service = make_service(known)
    service.picked_up(known)
    assert service.put_down(named, "drawer").status == "ambiguous"
    assert service.memory.carried == (known,)


@pytest.mark.parametrize(("known", "named"), OTHER_THINGS)
def test_what_is_said_or_seen_of_a_near_name_is_a_new_thing(make_service, known, named):
    for note in (
        lambda one: one.note_moved(named, "drawer", "anna"),
        lambda one: one.observe("drawer", [Sighting(named)]),
    ):
        service = make_service(known)
        assert note(service).status == "ok"
        assert set(service.memory.descriptions) == {known, named}
        assert service.memory.last_seen(known).furniture == 0
        assert service.memory.last_seen(named).furniture == 1


@pytest.mark.parametrize(("known", "named"), OTHER_THINGS)
def test_a_question_is_not_answered_with_a_near_name(make_service, known, named):
    answer = make_service(known).where_is(named)
    assert answer.taken_for == ()
    assert answer.status in ("ambiguous", "unknown")


@pytest.mark.parametrize(("known", "named"), SAME_NAMES)
def test_the_spelling_of_one_name_makes_no_difference(make_service, known, named):
    assert Name.read(known).is_same(Name.read(named))
    service = make_service(known)
    assert service.where_is(named).taken_for == (known,)
    assert service.picked_up(named).thing == known
    assert service.put_down(named, "drawer").thing == known
    assert service.forget(named).status == "ok"
    assert service.memory.descriptions == ()


@pytest.mark.parametrize(("known", "named"), OTHER_THINGS[:6])
def test_calls_of_the_memory_itself_are_as_strict(make_service, known, named):
    memory = make_service(known).memory
    for call in (memory.forget, memory.picked_up, lambda name: memory.rename(name, "mine")):
        with pytest.raises(ValueError, match="must be named exactly") as raised:
            call(named)
        assert known in str(raised.value)
    assert memory.descriptions == (known,)


def test_an_alias_that_a_person_declared_is_exact_and_a_shipped_one_is_not():
    memory = SceneGraphMemory(aliases={"tarp": ["ground sheet"]})
    shelf = memory.add_furniture("shelf", memory.add_room("hall"))
    memory.observe(shelf, [Sighting("tarp"), Sighting("sofa pillow")])
    assert memory.resolve_exact("ground-sheet").matches == ("tarp",)
    assert memory.resolve("cushion").matches == ("sofa pillow",)
    assert memory.resolve_exact("cushion").matches == ()
    assert memory.resolve_exact("cushion").doubtful == ("sofa pillow",)


@pytest.mark.parametrize(("seen", "asked"), NO_FINDS)
def test_another_word_before_it_is_another_thing(make_service, seen, asked):
    service = make_service(seen)
    assert service.where_is(asked).taken_for == ()
    search = service.finder.search(service.memory, asked)
    search.next()
    assert not search.seen([Sighting(seen)])


@pytest.mark.parametrize(("seen", "asked"), OTHER_SORTS)
def test_one_sort_is_not_taken_for_another(make_service, seen, asked):
    assert make_service(seen).memory.resolve(asked).matches == ()


@pytest.mark.parametrize(("seen", "asked"), OTHER_WORDS)
def test_other_words_for_a_thing_find_it(make_service, seen, asked):
    assert make_service(seen).memory.resolve(asked).matches == (seen,)


@pytest.mark.parametrize(("seen", "asked"), BROADER)
def test_a_compound_is_found_by_its_last_word_and_not_the_other_way_round(
    make_service, seen, asked
):
    assert make_service(seen).memory.resolve(asked).matches == (seen,)
    assert make_service(asked).memory.resolve(seen).matches == ()


@pytest.mark.parametrize(("seen", "asked"), SAY_NOTHING_NEW)
def test_what_says_nothing_new_changes_nothing(make_service, seen, asked):
    assert make_service(seen).where_is(asked).taken_for == (seen,)


@pytest.mark.parametrize(("seen", "asked", "word"), NOT_READ)
def test_what_may_be_another_one_is_asked_back(make_service, seen, asked, word):
    answer = make_service(seen).where_is(asked)
    assert (answer.status, answer.candidates) == ("ambiguous", (seen,))
    assert word in answer.ask


def test_a_label_with_a_number_is_the_one_thing_that_has_none(make_service):
    assert make_service("soap bottle").where_is("soap_bottle_3").status == "ok"
    assert make_service("soap bottle").where_is("soap bottle 3").status == "ambiguous"
    assert make_service("soap bottle 1").where_is("soap_bottle_3").status == "unknown"
    assert make_service("red mug", "blue mug").where_is("mug_3").status == "ambiguous"


def test_a_word_of_two_things_is_none_of_those_that_are_surely_the_other(make_service):
    service = make_service("laptop", "notebook")
    for asked, meant in (
        ("notebook computer", "laptop"),
        ("macbook", "laptop"),
        ("notebook", "notebook"),
    ):
        assert service.where_is(asked).taken_for == (meant,)
    assert make_service("notebook").where_is("laptop").taken_for == ("notebook",)


def test_a_short_slip_beside_right_words_is_mended(make_service):
    service = make_service("frying pan", "car keys", "house keys", "vacuum cleaner")
    for asked, meant in (
        ("frying pann", "frying pan"),
        ("car kees", "car keys"),
        ("vaccum cleaner", "vacuum cleaner"),
    ):
        assert service.where_is(asked).taken_for == (meant,)
    assert service.where_is("hose keys").status == "ambiguous"  # "hose" is a word


def test_a_doubtful_sighting_is_offered(make_service):
    service = make_service("piano bench")
    service.observe("drawer", [Sighting("barrel lid")])
    answer = service.where_is("lid")
    assert (answer.status, answer.candidates) == ("ambiguous", ("barrel lid",))
    search = service.finder.search(service.memory, "lid")
    search.next()
    assert not search.seen([Sighting("barrel lid"), Sighting("spanner")])
    assert search.offered == ("barrel lid",)


@pytest.mark.parametrize(
    ("seen", "asked"),
    [("bread box", "bread"), ("pill box", "pills"), ("jam jar", "jam"), ("zorb charger", "zorb")],
)
@pytest.mark.parametrize("is_known", [False, True])
def test_what_holds_it_ends_no_search(make_service, seen, asked, is_known):
    service = make_service(*([seen] if is_known else ["spanner"]))
    search = service.finder.search(service.memory, asked)
    search.next()
    assert not search.seen([Sighting(seen)])
    assert search.offered == (seen,)
    search.next()
    assert search.seen([Sighting(asked)])


def test_what_was_found_is_not_what_holds_it(make_service):
    memory = make_service("bread box").memory
    before = [str(row) for row in memory.history("bread box")]
    search = Finder(Bayesian()).search(memory, "bread")
    search.next()
    search.found()
    assert [str(row) for row in memory.history("bread box")] == before
    assert "bread" in memory.descriptions


@pytest.mark.parametrize(
    ("seen", "asked"),
    [
        ("front door key", "back door key"),
        ("upper bunk sheet", "lower bunk sheet"),
        ("rear bike light", "front bike light"),
        ("inner tyre tube", "outer tyre tube"),
    ],
)
def test_what_picks_one_of_several_ends_no_search_for_another(make_service, seen, asked):
    service = make_service("spanner")
    search = service.finder.search(service.memory, asked)
    search.next()
    assert not search.seen([Sighting(seen)])


@pytest.mark.parametrize(
    ("seen", "asked"),
    [
        ("tan leather glove", "glove"),
        ("anna's helmet", "helmet"),
        ("kitchen stool", "stool"),
        ("muddy boot", "boot"),
        ("left slipper", "slipper"),
        ("old striped scarf", "scarf"),
    ],
)
def test_what_says_how_it_is_narrows(make_service, seen, asked):
    assert make_service(seen).where_is(asked).taken_for == (seen,)


@pytest.mark.parametrize(
    ("named", "words", "instance"),
    [
        ("ladle_1", "ladle", "1"),
        ("red ladle 12", "red ladle", "12"),
        ("ladle.007", "ladle", "7"),
        ("Ladle_9c1f", "ladle", "9c1f"),
        ("ladle (3)", "ladle", "3"),
        ("ladle #3", "ladle", "3"),
        ("scone.n.01_2", "scone", "2"),
        ("scone.n.01", "scone", ""),
        ("bottom_cabinet_qxzrtk_0", "bottom cabinet", "qxzrtk 0"),
        ("SoapBar|+00.10|-01.20", "soap bar", "+00.10|-01.20"),
        ("facade", "facade", ""),
        ("bolt m4x20", "bolt m4x20", ""),
        ("3", "3", ""),
        ("ladle[3]", "ladle", "3"),
        ("ladle@3", "ladle", "3"),
        ("ladle no. 3", "ladle", "3"),
        ("ladle №3", "ladle", "3"),
        ("ladle nr 3", "ladle", "3"),
        ("ladle id 3", "ladle", "3"),
        ("ladle_id3", "ladle", "3"),
        ("ladle_track3", "ladle", "3"),
        ("ladle_instance_3", "ladle", "3"),
        ("railway track 3", "railway track", "3"),
        ("017_red_ladle", "red ladle", "17"),
        ("017_ladle_2", "ladle", "17 2"),
        ("501 jeans", "501 jeans", ""),
        ("0 7", "0 7", ""),
        ("track_3_ladle", "ladle", "3"),
        ("obj 3 red ladle", "red ladle", "3"),
        ("[3] ladle", "ladle", "3"),
        ("#3 ladle", "ladle", "3"),
        ("3: ladle", "ladle", "3"),
        ("ladle (id 3)", "ladle", "3"),
        ("ladle_id:3", "ladle", "3"),
        ("ladle_obj_3", "ladle", "3"),
        ("ladle<3>", "ladle", "3"),
        ("ladle{3}", "ladle", "3"),
        ("ladle~3", "ladle", "3"),
        ("ladle (3", "ladle (3", ""),
        ("3 ladles", "3 ladles", ""),
        ("勺子3", "勺子", "3"),
        ("スプーン_3", "スプーン", "3"),
        ("zorb3", "zorb3", ""),
    ],
)
def test_a_counter_is_no_word(named, words, instance):
    assert split_instance(named) == (words, instance)


def test_numbered_things_are_asked_for_together_and_one_by_one(make_service):
    service = make_service("ladle_1", "Ladle 2", "red ladle 3", "whisk.001", "SoapBottle_4", "cup7")
    assert service.where_is("ladle").taken_for == ("ladle_1", "Ladle 2", "red ladle 3")
    assert service.where_is("ladle 2").taken_for == ("Ladle 2",)
    assert service.where_is("ladle_03").taken_for == ("red ladle 3",)
    assert service.where_is("ladle 9").taken_for == ()
    assert service.where_is("the whisk").taken_for == ("whisk.001",)
    assert service.where_is("soap bottle").taken_for == ("SoapBottle_4",)
    assert service.where_is("cup").taken_for == ("cup7",)


@pytest.mark.parametrize(
    ("one", "other", "is_one"),
    [
        ("PS5", "ps 5", True),
        ("WD40", "wd-40", True),
        ("smørebrett", "smorebrett", True),
        ("Łódź poster", "lodz poster", True),
        ("ps5 1", "ps 51", False),
        ("ps5", "ps 6", False),
        ("b1 2", "b 12", False),
        ("ladle", "ladle 1", False),
        ("017_ladle", "018_ladle", False),
    ],
)
def test_a_number_may_be_written_apart(make_service, one, other, is_one):
    service = make_service(one)
    assert (service.where_is(other).taken_for == (one,)) >= is_one
    assert (service.forget(other, by="ann").status == "ok") == is_one


@pytest.mark.parametrize("word", ["badger", "anvil", "lantern", "cobra", "sickle"])
def test_a_word_is_no_typo(make_service, word):
    service = make_service("badge", "anvils case", "lanterns oil", "copra", "pickle")
    assert word not in service.where_is(word).taken_for
    assert service.memory.resolve(word).how != "typo"


def test_a_slip_is_mended_and_leads_to_no_synonym(make_service):
    memory = make_service("spatula", "couch").memory
    assert memory.resolve("spatulla").matches == ("spatula",)
    assert memory.resolve("settte").matches == ()


@pytest.mark.parametrize("name", ["\u200b", "\u2060\ufeff", "\u3164", "\u00ad"])
def test_what_shows_nothing_is_no_name(name):
    with pytest.raises(ValueError, match="description must be a non-empty text"):
        read_words("description", name)
    assert read_name(f"tr{name}ay") == ("tray",)


def test_a_question_for_a_place_or_a_room_is_answered_with_it():
    memory = SceneGraphMemory()
    hall, den = memory.add_room("hall"), memory.add_room("den")
    fridge = memory.add_furniture("fridge", hall, "white fridge")
    tables = [memory.add_furniture("table", hall), memory.add_furniture("table", den)]
    memory.observe(fridge, [Sighting("milk", "in")])
    service = MemoryService(memory, Finder(Bayesian()), None)
    for asked in ("fridge", "where is the white fridge?", "refrigerator", "hall fridge"):
        answer = service.where_is(asked)
        assert (answer.status, answer.asked_for) == ("ok", "place")
        assert [(one.place, one.probability) for one in answer.places] == [(fridge, 1.0)]
        assert answer.places[0].why == "it is this place"
    assert [one.place for one in service.where_is("table").places] == tables
    ranking = service.finder.rank(memory, "den table")
    assert [place.furniture for place in ranking] == tables[1:]
    room = service.where_is("the den")
    assert (room.asked_for, [one.place for one in room.places]) == ("room", tables[1:])
    assert "it is no thing to look for" in service.search_start("fridge").outcome
    assert service.where_is("milk").asked_for == "thing"
    memory.observe(tables[0], [Sighting("table")])  # a toy, perhaps: it was seen as a thing
    assert service.where_is("table").asked_for == "thing"


@pytest.mark.parametrize(
    ("question", "unread"),
    [
        ("plastic hammer", ("plastic",)),
        ("metal hammer", ()),
        ("leather belt", ()),
        ("wooden belt", ("wooden",)),
        ("peter's belt", ("peter's",)),
        ("campbell's soup", ()),
        ("the soup that is not zorby", ("zorby",)),
    ],
)
def test_a_material_or_an_owner_that_no_name_has_is_asked_back(question, unread):
    memory = SceneGraphMemory()
    shelf = memory.add_furniture("shelf", memory.add_room("garage"))
    memory.observe(shelf, [Sighting(name) for name in ("hammer", "belt", "soup")])
    resolution = memory.resolve(question)
    assert resolution.unused == unread
    assert resolution.is_ambiguous == bool(unread)


@pytest.mark.parametrize(
    ("question", "matches"),
    [
        ("laptops", ("anna's laptop", "tom's laptop")),
        ("notebook", ("notebook",)),
        ("peter's laptop", ()),
        ("a drink without milk", ("juice",)),
    ],
)
def test_what_may_be_so_called_is_none_beside_what_is(question, matches):
    memory = SceneGraphMemory()
    shelf = memory.add_furniture("shelf", memory.add_room("garage"))
    names = ("anna's laptop", "tom's laptop", "notebook", "milk", "juice")
    memory.observe(shelf, [Sighting(name) for name in names])
    assert memory.resolve(question).matches == matches
