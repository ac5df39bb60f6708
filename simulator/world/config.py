"""The rules of a sampled home: those of every home, its dynamics and its sensing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any

from simulator.world.dynamics import DYNAMICS, Dynamics
from simulator.world.paper_dynamics import PaperDynamics
from simulator.world.rules import HomeRules
from simulator.world.sensing import SENSING, ConstantMisses, Sensing


@dataclass(frozen=True)
class HomeConfig(HomeRules):
    """Rules that a sampled home obeys, see `HomeRules`; the defaults are the paper's.

    Attributes:
        dynamics: how the home changes, see `simulator.world.dynamics`.
        sensing: what a look shows, see `simulator.world.sensing`.

    Source: paper appendix A; docs/design.md, rulings 1-8 and 11.
    """

    dynamics: Dynamics = field(default_factory=PaperDynamics)
    sensing: Sensing = field(default_factory=ConstantMisses)

    def describe(self) -> dict[str, Any]:
        """Return all rules as JSON values, from which `from_json` makes the same rules."""
        size = self.furniture_per_room
        return {
            **{rule.name: getattr(self, rule.name) for rule in fields(self)},
            "rooms": list(self.rooms),
            "furniture_per_room": size if isinstance(size, int) else list(size),
            "dynamics": DYNAMICS.describe(self.dynamics),
            "sensing": SENSING.describe(self.sensing),
        }

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> HomeConfig:
        """Read rules that a file has kept; what it does not say is the paper's.

        Raises:
            ValueError: if a value is out of range, or a part is none of `DYNAMICS` or `SENSING`.
            TypeError, AttributeError: if a value is of the wrong kind.
        """
        rules = {rule.name: data[rule.name] for rule in fields(cls) if rule.name in data}
        for name in ("rooms", "furniture_per_room"):
            if isinstance(rules.get(name), list):
                rules[name] = tuple(rules[name])
        if "dynamics" in rules:
            rules["dynamics"] = DYNAMICS.read(rules["dynamics"])
        if "sensing" in rules:
            rules["sensing"] = SENSING.read(rules["sensing"])
        return cls(**rules)
