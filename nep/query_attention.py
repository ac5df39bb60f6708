"""Self-attention among the query edges of each snapshot."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn

from nep.layers.dropout import ByteDropout


@dataclass(frozen=True, slots=True)
class QueryPadding:
    """Where each query edge sits in a (B, K) table, K the most query edges of one snapshot.

    Attributes:
        slot: (Q,) int64, the table slot of each query edge: row times K plus column.
        source: (B * K,) int64, the query edge of each slot; an arbitrary one in a slot of padding.
        bias: (B, 1, K), or (1, K, K) for a single snapshot, added to attention logits: 0 where a
            slot may be attended to, else -inf.
    """

    slot: Tensor
    source: Tensor
    bias: Tensor

    @classmethod
    def from_snapshots(cls, query_snapshot: Tensor, num_snapshots: int) -> QueryPadding:
        """Give each query edge the next column of its snapshot's row.

        Args:
            query_snapshot: (Q,) int64 in 0..B-1, in any order; Q at least 1.
            num_snapshots: B.
        """
        if num_snapshots == 1:  # its query edges are the table: nothing to pad
            slot = torch.arange(len(query_snapshot), device=query_snapshot.device)
            bias = torch.zeros(1, len(slot), len(slot), device=slot.device)
            return cls(slot=slot, source=slot, bias=bias)
        count = torch.bincount(query_snapshot, minlength=num_snapshots)  # (B,)
        width = int(count.max())
        order = torch.argsort(query_snapshot, stable=True)
        rank = torch.arange(len(order), device=order.device)
        first = count.cumsum(0) - count  # (B,)
        in_order = query_snapshot[order]
        slot = torch.empty_like(order)
        slot[order] = in_order * width + rank - first[in_order]
        source = slot.new_zeros(num_snapshots * width)
        source[slot] = torch.arange(len(slot), device=slot.device)
        is_filled = torch.arange(width, device=order.device) < count.unsqueeze(1)
        # A row without query edges may attend to its padding: finite, and nothing reads it.
        is_open = is_filled | (count == 0).unsqueeze(1)
        bias = torch.zeros_like(is_open, dtype=torch.float32).masked_fill(~is_open, -torch.inf)
        return cls(slot=slot, source=source, bias=bias.unsqueeze(1))


class QueryAttentionLayer(nn.Module):
    """One transformer encoder layer (post-norm, ReLU), equal to `torch.nn.TransformerEncoderLayer`.

    Only the attention itself works on the padded table. The projections and the feed-forward
    network, where nearly all the arithmetic is, run on the Q rows that exist: about half of the
    table.

    Args:
        units: width D.
        heads: attention heads.
        feed_forward_units: hidden width of the feed-forward network.
        dropout: probability, at the four places where the standard layer has it.

    Source: Vaswani et al. 2017; paper section 4.3 and appendix C.
    """

    def __init__(self, units: int, heads: int, feed_forward_units: int, dropout: float) -> None:
        super().__init__()
        if heads < 1 or units % heads:
            raise ValueError(
                f"transformer_heads must divide the width of a query edge, got {heads} heads "
                f"for width {units}. Choose for instance 2."
            )
        self.heads = heads
        self.project_in = nn.Linear(units, 3 * units)
        self.project_out = nn.Linear(units, units)
        self.feed_forward_in = nn.Linear(units, feed_forward_units)
        self.feed_forward_out = nn.Linear(feed_forward_units, units)
        self.attention_norm = nn.LayerNorm(units)
        self.feed_forward_norm = nn.LayerNorm(units)
        self.dropout = ByteDropout(dropout)
        nn.init.xavier_uniform_(self.project_in.weight)
        nn.init.zeros_(self.project_in.bias)
        nn.init.zeros_(self.project_out.bias)

    def forward(self, query: Tensor, padding: QueryPadding) -> Tensor:
        """Attend once: (Q, D) -> (Q, D)."""
        query = self.attention_norm(query + self.dropout(self._attend(query, padding)))
        hidden = self.dropout(torch.relu(self.feed_forward_in(query)))
        return self.feed_forward_norm(query + self.dropout(self.feed_forward_out(hidden)))

    def _attend(self, query: Tensor, padding: QueryPadding) -> Tensor:
        num_rows, _, width = padding.bias.shape
        head_units = query.shape[1] // self.heads
        projected = self.project_in(query).view(len(query), 3 * self.heads, head_units)
        # Heads first, then padded: the three parts come out as contiguous matrices for `bmm`.
        table = projected.transpose(0, 1).index_select(1, padding.source)
        q, k, v = table.view(3, self.heads * num_rows, width, head_units).unbind(0)
        logits = torch.baddbmm(
            padding.bias.repeat(self.heads, 1, 1), q, k.transpose(1, 2), alpha=head_units**-0.5
        )  # (heads * B, K, K)
        attended = self.dropout(logits.softmax(dim=2)) @ v
        attended = attended.view(self.heads, num_rows * width, head_units)
        return self.project_out(
            attended.index_select(1, padding.slot).transpose(0, 1).reshape(query.shape)
        )


class QueryAttention(nn.Module):
    """Transformer encoder over each snapshot's query edges, which are a set: no positions.

    Args:
        units: width D.
        layers: number of encoder layers.
        heads: attention heads.
        feed_forward_units: hidden width of the feed-forward networks.
        dropout: probability.
    """

    def __init__(
        self, units: int, layers: int, heads: int, feed_forward_units: int, dropout: float
    ) -> None:
        super().__init__()
        self.layers = nn.ModuleList(
            QueryAttentionLayer(units, heads, feed_forward_units, dropout) for _ in range(layers)
        )

    def forward(self, query: Tensor, query_snapshot: Tensor, num_snapshots: int) -> Tensor:
        """Let the query edges of each snapshot attend to each other.

        Args:
            query: (Q, D).
            query_snapshot: (Q,) int64 in 0..B-1, in any order.
            num_snapshots: B.

        Returns:
            (Q, D).
        """
        if len(query) == 0:
            return query
        padding = QueryPadding.from_snapshots(query_snapshot, num_snapshots)
        for layer in self.layers:
            query = layer(query, padding)
        return query
