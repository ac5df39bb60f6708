"""TGN: a memory of every node, and attention over its latest events."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import torch
from torch import Tensor, nn
from torch_geometric.nn import TransformerConv
from torch_geometric.nn.models.tgn import IdentityMessage, MeanAggregator, TGNMemory

from tools.temporal.network import PairDecoder, TemporalNetwork
from tools.temporal.stream import MESSAGE_DIM, EventStream, StreamQuestions


class MessageStore:
    """Messages that nodes sent in the last look that concerned them; later ones replace them.

    Rows lie in the order in which they came; what has been replaced is dropped when there is no
    room left, so that a look costs as much as it has events.
    """

    def __init__(self, num_nodes: int, raw_dim: int, dtype: torch.dtype) -> None:
        """Start empty, with `raw_dim` columns of a message."""
        self.num_nodes = num_nodes
        self._first = torch.zeros(num_nodes, dtype=torch.long)
        self._count = torch.zeros(num_nodes, dtype=torch.long)
        self._size = 0
        self._ids = torch.zeros(3, 0, dtype=torch.long)  # sender, receiver, time
        self._raw = torch.zeros(0, raw_dim, dtype=dtype)

    def grow(self, num_nodes: int) -> None:
        """Make room for nodes that have sent nothing."""
        more = self._first.new_zeros(num_nodes - self.num_nodes)
        self._first = torch.cat([self._first, more])
        self._count = torch.cat([self._count, more])
        self.num_nodes = num_nodes

    def put(self, src: Tensor, dst: Tensor, t: Tensor, raw: Tensor) -> None:
        """Keep messages (n,), (n,), (n,) and (n, M) in place of earlier ones of the same `src`."""
        if self._size + len(src) > len(self._raw):
            self._make_room(len(src))
        nodes, order = src.sort(stable=True)
        nodes, count = nodes.unique_consecutive(return_counts=True)
        rows = slice(self._size, self._size + len(src))
        self._ids[:, rows] = torch.stack([src, dst, t])[:, order]
        self._raw[rows] = raw[order]
        self._first[nodes] = self._size + count.cumsum(0) - count
        self._count[nodes] = count
        self._size += len(src)

    def take(self, nodes: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Return sender, receiver, time and content of the messages of nodes, one after another."""
        rows = self._find_rows(nodes)
        src, dst, t = self._ids[:, rows]
        return src, dst, t, self._raw[rows]

    def _find_rows(self, nodes: Tensor) -> Tensor:
        count = self._count[nodes]
        shift = self._first[nodes] - (count.cumsum(0) - count)
        shift = shift.repeat_interleave(count)
        return shift + torch.arange(len(shift))

    def _make_room(self, more: int) -> None:
        """Drop what has been replaced, and have room for as much again."""
        rows = self._find_rows(torch.arange(self.num_nodes))
        size = len(rows)
        ids = self._ids.new_zeros(3, 2 * (size + more))
        raw = self._raw.new_zeros(2 * (size + more), self._raw.shape[1])
        ids[:, :size], raw[:size] = self._ids[:, rows], self._raw[rows]
        self._ids, self._raw, self._size = ids, raw, size
        self._first = self._count.cumsum(0) - self._count


class _GrowingMemory(TGNMemory):
    """PyG's memory for nodes that become known on the way.

    Differs: messages are kept in tables, where PyG has a dictionary of tensors, one for each node;
    thousands of small tensors were most of the time of a training.
    """

    num_nodes: int
    memory: Tensor
    last_update: Tensor
    msg_s_store: MessageStore
    msg_d_store: MessageStore

    def grow(self, num_nodes: int) -> None:
        """Make room for nodes, with the memory of those that were never met."""
        added = num_nodes - self.num_nodes
        if added <= 0:
            return
        empty = torch.zeros(added, self.memory_dim, dtype=self.gru.weight_ih.dtype)
        self.memory = torch.cat([self.memory, empty])
        self.last_update = torch.cat([self.last_update, self.last_update.new_zeros(added)])
        self._assoc = torch.zeros(num_nodes, dtype=torch.long)
        self.msg_s_store.grow(num_nodes)
        self.msg_d_store.grow(num_nodes)
        self.num_nodes = num_nodes

    def start(self, num_nodes: int) -> None:
        """Forget everything, and make room for nodes."""
        self.num_nodes = 0
        self.memory = torch.zeros(0, self.memory_dim, dtype=self.gru.weight_ih.dtype)
        self.last_update = torch.zeros(0, dtype=torch.long)
        self._reset_message_store()
        self.grow(num_nodes)

    def _reset_message_store(self) -> None:
        dtype = self.gru.weight_ih.dtype
        self.msg_s_store = MessageStore(self.num_nodes, self.raw_msg_dim, dtype)
        self.msg_d_store = MessageStore(self.num_nodes, self.raw_msg_dim, dtype)

    def _update_msg_store(
        self, src: Tensor, dst: Tensor, t: Tensor, raw_msg: Tensor, msg_store: MessageStore
    ) -> None:
        msg_store.put(src, dst, t, raw_msg)

    def _compute_msg(
        self, n_id: Tensor, msg_store: MessageStore, msg_module: nn.Module
    ) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        src, dst, t, raw_msg = msg_store.take(n_id)
        t_enc = self.time_enc((t - self.last_update[src]).to(raw_msg.dtype))
        return msg_module(self.memory[src], self.memory[dst], raw_msg, t_enc), t, src, dst


