"""A recurrent network per thing: it reads the thing's own events, and points at their places."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import torch
from torch import Tensor, nn

from tools.temporal.network import PairDecoder, TemporalNetwork
from tools.temporal.stream import MESSAGE_DIM, StreamQuestions


class RecurrentPerThing(TemporalNetwork):
    """A GRU over the latest events of the thing that is asked for.

    A place is scored by the last state, by the state after the thing's last event there, and by how
    long ago that was.
    """

    name: ClassVar[str] = "GRU per thing"

    def __init__(self, units: int = 32, num_events: int = 16, dropout: float = 0.1) -> None:
        super().__init__(units, num_events, dropout)
        self.gru = nn.GRU(units + MESSAGE_DIM + 1, units, batch_first=True)
        self.never = nn.Parameter(torch.zeros(units))
        self.dropout = nn.Dropout(dropout)
        self.decode = PairDecoder(units, more=units + 2)

    def forward(self, asked: StreamQuestions) -> Tensor:
        """Return logits of all places, (Q, F)."""
        stream = self.stream
        things, places = stream.find_things(asked.thing), stream.find_places(asked.home)
        events = stream.find_latest(things, self.num_events)  # (Q, K), -1 first
        message, time = self.gather(events)
        is_event = events >= 0
        where = stream.dst[np.maximum(events, 0)] if len(stream.dst) else np.zeros_like(events)
        since = torch.log1p(asked.time - time) * torch.from_numpy(is_event)
        place_of = self.embed(where) * torch.from_numpy(is_event).unsqueeze(-1)
        inputs = torch.cat([place_of, message, since.unsqueeze(-1)], dim=-1)
        states, _ = self.gru(inputs)  # (Q, K, D); nothing comes first
        states = self.dropout(states)
        is_at_place = is_event[:, None, :] & (where[:, None, :] == places[:, :, None])  # (Q, F, K)
        is_known = is_at_place.any(axis=2)
        last = self.num_events - 1 - is_at_place[:, :, ::-1].argmax(axis=2)  # (Q, F)
        query = np.arange(len(things))[:, None]
        rows = torch.from_numpy(last)
        state_here = states[torch.from_numpy(query), rows]  # (Q, F, D)
        known = torch.from_numpy(is_known).unsqueeze(-1)
        state_here = torch.where(known, state_here, self.never)
        age = since[torch.from_numpy(query), rows].unsqueeze(-1) * known
        more = torch.cat([state_here, age, known.to(age.dtype)], dim=-1)
        thing = self.embed(things) + states[:, -1]
        return self.decode(thing, self.embed(places), asked, more)
