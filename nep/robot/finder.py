"""The finder of `sgm`, for every network: those that ONNX Runtime cannot run are run by torch."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from sgm.finder import object_finder
from sgm.network.network import Network, has_onnx


class TrainedObjectFinder(object_finder.ObjectFinder):
    """Answers where an object is, from a `SceneGraphMemory` alone; see `sgm.ObjectFinder`.

    Torch is loaded for a checkpoint, and for an exported network that reads a graph.
    """

    @classmethod
    def _read(cls, path: Path) -> Any:
        if path.is_dir() and has_onnx(path):
            return super()._read(path)
        from nep.players.checkpoints import load_trained  # loads torch, seconds

        return load_trained(path)

    def _make_policy(self, model: Any, asks_moved: float) -> Any:
        """Return the policy that asks a network."""
        if isinstance(model, Network):
            return super()._make_policy(model, asks_moved)
        from nep.players.policy import NEPPolicy  # loads torch

        if model.builder.config.belief:
            raise ValueError(
                "network must read the memory alone, got one with features.belief: that filter "
                "knows the rules of simulated homes. Train without, or take the shipped 'heat'."
            )
        return NEPPolicy(model.module.eval(), model.builder, asks_moved=asks_moved)


ObjectFinder = TrainedObjectFinder  # as users import it
