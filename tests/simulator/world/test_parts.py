"""Dynamics and sensing by name, by import path and in files."""

import json
from dataclasses import dataclass

import numpy as np
import pytest

from simulator.world.config import HomeConfig
from simulator.world.dynamics import DYNAMICS, Dynamics, Life
from simulator.world.paper_dynamics import PaperDynamics
from simulator.world.sampled_homes import SampledHomes
from simulator.world.sensing import (
    SENSING,
    Confidences,
    ConstantMisses,
    MissesPerFurniture,
    MissesPerType,
    PartialViews,
)
from simulator.world.streams import Streams


@dataclass(frozen=True, slots=True)
class Still(Dynamics):
    """Nothing ever happens; a part of one's own, by its import path."""

    hours: int = 24

    @classmethod
    def start(cls, homes, members, rules):
        return StillLife(homes, members, [rule.hours for rule in rules])


class StillLife(Life):
    def __init__(self, homes, members, hours):
        self.homes, self.members, self.hours = homes, members.tolist(), hours

    def step(self):
        pass

    def transition_rows(self, homes, codes):
        assert set(homes) <= set(self.members)
        return np.zeros((len(homes), self.homes.num_place_codes), dtype=np.float32)


PATH = f"{Still.__module__}.Still"


def test_a_name_or_an_import_path_makes_a_part():
    assert DYNAMICS.find("paper")() == PaperDynamics()
    assert DYNAMICS.find(PATH)(hours=3) == Still(3)
    assert SENSING.find("partial_views")(lowest=0.5) == PartialViews(0.5)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        (
            "clever",
            r"dynamics must be one of paper, .*, got 'clever'\. Choose one of these, or",
        ),
        ("no.such.Module", r"got 'no\.such\.Module': No module named 'no'\. Choose"),
        ("simulator.world.dynamics.Nothing", r"got 'simulator\.world\.dynamics\.Nothing'\. Choose"),
        ("simulator.world.sensing.PartialViews", r"got 'simulator\.world\.sensing\.PartialViews'"),
    ],
)
def test_what_is_no_part_is_refused(name, message):
    with pytest.raises(ValueError, match=message):
        DYNAMICS.find(name)()


def test_homes_of_one_group_have_dynamics_of_their_own(default_prior):
    """Each class starts once, with its homes and the rules of each."""
    kinds = [PaperDynamics(), Still(1), PaperDynamics(), Still(2), Still(3)]
    configs = [HomeConfig(dynamics=kind, furniture_per_room=3) for kind in kinds]
    homes = SampledHomes(default_prior, configs, Streams(0, "train", range(5)))
    paper, still = homes.lives
    assert (still.members, still.hours) == ([1, 3, 4], [1, 2, 3])
    before = homes.object_place.copy()
    for _ in range(5):
        homes.evolve()
    has_changed = (homes.object_place != before).any(axis=1)
    assert has_changed.tolist() == [True, False, True, False, False]
    home = np.array([1, 0, 4])
    rows = homes.transition_rows(home, homes.object_code[home, 0])
    assert rows.any(axis=1).tolist() == [False, True, False]
    np.testing.assert_array_equal(
        rows[1:2], paper.transition_rows(home[1:2], homes.object_code[0, :1])
    )


CONFIGS = [
    HomeConfig(),
    HomeConfig(rooms=("bedroom", "bedroom"), furniture_per_room=(2, 5), move_share=0.5),
    HomeConfig(sensing=MissesPerType({"mug": 0.5})),
    HomeConfig(sensing=MissesPerFurniture({"shelf": 0.125}), detection_error=0.5),
    HomeConfig(sensing=Confidences(lowest=0.75)),
]


@pytest.mark.parametrize("config", CONFIGS)
def test_rules_survive_a_file(config):
    data = config.describe()
    assert json.loads(json.dumps(data)) == data
    assert HomeConfig.from_json(data) == config
    assert hash(HomeConfig.from_json(data)) == hash(config)


def test_rules_of_older_files_are_the_papers_where_they_say_nothing():
    old = {"rooms": ["kitchen"], "furniture_per_room": 3, "move_share": 0.1, "forgotten": 7}
    expected = HomeConfig(rooms=("kitchen",), furniture_per_room=3, move_share=0.1)
    assert HomeConfig.from_json(old) == expected
    assert expected.sensing == ConstantMisses()


def test_a_file_names_parts_by_their_entries_alone():
    """An import path out of a file would run whatever code it names."""
    data = HomeConfig(dynamics=Still()).describe()
    assert data["dynamics"] == {"name": PATH, "hours": 24}
    message = r"dynamics of a file must be one of paper, .*Still'\. Add it to the registry first"
    with pytest.raises(ValueError, match=message):
        HomeConfig.from_json(data)
    DYNAMICS["still"] = PATH
    try:
        data = HomeConfig(dynamics=Still(7)).describe()
        assert data["dynamics"] == {"name": "still", "hours": 7}
        assert HomeConfig.from_json(data).dynamics == Still(7)
        data["dynamics"]["minutes"] = 1
        with pytest.raises(ValueError, match=r"dynamics 'still' has other fields: .*minutes"):
            HomeConfig.from_json(data)
    finally:
        del DYNAMICS["still"]


def test_every_entry_leads_to_a_part():
    assert all(isinstance(DYNAMICS.find(name)(), Dynamics) for name in DYNAMICS)
    for name in SENSING:
        assert SENSING.describe(SENSING.find(name)())["name"] == name
