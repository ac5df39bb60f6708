"""Changes a file at random: bytes of any file, values of one that is JSON or has lines."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from tests.sgm.memory.sessions import VALUES


def mutate_bytes(content: bytes, rng: np.random.Generator) -> bytes:
    """Flip, cut, repeat or overwrite some bytes."""
    data = bytearray(content)
    for _ in range(int(rng.integers(1, 4))):
        if not data:
            break
        at, length = int(rng.integers(len(data))), int(rng.integers(1, 40))
        kind = rng.integers(5)
        if kind == 0:
            data[at] ^= 1 << int(rng.integers(8))
        elif kind == 1:
            del data[at : at + length]
        elif kind == 2:
            data[at:at] = data[at : at + length] * int(rng.integers(1, 50))
        elif kind == 3:
            data[at : at + length] = rng.bytes(length)
        else:
            del data[at:]
    return bytes(data)


def mutate_json(data: Any, rng: np.random.Generator) -> Any:
    """Replace, remove or repeat one value, anywhere in it."""
    data = json.loads(json.dumps(data))
    owner, key = None, None
    here = data
    while isinstance(here, (dict, list)) and here and (owner is None or rng.random() < 0.8):
        owner = here
        keys = list(here) if isinstance(here, dict) else range(len(here))
        key = keys[int(rng.integers(len(keys)))]
        here = here[key]
    kind = rng.integers(4)
    if owner is None:
        return VALUES[int(rng.integers(len(VALUES)))]
    if kind == 0:
        del owner[key]
    elif kind == 1 and isinstance(owner, list):
        owner.append(here)
    elif kind == 2 and isinstance(owner, dict):
        owner[str(rng.choice(["x", "version", "rooms"]))] = here
    else:
        owner[key] = VALUES[int(rng.integers(len(VALUES)))]
    return data


def mutate_text(content: bytes, rng: np.random.Generator) -> bytes:
    """Replace a word of a file with lines by an odd one, or repeat or remove a line."""
    lines = content.decode().split("\n")
    at = int(rng.integers(len(lines)))
    kind = rng.integers(4)
    if kind == 0:
        del lines[at]
    elif kind == 1:
        lines.insert(at, lines[int(rng.integers(len(lines)))])
    else:
        mark = "," if "," in lines[at] else " "
        words = lines[at].split(mark)
        odd = VALUES[int(rng.integers(len(VALUES)))]
        words[int(rng.integers(len(words)))] = odd if isinstance(odd, str) else str(odd)
        lines[at] = mark.join(words)
    return "\n".join(lines).encode()
