"""Elsewhere as one more answer: its target, its place in the loss, and what it reads."""

from dataclasses import replace

import pytest
import torch

from datamodules.feature_config import EVIDENCE_DIM, QUESTION_DIM
from nep.any_home.any_home_module import AnyHomeModule
from nep.any_home.elsewhere import ELSEWHERE_BELIEFS, find_elsewhere

NAN = torch.nan


@pytest.fixture
def batch(random_batch):
    flat = random_batch(3)
    num_places = flat.furniture.stop - flat.furniture.start
    generator = torch.Generator().manual_seed(1)
    return replace(
        flat,
        evidence=torch.randn(num_places, EVIDENCE_DIM, generator=generator),
        question=torch.randn(flat.num_snapshots, QUESTION_DIM, generator=generator),
    )


@pytest.fixture
def module():
    torch.manual_seed(0)
    return AnyHomeModule(8, members=1)


def test_what_is_nowhere_is_elsewhere(batch):
    """Of six snapshots: one true, all false, one true and one unknown, unknown, nothing asked."""
    asked = replace(
        batch,
        query_snapshot=torch.tensor([0, 0, 1, 1, 2, 2, 3, 3]),
        query_target=torch.tensor([0.0, 1, 0, 0, 1, NAN, 0, NAN]),
        num_snapshots=5,
    )
    expected = torch.tensor([0.0, 1, 0, NAN, NAN])
    torch.testing.assert_close(find_elsewhere(asked), expected, equal_nan=True)


def test_the_loss_of_what_is_nowhere_is_that_of_elsewhere(module, batch):
    """-log of its share among the answers of its snapshot, averaged over snapshots."""
    module.eval()  # both passes standardise alike
    nowhere = replace(batch, query_target=torch.zeros(len(batch.query_target)))
    answer = module.predictor.answer(nowhere)
    expected = []
    for number, elsewhere in enumerate(answer.elsewhere):
        of_snapshot = answer.edges[batch.query_snapshot == number]
        expected.append(torch.logsumexp(torch.cat([of_snapshot, elsewhere[None]]), 0) - elsewhere)
    found, _ = module.compute_loss(nowhere)
    torch.testing.assert_close(found, torch.stack(expected).mean())


def test_an_untrained_network_answers_what_the_filter_believes(module, batch):
    head = module.predictor.elsewhere
    torch.nn.init.zeros_(head.last.weight)
    torch.nn.init.zeros_(head.last.bias)
    answer = module.predictor.eval().answer(batch).elsewhere
    belief = batch.question[
        :, head.belief_columns[ELSEWHERE_BELIEFS.index("elsewhere.log_belief_rule")]
    ]
    torch.testing.assert_close(answer, belief)


def test_each_question_is_answered_alone(module, batch):
    """Other evidence of one snapshot changes the answer of that snapshot alone."""
    module.eval()
    first = module.predictor.answer(batch).elsewhere
    question = batch.question.clone()
    question[1] += 1
    changed = module.predictor.answer(replace(batch, question=question)).elsewhere
    assert first[1] != changed[1]
    torch.testing.assert_close(first[[0, 2]], changed[[0, 2]])
