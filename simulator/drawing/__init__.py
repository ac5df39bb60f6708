"""Pictures of homes: `draw_home`, `draw_belief`, `draw_history`, on axes of matplotlib."""

from simulator.drawing.floor_plan import FloorPlan
from simulator.drawing.history import History, draw_history
from simulator.drawing.home import draw_belief, draw_home, draw_pixels

__all__ = ["FloorPlan", "History", "draw_belief", "draw_history", "draw_home", "draw_pixels"]
