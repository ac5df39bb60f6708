"""NEP-HAN: graph attention in two levels, within each edge type, then among edge types."""

from __future__ import annotations

from functools import partial

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from datamodules.batch import Batch
from nep.encoders.encoder import ConvolvingEncoder, check_heads, draw_glorot
from nep.layers.equal_rows import project_per_node_type
from nep.layers.segment import segment_softmax, segment_sum
from sgm.schema import EDGE_TYPES, NODE_TYPES

_NEGATIVE_SLOPE = 0.2  # of LeakyReLU


class HANConv(nn.Module):
    r"""Graph attention within each edge type, then attention among the edge types of a node.

    With node type :math:`\tau`, edge type :math:`\phi` and heads :math:`k`:

    .. math::
        h_i &= M_{\tau(i)} x_i + c_{\tau(i)} \\
        \alpha^k_{ij} &= \mathrm{softmax}_{j \in N_\phi(i)}
            \mathrm{LeakyReLU}(a_{\phi,k}^\top h^k_i + b_{\phi,k}^\top h^k_j) \\
        z^\phi_i &= \mathrm{ReLU}\big(\big\|_k \sum_{j \in N_\phi(i)} \alpha^k_{ij} h^k_j\big) \\
        \beta^\phi_i &= \mathrm{softmax}_{\phi} \; q^\top \tanh(W z^\phi_i + c) \\
        x'_i &= \sum_\phi \beta^\phi_i z^\phi_i

    over the edge types :math:`\phi` that enter the node. A node without incoming edges gets zero.

    Args:
        units: width of the nodes, in and out.
        heads: number of attention heads, each giving `units / heads` units.

    Raises:
        ValueError: if `units` is not a multiple of `heads`.

    Source: Wang et al. 2019 (arXiv:1903.07293), equations 1 to 9, an edge type for a meta-path.
    Differs: the weights of edge types are a node's own. Averaged over all nodes, as published,
    they would make a home's answer depend on the other homes of the batch.
    """

    def __init__(self, units: int, heads: int) -> None:
        super().__init__()
        check_heads("HAN", heads, units)
        head_units = units // heads
        self.heads = heads
        self.node_weight = nn.Parameter(torch.empty(len(NODE_TYPES), units, units))  # M
        self.node_bias = nn.Parameter(torch.zeros(len(NODE_TYPES), units))
        self.attend_dst = nn.Parameter(torch.empty(len(EDGE_TYPES), heads, head_units))  # a
        self.attend_src = nn.Parameter(torch.empty(len(EDGE_TYPES), heads, head_units))  # b
        self.semantic = nn.Linear(units, units)  # W
        self.semantic_query = nn.Linear(units, 1, bias=False)  # q
        draw_glorot(units, units, self.node_weight)
        draw_glorot(2 * head_units, 1, self.attend_dst, self.attend_src)

    def forward(self, batch: Batch, node: Tensor) -> Tensor:
        """Convolve once: (N, units) -> (N, units)."""
        hidden = project_per_node_type(batch, node, self.node_weight, self.node_bias)
        hidden = hidden.unflatten(1, (self.heads, -1))  # (N, K, d)
        # One segment per destination and edge type that occur together, P of them.
        counts = torch.tensor(batch.edge_counts, device=batch.edge_dst.device)
        etype = torch.repeat_interleave(counts)  # (E,)
        pair, segment = (batch.edge_dst * len(EDGE_TYPES) + etype).unique(return_inverse=True)
        pair_dst = pair // len(EDGE_TYPES)

        message = hidden.index_select(0, batch.edge_src)  # (E, K, d)
        of_src = message * batch.repeat_per_edge_type(self.attend_src)
        of_dst = hidden.index_select(0, batch.edge_dst)
        of_dst = of_dst * batch.repeat_per_edge_type(self.attend_dst)
        logits = F.leaky_relu(of_src.sum(dim=2) + of_dst.sum(dim=2), _NEGATIVE_SLOPE)  # (E, K)
        attention = segment_softmax(logits, segment, len(pair)).unsqueeze(2)
        z = torch.relu(segment_sum((attention * message).flatten(1), segment, len(pair)))  # (P, D)
        weight = self.semantic_query(torch.tanh(self.semantic(z)))  # (P, 1)
        weight = segment_softmax(weight, pair_dst, batch.num_nodes)
        return segment_sum(weight * z, pair_dst, batch.num_nodes)


class HAN(ConvolvingEncoder):
    """Heterogeneous graph attention, an edge type for a meta-path.

    Args:
        units: width of the node and edge embeddings and of every convolution.
        heads: attention heads of each convolution.
        num_convolutions: 1, as the paper's appendix has for the other encoders.
        residual: whether a convolution's input is added to its output. On: attention runs over a
            node's neighbours and never over itself.

    Source: Wang et al. 2019; a variant that the paper's table leaves out.
    """

    uses_edges = False

    def __init__(
        self, units: int = 64, heads: int = 2, num_convolutions: int = 1, residual: bool = True
    ) -> None:
        super().__init__(units, num_convolutions, partial(HANConv, units, heads), residual)
        self.heads = heads
