"""Embedding of what the memory says about places and questions."""

from __future__ import annotations

from collections.abc import Collection

import torch
from torch import Tensor, nn

from datamodules.batch import Batch
from datamodules.features import count_columns
from nep.layers.ensemble_linear import make_linear, split_members
from nep.layers.gelu import gelu
from sgm.evidence.columns import CLOCK_GROUPS, PLACE_COLUMNS, QUESTION_COLUMNS

_LEAST_VARIANCE = 4e-4  # of a column, so that one that hardly varies is not blown up
BELIEFS = tuple(name for name in PLACE_COLUMNS if name.startswith("filters.log_belief_"))
_FIRST_BELIEF = "filters.log_belief_asked"  # what an untrained network answers, all but noise
MOST_DEVIATIONS = 8.0  # from the mean, of a column


class EvidenceEmbedding(nn.Module):
    """Two layers over the evidence of a furniture node and of its question, GELU after each.

    Columns are standardised by what training showed, and clipped. `compute_shortcut` leads the
    logarithms of the filters' beliefs past the network, so that it learns what to add to them.

    Args:
        units: width of both layers, for each member of an ensemble.
        reads: groups of features beyond the paper's that are on.
        clock_dropout: share of the questions that hide the clock while training, so that one
            network serves homes with and without one.
        members: M, see `Encoder`.
    """

    belief_columns: Tensor
    place_has_clock: Tensor
    question_has_clock: Tensor

    def __init__(
        self,
        units: int,
        reads: Collection[str] = ("evidence",),
        clock_dropout: float = 0.5,
        members: int = 1,
    ) -> None:
        super().__init__()
        num_place, num_question = count_columns("place", reads), count_columns("question", reads)
        self.clock_dropout = clock_dropout
        self.members = members
        # A plain average over all batches: no momentum to choose.
        self.place_scale = nn.BatchNorm1d(num_place, _LEAST_VARIANCE, None, affine=False)
        self.question_scale = nn.BatchNorm1d(num_question, _LEAST_VARIANCE, None, affine=False)
        self.place = nn.Linear(num_place, members * units)
        self.question = nn.Linear(num_question, members * units, bias=False)
        self.second = make_linear(units, units, members)
        self.shortcut = nn.Linear(len(BELIEFS), members, bias=False)
        with torch.no_grad():
            self.shortcut.weight.zero_()[:, BELIEFS.index(_FIRST_BELIEF)] = 1
        beliefs = torch.tensor([PLACE_COLUMNS.index(name) for name in BELIEFS])
        self.register_buffer("belief_columns", beliefs, persistent=False)
        for name, columns, count in (
            ("place", PLACE_COLUMNS, num_place),
            ("question", QUESTION_COLUMNS, num_question),
        ):
            is_clock = [column.partition(".")[0] in CLOCK_GROUPS for column in columns]
            is_clock += [False] * (count - len(columns))  # further features
            self.register_buffer(f"{name}_has_clock", torch.tensor(is_clock), persistent=False)

    def forward(self, batch: Batch) -> Tensor:
        """Embed the furniture nodes: (NF, units), or (NF, M, units) of several members.

        Raises:
            ValueError: if the batch holds no evidence.
        """
        if batch.evidence is None or batch.question is None:
            raise ValueError(
                "batch must hold evidence for a model with evidence, got none. Build it with "
                "features.evidence."
            )
        place, question = batch.evidence, batch.question
        snapshot = batch.node_snapshot[batch.furniture]
        if self.training and self.clock_dropout:
            hides = torch.rand(len(question), 1, device=question.device) < self.clock_dropout
            question = question.masked_fill(hides & self.question_has_clock, 0)
            place = place.masked_fill(hides[snapshot] & self.place_has_clock, 0)
        place = self.place_scale(place).clamp(-MOST_DEVIATIONS, MOST_DEVIATIONS)
        question = self.question_scale(question).clamp(-MOST_DEVIATIONS, MOST_DEVIATIONS)
        hidden = self.place(place) + self.question(question).index_select(0, snapshot)
        return gelu(self.second(gelu(split_members(hidden, self.members))))

    def compute_shortcut(self, batch: Batch) -> Tensor:
        """Return what the filters add to the logits of furniture nodes, (NF, M)."""
        assert batch.evidence is not None
        shortcut: Tensor = self.shortcut(batch.evidence.index_select(1, self.belief_columns))
        return shortcut
