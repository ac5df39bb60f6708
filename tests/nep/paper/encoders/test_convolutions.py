"""Laws of the convolutions, and their equality with plain loops over the published formulas."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest
import torch
from torch import nn

from datamodules import dgl_stand_in, dgl_stand_in_layers, message_passing
from datamodules.dgl_stand_in import GraphStandIn
from nep.paper.encoders import Encoder, hgt
from nep.paper.encoders.gcn import GCNConv
from nep.paper.encoders.han import HANConv
from nep.paper.encoders.heat import HEATConv
from nep.paper.encoders.hgt import ReluHGTConv
from sgm.schema import EDGE_TYPES, NODE_TYPES

IN, OUT, EDGE = 6, 8, 5
WIDTHS = (IN, OUT, EDGE)


def leaky(x):
    return np.where(x > 0, x, 0.2 * x)


def loop_heat(layer, graph, node, edge):
    """Mo et al. 2021, literally: project, embed, concatenate, attend, concatenate, project."""
    p = {name: value.detach().numpy() for name, value in layer.named_parameters()}
    ntype = np.repeat(np.arange(len(NODE_TYPES)), graph.node_counts)
    etype = np.repeat(np.arange(len(EDGE_TYPES)), graph.edge_counts)
    h = [x @ p["node_weight"][t] + p["node_bias"][t] for x, t in zip(node, ntype, strict=True)]
    out = np.tile(p["bias"], (graph.num_nodes, 1))
    if layer.root_weight:
        out += np.stack(h)
    src, dst = graph.edge_src.numpy(), graph.edge_dst.numpy()
    a = [p[f"attend_{part}"] for part in ("dst", "src", "edge_type", "edge_attribute")]
    width = OUT // layer.heads
    for i in range(graph.num_nodes):
        incoming = np.flatnonzero(dst == i)
        if len(incoming) == 0:
            continue
        t = leaky(p["edge_type"][etype[incoming]])
        u = leaky(edge[incoming] @ p["edge_attribute.weight"].T)
        h_src = np.stack([h[j] for j in src[incoming]])
        for k in range(layer.heads):
            wide = np.concatenate([np.tile(h[i], (len(incoming), 1)), h_src, t, u], axis=1)
            logit = leaky(wide @ np.concatenate([part[:, k] for part in a]))
            weight = np.exp(logit) / np.exp(logit).sum()
            own = slice(k * width, (k + 1) * width)
            w = np.concatenate([p["message_node"][:, own], p["message_edge"][k]])
            out[i, own] += weight @ np.concatenate([h_src, u], axis=1) @ w
    return out


def loop_gcn(layer, graph, node, edge):
    """Kipf & Welling 2017, equation 2, with the dense matrix."""
    adjacency = np.eye(graph.num_nodes)
    for src, dst in zip(graph.edge_src, graph.edge_dst, strict=True):
        adjacency[dst, src] += 1
    degree = graph.degree.numpy()
    scale = np.diag((degree + 1.0) ** -0.5)
    weight, bias = layer.weight.weight.detach().numpy(), layer.bias.detach().numpy()
    return scale @ adjacency @ scale @ node @ weight.T + bias


def list_types(graph):
    """Type of each node and of each edge."""
    return (
        np.repeat(np.arange(len(NODE_TYPES)), graph.node_counts),
        np.repeat(np.arange(len(EDGE_TYPES)), graph.edge_counts),
    )


def loop_hgt(layer, graph, node, edge):
    """Hu et al. 2020, literally: one softmax over all incoming edges per node and head."""
    p = {name: value.detach().numpy() for name, value in layer.layer.named_parameters()}
    ntype, etype = list_types(graph)
    src, dst = graph.edge_src.numpy(), graph.edge_dst.numpy()
    width = IN // 2
    out = np.zeros((graph.num_nodes, IN))
    for i in range(graph.num_nodes):
        h = np.zeros(IN)
        incoming = np.flatnonzero(dst == i)
        for k in range(2):
            own = slice(k * width, (k + 1) * width)
            query = (node[i] @ p["linear_q.W"][ntype[i]])[own]
            logits, messages = [], []
            for e in incoming:
                key = (node[src[e]] @ p["linear_k.W"][ntype[src[e]]])[own]
                value = (node[src[e]] @ p["linear_v.W"][ntype[src[e]]])[own]
                score = key @ p[f"relation_att.{k}.W"][etype[e]] @ query
                logits.append(score * p[f"relation_pri.{k}"][etype[e]] / np.sqrt(width))
                messages.append(value @ p[f"relation_msg.{k}.W"][etype[e]])
            if len(incoming):
                weight = np.exp(logits) / np.exp(logits).sum()
                h[own] = weight @ np.array(messages)
        share = 1 / (1 + np.exp(-p["skip"][ntype[i]]))
        out[i] = share * np.maximum(h, 0) @ p["linear_a.W"][ntype[i]] + (1 - share) * node[i]
    return out


def loop_han(layer, graph, node, edge):
    """Wang et al. 2019, literally, with edge types for meta-paths and weights per node."""
    p = {name: value.detach().numpy() for name, value in layer.named_parameters()}
    ntype, etype = list_types(graph)
    src, dst = graph.edge_src.numpy(), graph.edge_dst.numpy()
    h = (node[:, None] @ p["node_weight"][ntype])[:, 0] + p["node_bias"][ntype]
    width = IN // layer.heads
    out = np.zeros((graph.num_nodes, IN))
    for i in range(graph.num_nodes):
        found = []
        for kind in range(len(EDGE_TYPES)):
            sources = src[(dst == i) & (etype == kind)]
            if len(sources) == 0:
                continue
            z = np.zeros(IN)
            for k in range(layer.heads):
                own = slice(k * width, (k + 1) * width)
                a, b = p["attend_dst"][kind, k], p["attend_src"][kind, k]
                weight = np.exp(leaky(h[i, own] @ a + h[sources][:, own] @ b))
                z[own] = weight / weight.sum() @ h[sources][:, own]
            found.append(np.maximum(z, 0))
        if found:
            z = np.array(found)
            score = np.tanh(z @ p["semantic.weight"].T + p["semantic.bias"])
            weight = np.exp(score @ p["semantic_query.weight"][0])
            out[i] = weight / weight.sum() @ z
    return out


class Layer(nn.Module):
    """A layer on a batch, on either engine; edges are given to those that read them."""

    def __init__(self, layer, engine):
        super().__init__()
        self.layer, self.engine = layer, engine

    def forward(self, batch, node, edge):
        graph = batch.homogeneous
        if self.engine == "stand-in":
            graph = GraphStandIn(batch.edge_src, batch.edge_dst, batch.num_nodes)
            graph.ndata.update(_TYPE=batch.node_type, degree=batch.degree)
            graph.edata["_TYPE"] = batch.edge_type
        edges = (edge,) if isinstance(self.layer, HEATConv) else ()
        return self.layer(graph, node, *edges)


def make_hgt(engine):
    layer = ReluHGTConv(IN, 2)
    if engine == "stand-in" and type(layer.layer) is not dgl_stand_in_layers.HGTConv:
        counts = len(NODE_TYPES), len(EDGE_TYPES)
        layer.layer, dgls = dgl_stand_in_layers.HGTConv(IN, IN // 2, 2, *counts), layer.layer
        layer.layer.load_state_dict(dgls.state_dict())
        layer.layer.linear_a.register_forward_pre_hook(hgt._apply_relu)
    return layer


LAYERS = {
    "gcn": (lambda engine: GCNConv(IN, OUT), loop_gcn),
    "hgt": (make_hgt, loop_hgt),
    "han": (lambda engine: HANConv(IN, 2), loop_han),
    "han with one head": (lambda engine: HANConv(IN, 1), loop_han),
    "heat": (lambda engine: HEATConv(WIDTHS, 2, (3, 4), False), loop_heat),
    "heat with one head": (lambda engine: HEATConv(WIDTHS, 1, (3, 4), False), loop_heat),
    "heat with its own features": (lambda engine: HEATConv(WIDTHS, 2, (3, 4)), loop_heat),
}
ENGINES = [pytest.param("dgl", marks=pytest.mark.dgl), "stand-in"]


def make_layer(name, engine):
    torch.manual_seed(1)
    layer = LAYERS[name][0](engine)
    torch.manual_seed(2)
    # Constant at first, which would hide a lost bias or a lost weight of a type.
    for parameter_name, parameter in layer.named_parameters():
        if parameter_name.rpartition(".")[2] in ("node_bias", "bias", "skip") or (
            "relation_pri" in parameter_name
        ):
            nn.init.normal_(parameter)
    return Layer(layer, engine)


@pytest.fixture(params=ENGINES)
def engine(request):
    return request.param


@pytest.fixture(params=LAYERS)
def layer_and_loop(request, engine, monkeypatch):
    if engine == "stand-in":
        monkeypatch.setattr(message_passing, "_knows", lambda device: False)
    return make_layer(request.param, engine), LAYERS[request.param][1]


def make_features(graph, seed=0):
    generator = torch.Generator().manual_seed(seed)
    node = torch.randn(graph.num_nodes, IN, generator=generator)
    edge = torch.randn(graph.num_edges, EDGE, generator=generator)
    return node, edge


def test_layer_equals_the_published_formula(layer_and_loop, random_batch):
    layer, loop = layer_and_loop
    graph = random_batch(0)
    node, edge = make_features(graph)
    want = loop(layer.layer, graph, node.numpy(), edge.numpy())
    got = layer(graph, node, edge).detach().numpy()
    np.testing.assert_allclose(got, want, rtol=1e-4, atol=1e-5)


def test_node_without_edges_and_graph_without_edges_are_finite(
    layer_and_loop, random_batch, edit_edges
):
    layer, _ = layer_and_loop
    for keep in (lambda etype, src, dst: src < 0, lambda etype, src, dst: dst != 0):
        graph = edit_edges(random_batch(0), keep)
        node, edge = make_features(graph)
        node.requires_grad_()
        out = layer(graph, node, edge)
        out.sum().backward()
        assert out.isfinite().all()
        assert node.grad.isfinite().all()


def test_gradient_reaches_every_parameter(layer_and_loop, random_batch):
    layer, _ = layer_and_loop
    graph = random_batch(0)
    layer(graph, *make_features(graph)).square().sum().backward()
    for name, parameter in layer.named_parameters():
        assert parameter.grad.abs().sum() > 0, name


@pytest.mark.dgl
@pytest.mark.parametrize("name", LAYERS)
def test_both_engines_give_the_same(name, random_batch, monkeypatch):
    """Outputs in float32 to 1e-6; outputs and gradients in float64 to 1e-12 of the largest."""
    batch = random_batch(2)
    found = []
    for engine in ("dgl", "stand-in"):
        with monkeypatch.context() as patch:
            if engine == "stand-in":
                patch.setattr(message_passing, "_knows", lambda device: False)
            layer = make_layer(name, engine)
            node, edge = make_features(batch)
            single = layer(batch, node, edge).detach()
            layer, node, edge = layer.double(), node.double().requires_grad_(), edge.double()
            out = layer(batch, node, edge)
            out.square().sum().backward()
            gradients = {key: value.grad for key, value in layer.named_parameters()}
            found.append({"single": single, "out": out.detach(), "node": node.grad, **gradients})
    assert found[0].keys() == found[1].keys()
    for key, value in found[0].items():
        scale = float(value.abs().max()) or 1.0
        most = 1e-6 if key == "single" else 1e-12
        torch.testing.assert_close(found[1][key] / scale, value / scale, rtol=0, atol=most)


def test_gradients_of_heat_match_finite_differences(random_batch, engine):
    torch.manual_seed(0)
    layer = Layer(HEATConv((IN, 4, EDGE), 2, (3, 4), False).double(), engine)
    graph = random_batch(0, num_snapshots=1, num_furniture=2, num_objects=2)
    node, edge = (x.double().requires_grad_() for x in make_features(graph))
    assert torch.autograd.gradcheck(lambda n, e: layer(graph, n, e), (node, edge))


@pytest.mark.dgl
def test_a_layer_stands_alone_on_any_graph_of_dgl():
    """Of three node types and two edge types, in DGL's own order; and nothing stays on it."""
    import dgl

    torch.manual_seed(0)
    hetero = dgl.heterograph(
        {("b", "x", "a"): ([0, 1, 1], [0, 0, 1]), ("a", "y", "c"): ([0, 1], [1, 1])}
    )
    graph = dgl.to_homogeneous(hetero)
    layer = HEATConv((3, 4, 2), num_types=(3, 2))
    node, edge = torch.randn(graph.num_nodes(), 3), torch.randn(graph.num_edges(), 2)
    before = set(graph.ndata), set(graph.edata)
    out = layer(graph, node, edge)
    assert out.shape == (graph.num_nodes(), 4)
    assert (set(graph.ndata), set(graph.edata)) == before
    # The same with nodes and edges in another order.
    order, edge_order = torch.tensor([3, 0, 5, 1, 4, 2]), torch.tensor([4, 2, 0, 1, 3])
    src, dst = (order.argsort()[end] for end in graph.edges())
    mixed = dgl.graph((src[edge_order], dst[edge_order]), num_nodes=6)
    mixed.ndata[dgl.NTYPE] = graph.ndata[dgl.NTYPE][order]
    mixed.edata[dgl.ETYPE] = graph.edata[dgl.ETYPE][edge_order]
    torch.testing.assert_close(layer(mixed, node[order], edge[edge_order]), out[order])


