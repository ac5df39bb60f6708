"""What a temporal network must offer, and what all of them share: input, decoder, settings."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import ClassVar

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn.functional import embedding

from sgm.checks import check_at_least, check_shares
from tools.temporal.stream import MESSAGE_DIM, EventStream, StreamQuestions

TEXT_DIM = 96
IDENTITY_DIM = 16
_NUM_IDENTITIES = 1024  # of nodes of one home; more share theirs
_FLOOR = 1e-4  # of prior weights, before the logarithm


class TemporalNetwork(nn.Module, ABC):
    """Scores all places of a home for a thing, from the events before the question.

    A node is known by the text vector of its label, and by random features that tell it from the
    other nodes of its home. The decoder also gets the prior weight of each place, as the node edge
    predictor does.

    Args:
        units: D, width of embeddings.
        num_events: K, latest events of a node that are read.
        dropout: within the network.

    Attributes:
        name: in tables.
        stream: the events that it reads, after `reset`.
    """

    name: ClassVar[str]
    stream: EventStream
    identities: Tensor

    def __init__(self, units: int = 32, num_events: int = 16, dropout: float = 0.1) -> None:
        super().__init__()
        check_at_least(2, units=units, num_events=num_events)
        check_shares(dropout=dropout)
        self.settings = {"units": units, "num_events": num_events, "dropout": dropout}
        self.units, self.num_events = units, num_events
        generator = torch.Generator().manual_seed(0)
        identities = torch.randn(_NUM_IDENTITIES, IDENTITY_DIM, generator=generator)
        self.register_buffer("identities", identities, persistent=False)
        self.read_text = nn.Linear(TEXT_DIM, units)
        self.read_identity = nn.Linear(IDENTITY_DIM, units, bias=False)
        self.kind = nn.Embedding(2, units)
        self._text = torch.zeros(1, TEXT_DIM)

    def reset(self, stream: EventStream, text: np.ndarray) -> None:
        """Start with an empty stream of new homes, and vectors (L, 96) of the labels there."""
        self.stream = stream
        self._text = torch.from_numpy(np.asarray(text, dtype=np.float32)).to(self.dtype)

    @property
    def dtype(self) -> torch.dtype:
        """Type of its numbers: float32 while training, float64 when it plays."""
        return self.read_text.weight.dtype

    @abstractmethod
    def forward(self, asked: StreamQuestions) -> Tensor:
        """Return the logits of all places, (Q, F); those of columns that are no place are open."""

    def note(self, numbers: np.ndarray) -> None:
        """Take note of events that the stream has got, (n,); a network without a state need not."""

    def embed(self, nodes: np.ndarray) -> Tensor:
        """Return what is known of nodes without their events, (..., D)."""
        stream = self.stream
        is_thing = nodes >= stream.num_homes * stream.num_places
        number = stream.node_number[nodes] % _NUM_IDENTITIES
        label = torch.from_numpy(stream.node_label[nodes])
        # Labels and identities are far fewer than nodes: project first, look up then.
        return (
            embedding(label, self.read_text(self._text))
            + embedding(torch.from_numpy(number), self.read_identity(self.identities))
            + self.kind(torch.from_numpy(is_thing.astype(np.int64)))
        )

    def encode_pairs(
        self, asked: StreamQuestions, encode: Callable[[np.ndarray, int], Tensor]
    ) -> tuple[Tensor, Tensor]:
        """Encode what is asked for, (Q, D), and the places of its home, (Q, F, D).

        Args:
            asked: the questions.
            encode: returns embeddings of nodes (n,) at a time step, (n, D); each is asked for once.
        """
        pairs = self.stream.find_pairs(asked)
        count = len(pairs.things)
        nodes, back = np.unique(np.concatenate([pairs.things, pairs.places]), return_inverse=True)
        encoded = encode(nodes, asked.time)[torch.from_numpy(back)]
        return encoded[:count], pairs.spread(encoded[count:])

    def gather(self, events: np.ndarray) -> tuple[Tensor, Tensor]:
        """Return messages (..., 4) and time steps (...,) of events; zeros where one is -1."""
        is_none = torch.from_numpy(events < 0)
        known = np.maximum(events, 0)
        if not len(self.stream.time):
            none = torch.zeros(*events.shape, MESSAGE_DIM, dtype=self.dtype)
            return none, none[..., 0]
        message = torch.from_numpy(self.stream.message[known]).to(self.dtype)
        time = torch.from_numpy(self.stream.time[known]).to(self.dtype)
        return message.masked_fill(is_none.unsqueeze(-1), 0), time.masked_fill(is_none, 0)


class PairDecoder(nn.Module):
    """Scores pairs of a thing and a place: an MLP of both, their product and the prior."""

    def __init__(self, units: int, more: int = 0) -> None:
        """Set the width of things and places, and how many further columns every pair has."""
        super().__init__()
        self.layers = nn.Sequential(
            nn.Linear(3 * units + 2 + more, 2 * units), nn.ReLU(), nn.Linear(2 * units, 1)
        )

    def forward(
        self, thing: Tensor, place: Tensor, asked: StreamQuestions, more: Tensor | None = None
    ) -> Tensor:
        """Return logits (Q, F) of things (Q, D) or (Q, F, D) and places (Q, F, D)."""
        if thing.dim() == 2:
            thing = thing.unsqueeze(1).expand_as(place)
        prior = torch.from_numpy(asked.prior).to(place.dtype)
        columns = [
            thing,
            place,
            thing * place,
            prior.unsqueeze(-1),
            (prior + _FLOOR).log().unsqueeze(-1) / 5,
        ]
        if more is not None:
            columns.append(more)
        return self.layers(torch.cat(columns, dim=-1)).squeeze(-1)
