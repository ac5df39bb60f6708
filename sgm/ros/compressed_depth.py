"""Compressed depth images, as `compressed_depth_image_transport` publishes them."""

from __future__ import annotations

import io
import struct
from typing import Any

import numpy as np

from sgm.messages import needed_to, shorten

MOST_PIXELS = 1 << 25  # of a depth image: 8K is less
_PNG = b"\x89PNG\r\n\x1a\n"
_HEADER = struct.Struct("<iff")  # a number, and the two of the inverse depth of 32FC1


def read_compressed_depth(encoding: str, data: Any) -> np.ndarray:
    """Return the depth in metres, 0 or nan where there is none, float32 (height, width).

    16UC1 is millimetres. 32FC1 is inverse depth: a / (value - b), by two numbers before the PNG.

    Args:
        encoding: `format` of a `sensor_msgs/CompressedImage`, such as "16UC1; compressedDepth png".
        data: its bytes.

    Raises:
        ValueError: if it is no depth as PNG, or more than `MOST_PIXELS`.
        ModuleNotFoundError: if Pillow is not installed.
    """
    kind = encoding.partition(";")[0].strip()
    content = np.asarray(data, dtype=np.uint8).tobytes() if not isinstance(data, bytes) else data
    start = content[: _HEADER.size + len(_PNG)].find(_PNG)
    if kind not in ("16UC1", "32FC1") or start not in (0, _HEADER.size):
        raise ValueError(
            "compressed depth must be 16UC1 or 32FC1 as PNG, got "
            f"{shorten(encoding)}. Record the raw image, or set the format of the transport to png."
        )
    values = _read_png(content[start:])
    if kind == "16UC1":
        return values.astype(np.float32) / np.float32(1000)
    if not start:
        raise ValueError(
            f"compressed depth of 32FC1 must begin with {_HEADER.size} bytes of its scale, got "
            "none. It was cut, or is no compressedDepth."
        )
    _, a, b = _HEADER.unpack_from(content)
    with np.errstate(divide="ignore", invalid="ignore"):
        depth = np.float32(a) / (values.astype(np.float32) - np.float32(b))
    return np.where(values > 0, depth, np.float32(np.nan))


def _read_png(content: bytes) -> np.ndarray:
    """Return the numbers of a PNG of one channel of 16 bits, (height, width)."""
    with needed_to("read compressed depth", install="pillow"):
        from PIL import Image
    try:
        with Image.open(io.BytesIO(content), formats=("PNG",)) as image:
            mode, (width, height) = image.mode, image.size
            if not mode.startswith("I") or width * height > MOST_PIXELS:
                raise ValueError(f"{width} x {height} pixels of {mode}")
            return np.asarray(image).astype(np.uint16)
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        raise ValueError(
            f"compressed depth must be a PNG of 16 bits and at most {MOST_PIXELS} pixels, got "
            f"{shorten(str(error)[:100])}. Check the driver."
        ) from None
