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


@pytest.mark.parametrize("rooms", [(), ("kitchen", "kitchen")])
def test_rooms_are_one_or_more_and_differ(rooms):
    with pytest.raises(ValueError, match=r"rooms must be one or more .* Name each room once"):
        HomeConfig(rooms=rooms)


def test_rules_cannot_change_under_a_running_home():
    with pytest.raises(dataclasses.FrozenInstanceError):
        HomeConfig().move_share = 0.5
