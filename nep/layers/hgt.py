"""Heterogeneous graph transformer."""

from __future__ import annotations

import math

import torch
from torch import Tensor, nn

from datamodules.batch import EDGE_TYPES, NODE_TYPES, Batch
from nep.layers.heads import check_heads
from nep.layers.per_node_type import project_per_node_type
from nep.layers.segment import segment_softmax, segment_sum


class HGTConv(nn.Module):
    r"""Attention over a node's incoming edges of all types, projected by node and edge type.

    With node type :math:`\tau`, edge type :math:`\phi`, heads :math:`k` of width :math:`d`:

    .. math::
        \alpha^k_{ij} &= \mathrm{softmax}_{j \in N(i)} \frac{\mu^k_{\phi(ij)}}{\sqrt{d}}
            (K^k_{\tau(j)} x_j)^\top A^k_{\phi(ij)} (Q^k_{\tau(i)} x_i) \\
        h_i &= \big\|_k \sum_{j \in N(i)} \alpha^k_{ij} M^{k\top}_{\phi(ij)} V^k_{\tau(j)} x_j \\
        x'_i &= s_{\tau(i)} O_{\tau(i)} \mathrm{ReLU}(h_i) + (1 - s_{\tau(i)}) x_i

    where :math:`s` is a sigmoid of one number per node type. A node without incoming edges keeps
    its share :math:`(1 - s) x_i`.

    A source node is transformed once per edge type it sends along, before edges gather it.

    Args:
        units: width of the nodes, in and out.
        heads: number of attention heads, each giving `units / heads` units.

    Raises:
        ValueError: if `units` is not a multiple of `heads`.

    Source: Hu et al. 2020 (arXiv:2003.01332), equations 1 to 5. Differs: no dropout; the gate of
    the residual is that of the authors' code.
    """

    def __init__(self, units: int, heads: int) -> None:
        super().__init__()
        check_heads("HGT", heads, units)
        head_units = units // heads
        self.heads = heads
        self.key = nn.Parameter(torch.empty(len(NODE_TYPES), units, units))  # K
        self.query = nn.Parameter(torch.empty(len(NODE_TYPES), units, units))  # Q
        self.value = nn.Parameter(torch.empty(len(NODE_TYPES), units, units))  # V
        self.output = nn.Parameter(torch.empty(len(NODE_TYPES), units, units))  # O
        shape = (len(EDGE_TYPES), heads, head_units, head_units)
        self.attend = nn.Parameter(torch.empty(shape))  # A
        self.message = nn.Parameter(torch.empty(shape))  # M
        self.importance = nn.Parameter(torch.ones(len(EDGE_TYPES), heads))  # mu
        self.skip = nn.Parameter(torch.ones(len(NODE_TYPES)))
        for weight in (self.key, self.query, self.value, self.output):
            bound = math.sqrt(3.0 / units)  # Glorot
            nn.init.uniform_(weight, -bound, bound)
        for weight in (self.attend, self.message):
            bound = math.sqrt(3.0 / head_units)
            nn.init.uniform_(weight, -bound, bound)

    def forward(self, batch: Batch, node: Tensor) -> Tensor:
        """Convolve once: (N, units) -> (N, units)."""
        query = project_per_node_type(batch, node, self.query).unflatten(
            1, (self.heads, -1)
        )  # (N, K, d)
        key, message = self._gather(batch, node)  # (E, K, d), twice
        scale = self.importance / math.sqrt(query.shape[2])  # (10, K)
        logits = (key * query.index_select(0, batch.edge_dst)).sum(dim=2)
        attention = segment_softmax(
            logits * batch.repeat_per_edge_type(scale), batch.edge_dst, batch.num_nodes
        )  # (E, K)
        incoming = segment_sum(
            (attention.unsqueeze(2) * message).flatten(1), batch.edge_dst, batch.num_nodes
        )
        share = torch.sigmoid(batch.repeat_per_node_type(self.skip.unsqueeze(1)))  # (N, 1)
        return (
            share * project_per_node_type(batch, torch.relu(incoming), self.output)
            + (1 - share) * node
        )

    def _gather(self, batch: Batch, node: Tensor) -> tuple[Tensor, Tensor]:
        """Keys and messages of every edge, each (E, K, d)."""
        key = project_per_node_type(batch, node, self.key).unflatten(1, (self.heads, -1))
        value = project_per_node_type(batch, node, self.value).unflatten(1, (self.heads, -1))
        key_blocks = dict(zip(NODE_TYPES, key.split(batch.node_counts), strict=True))
        value_blocks = dict(zip(NODE_TYPES, value.split(batch.node_counts), strict=True))
        first = {
            ntype: sum(batch.node_counts[:position]) for position, ntype in enumerate(NODE_TYPES)
        }
        keys, messages = [], []
        sources = batch.edge_src.split(batch.edge_counts)
        for position, ((ntype, _, _), source) in enumerate(zip(EDGE_TYPES, sources, strict=True)):
            local = source - first[ntype]
            sent = torch.einsum("nkd,kdo->nko", key_blocks[ntype], self.attend[position])
            keys.append(sent.index_select(0, local))
            sent = torch.einsum("nkd,kdo->nko", value_blocks[ntype], self.message[position])
            messages.append(sent.index_select(0, local))
        return torch.cat(keys), torch.cat(messages)
