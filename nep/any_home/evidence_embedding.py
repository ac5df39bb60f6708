"""Embedding of what the memory says about places and about a question."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from nep.any_home.ensemble_linear import EnsembleLinear, gelu
from sgm.evidence.columns import CLOCK_GROUPS, PLACE_COLUMNS, QUESTION_COLUMNS

_LEAST_VARIANCE = 4e-4  # of a column, so that one that hardly varies is not blown up
FILTER_BELIEFS = tuple(name for name in PLACE_COLUMNS if name.startswith("filters.log_belief_"))
_FIRST_BELIEF = "filters.log_belief_asked"  # what an untrained network answers, all but noise
MOST_DEVIATIONS = 8.0  # from the mean, of a column


class EvidenceEmbedding(nn.Module):
    """Two layers over the evidence of a furniture node and of its question, GELU after each.

    Columns are standardised by what training showed, and clipped. `compute_shortcut` leads the
    logarithms of the filters' beliefs past the network, so that it learns what to add to them.

    Args:
        units: D, width of both layers, for each member of an ensemble.
        members: M, networks in an ensemble.
        clock_dropout: share of the questions that hide the clock while training, so that one
            network serves homes with and without one.
    """

    belief_columns: Tensor
    place_has_clock: Tensor
    question_has_clock: Tensor

    def __init__(self, units: int, members: int, clock_dropout: float) -> None:
        super().__init__()
        self.clock_dropout, self.members = clock_dropout, members
        num_place, num_question = len(PLACE_COLUMNS), len(QUESTION_COLUMNS)
        # A plain average over all batches: no momentum to choose.
        self.place_scale = nn.BatchNorm1d(num_place, _LEAST_VARIANCE, None, affine=False)
        self.question_scale = nn.BatchNorm1d(num_question, _LEAST_VARIANCE, None, affine=False)
        self.place = nn.Linear(num_place, members * units)
        self.question = nn.Linear(num_question, members * units, bias=False)
        self.second = EnsembleLinear(units, units, members)
        self.shortcut = nn.Linear(len(FILTER_BELIEFS), members, bias=False)
        with torch.no_grad():
            self.shortcut.weight.zero_()[:, FILTER_BELIEFS.index(_FIRST_BELIEF)] = 1
        beliefs = torch.tensor([PLACE_COLUMNS.index(name) for name in FILTER_BELIEFS])
        self.register_buffer("belief_columns", beliefs, persistent=False)
        for name, columns in (("place", PLACE_COLUMNS), ("question", QUESTION_COLUMNS)):
            is_clock = [column.partition(".")[0] in CLOCK_GROUPS for column in columns]
            self.register_buffer(f"{name}_has_clock", torch.tensor(is_clock), persistent=False)

    def forward(self, place: Tensor, question: Tensor, snapshot: Tensor) -> tuple[Tensor, Tensor]:
        """Embed the furniture nodes, and standardise the evidence of the questions.

        (NF, columns), (B, columns), (NF,) -> (NF, M, D), (B, columns).
        """
        if self.training and self.clock_dropout:
            hides = torch.rand(len(question), 1, device=question.device) < self.clock_dropout
            question = question.masked_fill(hides & self.question_has_clock, 0)
            place = place.masked_fill(hides[snapshot] & self.place_has_clock, 0)
        place = self.place_scale(place).clamp(-MOST_DEVIATIONS, MOST_DEVIATIONS)
        question = self.question_scale(question).clamp(-MOST_DEVIATIONS, MOST_DEVIATIONS)
        hidden = self.place(place) + self.question(question).index_select(0, snapshot)
        hidden = gelu(hidden).unflatten(1, (self.members, -1))
        return gelu(self.second(hidden)), question

    def compute_shortcut(self, place: Tensor) -> Tensor:
        """Return what the filters add to the logits of places: (NF, columns) -> (NF, M)."""
        shortcut: Tensor = self.shortcut(place.index_select(1, self.belief_columns))
        return shortcut
