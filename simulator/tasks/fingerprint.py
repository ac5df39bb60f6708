"""A checksum by which two people know that they play in the same homes."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable

import numpy as np

from simulator.policies import Bayesian
from simulator.tasks.rollout import Rollout
from simulator.world.source import HomeSource
from simulator.world.streams import Streams


def compute_fingerprint(source: HomeSource, streams: Streams, num_steps: int) -> str:
    """Return the SHA-256 of what the first home is, how it changes and what is asked there.

    Equal settings give equal homes by the same code alone: a source or dynamics of one's own, or
    another version of a package, may mean something else by them. No stream is used up.
    """
    homes = source.make(streams.select(streams.homes[:1]))
    rollout = Rollout(homes, Bayesian())
    digest = hashlib.sha256()
    _add_texts(digest, [*homes.room_labels[0], *homes.furniture_labels[0]])
    for _ in range(num_steps):
        codes, _ = rollout.ask()
        present = np.flatnonzero(homes.is_present[0])
        names = homes.object_descriptions
        _add_texts(digest, [names.text(int(code)) for code in homes.object_code[0, present]])
        digest.update(homes.object_place[0, present].astype("<i8").tobytes())
        _add_texts(digest, [names.text(int(codes[0]))])
    return digest.hexdigest()


def _add_texts(digest: hashlib._Hash, texts: Iterable[str]) -> None:
    digest.update("\0".join(texts).encode() + b"\0\0")
