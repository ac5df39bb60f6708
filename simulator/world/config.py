"""The rules of a home: sizes, noise, dynamics and sensing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields


@dataclass(frozen=True, slots=True)
class HomeConfig:
    """Rules that a sampled home obeys; the defaults are the paper's.

    Attributes:
        rooms: label of every room; the prior must have them, and a home may have several of one.
        furniture_per_room: furniture nodes in each room, 8 x 4 rooms = 32; or one number per room.
        objects_per_furniture: objects placed per furniture node at t = 0; 6 x 32 = 192.
        noise_zero_prob: probability that a placement weight is zeroed, class and instance noise.
        noise_scale: the others are multiplied by U(1 - noise_scale, 1 + noise_scale).
        move_share: share of the present objects that move in a step.
        count_slack: objects present stay within (1 +- count_slack) of the initial count.
        detection_error: probability that an object on an observed furniture node is missed.
        dynamic_nodes: whether objects are added and removed.
        cross_room_moves: whether a move may lead to another room (docs/design.md, ruling 2: harder
            variant).

    Source: paper appendix A; docs/design.md, rulings 1-8 and 11.
    """

    rooms: tuple[str, ...] = ("kitchen", "living room", "bedroom", "bathroom")
    furniture_per_room: int | tuple[int, ...] = 8
    objects_per_furniture: int = 6
    noise_zero_prob: float = 0.25
    noise_scale: float = 0.25
    move_share: float = 0.05
    count_slack: float = 0.05
    detection_error: float = 0.25
    dynamic_nodes: bool = True
    cross_room_moves: bool = False

    def __post_init__(self) -> None:
        """Check every value.

        Raises:
            ValueError: if there is no room, a count is below 1 or a share is outside [0, 1].
        """
        if not self.rooms:
            raise ValueError("rooms must be one or more labels, got none. Name a room.")
        sizes = self.room_sizes
        if len(sizes) != len(self.rooms):
            raise ValueError(
                f"furniture_per_room must be one number, or one for each of the {len(self.rooms)} "
                f"rooms, got {len(sizes)}. Name as many as there are rooms."
            )
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name == "rooms":
                continue
            if field.name.endswith(("_room", "_furniture")):
                lowest = min(sizes) if field.name == "furniture_per_room" else value
                if lowest < 1:
                    raise ValueError(f"{field.name} must be at least 1, got {value}. Raise it.")
            elif not isinstance(value, bool) and not 0 <= value <= 1:
                raise ValueError(
                    f"{field.name} must lie in [0, 1], got {value}. Give a share or probability."
                )

    @property
    def room_sizes(self) -> tuple[int, ...]:
        """Furniture nodes of every room, (R,)."""
        size = self.furniture_per_room
        return (size,) * len(self.rooms) if isinstance(size, int) else tuple(size)


def spread_configs(
    config: HomeConfig | Sequence[HomeConfig], num_homes: int
) -> tuple[HomeConfig, ...]:
    """Return the rules of each of H homes, given one for all or one per home.

    Raises:
        ValueError: if there are neither one nor H.
    """
    if isinstance(config, HomeConfig):
        return (config,) * num_homes
    if len(config) != num_homes:
        raise ValueError(
            f"configs must be one, or one for each of the {num_homes} homes, got {len(config)}. "
            "Give as many as the streams have homes."
        )
    return tuple(config)
