"""What a word before the name of a thing does: it says how the thing is, or makes it another one.

"Red", "large", "wooden", "dad's" and "kitchen" say how a thing is or where it belongs: a "red mug"
is a mug. Any other word may make it another thing: a "trash can" is no "soda can", and a "sea lion"
no "lion". So such a word narrows only where a table says so: one of these, or `AliasTable`.
"""

from __future__ import annotations

from functools import lru_cache

from sgm.names.words import unify

# Words that are compared as one, as singulars; other spellings of one word are in `words`.
_ALIKE = {
    "striped": "stripe",
    "stripy": "stripe",
    "stripey": "stripe",
    "wooden": "wood",
    "woolen": "wool",
    "dotted": "dot",
    "spotted": "dot",
    "spotty": "dot",
    "checked": "check",
    "checkered": "check",
    "golden": "gold",
    "tiny": "small",
    "little": "small",
    "mini": "small",
    "big": "large",
    "huge": "large",
    "flowery": "flower",
    "floral": "flower",
    "flowered": "flower",
    "colored": "color",
    "tall": "large",
    "steel": "metal",
    "colorful": "color",
    "metallic": "metal",
    "leathern": "leather",
    "grayish": "gray",
    "uppermost": "upper",
    "righthand": "right",
    "lefthand": "left",
    "1st": "first",
    "2nd": "second",
    "3rd": "third",
    "4th": "fourth",
    "5th": "fifth",
    "6th": "sixth",
    "7th": "seventh",
    "8th": "eighth",
    "9th": "ninth",
    "10th": "tenth",
    "lady": "woman",
    "gentleman": "man",
    "mens": "man",
    "womens": "woman",
    "child": "kid",
    "cuddly": "stuffed",
    "plush": "stuffed",
}
# Properties that shut one another out: what is red is not blue, unless it is said to be both.
COLOURS = frozenset(
    "red blue green yellow black white brown gray orange purple pink beige turquoise "
    "violet navy silver gold cream transparent clear teal maroon cyan magenta lilac khaki "
    "olive tan ivory crimson scarlet indigo burgundy bronze copper rose mint mustard "
    "lavender".split()
)
MATERIALS = frozenset(
    "wood plastic glass metal leather paper ceramic cotton wool stone rubber cardboard "
    "porcelain denim canvas marble bamboo stainless silicone silk linen iron wicker brass "
    "velvet fleece felt rattan straw nylon polyester oak pine walnut tin foam clay "
    "aluminum acrylic suede satin lace mesh concrete granite crystal vinyl fabric knitted "
    "crochet".split()
)
_SIZES = frozenset(("small", "large", "medium"))
_SHAPES = frozenset("round square oval rectangular triangular".split())
_LENGTHS = frozenset(("short", "long"))
_SIDES = frozenset(("left", "right"))
_ENDS = frozenset(("front", "back", "rear"))
_LEVELS = frozenset(("upper", "lower", "middle", "top", "bottom"))
_DEPTHS = frozenset(("inner", "outer"))
_ORDER = frozenset("first second third fourth fifth sixth seventh eighth ninth tenth last".split())
_WINDS = frozenset("north south east west".split())
_AGES = frozenset(("new", "old"))
_SEASONS = frozenset("winter summer autumn".split())
_WEARERS = (  # "kids" are boys and girls, and "adults" women and men
    frozenset("man woman boy girl".split()),
    frozenset(("man", "kid")),
    frozenset(("woman", "kid")),
    frozenset(("adult", "kid")),
    frozenset(("adult", "boy")),
    frozenset(("adult", "girl")),
)
_STATES = (
    frozenset(("open", "closed")),
    frozenset(("clean", "dirty")),
    frozenset(("full", "empty")),
    frozenset(("hot", "cold", "warm")),
    frozenset(("wet", "dry")),
    frozenset(("dark", "light")),
    frozenset(("male", "female")),
    frozenset(("indoor", "outdoor")),
    frozenset(("hard", "soft")),
    frozenset(("thick", "thin")),
    frozenset(("cordless", "corded")),
)
_CLASSES = (
    COLOURS,
    MATERIALS,
    _SIZES,
    _SHAPES,
    _LENGTHS,
    _SIDES,
    _ENDS,
    _LEVELS,
    _DEPTHS,
    _ORDER,
    _WINDS,
    _AGES,
    *_WEARERS,
    *_STATES,
)
# Words that pick one of two or more that are alike but for where they belong.
_PICKING = frozenset().union(
    _SIDES, _ENDS, _LEVELS, _DEPTHS, _ORDER, _WINDS, ("spare", "lowest", "highest")
)
_QUALITIES = frozenset(
    "stripe dot check color flower plain enamel eaten favorite good nice used other spare "
    "extra broken bright cast heavy fluffy cute beautiful bloody stupid damn lovely own "
    "same whole half big fresh frozen fancy cheap expensive sharp blunt modern antique "
    "vintage retro classic common normal regular standard basic simple generic portable "
    "foldable folding inflatable disposable reusable adjustable removable rechargeable "
    "waterproof handmade homemade shiny matte glossy rusty dusty muddy sticky greasy "
    "crumpled torn chipped cracked wide narrow deep shallow flat high low tilted electric "
    "electrical electronic digital analog wireless cordless corded bluetooth wifi usb led "
    "smart automatic manual mechanical solar battery gas double single triple twin "
    "woman man boy girl kid unisex adult junior toddler personal private public shared random "
    "unknown nearby framed".split()
)
# Where it belongs, or when it is used.
_BELONGING = frozenset(
    "kitchen bathroom bedroom livingroom diningroom office garden garage hallway hall "
    "corridor balcony patio basement attic cellar nursery study school gym guest master "
    "outdoor indoor outside inside home household house domestic bedside "
    "wall mounted ceiling floor freestanding standing hanging corner travel camping "
    "picnic beach hiking walking running trekking cycling winter summer rain work "
    "workshop evening gaming everyday sunday christmas easter birthday party wedding "
    "family".split()
)
PROPERTIES = frozenset().union(*_CLASSES, _QUALITIES, _BELONGING)
_NO_PROPERTIES = frozenset(  # nouns with an ending of adjectives
    "bed seed weed reed shed sled feed fly jelly belly lily family dolly dish fish radish polish "
    "goldfish swordfish jellyfish starfish catfish butterfly bird watershed toboggan ply "
    "airbed daybed flowerbed seaweed".split()
)
# Words that say how most things are, and make these things other ones.
_CHANGES = {
    "back": "pack board",
    "bamboo": "shoot",
    "beach": "ball buggy",
    "big": "foot",
    "birthday": "cake card",
    "black": "board bird berry pepper smith",
    "blue": "berry bird",
    "christmas": "tree stocking",
    "clay": "pigeon",
    "cold": "sore",
    "cotton": "ball bud candy pad swab wool",
    "cream": "cheese cracker jug pitcher maker",
    "crystal": "ball",
    "dark": "room",
    "deep": "fryer",
    "double": "bass decker",
    "dry": "cleaner dock",
    "dust": "jacket",
    "easter": "egg bunny",
    "electric": "chair eel",
    "family": "tree",
    "flat": "bread fish iron car",
    "floor": "plan",
    "flower": "bed pot girl",
    "foam": "cutter roller",
    "garden": "egg",
    "gas": "mask station",
    "glass": "cleaner cutter case wiper",
    "gold": "fish",
    "green": "house",
    "half": "pipe",
    "hard": "drive disk hat ware",
    "high": "chair heel",
    "home": "base plate run",
    "hot": "dog plate pot sauce pants rod tub",
    "house": "boat fly key",
    "iron": "board",
    "kitchen": "hood island roll",
    "lavender": "oil plant",
    "leather": "conditioner polish",
    "left": "over",
    "light": "bulb house switch",
    "master": "key",
    "metal": "detector",
    "mint": "tea sauce",
    "mustard": "jar pot",
    "oak": "tree",
    "olive": "oil tree",
    "orange": "juice tree peel",
    "paper": "clip cutter dispenser holder knife mill punch rack roll shredder towel tray trimmer",
    "pine": "apple cone nut tree",
    "plastic": "surgeon wrap",
    "rain": "bow coat drop",
    "red": "bull wood",
    "rose": "bush water",
    "round": "about",
    "rubber": "band plant stamp",
    "school": "bus",
    "second": "hand",
    "short": "cake bread",
    "silver": "fish ware",
    "smart": "phone",
    "soft": "ball",
    "solar": "system panel",
    "spare": "rib tire",
    "square": "root",
    "stone": "mason oven",
    "straw": "berry",
    "tan": "line",
    "tin": "opener can",
    "top": "hat",
    "usb": "stick",
    "walking": "stick cane frame",
    "wall": "paper nut outlet socket",
    "walnut": "meat tree",
    "wedding": "ring cake",
    "wet": "suit wipe",
    "white": "board out",
    "wood": "burner chip chipper pecker stove cutter",
    "wool": "brush",
    "work": "book bench out",
}
_CHANGED = {word: frozenset(heads.split()) for word, heads in _CHANGES.items()}
# Things of which other words before them name a kind: a "claw hammer" is a hammer. Of "can",
# "stand" or "machine" they do not.
_PLAIN_HEADS = frozenset(
    "hammer screwdriver wrench plier saw drill knife scissor shovel rake broom axe ladder "
    "chisel spatula ladle whisk grater peeler corkscrew colander saucepan skillet pan "
    "teapot kettle mug thermos jug pitcher shirt sweater hoodie jacket coat dress skirt "
    "trousers jean boot shoe sneaker sandal slipper sock glove scarf hat helmet poncho "
    "raincoat pajama apron backpack suitcase handbag wallet umbrella blanket quilt duvet "
    "pillow cushion curtain rug carpet towel lamp lantern torch flashlight candle "
    "candlestick chair armchair stool sofa couch bench table desk shelf bookshelf "
    "bookcase wardrobe dresser nightstand cabinet cupboard mirror clock thermometer radio "
    "television tv laptop computer phone telephone smartphone headphone earbud speaker "
    "camera webcam printer scanner router keyboard charger microphone projector guitar "
    "piano violin trumpet flute drum doll bike bicycle scooter skateboard tent basketball "
    "football racket poster painting calendar newspaper magazine notebook crayon stapler "
    "calculator scissors comb razor toothbrush toothpaste shampoo lipstick perfume "
    "necklace book remote bracelet earring wristwatch vase flowerpot toaster blender "
    "microwave refrigerator fridge freezer dishwasher stove sink toilet bathtub vacuum "
    "heater fan novel spoon fork remotecontrol".split()
)
# Words that make even these another thing.
_MAKES_OTHER = frozenset(
    "power life sea stationary toy doll dollhouse model fake pretend stuffed miniature "
    "replica chocolate gingerbread baby pet dog cat bird hamster horse picture photo "
    "drawing air water table bunk sound drum record hair tape heat video ear head web "
    "tele steam hand foot sweat sweeper".split()
)
# What is of one of these is not of another: a "kitchen cabinet", and a "bathroom cabinet".
ROOMS = frozenset(
    "kitchen bathroom bedroom livingroom diningroom office garden garage hallway balcony "
    "patio basement attic cellar nursery".split()
)
_DRINKS = frozenset("coffee tea wine beer water juice whiskey cocktail champagne espresso".split())
_VESSELS = frozenset("mug cup glass bottle jug pitcher carafe tumbler".split())


