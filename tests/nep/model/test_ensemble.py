"""Several networks in one: each answers alone, and their probabilities are averaged."""

from dataclasses import replace

import pytest
import torch

from datamodules.features import EVIDENCE_DIM, QUESTION_DIM
from nep.encoders import GCN, Sets
from nep.layers.segment import segment_softmax, segment_sum
from nep.model.module import NEPModule
from nep.model.node_edge_predictor import NodeEdgePredictor
from nep.model.settings import NetworkConfig

MEMBERS, UNITS = 3, 8


def make(members):
    return NodeEdgePredictor(
        Sets(UNITS, members=members), network=NetworkConfig(transformer=False), reads=["evidence"]
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
    assert found.shape == (len(graph.query_edge), MEMBERS)
    for member in range(MEMBERS):
        alone = take_out(ensemble, member)(graph)
        torch.testing.assert_close(found[:, member], alone)
    assert (found[:, 0] - found[:, 1]).abs().max() > 1e-3


def test_the_answer_is_the_mean_of_their_probabilities(ensemble, graph):
    of_members = ensemble.score_members(graph)
    expected = segment_softmax(of_members, graph.query_snapshot, graph.num_snapshots).mean(dim=1)
    found = ensemble(graph).exp()
    torch.testing.assert_close(found, expected)
    total = segment_sum(found.unsqueeze(1), graph.query_snapshot, graph.num_snapshots)
    torch.testing.assert_close(total, torch.ones_like(total))


def test_a_single_network_answers_with_its_logits(graph):
    torch.manual_seed(0)
    model = make(1).eval()
    assert torch.equal(model(graph), model.score_members(graph)[:, 0])


def test_what_no_member_expects_is_finite(ensemble, graph):
    logits = torch.zeros(len(graph.query_edge), MEMBERS)
    logits[0] = 1e6
    assert ensemble.join_answers(graph, logits).isfinite().all()


def test_a_members_loss_trains_that_member_alone(ensemble, graph):
    ensemble.train().score_members(graph)[:, 1].sum().backward()
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
    expected = sum(module._compute_loss(batch, logits) for logits in each.unbind(1)) / MEMBERS
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
