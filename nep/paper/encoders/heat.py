"""NEP-HEAT: attention by node type, edge type and edge features."""

from __future__ import annotations

from functools import partial
from typing import Any

import torch
from torch import Tensor, nn
from torch.nn.functional import leaky_relu

from datamodules.message_passing import ETYPE, NTYPE, edge_softmax, fn
from nep.paper.encoders.encoder import ConvolvingEncoder, check_heads, make_glorot, multiply_by_type
from sgm.schema import EDGE_TYPES, NODE_TYPES

SLOPE = 0.2  # of every LeakyReLU
NUM_TYPES = len(NODE_TYPES), len(EDGE_TYPES)


class HEATConv(nn.Module):
    r"""Attention over a node's incoming edges of all types, by node and edge type and features.

    With node type :math:`\tau`, edge type :math:`\phi`, edge attributes :math:`e`, heads :math:`k`:

    .. math::
        h_i &= M_{\tau(i)} x_i + c_{\tau(i)}, \quad
        t_\phi = \mathrm{LeakyReLU}(T_\phi), \quad u_{ij} = \mathrm{LeakyReLU}(U e_{ij}) \\
        \alpha^k_{ij} &= \mathrm{softmax}_{j \in N(i)}
            \mathrm{LeakyReLU}(a_k^\top [h_i \| h_j \| t_{\phi(ij)} \| u_{ij}]) \\
        x'_i &= b + \big\|_k \sum_{j \in N(i)} \alpha^k_{ij} W_k [h_j \| u_{ij}]

    and :math:`+ h_i` with `root_weight`. No concatenation is made: `a` and `W` have a part for
    each of what they read, and edge attributes are summed before they are projected.

    Args:
        units: widths of nodes in, nodes out (over all heads) and edges in.
        heads: number of attention heads, each giving a share of the width.
        edge_units: widths of :math:`t` and :math:`u`.
        root_weight: whether the node's own :math:`h_i` is added.
        num_types: numbers of node types and of edge types.

    Source: Mo et al. 2021 (arXiv:2106.07161). Differs: no activation after the sum.
    """

    def __init__(
        self,
        units: tuple[int, int, int],
        heads: int = 1,
        edge_units: tuple[int, int] = (16, 16),
        root_weight: bool = True,
        num_types: tuple[int, int] = NUM_TYPES,
    ) -> None:
        super().__init__()
        (node_in, node_out, edge_in), (t, u), (nodes, edges) = units, edge_units, num_types
        check_heads("HEAT", heads, node_out)
        self.heads, self.root_weight, each = heads, root_weight, node_out // heads
        self.edge_attribute = nn.Linear(edge_in, u, bias=False)  # U
        (self.node_weight,) = make_glorot(node_in, node_out, (nodes, node_in, node_out))  # M
        self.node_bias = nn.Parameter(torch.zeros(nodes, node_out))  # c
        self.edge_type = nn.Parameter(torch.randn(edges, t))  # T
        nn.init.xavier_uniform_(self.edge_attribute.weight)
        parts = [(width, heads) for width in (node_out, node_out, t, u)]
        attend = make_glorot(2 * node_out + t + u, heads, *parts)  # a
        self.attend_dst, self.attend_src, self.attend_edge_type, self.attend_edge_attribute = attend
        message = make_glorot(node_out + u, each, (node_out, node_out), (heads, u, each))  # W
        self.message_node, self.message_edge = message
        self.bias = nn.Parameter(torch.zeros(node_out))  # b
        self.attention = nn.Identity()  # alpha passes through, to be looked at

    def forward(self, graph: Any, node: Tensor, edge: Tensor) -> Tensor:
        """Convolve once, on a graph of DGL: (N, units[0]), (E, units[2]) -> (N, units[1])."""
        h = multiply_by_type(node, graph.ndata[NTYPE], self.node_weight, self.node_bias)
        t, u = leaky_relu(self.edge_type, SLOPE), leaky_relu(self.edge_attribute(edge), SLOPE)
        of_type = (t @ self.attend_edge_type).index_select(0, graph.edata[ETYPE])
        with graph.local_scope():
            graph.srcdata["h"] = (h @ self.message_node).unflatten(1, (self.heads, -1))
            graph.srcdata["src"], graph.dstdata["dst"] = h @ self.attend_src, h @ self.attend_dst
            graph.apply_edges(fn.u_add_v("src", "dst", "logit"))
            logit = graph.edata["logit"] + of_type + u @ self.attend_edge_attribute  # (E, K)
            alpha = self.attention(edge_softmax(graph, leaky_relu(logit, SLOPE))).unsqueeze(2)
            graph.edata["alpha"], graph.edata["u"] = alpha, alpha * u.unsqueeze(1)  # (E, K, A)
            graph.update_all(fn.u_mul_e("h", "alpha", "m"), fn.sum("m", "h"))
            graph.update_all(fn.copy_e("u", "m"), fn.sum("m", "u"))
            edges = torch.einsum("nka,kad->nkd", graph.dstdata["u"], self.message_edge)
            total = (graph.dstdata["h"] + edges).flatten(1) + self.bias
        return total + h if self.root_weight else total


class HEAT(ConvolvingEncoder):
    """Convolutions, each followed by ReLU; then its input is added, if `residual`.

    Args:
        units: width of the node and edge embeddings and of every convolution.
        heads: attention heads of each convolution.
        num_convolutions: 1, as in the paper's appendix.
        residual: whether the input of a convolution is added to its output.
        edge_units: widths of what it learns of an edge's type, and of the edge's embedding.
        root_weight: whether a node's own transformed features are added.

    Source: paper section 4.3, NEP-HEAT, and appendix C. What it does not state are PyTorch
    Geometric's defaults; the edge widths are ours. Without `root_weight` and `residual` the ends
    of a query edge lose their own label and history: attention runs over neighbours alone.
    """

    uses_edges = has_relu = True

    def __init__(
        self,
        units: int = 64,
        heads: int = 1,
        num_convolutions: int = 1,
        residual: bool = False,
        edge_units: tuple[int, int] = (16, 16),
        root_weight: bool = True,
    ) -> None:
        type_units, attribute_units = edge_units  # of a file, a list
        widths = (type_units, attribute_units)
        make = partial(HEATConv, (units,) * 3, heads, widths, root_weight)
        super().__init__(units, num_convolutions, make, residual)
        self.heads, self.edge_units, self.root_weight = heads, widths, root_weight
