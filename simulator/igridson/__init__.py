"""Homes on a grid: an agent walks to where the memory says a thing may be, and looks.

`gymnasium.make("simulator.igridson:iGridson-v0")` imports this package, which registers it.
"""

from __future__ import annotations

import os

from sgm.messages import needed_to

# pygame prints a banner when MiniGrid imports it.
os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")

with needed_to("play in the home on a grid", extra="igridson"):
    import gymnasium

ENV_ID = "iGridson-v0"

if ENV_ID not in gymnasium.registry:
    gymnasium.register(ENV_ID, entry_point="simulator.igridson.env:IGridsonEnv")
