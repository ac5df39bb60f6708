"""Networks that were each trained without one recorded home, as one player."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nep.players.contestants import Checkpoint, Player
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Change, Queries
from sgm.messages import shorten
from simulator.policies import Policy
from simulator.trace.recorded_homes import RecordedHomes
from simulator.world.homes import Homes

_HOME = "{home}"


class LeftOutPolicy(Policy):
    """Asks of every home the network that has not seen it."""

    score_kind = "logits"

    def __init__(self, networks: Sequence[Player], network_of_home: np.ndarray) -> None:
        """Keep the networks, and the number of that of each home, (H,)."""
        self._networks = networks
        self._network_of_home = network_of_home

    def reset(self, memory: MemoryBatch) -> None:
        """Forget earlier homes."""
        for network in self._networks:
            network.reset(memory)

    def scores(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        """Return logits, (Q, F), -inf where there is no query edge."""
        scores = np.full((len(queries.home), memory.num_furniture), -np.inf)
        asked = self._network_of_home[queries.home]
        for number, network in enumerate(self._networks):
            rows = np.flatnonzero(asked == number)
            if len(rows):
                scores[rows] = network.scores(memory, queries.take(rows))
        return scores

    def observe(self, memory: MemoryBatch, change: Change) -> None:
        """Take note of a look."""
        for network in self._networks:
            network.observe(memory, change)


@dataclass(frozen=True, slots=True)
class LeftOut:
    """Checkpoints that differ in the recorded home that they were not trained in.

    The source has "{home}" for the name of the home that each left out.
    """

    name: str
    source: str

    @classmethod
    def parse(cls, text: str) -> LeftOut:
        """Read `NAME=SOURCE`.

        Raises:
            ValueError: if there is no name, or no "{home}" in the source.
        """
        name, _, source = text.partition("=")
        if not name or _HOME not in source:
            raise ValueError(
                f"networks that leave a home out must be NAME=SOURCE with {_HOME} in SOURCE, got "
                f"{shorten(text)}. Write for example own=runs/without_{_HOME}/exported."
            )
        return cls(name, source)

    def find(self, home: str) -> Checkpoint:
        """Return the network that was trained without a home.

        Raises:
            ValueError: if there is none.
        """
        return Checkpoint.parse(f"{self.name}={self.source.replace(_HOME, home)}")

    def make(self, homes: Homes) -> LeftOutPolicy:
        """Make the player for recorded homes."""
        assert isinstance(homes, RecordedHomes), "only recorded homes have names"
        names = sorted(set(homes.names))
        networks = [self.find(name).load().play_in(homes) for name in names]
        return LeftOutPolicy(networks, np.array([names.index(name) for name in homes.names]))
