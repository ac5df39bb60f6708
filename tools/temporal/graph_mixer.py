"""GraphMixer: an MLP-mixer over the latest links of a node, and the mean of its neighbours."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import torch
from torch import Tensor, nn
from torch_geometric.nn.models.graph_mixer import LinkEncoder, NodeEncoder

from tools.temporal.network import PairDecoder, TemporalNetwork
from tools.temporal.stream import MESSAGE_DIM, StreamQuestions


class GraphMixer(TemporalNetwork):
    """PyG's link and node encoders, and our decoder of pairs.

    Source: Cong et al. 2023, "Do We Really Need Complicated Model Architectures for Temporal
    Networks?". Differs: an edge also has what is known of the node at its other end, since messages
    alone do not say where a thing was seen.
    """

    name: ClassVar[str] = "GraphMixer"

    def __init__(
        self, units: int = 32, num_events: int = 16, dropout: float = 0.1, window: int = 50
    ) -> None:
        super().__init__(units, num_events, dropout)
        self.settings["window"] = window
        self.link = LinkEncoder(
            num_events, units + MESSAGE_DIM, units, units, units, is_sorted=True, dropout=dropout
        )
        self.neighbours = NodeEncoder(window)
        self.join = nn.Linear(2 * units, units)
        self.decode = PairDecoder(units)

    def forward(self, asked: StreamQuestions) -> Tensor:
        """Return logits of all places, (Q, F)."""
        return self.decode(*self.encode_pairs(asked, self._encode), asked)

    def _encode(self, nodes: np.ndarray, now: int) -> Tensor:
        """Return embeddings of nodes, (n, D)."""
        stream = self.stream
        # The mixer tells links by their place in the list: the latest comes first.
        events = stream.find_latest(nodes, self.num_events)[:, ::-1]
        receiver, column = np.nonzero(events >= 0)
        numbers = events[receiver, column]
        message, time = self.gather(numbers)
        other = self.embed(stream.find_other_ends(nodes[receiver], numbers))
        seed = torch.full((len(nodes),), float(now), dtype=self.dtype)
        embedded = self.embed(nodes)
        if not len(receiver):
            return self.join(torch.cat([torch.zeros_like(embedded), embedded], dim=1))
        to = torch.from_numpy(receiver)
        links = self._mix(to, torch.cat([other, message], dim=1), time, seed)
        # neighbours stand behind the nodes themselves
        both = torch.cat([embedded, other])
        edges = torch.stack([len(nodes) + torch.arange(len(receiver)), to])
        mixed = self.neighbours(both, edges, time, torch.cat([seed, seed.new_zeros(len(receiver))]))
        return self.join(torch.cat([links, mixed[: len(nodes)]], dim=1))

    def _mix(self, to: Tensor, edges: Tensor, time: Tensor, seed: Tensor) -> Tensor:
        """Mix the links of nodes (n,); those without links are alike, and share a row."""
        linked, index = to.unique_consecutive(return_inverse=True)
        num_rows = min(len(linked) + 1, len(seed))
        found = self.link(
            torch.stack([torch.zeros_like(index), index]), edges, time, seed[:num_rows]
        )
        found_row = torch.full((len(seed),), num_rows - 1)
        found_row[linked] = torch.arange(len(linked))
        return found[found_row]
