import dataclasses

import pytest

from simulator.world.config import HomeConfig


def test_defaults_are_those_of_the_paper():
    config = HomeConfig()
    assert config.rooms == ("kitchen", "living room", "bedroom", "bathroom")
    assert (config.furniture_per_room, config.objects_per_furniture) == (8, 6)
    assert (config.noise_zero_prob, config.noise_scale) == (0.25, 0.25)
    assert (config.move_share, config.count_slack, config.detection_error) == (0.05, 0.05, 0.25)
    assert config.dynamic_nodes
    assert not config.cross_room_moves


@pytest.mark.parametrize("name", ["furniture_per_room", "objects_per_furniture"])
def test_sizes_start_at_one(name):
    with pytest.raises(ValueError, match=rf"{name} must be at least 1, got 0\. Raise it\."):
        HomeConfig(**{name: 0})
    HomeConfig(**{name: 1})


@pytest.mark.parametrize(
    "name", ["noise_zero_prob", "noise_scale", "move_share", "count_slack", "detection_error"]
)
@pytest.mark.parametrize("value", [-0.1, 1.1, float("nan")])
def test_shares_lie_between_zero_and_one(name, value):
    message = rf"{name} must lie in \[0, 1\], got {value}\. Give a share or probability\."
    with pytest.raises(ValueError, match=message):
        HomeConfig(**{name: value})


def test_rooms_are_one_or_more_of_a_kind():
    with pytest.raises(ValueError, match=r"rooms must be one or more labels, got none\. Name a"):
        HomeConfig(rooms=())
    assert HomeConfig(rooms=("bedroom", "bedroom")).room_sizes == (8, 8)


def test_rooms_have_sizes_of_their_own():
    rooms = ("kitchen", "bedroom")
    assert HomeConfig(rooms=rooms, furniture_per_room=(1, 5)).room_sizes == (1, 5)
    with pytest.raises(
        ValueError,
        match=r"furniture_per_room must be one number, or one for each "
        r"of the 2 rooms, got 3\. Name as many",
    ):
        HomeConfig(rooms=rooms, furniture_per_room=(1, 5, 2))
    with pytest.raises(
        ValueError, match=r"furniture_per_room must be at least 1, got 0\. Raise it"
    ):
        HomeConfig(rooms=rooms, furniture_per_room=(1, 0))


def test_rules_cannot_change_under_a_running_home():
    with pytest.raises(dataclasses.FrozenInstanceError):
        HomeConfig().move_share = 0.5