@pytest.mark.parametrize("what", ["nodes", "edges"])
def test_the_order_of_nodes_and_of_edges_makes_no_difference(
    layer_and_loop, random_batch, engine, what
):
    """Those of a graph of one's own need not lie type after type, as in a homogeneous view."""
    layer, batch = layer_and_loop[0].layer, random_batch(0)
    node, edge = make_features(batch)
    order, edge_order = torch.arange(batch.num_nodes), torch.arange(batch.num_edges)
    if what == "nodes":
        order = order[torch.randperm(batch.num_nodes)]
    else:
        edge_order = edge_order[torch.randperm(batch.num_edges)]
    found = []
    for rows, places in (
        (torch.arange(batch.num_nodes), torch.arange(batch.num_edges)),
        (order, edge_order),
    ):
        src, dst = (rows.argsort()[end[places]] for end in (batch.edge_src, batch.edge_dst))
        graph = message_passing.make_graph(src, dst, batch.num_nodes)
        graph.ndata["_TYPE"], graph.ndata["degree"] = batch.node_type[rows], batch.degree[rows]
        graph.edata["_TYPE"] = batch.edge_type[places]
        edges = (edge[places],) if isinstance(layer, HEATConv) else ()
        found.append(layer(graph, node[rows], *edges).detach()[rows.argsort()])
    torch.testing.assert_close(found[1], found[0])