class TGN(TemporalNetwork):
    """PyG's `TGNMemory` with identity messages and their mean; attention on top.

    Source: Rossi et al. 2020, "Temporal Graph Networks for Deep Learning on Dynamic Graphs". As
    in PyG's example, the events of a batch, here those of a look, are remembered together. The mean
    of their messages, since all are of one time, and none of them is the last.
    """

    name: ClassVar[str] = "TGN"

    def __init__(
        self, units: int = 32, num_events: int = 16, dropout: float = 0.1, heads: int = 2
    ) -> None:
        super().__init__(units, num_events, dropout)
        self.settings["heads"] = heads
        raw = MESSAGE_DIM + 2 * units  # what an event says, and what is known of both its ends
        self.raw_units = raw
        message = IdentityMessage(raw, units, units)
        self.memory = _GrowingMemory(1, raw, units, units, message, MeanAggregator())
        self.attention = TransformerConv(
            units, units // heads, heads=heads, dropout=dropout, edge_dim=units + MESSAGE_DIM
        )
        self.decode = PairDecoder(units)

    def reset(self, stream: EventStream, text: np.ndarray) -> None:
        """Start with a stream of new homes, and an empty memory."""
        super().reset(stream, text)
        self.memory.start(stream.num_nodes)

    def note(self, numbers: np.ndarray) -> None:
        """Remember events: they change the memories of their things and places."""
        self.memory.detach()  # also after a look without an event: its graph has been used
        if not len(numbers):
            return
        stream = self.stream
        self.memory.grow(stream.num_nodes)
        src, dst = stream.src[numbers], stream.dst[numbers]
        message, _ = self.gather(numbers)
        with torch.no_grad():  # raw messages are stored: gradients flow through what reads them
            known = torch.cat([message, self.embed(src), self.embed(dst)], dim=1)
        time = torch.from_numpy(stream.time[numbers].copy())
        self.memory.update_state(
            torch.from_numpy(src.copy()), torch.from_numpy(dst.copy()), time, known
        )

    def forward(self, asked: StreamQuestions) -> Tensor:
        """Return logits of all places, (Q, F)."""
        self.memory.grow(self.stream.num_nodes)
        return self.decode(*self.encode_pairs(asked, self._encode), asked)

    def _encode(self, nodes: np.ndarray, now: int) -> Tensor:
        stream = self.stream
        events = stream.find_latest(nodes, self.num_events)
        receiver, column = np.nonzero(events >= 0)
        numbers = events[receiver, column]
        ends = stream.find_other_ends(nodes[receiver], numbers)
        everyone, index = np.unique(np.concatenate([nodes, ends]), return_inverse=True)
        memory, last_update = self.memory(torch.from_numpy(everyone))
        hidden = memory + self.embed(everyone)
        targets, other = index[: len(nodes)], index[len(nodes) :]
        message, time = self.gather(numbers)
        edge_index = torch.from_numpy(np.stack([other, targets[receiver]]))
        since = (last_update[edge_index[0]] - time).to(hidden.dtype)
        edge = torch.cat([self.memory.time_enc(since), message], dim=1)
        hidden = hidden + self.attention(hidden, edge_index, edge)
        return hidden[torch.from_numpy(targets)]
