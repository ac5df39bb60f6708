"""The logit of *elsewhere*: that what is asked for is at no place of the home."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from datamodules.batch import Batch
from nep.layers.ensemble_linear import gelu, make_linear, split_members
from nep.layers.segment import segment_max, segment_sum
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
        members: M, see `Encoder`.
        num_question: C, columns of the evidence of a question.
    """

    belief_columns: Tensor

    def __init__(self, units: int, members: int, num_question: int) -> None:
        super().__init__()
        self.members = members
        self.places = make_linear(2 * units, units, members)
        self.question = nn.Linear(num_question, members * units, bias=False)
        self.last = make_linear(units, 1, members)
        self.shortcut = nn.Linear(len(ELSEWHERE_BELIEFS), members, bias=False)
        with torch.no_grad():
            self.shortcut.weight.zero_()[:, ELSEWHERE_BELIEFS.index(_FIRST_BELIEF)] = 1
        beliefs = torch.tensor([QUESTION_COLUMNS.index(name) for name in ELSEWHERE_BELIEFS])
        self.register_buffer("belief_columns", beliefs, persistent=False)

    def forward(self, batch: Batch, places: Tensor, question: Tensor) -> Tensor:
        """Score elsewhere for each question.

        Args:
            batch: B snapshots, with evidence.
            places: encodings of the furniture nodes, (NF, D), or (NF, M, D) of several members.
            question: standardised evidence of the questions, (B, C).

        Returns:
            Logits, (B, M).
        """
        assert batch.question is not None
        snapshot, num_snapshots = batch.node_snapshot[batch.furniture], batch.num_snapshots
        columns = places.flatten(1)  # (NF, M D)
        size = segment_sum(columns.new_ones(len(columns), 1), snapshot, num_snapshots)
        mean = segment_sum(columns, snapshot, num_snapshots) / size.clamp(min=1)
        most = segment_max(columns, snapshot, num_snapshots)
        pooled = [split_members(values, self.members) for values in (mean, most)]
        asked = split_members(self.question(question), self.members)
        hidden = gelu(self.places(torch.cat(pooled, dim=-1)) + asked)  # (B, M, D)
        by_belief: Tensor = self.shortcut(batch.question.index_select(1, self.belief_columns))
        return self.last(hidden).flatten(1) + by_belief
