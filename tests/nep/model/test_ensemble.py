"""Several networks in one: each answers alone, and their probabilities are averaged."""

from dataclasses import replace

import pytest
import torch

from datamodules.features import EVIDENCE_DIM, QUESTION_DIM
from nep.encoders import GCN, Sets
from nep.layers.segment import segment_softmax, segment_sum
from nep.model.module import NEPModule
from nep.model.node_edge_predictor import Logits, NodeEdgePredictor
from nep.model.settings import NetworkConfig

MEMBERS, UNITS = 3, 8


def make(members):
    return NodeEdgePredictor(
        Sets(UNITS, members=members),
        network=NetworkConfig(transformer=False, elsewhere=True),
        reads=["evidence"],
    )


@pytest.fixture
def graph(random_batch):
    flat = random_batch(3)
    generator = torch.Generator().manual_seed(1)
    num_places = flat.furniture.stop - flat.furniture.start
    return replace(
        flat,
        evidence=torch.randn(num_places, EVIDENCE_DIM, generator=generator),
        question=torch.randn(flat.num_snapshots, QUESTION_DIM, generator=generator),
    )


@pytest.fixture
def ensemble(graph):
    torch.manual_seed(0)
    model = make(MEMBERS)
    with torch.no_grad():
        model.train()(graph)  # so that the scales of columns are not those of the beginning
    return model.eval()


def take_out(ensemble, member):
    """One member as a network of its own."""
    alone = make(1)
    weights = {}
    for (name, wanted), found in zip(
        alone.state_dict().items(), ensemble.state_dict().values(), strict=True
    ):
        if found.shape == wanted.shape:  # of the scales, which all share
            weights[name] = found
        elif found.ndim == 3:
            weights[name] = found[member].t() if name.endswith("weight") else found[member, 0]
        else:  # a first layer: rows of all members, one after the other
            weights[name] = found.chunk(MEMBERS)[member]
    alone.load_state_dict(weights)
    return alone.eval()


def test_each_member_answers_as_it_would_alone(ensemble, graph):
    found = ensemble.score_members(graph)
    assert found.edges.shape == (len(graph.query_edge), MEMBERS)
    assert found.elsewhere.shape == (graph.num_snapshots, MEMBERS)
    for member, own in enumerate(found.split()):
        alone = take_out(ensemble, member).answer(graph)
        torch.testing.assert_close(own.edges, alone.edges)
        torch.testing.assert_close(own.elsewhere, alone.elsewhere)
    for logits in (found.edges, found.elsewhere):
        assert (logits[:, 0] - logits[:, 1]).abs().max() > 1e-3


def test_the_answer_is_the_mean_of_their_probabilities(ensemble, graph):
    of_members, snapshot = ensemble.score_members(graph).join(graph)
    expected = segment_softmax(of_members, snapshot, graph.num_snapshots).mean(dim=1)
    found = ensemble.answer(graph).join(graph)[0].exp()
    torch.testing.assert_close(found, expected)
    torch.testing.assert_close(found[: len(graph.query_edge)], ensemble(graph).exp())
    total = segment_sum(found.unsqueeze(1), snapshot, graph.num_snapshots)
    torch.testing.assert_close(total, torch.ones_like(total))


def test_a_single_network_answers_with_its_logits(graph):
    torch.manual_seed(0)
    model = make(1).eval()
    of_member = model.score_members(graph)
    assert torch.equal(model(graph), of_member.edges[:, 0])
    assert torch.equal(model.answer(graph).elsewhere, of_member.elsewhere[:, 0])


def test_what_no_member_expects_is_finite(ensemble, graph):
    logits = torch.zeros(len(graph.query_edge), MEMBERS)
    logits[0] = 1e6
    joined = ensemble.join_members(graph, Logits(logits, torch.zeros(3, MEMBERS)))
    assert joined.edges.isfinite().all()
    assert joined.elsewhere.isfinite().all()


def test_a_members_loss_trains_that_member_alone(ensemble, graph):
    of_members = ensemble.train().score_members(graph)
    (of_members.edges[:, 1].sum() + of_members.elsewhere[:, 1].sum()).backward()
    for name, parameter in ensemble.named_parameters():
        parts = parameter.grad if parameter.ndim == 3 else parameter.grad.chunk(MEMBERS)
        assert not parts[0].any(), name
        assert not parts[2].any(), name
    assert ensemble.head[-1].weight.grad[1].any()


def test_the_loss_is_the_mean_of_the_members(random_batch, monkeypatch):
    module = NEPModule(
        Sets(UNITS, members=MEMBERS),
        transformer=False,
        paper_loss=False,
        listwise_weight=1.0,
    )
    batch = random_batch(3)
    each = module.predictor.score_members(batch)
    expected = sum(module._compute_loss(batch, logits) for logits in each.split()) / MEMBERS
    monkeypatch.setattr(module, "log", lambda *args, **options: None)
    torch.testing.assert_close(module.training_step(batch, 0), expected)


def test_an_encoder_without_members_is_one_network():
    assert GCN(UNITS).members == 1
    assert "members" not in GCN(UNITS).config()["init_args"]
    assert Sets(UNITS, members=MEMBERS).config()["init_args"]["members"] == MEMBERS


def test_query_edges_of_an_ensemble_do_not_attend_to_each_other():
    with pytest.raises(ValueError, match=r"transformer must be false .* got 3 members\. Set "):
        NEPModule(Sets(UNITS, members=MEMBERS))


def test_there_is_at_least_one_member():
    with pytest.raises(ValueError, match="members must be at least 1, got 0"):
        Sets(UNITS, members=0)
