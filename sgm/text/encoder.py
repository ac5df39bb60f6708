"""What every text encoder gives: vectors of one width and one scale."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float32]

WIDTH = 96
RMS = 0.5  # root mean square of the entries of a vector


class TextEncoder(Protocol):
    """Turns texts in lower case into vectors."""

    @property
    def name(self) -> str:
        """Language, name and version, such as "en_household-1.0.0"."""
        ...

    def encode(self, texts: Sequence[str]) -> Iterator[FloatArray]:
        """Give the vector of each text, float32 (96,), of root mean square `RMS`."""
        ...


def scale_mean(tokens: NDArray[Any]) -> FloatArray:
    """Scale the mean of the vectors of a text's tokens to `RMS`, (T, 96) -> float32 (96,)."""
    mean = tokens.mean(axis=0)  # (96,)
    scale = RMS / max(float(np.sqrt(np.mean(mean**2))), 1e-8)
    return (mean * scale).astype(np.float32)
