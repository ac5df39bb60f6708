"""What a network answers."""

from __future__ import annotations

from dataclasses import dataclass

from torch import Tensor


@dataclass(frozen=True, slots=True)
class Logits:
    """What a network says of the Q query edges of B snapshots; probabilities are softmax shares.

    Attributes:
        edges: of the query edges, (Q,).
        elsewhere: that what is asked for is at no place, (B,); None where the network does not say
            so.
    """

    edges: Tensor
    elsewhere: Tensor | None
