"""What every text encoder gives: vectors of one width and one scale.

An encoder has a `name`, language, name and version, such as "en_household-1.0.0", and `encode`,
which gives the vector of each of some texts in lower case.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float32]

WIDTH = 96
RMS = 0.5  # root mean square of the entries of a vector


def scale_mean(tokens: NDArray[Any]) -> FloatArray:
    """Scale the mean of the vectors of a text's tokens to `RMS`, (T, 96) -> float32 (96,)."""
    mean = tokens.mean(axis=0)  # (96,)
    scale = RMS / max(float(np.sqrt(np.mean(mean**2))), 1e-8)
    return (mean * scale).astype(np.float32)
