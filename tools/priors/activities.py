"""What people use where, by kind of activity: read from BEHAVIOR's definitions.

`python -m tools.priors activities --out FILE` writes the table that
`simulator.world.routine.activity_kinds` loads; the package `bddl` is needed for that alone.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from sgm.files import read_table
from simulator.priors.types import load_names
from tools.priors.behavior import find_places, find_synset, parse_expression, walk_facts
from tools.priors.counts import PlacementCounts
from tools.priors.packages import find_package_data

# An activity is of the first kind of which a part of its name is one of these words. Names that
# are of none, garden and car for the most part, are left out and listed.
KIND_WORDS: Mapping[str, str] = {
    "washing up": (
        "dish|wash_baby_bottles|washing_bowls|washing_plates|washing_pots|washing_utensils|rinsing|"
        "clearing_|cleaning_up_after_a_meal|cleaning_up_plates|clean_cups|wine_glasses|"
        "after_dinner|leftovers|cleaning_cups|cleaning_glasses|cleaning_table_after|copper_mugs"
    ),
    "eating": (
        "serving_|set_a_|setting_the_table|setting_table|laying_out_a_feast|laying_restaurant|"
        "getting_a_drink|making_a_drink|making_a_snack|pouring|pour_|coffee|tea_|iced_tea|"
        "passing_out_drinks|putting_meal_on|buffet|stash_snacks|mixing_drinks|condiments|"
        "breakfast_bar|wine_and_cheese"
    ),
    "leaving": (
        "pack_|packing_|shopping|buy_|buying_|groceries|mail|library|picking_up_take|"
        "picking_up_prescriptions|picking_up_baggage|loading_the_car|sending|returning|paying|"
        "getting_package|getting_organized|backpack_in_car|bringing_newspaper"
    ),
    "cooking": (
        "cook|bake|roast|fry|grill|boil|make_|toast|prepare_|preparing|chop|slicing|halve|melt|"
        "heat|thaw|freez|can_|canning|store_honey|store_nuts|store_produce|store_whole|"
        "store_brown|store_beer|storing_food|preserv|saute|glaze|meat|food|fridge|vegetables|"
        "fruit|cool_cakes|warm_|filling_salt|filling_sugar|filling_pepper|bottling|making_a_meal"
    ),
    "grooming": "bathroom|towel|toilet|denture|razor|nail|invisalign|prescription|spa_|hair",
    "dressing": (
        "cloth|laundry|iron|dress|wardrobe|fold|linen|delicates|jeans|wash_a_|shoes|boots|"
        "sneakers|belt|_hat|coat|sheets|quilt|lint|sunglasses|watch|leotard"
    ),
    "reading": "book|newspaper|magazine",
    "work": (
        "office|desk|computer|printer|modem|scanner|fax|document|file|pencil|school|keyboard|"
        "electronics|monitor|calculator|webcam"
    ),
    "play": (
        "toy|game|movie|party|guitar|piano|violin|trumpet|trombone|saxophone|art_|hobby|doll|"
        "sport|ball|tennis|skate|radio|crib|teddy|train_track|living_room_for_guest"
    ),
    "cleaning": (
        "clean|wash|mop|sweep|dust|polish|vacuum|scrub|tidy|putting_|picking_up|organi|sort|"
        "trash|dispos|recycl|emptying|treating|remove|water|wax|rearrang|making_the_bed|collect|"
        "clutter|shampoo|box|moving|store_"
    ),
}
# Nothing is done in furniture that holds things inside, such as a fridge, but for these.
_WET = ("sink",)
MIN_SHARE = 0.02  # of a kind's activities in which a type must occur; rarer ones are by chance


@dataclass(slots=True)
class KindCounts:
    """What the activities of one kind use, and where it lies then.

    Attributes:
        num_activities: how many definitions are of the kind.
        objects: activities in which an object of the type occurs, by label.
        places: activities in which something lies there, by room and furniture label; furniture
            that only stores things is left out.
    """

    num_activities: int = 0
    objects: Counter[str] = field(default_factory=Counter)
    places: Counter[tuple[str, str]] = field(default_factory=Counter)


def find_kind(activity: str) -> str | None:
    """Return the kind of an activity by its name, None if it is of no kind."""
    for category, words in KIND_WORDS.items():
        if re.search(words, f"{activity}_"):
            return category
    return None


def count_activities(folder: Path | None = None) -> tuple[dict[str, KindCounts], list[str]]:
    """Count object types and places by kind of activity.

    Args:
        folder: the `bddl` package's folder; None finds the installed package.

    Returns:
        Counts of every kind, and the names of the activities that are of no kind.

    Raises:
        ModuleNotFoundError: if `folder` is None and the package is missing.
        ValueError: if there is no activity, or the definition of one is not balanced.
    """
    folder = find_package_data("bddl", "") if folder is None else Path(folder)
    names = load_names("behavior")
    kinds = {category: KindCounts() for category in KIND_WORDS}
    left_out = []
    definitions = sorted((folder / "activity_definitions").glob("*/*.bddl"))
    if not definitions:
        raise ValueError(
            f"bddl must hold activity_definitions/*/*.bddl, got none in {folder}. Name the folder "
            "of the package, or leave it out."
        )
    for path in definitions:
        category = find_kind(path.parent.name)
        if category is None:
            left_out.append(path.parent.name)
            continue
        text = path.read_text(encoding="utf-8")
        facts = list(walk_facts(parse_expression(text)))
        synsets = {find_synset(term) for fact in facts for term in fact if ".n." in term}
        counts = kinds[category]
        counts.num_activities += 1
        labels = {names.find_object(synset) for synset in synsets}
        counts.objects.update(label for label in labels if label is not None)
        places = find_places(text, PlacementCounts("activities"))
        counts.places.update(
            {
                (str(room), furniture)
                for room, furniture, _, relation in places
                if relation == "onTop" or furniture in _WET
            }
        )
    return kinds, left_out


def make_table(kinds: Mapping[str, KindCounts]) -> dict[str, Any]:
    """Return the table as JSON values: what was counted, and what we assume beside it.

    Objects have the share of the kind's activities that use them; places have counts.
    """
    table = {}
    for category, counts in kinds.items():
        assumed = [
            entry
            for entry in read_table("tools.priors", "assumed_activities.csv")
            if entry["kind"] == category
        ]
        table[category] = {
            "num_activities": counts.num_activities,
            "objects": {
                label: round(count / counts.num_activities, 3)
                for label, count in sorted(counts.objects.items())
                if count / counts.num_activities >= MIN_SHARE
            },
            "places": [[*place, count] for place, count in sorted(counts.places.items())],
            "assumed_objects": {
                entry["label"]: float(entry["weight"])
                for entry in assumed
                if entry["part"] == "object"
            },
            "assumed_places": [
                [entry["room"], entry["label"], float(entry["weight"])]
                for entry in assumed
                if entry["part"] == "place"
            ],
        }
    return {"source": "activity definitions of bddl 3.6.0; assumed: ours", "kinds": table}
