"""NEP-HAN: graph attention in two levels, within each edge type, then among edge types."""

from __future__ import annotations

from functools import partial
from typing import Any

import torch
from torch import Tensor, nn
from torch.nn.functional import leaky_relu

from datamodules.message_passing import ETYPE, NTYPE, edge_softmax, fn, make_graph
from nep.paper.encoders.encoder import ConvolvingEncoder, check_heads, make_glorot, multiply_by_type
from sgm.schema import EDGE_TYPES, NODE_TYPES

SLOPE = 0.2  # of LeakyReLU


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

    Source: Wang et al. 2019 (arXiv:1903.07293), equations 1 to 9, an edge type for a meta-path.
    Differs: the weights of edge types are a node's own. Averaged over all nodes, as published,
    they would make a home's answer depend on the other homes of the batch.
    """

    def __init__(self, units: int, heads: int) -> None:
        super().__init__()
        check_heads("HAN", heads, units)
        self.heads, each = heads, (len(EDGE_TYPES), heads, units // heads)
        (self.node_weight,) = make_glorot(units, units, (len(NODE_TYPES), units, units))  # M
        self.node_bias = nn.Parameter(torch.zeros(len(NODE_TYPES), units))
        self.attend_dst, self.attend_src = make_glorot(2 * each[2], 1, each, each)  # a, b
        self.semantic = nn.Linear(units, units)  # W
        self.semantic_query = nn.Linear(units, 1, bias=False)  # q
        self.attention = nn.Identity()  # alpha passes through, to be looked at

    def forward(self, graph: Any, node: Tensor) -> Tensor:
        """Convolve once, on a homogeneous view of DGL: (N, units) -> (N, units)."""
        h = multiply_by_type(node, graph.ndata[NTYPE], self.node_weight, self.node_bias)
        h, etype = h.unflatten(1, (self.heads, -1)), graph.edata[ETYPE]  # (N, K, d), (E,)
        src, dst = (end.long() for end in graph.edges())
        # A node for each pair of destination and edge type that occur together, P of them.
        pair, of_edge = (dst * len(EDGE_TYPES) + etype).unique(return_inverse=True)
        within = make_graph(src, of_edge, len(node), len(pair))  # nodes -> pairs
        among = make_graph(
            torch.arange(len(pair), device=pair.device),
            pair // len(EDGE_TYPES),
            len(pair),
            len(node),
        )  # pairs -> nodes
        ends = ((dst, self.attend_dst), (src, self.attend_src))
        logit = sum((h[end] * weight[etype]).sum(dim=2) for end, weight in ends)  # (E, K)
        within.srcdata["h"] = h
        alpha = self.attention(edge_softmax(within, leaky_relu(logit, SLOPE)))
        within.edata["alpha"] = alpha.unsqueeze(2)
        within.update_all(fn.u_mul_e("h", "alpha", "m"), fn.sum("m", "z"))
        z = torch.relu(within.dstdata["z"].flatten(1))  # (P, D)
        among.srcdata["z"] = z
        among.edata["beta"] = edge_softmax(among, self.semantic_query(torch.tanh(self.semantic(z))))
        among.update_all(fn.u_mul_e("z", "beta", "m"), fn.sum("m", "x"))
        return among.dstdata["x"]


class HAN(ConvolvingEncoder):
    """Heterogeneous graph attention, an edge type for a meta-path, added to what was there.

    Attention runs over a node's neighbours and never over itself.

    Args:
        units: width of the node and edge embeddings and of every convolution.
        heads: attention heads of each convolution.
        num_convolutions: 1, as the paper's appendix has for the other encoders.

    Source: Wang et al. 2019; a variant that the paper's table leaves out.
    """

    uses_edges = False

    def __init__(self, units: int = 64, heads: int = 2, num_convolutions: int = 1) -> None:
        super().__init__(units, num_convolutions, partial(HANConv, units, heads), residual=True)
        self.heads = heads
