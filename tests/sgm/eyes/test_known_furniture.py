"""Detections of furniture itself, and names that are ignored, are no things."""

import pytest

from sgm import Bayesian, Finder, SceneGraphMemory
from sgm.eyes import Box, Detection, FurnitureLabels, LookBuilder
from sgm.finder.service import MemoryService
from sgm.memory.sighting import Sighting
from tests.sgm.eyes.scenes import CAMERA, FLOOR, TABLE, detect, look_around, put_on, render

CUPBOARD = Box((2.0, 1.6, 0.9), (0.5, 0.6, 1.8), interior="door")


def make_home():
    memory = SceneGraphMemory()
    room = memory.add_room("kitchen")
    memory.add_furniture("coffee table", room, box=TABLE)
    memory.add_furniture("fridge", room, "white fridge", box=CUPBOARD)
    memory.add_furniture("floor", room, box=FLOOR)
    return memory


def see(builder, names, *, has_depth=True, is_3d=False, others=()):
    """Look at the table and the fridge; names are what the detector calls both."""
    mug = put_on(TABLE, 0.1, 0.3)
    for number, pose in enumerate(look_around((2, 0.6, 0.5), radius=2.2, num=20, turn=0.6)):
        found = [detect("mug", mug, pose), *(detect(name, mug, pose) for name in others)]
        for name, box in zip(names, (TABLE, CUPBOARD), strict=True):
            flat = detect(name, box, pose)
            found.append(Detection(name, 0.9, center=box.center, size=box.size) if is_3d else flat)
        depth = render([TABLE, CUPBOARD, FLOOR, mug], pose) if has_depth else None
        builder.frame(0.2 * number, pose, CAMERA, found, depth)
    return {one.description for look in builder.finish() for one in look.seen}


@pytest.mark.parametrize("how", [{}, {"has_depth": False}, {"is_3d": True}])
@pytest.mark.parametrize(
    "names",
    [("coffee table", "fridge"), ("Dining_Table", "refrigerator"), ("tables", "white fridge")],
)
def test_furniture_is_no_thing_on_itself_or_on_the_floor(names, how):
    builder = LookBuilder(make_home().layout.furniture)
    assert see(builder, names, **how) == {"mug"}
    assert builder.counts["detections of furniture"] == 40


def test_another_piece_of_furniture_stays_a_thing():
    """What is not on the map is not guessed: a chair before the table may be carried away."""
    builder = LookBuilder(make_home().layout.furniture)
    assert "sofa" in see(builder, ("sofa", "fridge"))
    assert builder.counts["detections of furniture"] == 20
    alone = LookBuilder(make_home().boxes)  # boxes have no names
    assert len(see(alone, ("coffee table", "fridge"))) > 1


def test_labels_of_ones_own():
    labels = FurnitureLabels({"fridge": ["Kühlschrank"], "coffee table": ["Tisch"]})
    builder = LookBuilder(make_home().layout.furniture, labels=labels)
    assert see(builder, ("Tisch", "Kühlschrank")) == {"mug"}
    assert labels.find("KÜHLSCHRANK") == ("fridge",)
    assert labels.find_label("couch 2") == "sofa"
    assert labels.find_label("rug") is None
    assert labels.are_same("table", "desk") is False
    with pytest.raises(TypeError, match="labels of furniture must be a list, got 'bench'"):
        FurnitureLabels("bench")
    for data in ({"fridge": "Kühlschrank"}, {"fridge": ["Kühlschrank"], "workbench": None}):
        assert FurnitureLabels.from_values(data).find_label("Kühlschrank 2") == "fridge"
    assert FurnitureLabels.from_values(["workbench"]).find_label("workbench") == "workbench"
    assert FurnitureLabels.from_values(None).find_label("workbench") is None
    for data in ("fridge", {"fridge": [1]}, {"fridge": {"a": 1}}):
        with pytest.raises(ValueError, match="names of furniture must be aliases by label, got"):
            FurnitureLabels.from_values(data)
    with pytest.raises(ValueError, match=r"In names\.yaml"):
        FurnitureLabels.from_values({" ": []}, "names.yaml")
    with pytest.raises(ValueError, match="label of furniture must be a non-empty text"):
        FurnitureLabels([" "])


def test_names_are_ignored_in_looks_and_by_a_service():
    builder = LookBuilder(make_home().layout.furniture, ignore=["Person", "wall"])
    assert see(builder, ("coffee table", "fridge"), others=("person", "the wall")) == {"mug"}
    assert builder.counts["detections ignored"] == 40
    memory = make_home()
    service = MemoryService(memory, Finder(Bayesian()), ignore=["person"])
    service.observe("fridge", [Sighting("milk", "in"), Sighting("person")])
    assert memory.descriptions == ("milk",)
    for make in (
        lambda own: LookBuilder({}, ignore=own),
        lambda own: MemoryService(memory, Finder(Bayesian()), ignore=own),
    ):
        with pytest.raises(TypeError, match="ignore must be a list, got 'wall'"):
            make("wall")
        with pytest.raises(ValueError, match="must be a non-empty text"):
            make([""])