@pytest.mark.dgl
def test_a_convolution_without_degrees_counts_those_of_the_graph(random_batch):
    batch = random_batch(0)
    layer, graph = GCNConv(IN, OUT), batch.homogeneous
    node, _ = make_features(batch)
    want = layer(graph, node)
    del graph.ndata["degree"]
    torch.testing.assert_close(layer(graph, node), want)


def test_heads_must_divide_the_width():
    with pytest.raises(ValueError, match=r"got 3 heads for 64 units\. Choose"):
        HEATConv((64, 64, 64), 3)


def test_what_an_encoder_writes_to_the_graph_is_forgotten(random_batch, engine, monkeypatch):
    class Writes(Encoder):
        num_hops, uses_edges = 1, True

        def forward(self, graph, node, edge):
            graph.ndata["degree"] = graph.ndata["h"] = node
            graph.edata["e"] = edge
            return graph.ndata["h"] + 1

    if engine == "stand-in":
        monkeypatch.setattr(message_passing, "_knows", lambda device: False)
    batch = random_batch(0)
    graph, degree = batch.homogeneous, batch.degree
    node, edge = make_features(batch)
    torch.testing.assert_close(Writes(IN).encode(batch, node, edge), node + 1)
    assert set(graph.ndata) == {"_TYPE", "degree"}
    assert set(graph.edata) == {"_TYPE"}
    assert graph.ndata["degree"].equal(degree)


class Function(NamedTuple):
    """As of `dgl.function`."""

    name: str
    in_field: str = "h"
    lhs_field: str = "h"
    rhs_field: str = "h"
    out_field: str = "m"


@pytest.mark.parametrize(
    ("message", "reduce", "got"),
    [("copy_u", "mean", "mean"), ("u_dot_v", "sum", "u_dot_v"), ("u_sub_v", "sum", "u_sub_v")],
)
def test_the_stand_in_refuses_what_it_does_not_compute(message, reduce, got):
    graph = GraphStandIn(torch.tensor([0, 1]), torch.tensor([1, 1]), 2)
    graph.ndata["h"] = graph.edata["h"] = torch.ones(2, 1)
    with pytest.raises(
        AttributeError, match=rf"must be one of copy_u, .* sum, got '{got}'\. Write"
    ):
        graph.update_all(Function(message), Function(reduce, in_field="m", out_field="h"))
    with pytest.raises(AttributeError, match=rf"got '{got}'\. Write"):
        getattr(dgl_stand_in, got)
