"""Laws of the convolutions, and their equality with plain loops over the published formulas."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch
from torch import nn

from nep.encoders.encoder import AlikeConv
from nep.encoders.gcn import GCNConv
from nep.encoders.han import HANConv
from nep.encoders.heat import HEATConv
from nep.encoders.hgt import HGTConv
from sgm.schema import EDGE_TYPES, NODE_TYPES

IN, OUT, EDGE = 6, 8, 5


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
            if layer.sharing == "softmax":
                weight = np.exp(logit) / np.exp(logit).sum()
            else:
                weight = 1 / (1 + np.exp(-logit))
            own = slice(k * width, (k + 1) * width)
            w = np.concatenate([p["message_node"][:, own], p["message_edge"][k]])
            out[i, own] += weight @ np.concatenate([h_src, u], axis=1) @ w
    return out


def loop_gcn(layer, graph, node, edge):
    """Kipf & Welling 2017, equation 2, with the dense matrix."""
    adjacency = np.eye(graph.num_nodes)
    for src, dst in zip(graph.edge_src, graph.edge_dst, strict=True):
        adjacency[dst, src] += 1
    degree = graph.degree.numpy() if layer.normalize else np.zeros(graph.num_nodes)
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
    p = {name: value.detach().numpy() for name, value in layer.named_parameters()}
    ntype, etype = list_types(graph)
    src, dst = graph.edge_src.numpy(), graph.edge_dst.numpy()
    width = IN // layer.heads
    out = np.zeros((graph.num_nodes, IN))
    for i in range(graph.num_nodes):
        h = np.zeros(IN)
        incoming = np.flatnonzero(dst == i)
        for k in range(layer.heads):
            own = slice(k * width, (k + 1) * width)
            query = (node[i] @ p["query"][ntype[i]])[own]
            logits, messages = [], []
            for e in incoming:
                key = (node[src[e]] @ p["key"][ntype[src[e]]])[own]
                value = (node[src[e]] @ p["value"][ntype[src[e]]])[own]
                score = key @ p["attend"][etype[e], k] @ query
                logits.append(score * p["importance"][etype[e], k] / np.sqrt(width))
                messages.append(value @ p["message"][etype[e], k])
            if len(incoming):
                weight = np.exp(logits) / np.exp(logits).sum()
                h[own] = weight @ np.array(messages)
        share = 1 / (1 + np.exp(-p["skip"][ntype[i]]))
        out[i] = share * np.maximum(h, 0) @ p["output"][ntype[i]] + (1 - share) * node[i]
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


def over_edges(layer_class):
    """A layer that takes and ignores edges, so that all layers are called alike."""

    class OverEdges(layer_class):
        def forward(self, graph, node, edge):
            return super().forward(graph, node)

    return OverEdges


HEAT_VARIANTS = {
    "heat": {"heads": 2},
    "heat with one head": {"heads": 1},
    "heat with its own features": {"heads": 2, "root_weight": True},
    "heat that counts": {"heads": 2, "sharing": "sigmoid"},
}


@pytest.fixture(
    params=["gcn", "gcn that counts", "hgt", "han", "han with one head", *HEAT_VARIANTS]
)
def layer_and_loop(request):
    torch.manual_seed(1)
    heat = HEAT_VARIANTS.get(request.param, {"heads": 2})
    layer, loop = {
        "gcn": (over_edges(GCNConv)(IN, OUT), loop_gcn),
        "hgt": (over_edges(HGTConv)(IN, 2), loop_hgt),
        "han": (over_edges(HANConv)(IN, 2), loop_han),
        "han with one head": (over_edges(HANConv)(IN, 1), loop_han),
        "gcn that counts": (over_edges(GCNConv)(IN, OUT, normalize=False), loop_gcn),
    }.get(
        request.param,
        (HEATConv(IN, OUT, EDGE, edge_type_units=3, edge_attribute_units=4, **heat), loop_heat),
    )
    # Constant at first, which would hide a lost bias or a lost weight of a type.
    for name in ("node_bias", "bias", "importance", "skip"):
        if hasattr(layer, name):
            nn.init.normal_(getattr(layer, name))
    return layer, loop


def make_features(graph, seed=0):
    generator = torch.Generator().manual_seed(seed)
    node = torch.randn(graph.num_nodes, IN, generator=generator)
    edge = torch.randn(graph.num_edges, EDGE, generator=generator)
    return node, edge


def test_layer_equals_the_published_formula(layer_and_loop, random_batch):
    layer, loop = layer_and_loop
    graph = random_batch(0)
    node, edge = make_features(graph)
    want = loop(layer, graph, node.numpy(), edge.numpy())
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


def test_gradients_of_heat_match_finite_differences(random_batch):
    torch.manual_seed(0)
    layer = HEATConv(IN, 4, EDGE, 2, 3, 4).double()
    graph = random_batch(0, num_snapshots=1, num_furniture=2, num_objects=2)
    node, edge = (x.double().requires_grad_() for x in make_features(graph))
    assert torch.autograd.gradcheck(lambda n, e: layer(graph, n, e), (node, edge))


class Activated(nn.Module):
    """DGL leaves out the activation before the output projection."""

    def __init__(self, linear):
        super().__init__()
        self.linear = linear

    def forward(self, x, types, presorted):
        return self.linear(torch.relu(x), types, presorted)


@pytest.mark.dgl
def test_hgt_equals_dgl(random_batch):
    import dgl

    torch.manual_seed(2)
    ours = HGTConv(8, 2)
    nn.init.normal_(ours.importance)
    nn.init.normal_(ours.skip)
    theirs = dgl.nn.HGTConv(8, 4, 2, len(NODE_TYPES), len(EDGE_TYPES), dropout=0.0)
    for mine, other in (("key", "k"), ("query", "q"), ("value", "v"), ("output", "a")):
        getattr(theirs, f"linear_{other}").W.data = getattr(ours, mine).data
    for head in range(2):
        theirs.relation_att[head].W.data = ours.attend.data[:, head].contiguous()
        theirs.relation_msg[head].W.data = ours.message.data[:, head].contiguous()
        theirs.relation_pri[head].data = ours.importance.data[:, head].contiguous()
    theirs.skip.data = ours.skip.data
    theirs.linear_a = Activated(theirs.linear_a)
    graph = random_batch(3)
    node = torch.randn(graph.num_nodes, 8)
    ntype, etype = (torch.from_numpy(types) for types in list_types(graph))
    flat = dgl.graph((graph.edge_src, graph.edge_dst), num_nodes=graph.num_nodes)
    torch.testing.assert_close(
        ours(graph, node), theirs(flat, node, ntype, etype), rtol=1e-4, atol=1e-5
    )


def test_alike_furniture_hears_the_mean_of_its_like(random_batch):
    # One snapshot: places 0, 2 and 4 in one room, 1 and 3 in the other; place 4 has another label,
    # so that 0 and 2 are alike, and 1 and 3.
    batch = random_batch(0, num_snapshots=1)
    batch.label[batch.furniture] = torch.tensor([0, 0, 0, 0, 1])
    layer = AlikeConv(IN)
    nn.init.eye_(layer.weight.weight)
    nn.init.constant_(layer.weight.bias, 0.5)
    node, _ = make_features(batch)
    want = node.clone()
    place = node[batch.furniture]
    want[batch.furniture][:4] += torch.relu(place[[2, 3, 0, 1]] + 0.5)
    torch.testing.assert_close(layer(batch, node), want)
    # A third of one kind: each hears the mean of the two others.
    batch.label[batch.furniture.start + 4] = 0
    got = layer(batch, node)[batch.furniture][4]
    torch.testing.assert_close(got, place[4] + torch.relu((place[0] + place[2]) / 2 + 0.5))
    # A place that nobody asks about takes no part.
    asked = torch.isin(batch.edge_dst[batch.query_edge], torch.tensor([batch.furniture.start + 4]))
    fewer = replace(batch, query_edge=batch.query_edge[~asked])
    torch.testing.assert_close(layer(fewer, node), want)


def test_heads_must_divide_the_width():
    with pytest.raises(ValueError, match=r"got 3 heads for 64 units\. Choose"):
        HEATConv(64, 64, 64, 3, 16, 16)


def test_sharing_must_be_known():
    with pytest.raises(ValueError, match=r"sharing must be one of softmax, sigmoid, got 'mean'\."):
        HEATConv(64, 64, 64, 2, 16, 16, sharing="mean")