_USES = (ROOMS, _DRINKS)
# In what a thing is packed, or how it is shaped: a "soap bar" is no "soap bottle".
PACKAGES = frozenset("bottle can box carton bag jar jug tube bar packet roll pouch sachet".split())
_HOW = frozenset().union(*_CLASSES) | frozenset(
    "stripe dot check color flower plain enamel eaten favorite good nice used other spare "
    "extra broken bright heavy paperback hardcover fluffy cute beautiful bloody stupid "
    "damn lovely own same whole half fresh fancy cheap expensive sharp blunt shiny matte "
    "glossy rusty dusty muddy sticky greasy crumpled torn chipped cracked wide narrow "
    "deep shallow tilted cast".split()
)


@lru_cache(maxsize=10_000)
def spell(word: str) -> str:
    """Return a word as it is compared: singular, and words that say the same as one."""
    word = _ALIKE.get(word, word)
    word = unify(word)
    return _ALIKE.get(word, word)


def is_property(word: str) -> bool:
    """Tell whether a word, as it is compared, says how a thing is, and not which kind it is."""
    if word in PROPERTIES:
        return True
    if word in _NO_PROPERTIES or len(word) < 5:
        return False
    return word.endswith(("ed", "ful", "less", "ish"))


def says_how(word: str) -> bool:
    """Tell whether a word says how one thing is, now or to look at, and not of which sort it is.

    "Red", "wooden" and "dirty" do; "digital", "kitchen" and "ski" name a sort.
    """
    return word in _HOW


