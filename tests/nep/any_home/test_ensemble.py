"""Several networks in one: each answers alone, and their probabilities are averaged."""

from dataclasses import replace

import pytest
import torch

from datamodules.feature_config import EVIDENCE_DIM, QUESTION_DIM
from nep.any_home.any_home_module import AnyHomeModule
from nep.any_home.network import AnyHomeNetwork
from nep.training.segment import segment_softmax, segment_sum

MEMBERS, UNITS = 3, 8


def make(members):
    return AnyHomeNetwork(UNITS, 2, members, 0.5)


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
            weights[name] = found[member : member + 1]
        else:  # a first layer: rows of all members, one after the other
            weights[name] = found.chunk(MEMBERS)[member]
    alone.load_state_dict(weights)
    return alone.eval()


def test_each_member_answers_as_it_would_alone(ensemble, graph):
    found, _ = ensemble.score_members(graph)
    assert found.shape == (len(graph.query_edge) + graph.num_snapshots, MEMBERS)
    for member, own in enumerate(found.unbind(1)):
        alone = take_out(ensemble, member).answer(graph)
        torch.testing.assert_close(own, torch.cat([alone.edges, alone.elsewhere]))
    assert (found[:, 0] - found[:, 1]).abs().max() > 1e-3


def test_the_answer_is_the_mean_of_their_probabilities(ensemble, graph):
    of_members, snapshot = ensemble.score_members(graph)
    expected = segment_softmax(of_members, snapshot, graph.num_snapshots).mean(dim=1)
    answer = ensemble.answer(graph)
    found = torch.cat([answer.edges, answer.elsewhere]).exp()
    torch.testing.assert_close(found, expected)
    total = segment_sum(found.unsqueeze(1), snapshot, graph.num_snapshots)
    torch.testing.assert_close(total, torch.ones_like(total))


def test_a_single_network_answers_with_its_logits(graph):
    torch.manual_seed(0)
    model = make(1).eval()
    of_member, _ = model.score_members(graph)
    answer = model.answer(graph)
    assert torch.equal(torch.cat([answer.edges, answer.elsewhere]), of_member[:, 0])


def test_what_no_member_expects_is_finite(ensemble, graph):
    logits, snapshot = ensemble.score_members(graph)
    logits = torch.zeros_like(logits)
    logits[0] = 1e6
    assert ensemble.join_members(logits, snapshot, 3).isfinite().all()


def test_a_members_loss_trains_that_member_alone(ensemble, graph):
    of_members, _ = ensemble.train().score_members(graph)
    of_members[:, 1].sum().backward()
    for name, parameter in ensemble.named_parameters():
        parts = parameter.grad if parameter.ndim == 3 else parameter.grad.chunk(MEMBERS)
        assert not parts[0].any(), name
        assert not parts[2].any(), name
    assert ensemble.head[-1].weight.grad[1].any()


def test_the_loss_is_the_mean_of_the_members(ensemble, graph):
    module = AnyHomeModule(UNITS, members=MEMBERS).eval()
    module.predictor = ensemble
    losses = []
    for member in range(MEMBERS):
        alone = AnyHomeModule(UNITS, members=1).eval()
        alone.predictor = take_out(ensemble, member)
        losses.append(alone.compute_loss(graph)[0])
    torch.testing.assert_close(module.compute_loss(graph)[0], torch.stack(losses).mean())


@pytest.mark.parametrize("name", ["units", "num_rounds", "members"])
def test_there_is_at_least_one_of_each(name):
    with pytest.raises(ValueError, match=f"{name} must be at least 1, got 0"):
        AnyHomeModule(**{name: 0})


@pytest.mark.parametrize("reads", [[], ["evidence", "clock"]])
def test_it_reads_evidence_alone(reads):
    with pytest.raises(ValueError, match=r"reads must be evidence alone .* data.features.evidence"):
        AnyHomeModule(reads=reads)
