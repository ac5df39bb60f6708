"""The rules of a home: sizes, noise, dynamics and sensing."""

from __future__ import annotations

from dataclasses import dataclass, fields


@dataclass(frozen=True, slots=True)
class HomeConfig:
    """Rules that every sampled home obeys; the defaults are the paper's.

    Attributes:
        rooms: the rooms of every home, one each; the prior must have them.
        furniture_per_room: furniture nodes per room; 8 x 4 rooms = 32.
        objects_per_furniture: objects placed per furniture node at t = 0; 6 x 32 = 192.
        noise_zero_prob: probability that a placement weight is zeroed, class and instance noise.
        noise_scale: the others are multiplied by U(1 - noise_scale, 1 + noise_scale).
        move_share: share of the present objects that move in a step.
        count_slack: objects present stay within (1 +- count_slack) of the initial count.
        detection_error: probability that an object on an observed furniture node is missed.
        dynamic_nodes: whether objects are added and removed.
        cross_room_moves: whether a move may lead to another room (docs/design.md, ruling 2:
        harder variant).

    Source: paper appendix A; docs/design.md, rulings 1-8 and 11.
    """

    rooms: tuple[str, ...] = ("kitchen", "living room", "bedroom", "bathroom")
    furniture_per_room: int = 8
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
        if not self.rooms or len(set(self.rooms)) < len(self.rooms):
            raise ValueError(
                f"rooms must be one or more different labels, got {list(self.rooms)}. "
                "Name each room once."
            )
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name == "rooms":
                continue
            if field.name.endswith(("_room", "_furniture")):
                if value < 1:
                    raise ValueError(f"{field.name} must be at least 1, got {value}. Raise it.")
            elif not isinstance(value, bool) and not 0 <= value <= 1:
                raise ValueError(
                    f"{field.name} must lie in [0, 1], got {value}. Give a share or probability."
                )
