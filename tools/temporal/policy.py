"""A trained temporal network as a policy: it gets the looks as they happen."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

import numpy as np
import torch

from sgm.files import compute_checksum
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Change, Queries
from sgm.policies.policy import Policy, ScoreKind, mask_furniture
from sgm.text import load_text
from tools.temporal.episodes import make_asked, make_events
from tools.temporal.network import TemporalNetwork
from tools.temporal.registry import TrainedNetwork, load_parameters, make_network
from tools.temporal.stream import EventStream

_DECIMALS = 6  # of logits: below them the order of a sum shows


class EventPolicy(Policy):
    """Plays a temporal network in float64, so that a home is answered alike in any company."""

    score_kind: ClassVar[ScoreKind] = "logits"

    def __init__(self, trained: TrainedNetwork) -> None:
        """Keep the network; it may go on learning, and plays as it is at the next `reset`."""
        self._trained = trained
        self._network: TemporalNetwork | None = None

    @classmethod
    def load(cls, source: str) -> EventPolicy:
        """Load a network that `python -m nep.bench temporal` has trained.

        Raises:
            ValueError: if there is no such file, or it is damaged.
        """
        return cls(TrainedNetwork.load(source))

    @classmethod
    def identify(cls, source: str) -> str:
        """Return the SHA-256 of the file.

        Raises:
            ValueError: if there is none.
        """
        TrainedNetwork.load(source)
        return compute_checksum(Path(source))

    def reset(self, memory: MemoryBatch) -> None:
        """Start in new homes, with an empty stream."""
        trained = self._trained
        network = make_network(trained.name, trained.network.settings)
        load_parameters(network, dict(trained.network.named_parameters()))
        self._network = network.eval().double()
        stream = EventStream(memory.furniture_label, trained.sightings_alone)
        self._network.reset(stream, load_text().vectors(memory.labels))

    @torch.no_grad()
    def observe(self, memory: MemoryBatch, change: Change) -> None:
        """Take note of what a look has shown."""
        network = self._show_things(memory)
        network.note(network.stream.append(make_events(memory, change), memory.time))

    @torch.no_grad()
    def scores(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        """Return logits, (Q, F)."""
        network = self._show_things(memory)
        logits = network(make_asked(memory, queries)).numpy().round(_DECIMALS)
        return mask_furniture(memory, queries, logits)

    def _show_things(self, memory: MemoryBatch) -> TemporalNetwork:
        assert self._network is not None, "reset comes first"
        self._network.stream.know_things(memory.objects["home"], memory.objects["label"])
        return self._network
