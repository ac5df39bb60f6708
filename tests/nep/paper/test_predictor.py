"""Laws of the whole model: order, batching, padding, gradients, and that it learns."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch
from torch import nn
from torch.nn import functional as F

from datamodules.edited_graph import read_batch
from nep.paper.embedding import EdgeEmbedding, NodeEmbedding
from nep.paper.encoders import GCN, HAN, HEAT, HGT, MLP
from nep.paper.loss import balanced_bce
from nep.paper.predictor import NodeEdgePredictor
from nep.paper.query_attention import AttentionConfig, QueryAttention
from sgm.schema import EDGE_RELATIONS, EDGE_TYPES, NODE_TYPES, QUERY_EDGE_TYPES

ENCODERS = {
    "mlp": lambda: MLP(16),
    "gcn": lambda: GCN(16),
    "heat": lambda: HEAT(16),
    "hgt": lambda: HGT(16),
    "han": lambda: HAN(16),
    "two hops of han": lambda: HAN(16, num_convolutions=2),
    "two hops of hgt": lambda: HGT(16, num_convolutions=2),
    "two hops of heat without residual": lambda: HEAT(16, num_convolutions=2, residual=False),
}


@pytest.fixture(params=ENCODERS)
def encoder(request):
    torch.manual_seed(0)
    return ENCODERS[request.param]()


def get_query(batch):
    """Snapshot of each query edge, in query order."""
    return batch.query_snapshot


def test_node_and_edge_order_change_nothing(encoder, random_batch):
    model = NodeEdgePredictor(encoder).eval()
    batch = random_batch(3)
    graph, shuffled = batch.to_pyg(), batch.to_pyg()
    new_id = {ntype: torch.randperm(graph[ntype].num_nodes) for ntype in NODE_TYPES}
    edge_order = {etype: torch.randperm(graph[etype].num_edges) for etype in EDGE_TYPES}
    for ntype in NODE_TYPES:
        for key in {*graph[ntype]} - {"num_nodes"}:
            shuffled[ntype][key] = graph[ntype][key][torch.argsort(new_id[ntype])]
    for etype in EDGE_TYPES:
        for key in {*graph[etype]} - {"edge_index"}:
            shuffled[etype][key] = graph[etype][key][edge_order[etype]]
        src, dst = graph[etype].edge_index[:, edge_order[etype]]
        shuffled[etype].edge_index = torch.stack([new_id[etype[0]][src], new_id[etype[2]][dst]])

    positions = []  # in query order: where each query edge of the shuffled batch was before
    offset = 0
    for etype in QUERY_EDGE_TYPES:
        is_query = graph[etype].query >= 0
        rank = is_query.cumsum(0) - 1 + offset
        order = edge_order[etype]
        positions.append(rank[order][is_query[order]])
        offset += int(is_query.sum())
    got = model(read_batch(shuffled, batch.text, batch.num_snapshots))
    torch.testing.assert_close(got, model(batch)[torch.cat(positions)], rtol=1e-4, atol=1e-5)


def test_a_batch_equals_its_snapshots_one_by_one(encoder, random_batch, take_snapshot):
    model = NodeEdgePredictor(encoder).eval()
    batch = random_batch(4, num_snapshots=2)
    together = model(batch)
    snapshot = get_query(batch)
    for index in range(2):
        alone = model(take_snapshot(batch, index))
        torch.testing.assert_close(alone, together[snapshot == index], rtol=1e-4, atol=1e-5)


def test_a_snapshot_without_query_edges_changes_nothing(encoder, random_batch):
    model = NodeEdgePredictor(encoder).eval()
    batch = random_batch(5)
    want = model(batch)[get_query(batch) != 1]
    graph = batch.to_pyg()
    for etype in QUERY_EDGE_TYPES:
        graph[etype].query[graph[etype].query == 1] = -1
    got = model(read_batch(graph, batch.text, batch.num_snapshots))
    torch.testing.assert_close(got, want, rtol=1e-4, atol=1e-5)
    got.sum().backward()
    assert all(p.grad is None or p.grad.isfinite().all() for p in model.parameters())


def test_no_query_edge_at_all(encoder, random_batch):
    batch = random_batch(6)
    graph = batch.to_pyg()
    for etype in QUERY_EDGE_TYPES:
        graph[etype].query[:] = -1
    logits = NodeEdgePredictor(encoder)(read_batch(graph, batch.text, batch.num_snapshots))
    assert logits.shape == (0,)
    assert balanced_bce(logits, torch.zeros(0)).item() == 0


def test_an_empty_edge_type_is_fine(encoder, random_batch, edit_edges):
    batch = edit_edges(random_batch(7), lambda etype, src, dst: (src >= 0) & (etype[1] != "in"))
    logits = NodeEdgePredictor(encoder)(batch)
    assert len(logits) > 0
    assert logits.isfinite().all()


def test_gradient_reaches_every_parameter(encoder, random_batch):
    model = NodeEdgePredictor(encoder)
    batch = random_batch(8, num_snapshots=8)
    balanced_bce(model(batch), batch.query_target).backward()
    for name, parameter in model.named_parameters():
        assert parameter.grad is not None, name
        assert parameter.grad.abs().sum() > 0, name


@pytest.mark.slow
def test_overfits_ten_graphs(encoder, random_batch):
    # targets are random, so only the features of each edge's own neighbourhood can explain them
    model = NodeEdgePredictor(encoder, AttentionConfig(dropout=0.0))
    batch = random_batch(9, num_snapshots=10)
    optimiser = torch.optim.Adam(model.parameters(), lr=3e-3)
    for _ in range(300):
        logits = model(batch)
        loss = balanced_bce(logits, batch.query_target)
        is_right = (logits > 0) == batch.query_target.bool()
        if loss.item() < 0.02 and is_right.all():
            break
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
    assert loss.item() < 0.02
    assert is_right.all()


def test_output_depends_on_exactly_the_hops_it_declares(encoder, random_batch):
    # The path object - furniture - room - floor - home: change a node k hops from the query edges.
    model = NodeEdgePredictor(encoder).eval()
    hops = {"furniture": 0, "room": 1, "floor": 2, "house": 3}
    batch = random_batch(10, num_snapshots=1)
    before = model(batch)
    for ntype, distance in hops.items():
        rows = torch.repeat_interleave(torch.tensor(batch.node_counts)) == NODE_TYPES.index(ntype)
        changed = replace(batch, node_feature=batch.node_feature + rows.unsqueeze(1))
        assert (model(changed) != before).any().item() == (distance <= encoder.num_hops), ntype


def test_transformer_false_scores_each_query_edge_on_its_own(random_batch):
    torch.manual_seed(0)
    for transformer in (True, False):
        attention = AttentionConfig() if transformer else None
        model = NodeEdgePredictor(MLP(16), attention).eval()
        batch = random_batch(11, num_snapshots=1)
        before = model(batch)
        inside = batch.query_edge[batch.query_relation == 0]
        batch.edge_feature[inside] += 1.0  # another's features, as seen from onTop edges
        num_in = len(inside)
        others_changed = (model(batch)[num_in:] != before[num_in:]).any().item()
        assert others_changed == transformer
        assert (model.query_attention is not None) == transformer


def test_attention_equals_torch_and_ignores_padding():
    torch.manual_seed(0)
    ours = QueryAttention(16, AttentionConfig(feed_forward_units=12)).eval()
    theirs = nn.TransformerEncoder(
        nn.TransformerEncoderLayer(16, 2, 12, 0.1, batch_first=True),
        2,
        enable_nested_tensor=False,
    ).eval()
    for mine, other in zip(ours.layers, theirs.layers, strict=True):
        other.self_attn.in_proj_weight.data = mine.project_in.weight.data
        other.self_attn.in_proj_bias.data = mine.project_in.bias.data
        other.self_attn.out_proj.load_state_dict(mine.project_out.state_dict())
        other.linear1.load_state_dict(mine.feed_forward_in.state_dict())
        other.linear2.load_state_dict(mine.feed_forward_out.state_dict())
        other.norm1.load_state_dict(mine.attention_norm.state_dict())
        other.norm2.load_state_dict(mine.feed_forward_norm.state_dict())
    query = torch.randn(9, 16)
    snapshot = torch.tensor([3, 0, 0, 3, 1, 3, 0, 3, 3])  # 3, 1, 0 and 5 query edges, unsorted
    got = ours(query, snapshot, num_snapshots=4)
    for index in (0, 1, 3):
        alone = theirs(query[snapshot == index].unsqueeze(0)).squeeze(0)
        torch.testing.assert_close(got[snapshot == index], alone, rtol=1e-4, atol=1e-5)


def test_embeddings_equal_concatenated_features(random_batch):
    torch.manual_seed(0)
    batch = random_batch(12)
    node, edge = NodeEmbedding(16), EdgeEmbedding(16)

    def apply(module, features):
        return torch.relu(module.second(torch.relu(module.first(features))))

    graph = batch.to_pyg()
    data = [graph[ntype] for ntype in NODE_TYPES]
    wide_node = torch.cat(
        [
            torch.cat(
                [
                    batch.text[d["label"]],
                    d["temporal"],
                    F.one_hot(torch.full_like(d["label"], ntype), 5).float(),
                ],
                dim=1,
            )
            for ntype, d in enumerate(data)
        ]
    )
    assert wide_node.shape[1] == 105
    torch.testing.assert_close(node(batch), apply(node, wide_node))

    wide_edge = []
    for etype in EDGE_TYPES:
        feature = graph[etype].feature
        relation = torch.full((len(feature),), EDGE_RELATIONS.index(etype[1]))
        wide_edge.append(torch.cat([feature, F.one_hot(relation, 4).float()], dim=1))
    want = apply(edge, torch.cat(wide_edge))
    torch.testing.assert_close(edge(batch), want)
    torch.testing.assert_close(edge(batch, batch.query_edge), want[batch.query_edge])


@pytest.mark.parametrize("without", [("text",), ("node_feature",), ("text", "node_feature")])
def test_node_features_that_are_off_count_as_zeros(random_batch, without):
    torch.manual_seed(0)
    graph = random_batch(12)
    node = NodeEmbedding(16)
    zeros = {name: torch.zeros_like(getattr(graph, name)) for name in without}
    empty = {name: values[:, :0] for name, values in zeros.items()}
    torch.testing.assert_close(node(replace(graph, **empty)), node(replace(graph, **zeros)))


def test_query_order_is_that_of_the_batch(random_batch):
    batch = random_batch(13)
    want = []
    for etype in QUERY_EDGE_TYPES:
        data = batch.to_pyg()[etype]
        want += data["target"][data["query"] >= 0].tolist()
    assert batch.query_target.tolist() == want
    first = {"object": batch.num_nodes - batch.node_counts[4]}
    query_src = batch.edge_src[batch.query_edge] - first["object"]
    assert (query_src // 8 == batch.query_snapshot).all()  # 8 objects per snapshot
    assert (query_src % 8 == 0).all()  # the first of them is asked for


def test_a_graph_of_another_schema_is_refused(random_batch):
    batch = random_batch(0)
    part = batch.to_pyg().edge_type_subgraph([("object", "in", "furniture")])
    with pytest.raises(ValueError, match=r"node types of a batch must be .* empty types included"):
        read_batch(part, batch.text, batch.num_snapshots)


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: MLP(0), "units must be at least 1, got 0"),
        (lambda: GCN(16, num_convolutions=0), "num_convolutions must be at least 1, got 0"),
        (lambda: HEAT(16, heads=5), "got 5 heads for 16 units"),
        (lambda: HGT(16, heads=0), "got 0 heads for 16 units"),
        (lambda: HGT(16, num_convolutions=0), "num_convolutions must be at least 1, got 0"),
        (lambda: HAN(16, heads=3), "got 3 heads for 16 units"),
        (
            lambda: NodeEdgePredictor(MLP(16), AttentionConfig(heads=3)),
            "got 3 heads for width 32",
        ),
    ],
)
def test_bad_sizes_are_named(build, message):
    with pytest.raises(ValueError, match=message):
        build()
