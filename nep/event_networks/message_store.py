"""The latest messages of every node in tables, for TGN's memory."""

from __future__ import annotations

import torch
from torch import Tensor


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
