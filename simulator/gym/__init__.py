"""Find Object as a Gymnasium environment, and many homes of it at once.

`gymnasium.make("simulator.gym:FindObject-v0")` imports this package, which registers it.
"""

from __future__ import annotations

from sgm.messages import needed_to

with needed_to("make an environment", extra="gym"):
    import gymnasium

ENV_ID = "FindObject-v0"

if ENV_ID not in gymnasium.registry:
    gymnasium.register(
        ENV_ID,
        entry_point="simulator.gym.find_object_env:FindObjectEnv",
        vector_entry_point="simulator.gym.find_object_env:FindObjectVectorEnv",
    )
