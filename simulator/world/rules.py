"""The rules of a home, whatever parts it is made of: sizes, noise, shares, looks."""

from __future__ import annotations

from dataclasses import dataclass, field

from sgm.checks import check_at_least, check_at_most, check_choice, check_shares
from simulator.world.parts import Part

MAX_PLACES = 20_000  # furniture nodes of a home
MAX_OBJECTS = 1_000_000  # of a home, when it begins
# Who chooses where the robot looks in Predict Object Location: the policy that answers, a patrol
# that visits all furniture in turn, or chance.
LOOKS = ("policy", "patrol", "random")


@dataclass(frozen=True)
class HomeRules:
    """Rules of a home whose dynamics and sensing may be any part; see `HomeConfig`.

    What homes, their parts and filters read. Parts read homes, so their classes come after this.

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
        max_looks: looks after which a search (Find Object) ends without success; None for as many
            as there is furniture.
        looks: where the robot looks in Predict Object Location, one of `LOOKS`; on patrol or at
            random, all policies read the same memory.
        looks_per_step: looks after each answer; those after a policy's own one are at random.

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
    max_looks: int | None = None
    looks: str = "policy"
    looks_per_step: int = 1
    dynamics: Part = field(kw_only=True)
    sensing: Part = field(kw_only=True)

    def __post_init__(self) -> None:
        """Raise ValueError if there is no room, or a value is out of range; names it."""
        if not self.rooms:
            raise ValueError("rooms must be one or more labels, got none. Name a room.")
        sizes = self.room_sizes
        if len(sizes) != len(self.rooms):
            raise ValueError(
                f"furniture_per_room must be one number, or one for each of the {len(self.rooms)} "
                f"rooms, got {len(sizes)}. Name as many as there are rooms."
            )
        check_at_least(
            1,
            furniture_per_room=min(sizes),
            objects_per_furniture=self.objects_per_furniture,
            max_looks=self.max_looks,
            looks_per_step=self.looks_per_step,
        )
        check_at_most(
            MAX_PLACES, furniture_per_room=max(sizes), rooms_x_furniture_per_room=sum(sizes)
        )
        check_at_most(
            MAX_OBJECTS,
            objects_per_furniture=self.objects_per_furniture,
            furniture_x_objects_per_furniture=sum(sizes) * self.objects_per_furniture,
        )
        check_choice("looks", self.looks, LOOKS)
        shares = ("noise_zero_prob", "noise_scale", "move_share", "count_slack", "detection_error")
        check_shares(**{name: getattr(self, name) for name in shares})

    @property
    def room_sizes(self) -> tuple[int, ...]:
        """Furniture nodes of every room, (R,)."""
        size = self.furniture_per_room
        return (size,) * len(self.rooms) if isinstance(size, int) else tuple(size)
