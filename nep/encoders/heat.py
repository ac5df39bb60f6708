"""NEP-HEAT: attention by node type, edge type and edge features."""

from __future__ import annotations

from functools import partial
from typing import Literal, get_args

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from datamodules.batch import Batch
from nep.encoders.encoder import ConvolvingEncoder, check_heads, draw_glorot
from nep.layers.equal_rows import Linear, apply_to_each, multiply, project_per_node_type
from nep.layers.segment import attend, segment_softmax, segment_sum
from sgm.checks import check_choice
from sgm.schema import EDGE_TYPES, NODE_TYPES

# How the neighbours of a node share its attention.
Sharing = Literal["softmax", "sigmoid"]

_NEGATIVE_SLOPE = 0.2  # of every LeakyReLU


class HEATConv(nn.Module):
    r"""Attention over a node's incoming edges of all types, by node and edge type and features.

    With node type :math:`\tau`, edge type :math:`\phi`, edge attributes :math:`e` and heads
    :math:`k`:

    .. math::
        h_i &= M_{\tau(i)} x_i + c_{\tau(i)} \\
        t_{ij} &= \mathrm{LeakyReLU}(T_{\phi(ij)}), \quad
        u_{ij} = \mathrm{LeakyReLU}(U e_{ij}) \\
        \alpha^k_{ij} &= \mathrm{softmax}_{j \in N(i)}
            \mathrm{LeakyReLU}(a_k^\top [h_i \| h_j \| t_{ij} \| u_{ij}]) \\
        x'_i &= b + \big\|_k \sum_{j \in N(i)} \alpha^k_{ij} W_k [h_j \| u_{ij}]

    A node without incoming edges gets `b`; with `root_weight`, :math:`h_i` is added for every node.
    With sigmoid instead of softmax every edge has a weight of its own, so that the sum grows with
    the number of neighbours: attention that can count.

    The concatenations are never made, since what follows them is linear: each of the four parts
    of an attention logit is a scalar per node, edge type or edge; the edge part of the message is
    summed before it is projected; and :math:`h` itself is not needed, since :math:`W_k M_\tau`
    and :math:`a_k^\top M_\tau` are products of small matrices.

    Args:
        in_units: width of the input nodes.
        out_units: width of the output nodes, over all heads.
        edge_units: width of the edge attributes.
        heads: number of attention heads, each giving `out_units / heads` units.
        edge_type_units: width of the edge type embedding.
        edge_attribute_units: width of the edge attribute embedding.
        root_weight: whether the node's own :math:`h_i` is added.
        sharing: "softmax" or "sigmoid".

    Raises:
        ValueError: if `out_units` is not a multiple of `heads`, or there is no such sharing.

    Source: Mo et al. 2021 (arXiv:2106.07161); paper section 4.3. Differs: no
    activation after the sum, which is the caller's; each head gives a share of the width, so that
    the width does not depend on the number of heads.
    """

    def __init__(
        self,
        in_units: int,
        out_units: int,
        edge_units: int,
        heads: int,
        edge_type_units: int,
        edge_attribute_units: int,
        root_weight: bool = False,
        sharing: Sharing = "softmax",
    ) -> None:
        super().__init__()
        check_heads("HEAT", heads, out_units)
        check_choice("sharing", sharing, get_args(Sharing))
        self.root_weight = root_weight
        self.sharing = sharing
        head_units = out_units // heads
        self.heads = heads
        self.node_weight = nn.Parameter(torch.empty(len(NODE_TYPES), in_units, out_units))  # M
        self.node_bias = nn.Parameter(torch.zeros(len(NODE_TYPES), out_units))  # c
        self.edge_type = nn.Parameter(torch.empty(len(EDGE_TYPES), edge_type_units))  # T
        self.edge_attribute = Linear(edge_units, edge_attribute_units, bias=False)  # U
        # a, in its four parts
        self.attend_dst = nn.Parameter(torch.empty(out_units, heads))
        self.attend_src = nn.Parameter(torch.empty(out_units, heads))
        self.attend_edge_type = nn.Parameter(torch.empty(edge_type_units, heads))
        self.attend_edge_attribute = nn.Parameter(torch.empty(edge_attribute_units, heads))
        # W, in its two parts
        self.message_node = nn.Parameter(torch.empty(out_units, out_units))
        self.message_edge = nn.Parameter(torch.empty(heads, edge_attribute_units, head_units))
        self.bias = nn.Parameter(torch.zeros(out_units))
        # Glorot as if each concatenated input were one matrix: the parts share its fan-in.
        parts = [self.attend_dst, self.attend_src]
        parts += [self.attend_edge_type, self.attend_edge_attribute]
        draw_glorot(in_units, out_units, self.node_weight)
        nn.init.normal_(self.edge_type)
        nn.init.xavier_uniform_(self.edge_attribute.weight)
        draw_glorot(sum(len(part) for part in parts), heads, *parts)
        fan_in = out_units + edge_attribute_units
        draw_glorot(fan_in, head_units, self.message_node, self.message_edge)

    def forward(self, batch: Batch, node: Tensor, edge: Tensor) -> Tensor:
        """Convolve once: (N, in_units), (E, edge_units) -> (N, out_units)."""
        message, logit_src, logit_dst = self._project_nodes(batch, node)
        attribute = F.leaky_relu(self.edge_attribute(edge), _NEGATIVE_SLOPE)  # (E, A)
        edge_type = F.leaky_relu(self.edge_type, _NEGATIVE_SLOPE)
        logit_type = multiply(edge_type, self.attend_edge_type)
        logits = (
            logit_dst.index_select(0, batch.edge_dst)
            + logit_src.index_select(0, batch.edge_src)
            + batch.repeat_per_edge_type(logit_type)
            + multiply(attribute, self.attend_edge_attribute)
        )  # (E, K)
        # A batch that was pruned has edges into one node in six: sums are made for those alone.
        entered, entry = batch.find_entered()  # (R,), (E,)
        logits = F.leaky_relu(logits, _NEGATIVE_SLOPE)
        if self.sharing == "softmax":
            attention = segment_softmax(logits, entry, len(entered))  # (E, K)
        else:
            attention = apply_to_each(torch.sigmoid, logits)
        node_sum = attend(attention, message, batch.edge_src, entry, len(entered))  # (R, out_units)
        edge_sum = segment_sum(
            (attention.unsqueeze(2) * attribute.unsqueeze(1)).flatten(1), entry, len(entered)
        ).unflatten(1, (self.heads, -1))  # (R, K, A)
        of_heads = enumerate(self.message_edge)
        edge_part = torch.cat([multiply(edge_sum[:, k], weight) for k, weight in of_heads], dim=1)
        root = self.bias.expand(batch.num_nodes, -1)
        if self.root_weight:
            root = root + project_per_node_type(batch, node, self.node_weight, self.node_bias)
        return root.index_add(0, entered, node_sum + edge_part)

    def _project_nodes(self, batch: Batch, node: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Messages (N, out_units), attention logits as source and as destination (N, K)."""
        readout = torch.cat([self.message_node, self.attend_src, self.attend_dst], dim=1)
        weight = multiply(self.node_weight.flatten(0, 1), readout)
        projected = project_per_node_type(
            batch,
            node,
            weight.unflatten(0, (len(NODE_TYPES), -1)),
            multiply(self.node_bias, readout),
        )  # (N, out_units + 2 K)
        message, logit_src, logit_dst = projected.split(
            [self.message_node.shape[1], self.heads, self.heads], dim=1
        )
        return message, logit_src, logit_dst


class HEAT(ConvolvingEncoder):
    """Heterogeneous edge-enhanced graph attention, each convolution followed by ReLU.

    Args:
        units: width of the node and edge embeddings and of every convolution.
        heads: attention heads of each convolution.
        num_convolutions: the paper's appendix has 1.
        residual: whether a convolution's input is added to its output, after the ReLU.
        edge_units: widths of the embeddings of edge types and of edge attributes.
        root_weight: whether a convolution adds the node's own transformed features. Attention runs
            over a node's neighbours and never over itself: with neither this nor `residual`, the
            two ends of a query edge lose their own label and history.
        sharing: "softmax", or "sigmoid" for attention that can count, see `HEATConv`.
        alike: whether furniture of one label in one room then exchanges what it has, see
            `AlikeConv`.

    Source: paper section 4.3, NEP-HEAT, and appendix C. Where the paper states nothing, heads,
    root weight and residual are PyTorch Geometric's defaults; the edge widths are ours.
    `heat_two_heads.yaml` has two heads and the residual instead.
    """

    uses_edges = True
    has_relu = True
    has_equal_rows = True

    def __init__(
        self,
        units: int = 64,
        heads: int = 1,
        num_convolutions: int = 1,
        residual: bool = False,
        edge_units: tuple[int, int] = (16, 16),
        root_weight: bool = True,
        sharing: Sharing = "softmax",
        alike: bool = False,
    ) -> None:
        make = partial(HEATConv, units, units, units, heads, *edge_units, root_weight, sharing)
        super().__init__(units, num_convolutions, make, residual, alike)
        self.heads = heads
        self.edge_units = tuple(edge_units)
        self.root_weight = root_weight
        self.sharing = sharing