def picks(word: str) -> bool:
    """Tell whether a word, as it is compared, picks one of several.

    "Left", "upper", "second" and "topmost" do, a letter, and what has a number in it.
    """
    is_mark = len(word) == 1 or any(map(str.isdigit, word))
    return is_mark or word in _PICKING or word.endswith("most")


def narrows(word: str, heads: tuple[str, ...]) -> bool:
    """Tell whether a thing with a word before its name is a thing of that name.

    All are as they are compared. Heads are the last word and the name of the thing, written
    together: "red" narrows "mug", and "trash" does not narrow "can".
    """
    if not _CHANGED.get(word, frozenset()).isdisjoint(heads):
        return False
    if is_property(word) or (word in _DRINKS and heads[0] in _VESSELS):
        return True
    return word not in _MAKES_OTHER and not _PLAIN_HEADS.isdisjoint(heads)


def is_elsewhere(asked: frozenset[str], said: frozenset[str]) -> bool:
    """Tell whether two names say different rooms, or different drinks."""
    return any(asked & group and said & group and not asked & said & group for group in _USES)


def contradict(asked: frozenset[str], said: frozenset[str]) -> bool:
    """Tell whether properties that are asked for shut out those of a name: red, and blue."""
    classes = (*_CLASSES, _SEASONS)
    return any(asked & group and said & group and not asked & said & group for group in classes)
