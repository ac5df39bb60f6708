"""Our HEAT layer as PyTorch Geometric's, with equal weights."""

from __future__ import annotations

from copy import deepcopy

import torch
from torch import Tensor
from torch_geometric.nn import HEATConv as PyGHEATConv

from datamodules.batch import Batch
from nep.paper.encoders.heat import HEATConv
from sgm.schema import EDGE_TYPES, NODE_TYPES


class PyGLayer(torch.nn.Module):
    """PyTorch Geometric's `HEATConv` with the weights of one of our layers.

    With one head both are the same function of the nodes that edges enter; with several, theirs
    gives each head the whole width, of which ours keeps a share. Where no edge enters, ours gives
    its bias, and theirs zero.
    """

    def __init__(self, ours: HEATConv) -> None:
        super().__init__()
        _, in_units, out_units = ours.node_weight.shape
        edge_type_units, attribute = ours.edge_type.shape[1], ours.edge_attribute
        self.theirs = theirs = PyGHEATConv(
            in_units,
            out_units,
            len(NODE_TYPES),
            len(EDGE_TYPES),
            edge_type_units,
            attribute.in_features,
            attribute.out_features,
            heads=ours.heads,
            root_weight=ours.root_weight,
        )
        theirs.hetero_lin.is_sorted = True  # nodes lie type after type: saves it a sort
        attend = (
            ours.attend_dst,
            ours.attend_src,
            ours.attend_edge_type,
            ours.attend_edge_attribute,
        )
        message_edge = ours.message_edge.transpose(0, 1).flatten(1)  # (A, out_units)
        with torch.no_grad():
            theirs.hetero_lin.weight.copy_(ours.node_weight)
            theirs.hetero_lin.bias.copy_(ours.node_bias)
            theirs.edge_type_emb.weight.copy_(ours.edge_type)
            theirs.edge_attr_emb.weight.copy_(attribute.weight)
            theirs.att.weight.copy_(torch.cat(attend).t())
            theirs.lin.weight.copy_(torch.cat([ours.message_node, message_edge]).t())
            theirs.lin.bias.copy_(ours.bias)

    def forward(self, batch: Batch, node: Tensor, edge: Tensor) -> Tensor:
        """Convolve once: (N, in_units), (E, edge_units) -> (N, heads * out_units)."""
        return self.theirs(
            node,
            torch.stack([batch.edge_src, batch.edge_dst]),
            batch.node_type,
            batch.edge_type,
            edge,
        )

    def take_shares(self, out: Tensor) -> Tensor:
        """Of each head's whole width, the share that ours has: (N, heads * D) -> (N, D)."""
        heads = self.theirs.heads
        blocks = out.view(len(out), heads, heads, -1)  # by head, by share
        return blocks.diagonal(dim1=1, dim2=2).transpose(1, 2).flatten(1)


def compute_difference(ours: HEATConv, batch: Batch, node: Tensor, edge: Tensor) -> float:
    """Compare both layers: outputs where edges enter, and gradients of nodes and edges.

    In float64: the order of a sum over thousands of edges does not pass for a difference.

    Returns:
        The largest difference of any number.
    """
    theirs = PyGLayer(ours).double()
    entered = batch.edge_dst.unique()
    found = []
    for layer in (deepcopy(ours).double(), theirs):
        node, edge = (value.detach().double().requires_grad_() for value in (node, edge))
        if layer is theirs:
            out = theirs.take_shares(theirs(batch, node, edge))
        else:
            out = layer(batch.homogeneous, node, edge)
        out = out.index_select(0, entered)
        weight = torch.linspace(-1, 1, out.numel()).view_as(out)
        found.append((out.detach(), *torch.autograd.grad(out, [node, edge], weight)))
    return max(float((a - b).abs().max()) for a, b in zip(*found, strict=True))
