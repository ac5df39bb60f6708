"""Which thing of a memory a line of a log is about."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class ThingName:
    """Which node of a memory is meant: by its id, or, where it has none, by its words."""

    description: str
    id: str = ""

    def __str__(self) -> str:
        return f"{self.description} (id {self.id})" if self.id else self.description

    def to_json(self) -> dict[str, Any]:
        """Return JSON values for a log."""
        return {"description": self.description, **({"id": self.id} if self.id else {})}

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> ThingName:
        """Read JSON values of a log."""
        return cls(str(data["description"]), str(data.get("id", "")))
