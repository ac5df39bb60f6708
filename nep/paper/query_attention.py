"""Self-attention among the query edges of each snapshot."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.nn import functional

from nep.paper.wide_attention import MOST_KEYS, attend_apart, choose_keys
from sgm.checks import check_at_least, check_shares

# Slots of a row, where no snapshot has more query edges. Wider rows waste fewer slots and make more
# pairs of query edges that never attend to each other; 48 and 64 took longer in training.
_ROW_SLOTS = 32


@dataclass(frozen=True)
class AttentionConfig:
    """Sizes of the transformer over query edges.

    Attributes:
        layers: encoder layers.
        heads: of each layer.
        feed_forward_units: hidden width of each layer's feed-forward network.
        dropout: probability in these layers; PyTorch's default, which the paper keeps.
    """

    layers: int = 2
    heads: int = 2
    feed_forward_units: int = 64
    dropout: float = 0.1

    def __post_init__(self) -> None:
        """Check the sizes and the share."""
        check_at_least(
            1, layers=self.layers, heads=self.heads, feed_forward_units=self.feed_forward_units
        )
        check_shares(dropout=self.dropout)


@dataclass(frozen=True, slots=True)
class QueryPadding:
    """Where each query edge sits in a table of R rows of C slots.

    The query edges of a snapshot lie side by side in one row, which several snapshots share: with
    a row for each snapshot more than half of the slots would be padding.

    Attributes:
        slot: (Q,) int64, the table slot of each query edge: row times C plus column.
        source: (R * C,) int64, the query edge of each slot; an arbitrary one in a slot of padding.
        bias: (R, C, C), added to attention logits: 0 within a snapshot, else -inf. Padding attends
            to padding: finite, and nothing reads it.
    """

    slot: Tensor
    source: Tensor
    bias: Tensor

    @classmethod
    def from_snapshots(
        cls, query_snapshot: Tensor, num_snapshots: int, dtype: torch.dtype = torch.float32
    ) -> QueryPadding:
        """Give each snapshot a place in a row and each query edge the next slot of it.

        Args:
            query_snapshot: (Q,) int64 in 0..B-1, in any order; Q at least 1.
            num_snapshots: B.
            dtype: of the bias.
        """
        count = torch.bincount(query_snapshot, minlength=num_snapshots)  # (B,)
        counts = count.tolist()
        num_slots = max(max(counts), min(_ROW_SLOTS, len(query_snapshot)))
        starts, num_rows = _pack(counts, num_slots)
        order = torch.argsort(query_snapshot, stable=True)
        rank = torch.arange(len(order), device=order.device)
        # of a snapshot: its first slot, less the query edges of the snapshots before it
        shift = torch.tensor(starts, device=order.device) - (count.cumsum(0) - count)  # (B,)
        slot = torch.empty_like(order)
        slot[order] = shift[query_snapshot[order]] + rank
        source = slot.new_zeros(num_rows * num_slots)
        source[slot] = rank
        owner = slot.new_full((num_rows * num_slots,), -1)
        owner[slot] = query_snapshot
        owner = owner.view(num_rows, num_slots)
        is_shut = owner.unsqueeze(2) != owner.unsqueeze(1)
        bias = torch.zeros_like(is_shut, dtype=dtype).masked_fill_(is_shut, -torch.inf)
        return cls(slot=slot, source=source, bias=bias)


def _pack(counts: list[int], num_slots: int) -> tuple[list[int], int]:
    """Pack snapshots into few rows: the largest first, each where it leaves the least room.

    Returns:
        The first slot of each snapshot, row times `num_slots` plus column, and the number of rows.
    """
    starts = [0] * len(counts)
    num_rows = 0
    rows: list[list[int]] = [[] for _ in range(num_slots + 1)]  # by the slots they have left
    for snapshot in sorted(range(len(counts)), key=counts.__getitem__, reverse=True):
        count = counts[snapshot]
        room = next((room for room in range(count, num_slots + 1) if rows[room]), None)
        if room is None:
            row, room, num_rows = num_rows, num_slots, num_rows + 1
        else:
            row = rows[room].pop()
        starts[snapshot] = row * num_slots + num_slots - room
        rows[room - count].append(row)
    return starts, num_rows


class ByteDropout(nn.Module):
    """Dropout with a probability rounded to 1/256.

    On a CPU `torch.nn.Dropout` draws its random numbers one by one in one thread, which took a
    quarter of the time of the query attention. One 64-bit draw serves eight elements here, and the
    bytes become the factors of the elements as floats: operations on booleans run one element at
    a time. Nine times faster together.

    Args:
        probability: of an element to become zero; the others are scaled up to keep the mean.

    Raises:
        ValueError: if the probability is not in [0, 1).
    """

    def __init__(self, probability: float) -> None:
        super().__init__()
        if not 0.0 <= probability < 1.0:
            raise ValueError(
                f"dropout must lie in [0, 1), got {probability}. The paper's default is 0.1."
            )
        self.threshold = min(round(probability * 256), 255)

    def forward(self, values: Tensor) -> Tensor:
        """Drop elements while training; the identity otherwise: (...) -> (...)."""
        if not self.training or self.threshold == 0:
            return values
        num_words = (values.numel() + 7) // 8
        words = torch.empty(num_words, dtype=torch.int64, device=values.device)
        # from -2^63 without an upper end: all 64 bits are random
        random_bytes = words.random_(-(2**63), None).view(torch.uint8)[: values.numel()]
        factor = random_bytes.to(values.dtype).ge_(self.threshold)
        return values * factor.mul_(256.0 / (256 - self.threshold)).view(values.shape)


class QueryAttentionLayer(nn.Module):
    """One transformer encoder layer (post-norm, ReLU), equal to `torch.nn.TransformerEncoderLayer`.

    Only the attention itself works on the padded table. The projections and the feed-forward
    network, where nearly all the arithmetic is, run on the Q rows that exist. A single snapshot has
    no table, and attends to at most `MOST_KEYS` of its query edges (`choose_keys`).

    Args:
        units: width D.
        config: the other sizes; dropout is at the four places where the standard layer has it.

    Source: Vaswani et al. 2017; paper section 4.3 and appendix C.
    """

    def __init__(self, units: int, config: AttentionConfig) -> None:
        super().__init__()
        heads, feed_forward_units = config.heads, config.feed_forward_units
        if units % heads:
            raise ValueError(
                f"attention.heads must divide the width of a query edge, got {heads} heads "
                f"for width {units}. Choose for instance 2."
            )
        self.heads = heads
        self.project_in = nn.Linear(units, 3 * units)
        self.project_out = nn.Linear(units, units)
        self.feed_forward_in = nn.Linear(units, feed_forward_units)
        self.feed_forward_out = nn.Linear(feed_forward_units, units)
        self.attention_norm = nn.LayerNorm(units)
        self.feed_forward_norm = nn.LayerNorm(units)
        self.dropout = ByteDropout(config.dropout)
        self.attention = nn.Identity()  # shares pass through, to be looked at
        nn.init.xavier_uniform_(self.project_in.weight)
        nn.init.zeros_(self.project_in.bias)
        nn.init.zeros_(self.project_out.bias)

    def forward(self, query: Tensor, padding: QueryPadding | None) -> Tensor:
        """Attend once: (Q, D) -> (Q, D); all to all without `padding`."""
        attended = self._attend_to_all(query) if padding is None else self._attend(query, padding)
        query = self.attention_norm(query + self.dropout(attended))
        hidden = self.dropout(torch.relu(self.feed_forward_in(query)))
        return self.feed_forward_norm(query + self.dropout(self.feed_forward_out(hidden)))

    def _attend_to_all(self, query: Tensor) -> Tensor:
        parts = self.project_in(query).view(1, len(query), 3, self.heads, -1)
        q, k, v = parts.permute(2, 0, 3, 1, 4)  # (1, K, Q, head_units) each
        bias = None
        if len(query) > MOST_KEYS:
            rows, weight = choose_keys(query)
            k, v = k.index_select(2, rows), v.index_select(2, rows)
            bias = weight.to(k.dtype).log().expand(len(query), -1)  # (Q, MOST_KEYS)
        dropout = self.dropout.threshold / 256 if self.training else 0.0
        attended = functional.scaled_dot_product_attention(q, k, v, bias, dropout_p=dropout)
        return self.project_out(attended.transpose(1, 2).reshape(len(query), -1))

    def _attend(self, query: Tensor, padding: QueryPadding) -> Tensor:
        num_rows, num_slots, _ = padding.bias.shape
        head_units = query.shape[1] // self.heads
        table = self.project_in(query).index_select(0, padding.source)
        # A head's part of a row is a matrix with a stride, which `bmm` takes as it is: no copies.
        parts = table.view(num_rows, num_slots, -1).split(head_units, dim=2)
        attended = []
        for head in range(self.heads):
            q, k, v = parts[head :: self.heads]
            logits = torch.baddbmm(padding.bias, q, k.transpose(1, 2), alpha=head_units**-0.5)
            share = self.dropout(self.attention(logits.softmax(dim=2)))
            attended.append(share @ v)  # (R, C, head_units)
        rows = torch.cat(attended, dim=2).view(num_rows * num_slots, -1)
        return self.project_out(rows.index_select(0, padding.slot))


class QueryAttention(nn.Module):
    """Transformer encoder over each snapshot's query edges, which are a set: no positions.

    Args:
        units: width D.
        config: the other sizes.
    """

    def __init__(self, units: int, config: AttentionConfig) -> None:
        super().__init__()
        self.layers = nn.ModuleList(
            QueryAttentionLayer(units, config) for _ in range(config.layers)
        )

    def forward(self, query: Tensor, query_snapshot: Tensor, num_snapshots: int) -> Tensor:
        """Let the query edges of each snapshot attend to each other: (Q, D), (Q,) -> (Q, D)."""
        if len(query) == 0:
            return query
        if num_snapshots > 1:
            is_wide = torch.bincount(query_snapshot) > MOST_KEYS
            if is_wide.any():  # in one table, its pairs would be those of all others, too
                return attend_apart(self, query, query_snapshot, is_wide)
        padding = None
        if num_snapshots > 1:
            padding = QueryPadding.from_snapshots(query_snapshot, num_snapshots, query.dtype)
        for layer in self.layers:
            query = layer(query, padding)
        return query
