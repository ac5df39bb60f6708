"""The logit of *elsewhere*: that what is asked for is at no place of the home."""

from __future__ import annotations

from functools import partial

import torch
from torch import Tensor, nn

from datamodules.batch import Batch
from nep.any_home.ensemble_linear import EnsembleLinear, gelu
from nep.any_home.sets import pool
from sgm.evidence.columns import QUESTION_COLUMNS

ELSEWHERE_BELIEFS = tuple(
    name for name in QUESTION_COLUMNS if name.startswith("elsewhere.log_belief_")
)
_FIRST_BELIEF = "elsewhere.log_belief_rule"  # what an untrained network answers, all but noise


class ElsewhereHead(nn.Module):
    """One logit for each question, from its evidence and from what was encoded of its places.

    With h_i the encodings of the places S of a question and q its standardised evidence,

        logit = w gelu(W [mean_S h, max_S h] + V q) + u l + b,

    where l are the logarithms of what the filters believe of elsewhere, on the scale of those of
    places.

    Args:
        units: D, width of the encodings, for each member of an ensemble.
        members: M, networks in an ensemble.
        num_question: C, columns of the evidence of a question.
    """

    belief_columns: Tensor

    def __init__(self, units: int, members: int, num_question: int) -> None:
        super().__init__()
        self.places = EnsembleLinear(2 * units, units, members)
        self.question = nn.Linear(num_question, members * units, bias=False)
        self.last = EnsembleLinear(units, 1, members)
        self.shortcut = nn.Linear(len(ELSEWHERE_BELIEFS), members, bias=False)
        with torch.no_grad():
            self.shortcut.weight.zero_()[:, ELSEWHERE_BELIEFS.index(_FIRST_BELIEF)] = 1
        beliefs = torch.tensor([QUESTION_COLUMNS.index(name) for name in ELSEWHERE_BELIEFS])
        self.register_buffer("belief_columns", beliefs, persistent=False)

    def forward(
        self, places: Tensor, snapshot: Tensor, standardised: Tensor, question: Tensor
    ) -> Tensor:
        """Score elsewhere for each question.

        Args:
            places: encodings of the furniture nodes, (NF, M, D).
            snapshot: whose each is, (NF,).
            standardised: evidence of the questions, standardised, (B, C).
            question: the same as it is, (B, C).

        Returns:
            Logits, (B, M).
        """
        asked = self.question(standardised).unflatten(1, (places.shape[1], -1))
        hidden = gelu(self.places(pool(places, snapshot, len(question))) + asked)  # (B, M, D)
        by_belief: Tensor = self.shortcut(question.index_select(1, self.belief_columns))
        return self.last(hidden).flatten(1) + by_belief


def find_elsewhere(batch: Batch) -> Tensor:
    """Return for each snapshot whether what is asked for is at no place, float32 (B,).

    1 where all of its query edges are false, 0 where one is true; nan where none is known to be
    true and the truth of one is unknown, and without query edges.
    """
    count = partial(torch.bincount, batch.query_snapshot, minlength=batch.num_snapshots)
    num_true = count(weights=(batch.query_target > 0).float())
    is_known = count(weights=batch.query_target.isnan().float()) == 0
    is_known &= count() > 0
    elsewhere = torch.where(is_known, 1.0, torch.nan)
    return torch.where(num_true > 0, 0.0, elsewhere).float()
