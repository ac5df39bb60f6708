"""The layers of `dgl.nn` that encoders use, on any graph with DGL's calls, with DGL's weights."""

from __future__ import annotations

import math
from typing import Any

import torch
from torch import Tensor, nn

from datamodules import dgl_stand_in as fn
from datamodules.dgl_stand_in import GraphStandIn


class GraphConv(nn.Module):
    """The sum over in-neighbours: `dgl.nn.GraphConv` with norm "none", without weight and bias."""

    def __init__(self, in_units: int, out_units: int, **options: Any) -> None:
        super().__init__()
        wanted = {"norm": "none", "weight": False, "bias": False, "allow_zero_in_degree": True}
        assert options == wanted, options

    def forward(self, graph: GraphStandIn, node: Tensor) -> Tensor:
        """Sum: (N, D) -> (N, D)."""
        with graph.local_scope():
            graph.srcdata["h"] = node
            graph.update_all(fn.copy_u("h", "m"), fn.sum("m", "h"))
            return graph.dstdata["h"]


class TypedLinear(nn.Module):
    """A matrix for each type; rows lie type after type."""

    def __init__(self, in_units: int, out_units: int, num_types: int) -> None:
        super().__init__()
        self.W = nn.Parameter(torch.empty(num_types, in_units, out_units))
        nn.init.uniform_(self.W, -1 / math.sqrt(in_units), 1 / math.sqrt(in_units))

    def forward(self, rows: Tensor, types: Tensor, presorted: bool) -> Tensor:
        """Multiply each row by the matrix of its type: (n, in_units) -> (n, out_units)."""
        if not presorted:
            order = types.argsort(stable=True)
            sorted_rows: Tensor = self(rows[order], types[order], True)
            return sorted_rows[order.argsort()]
        counts = types.bincount(minlength=len(self.W)).tolist()
        return torch.cat([rows @ w for rows, w in zip(rows.split(counts), self.W, strict=True)])


class HGTConv(nn.Module):
    """`dgl.nn.HGTConv` without dropout and norm."""

    def __init__(
        self, in_units: int, head_units: int, heads: int, num_ntypes: int, num_etypes: int, **_: Any
    ) -> None:
        super().__init__()
        units = head_units * heads
        assert in_units == units
        self.linear_k, self.linear_q, self.linear_v, self.linear_a = (
            TypedLinear(units, units, num_ntypes) for _ in range(4)
        )
        self.relation_pri = nn.ParameterList(
            nn.Parameter(torch.ones(num_etypes)) for _ in range(heads)
        )
        self.relation_att, self.relation_msg = (
            nn.ModuleList(TypedLinear(head_units, head_units, num_etypes) for _ in range(heads))
            for _ in range(2)
        )
        self.skip = nn.Parameter(torch.ones(num_ntypes))

    def forward(
        self, graph: GraphStandIn, node: Tensor, ntype: Tensor, etype: Tensor, presorted: bool
    ) -> Tensor:
        """Convolve once: (N, units) -> (N, units)."""
        src, dst = graph.edges()
        heads = len(self.relation_pri)
        key, query, value = (
            linear(node, ntype, presorted).index_select(0, end).chunk(heads, dim=1)
            for linear, end in ((self.linear_k, src), (self.linear_q, dst), (self.linear_v, src))
        )
        incoming = []
        for head, importance in enumerate(self.relation_pri):
            sent = self.relation_att[head](key[head], etype, presorted) * query[head]
            scale = importance.index_select(0, etype) / math.sqrt(sent.shape[1])
            attention = graph.softmax(sent.sum(dim=1) * scale).unsqueeze(1)
            with graph.local_scope():
                graph.edata["m"] = attention * self.relation_msg[head](
                    value[head], etype, presorted
                )
                graph.update_all(fn.copy_e("m", "m"), fn.sum("m", "h"))
                incoming.append(graph.dstdata["h"])
        found: Tensor = self.linear_a(torch.cat(incoming, dim=1), ntype, presorted)
        share = torch.sigmoid(self.skip).index_select(0, ntype).unsqueeze(1)
        return share * found + (1 - share) * node
