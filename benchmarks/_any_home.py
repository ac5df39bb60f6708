"""The network for any home, which ships: in ONNX Runtime, and in torch to compare it with."""

from __future__ import annotations

from collections.abc import Callable

from _measure import Measure

from nep.players.contestants import load_player
from nep.players.policy import NEPPolicy
from sgm.policies.policy import Policy


def compare_runtimes(
    prepare: Callable[[bool, Callable[[], Policy]], tuple[Measure, str]], tiny: bool
) -> tuple[Measure, str]:
    """Measure ONNX Runtime, and torch in turn with it, whose figure is named `torch`."""
    (with_onnx, size), (with_torch, _) = (
        prepare(tiny, lambda load=load: load("any_home")) for load in (load_player, NEPPolicy.load)
    )

    def measure() -> tuple[float, dict[str, float]]:
        figure, more = with_onnx()
        return figure, {**more, "torch": with_torch()[0]}

    return measure, size
