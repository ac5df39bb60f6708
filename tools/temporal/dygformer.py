"""DyGFormer: a transformer over the latest neighbours of both ends of a pair."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn.functional import embedding, linear
from torch_geometric.nn import TemporalEncoding

from sgm.checks import check_at_least
from tools.temporal.network import PairDecoder, TemporalNetwork
from tools.temporal.stream import MESSAGE_DIM, StreamQuestions


class DyGFormer(TemporalNetwork):
    """Sequences of a thing and of a place, with how often each neighbour is in both, in patches.

    PyG has no such module, so that this is ours. Each sequence begins with the node itself, as in
    the paper, which is how a place that the thing was seen at is noticed.

    Args:
        patch: neighbours of a patch; the sequence is cut to a multiple of it.

    Source: Yu et al. 2023, "Towards Better Dynamic Graph Learning: New Architecture and Unified
    Library". Differs: one layer and the width of the others; our decoder of pairs.
    """

    name: ClassVar[str] = "DyGFormer"

    def __init__(
        self,
        units: int = 32,
        num_events: int = 16,
        dropout: float = 0.1,
        patch: int = 4,
        heads: int = 2,
    ) -> None:
        super().__init__(units, num_events, dropout)
        check_at_least(1, patch=patch, heads=heads)
        if units % heads or num_events % patch:
            raise ValueError(
                f"units and num_events must be multiples of heads and patch, got {units}, "
                f"{num_events}, {heads} and {patch}. Choose others."
            )
        self.settings |= {"patch": patch, "heads": heads}
        self.patch = patch
        self.time = TemporalEncoding(units)
        self.count = nn.Sequential(nn.Linear(1, units), nn.ReLU(), nn.Linear(units, units))
        self.read = nn.Linear(3 * units + MESSAGE_DIM, units)
        self.flatten = nn.Linear(patch * units, units)
        self.attend = nn.TransformerEncoderLayer(
            units, heads, 2 * units, dropout, batch_first=True, norm_first=True
        )
        self.decode = PairDecoder(units)

    def forward(self, asked: StreamQuestions) -> Tensor:
        """Return logits of all places, (Q, F)."""
        stream, width = self.stream, self.units
        pairs = stream.find_pairs(asked)
        of_thing = self._read_sequence(pairs.things, asked.time)
        of_place = self._read_sequence(pairs.places, asked.time)
        thing_row = pairs.query
        ends = of_thing[1][thing_row], of_place[1]  # (P, K): neighbours, -1 for none
        # A count is one of few numbers, and a thing's sequence is that of all its pairs: what is
        # linear is computed once for each of them, and looked up by pairs.
        numbers = torch.arange(self.num_events + 1, dtype=self.dtype).unsqueeze(-1)
        of_values, of_counts = self.read.weight.split([2 * width + MESSAGE_DIM, width], dim=1)
        table = linear(self.count(numbers), of_counts)  # (K + 1, D)
        tokens = []
        for (values, ids), rows, neighbours, other in (
            (of_thing, thing_row, ends[0], ends[1]),
            (of_place, np.arange(len(thing_row)), ends[1], ends[0]),
        ):
            known = linear(values, of_values, self.read.bias)
            known = known + embedding(_count(ids, ids), table)
            steps = known[torch.from_numpy(rows)] + embedding(_count(neighbours, other), table)
            is_none = torch.from_numpy(neighbours < 0).unsqueeze(-1)
            steps = steps.masked_fill(is_none, 0)  # (P, K, D)
            tokens.append(
                self.flatten(
                    steps.reshape(len(neighbours), -1, self.patch * width)
                )  # (P, K / p, D)
            )
        num_patches = tokens[0].shape[1]
        mixed = self.attend(torch.cat(tokens, dim=1))
        thing, place = mixed[:, :num_patches].mean(dim=1), mixed[:, num_patches:].mean(dim=1)
        own_thing = self.embed(pairs.things)[torch.from_numpy(thing_row)]
        own_place = self.embed(pairs.places)
        return self.decode(pairs.spread(thing + own_thing), pairs.spread(place + own_place), asked)

    def _read_sequence(self, nodes: np.ndarray, now: int) -> tuple[Tensor, np.ndarray]:
        """Return what is known of the neighbours of nodes, (n, K, 2 D + 4), and their ids (n, K).

        The first of K is the node itself.
        """
        stream = self.stream
        events = stream.find_latest(nodes, self.num_events - 1)
        message, time = self.gather(events)
        ids = np.where(events >= 0, stream.find_other_ends(nodes[:, None], events), -1)
        ids = np.concatenate([nodes[:, None], ids], axis=1)
        message = torch.cat([message.new_zeros(len(nodes), 1, MESSAGE_DIM), message], dim=1)
        age = torch.cat([time.new_zeros(len(nodes), 1), now - time], dim=1)
        text = self.embed(np.maximum(ids, 0))
        return torch.cat(
            [text, self.time(age.reshape(-1)).reshape(*age.shape, -1), message], dim=-1
        ), ids


def _count(neighbours: np.ndarray, other: np.ndarray) -> Tensor:
    """Return how often each of `neighbours` is in `other`, int64 (P, K)."""
    equal = (neighbours[:, :, None] == other[:, None, :]) & (neighbours >= 0)[:, :, None]
    return torch.from_numpy(equal.sum(axis=2))
