"""A finished look at a piece of furniture, as the memory takes it."""

from __future__ import annotations

from dataclasses import dataclass

from sgm.layout.viewpoint import Viewpoint
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting


@dataclass(frozen=True, slots=True)
class BuiltLook:
    """One visit to a place: many frames, and one look.

    Attributes:
        furniture: its id.
        seen: what was seen there.
        coverage: share that was in view of what is "in" and "onTop" of it.
        hidden: names of things that were seen there before, and whose spots were out of view now:
            that they were not seen says nothing.
        start, end: seconds of the first and the last frame.
        num_frames: frames in which it was in view.
        viewpoint: of the frame that showed most of it; None if it is unknown.
    """

    furniture: int
    seen: tuple[Sighting, ...]
    coverage: dict[str, float]
    hidden: tuple[str, ...]
    start: float
    end: float
    num_frames: int
    viewpoint: Viewpoint | None = None

    def tell(self, memory: SceneGraphMemory) -> None:
        """Fold the look into a memory."""
        memory.observe(self.furniture, self.seen, self.coverage, self.hidden, self.viewpoint)
