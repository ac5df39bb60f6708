"""NEP-HGT: a heterogeneous graph transformer."""

from __future__ import annotations

import math
from functools import partial

import torch
from torch import Tensor, nn

from datamodules.batch import Batch
from nep.encoders.encoder import ConvolvingEncoder, check_heads, draw_glorot
from nep.layers.equal_rows import project_per_node_type
from nep.layers.segment import segment_softmax, segment_sum
from sgm.schema import EDGE_TYPES, NODE_TYPES


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
        draw_glorot(units, units, self.key, self.query, self.value, self.output)
        draw_glorot(head_units, head_units, self.attend, self.message)

    def forward(self, batch: Batch, node: Tensor) -> Tensor:
        """Convolve once: (N, units) -> (N, units)."""
        query = project_per_node_type(batch, node, self.query)
        query = query.unflatten(1, (self.heads, -1))  # (N, K, d)
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
        projected = project_per_node_type(batch, torch.relu(incoming), self.output)
        return share * projected + (1 - share) * node

    def _gather(self, batch: Batch, node: Tensor) -> list[Tensor]:
        """Keys and messages of every edge, each (E, K, d)."""
        first_node = batch.first_node
        gathered = []
        for weight, of_types in ((self.key, self.attend), (self.value, self.message)):
            hidden = project_per_node_type(batch, node, weight).unflatten(1, (self.heads, -1))
            blocks, ends = batch.split_nodes(hidden), batch.split_edges(batch.edge_src)
            parts = []
            for matrix, ((ntype, *_), src) in zip(of_types, ends.items(), strict=True):
                sent = torch.einsum("nkd,kdo->nko", blocks[ntype], matrix)
                parts.append(sent.index_select(0, src - first_node[ntype]))
            gathered.append(torch.cat(parts))
        return gathered


class HGT(ConvolvingEncoder):
    """Convolutions of a heterogeneous graph transformer; each has its own gated residual.

    Args:
        units: width of the node and edge embeddings and of every convolution.
        heads: attention heads of each convolution.
        num_convolutions: 1, as the paper's appendix has for the other encoders.

    Source: Hu et al. 2020; a variant that the paper's table leaves out.
    """

    uses_edges = False

    def __init__(self, units: int = 64, heads: int = 2, num_convolutions: int = 1) -> None:
        super().__init__(units, num_convolutions, partial(HGTConv, units, heads))
        self.heads = heads
