"""A trained Node Edge Predictor as one more policy."""

from __future__ import annotations

from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import torch

from datamodules.batch_builder import BatchBuilder
from nep.players.checkpoints import checksum_trained, load_trained
from nep.training.training_module import Predictor, TrainingModule
from sgm.evidence.adaptive_filter import TASKS_ASK_MOVED
from sgm.evidence.evidence_features import compute_features
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Change, Queries
from sgm.network.policy import DECIMALS, StepPolicy
from simulator.policies.filters import HomeFilter
from simulator.snapshots.taken import take_snapshots
from simulator.world.homes import Homes


class NEPPolicy(StepPolicy):
    """Scores all queries of all homes in one forward pass.

    A furniture node's score is the highest logit of its query edges. A home's scores do not depend
    on the homes beside it, nor on threads: products of float32 differ in the last bit with the
    number of rows and who shares a vector register, enough to break a tie. So a copy of the network
    computes in float64, and its logits are rounded to six decimals.

    Asked again in a time step, it says what it said first and, by Bayes' rule, what looks have
    shown since (`StepAnswers`): where people live, asking the network anew took a tenth more looks.

    Half of what the tasks ask for has just moved, whereas users ask for anything. A network with
    evidence reads which kind of question it is.
    """

    def __init__(
        self,
        module: TrainingModule,
        builder: BatchBuilder,
        belief_filter: HomeFilter | None = None,
        asks_moved: float = TASKS_ASK_MOVED,
    ) -> None:
        """Keep the model and what turns snapshots into its batches.

        Args:
            module: the model.
            builder: with the features that it was trained on.
            belief_filter: the filter whose belief is among the features; None if there is none.
            asks_moved: share of the questions that are about what has just moved.
        """
        self._module = module
        self._builder = builder
        self._belief_filter = belief_filter
        self._asks_moved = asks_moved
        self._predictor: Any = None  # the copy that answers
        self._copied: tuple[Predictor, torch.device] | None = None  # of what, and where
        self._is_current = False
        self.counts_looks = builder.config.evidence  # type: ignore[misc]

    @property
    def reads_clock(self) -> bool:
        """Whether the network must know what time it is in the homes it plays in."""
        return self._builder.config.clock

    @property
    def text_pipeline(self) -> str | None:
        """Whose text vectors it reads; None for those that ship."""
        return self._builder.config.text_pipeline

    def play_in(self, homes: Homes) -> NEPPolicy:
        """Return the same network for some homes, whose rules it gets if it reads a belief."""
        belief_filter = HomeFilter.make(homes) if self._builder.config.belief else None
        return NEPPolicy(self._module, self._builder, belief_filter, self._asks_moved)

    @classmethod
    def identify(cls, source: str | Path) -> str:
        """Return the checksum of the weights, or of the checkpoint, that `load` reads.

        Raises:
            ValueError: if there is no such file.
        """
        return checksum_trained(source)

    def for_questions(self, asks_moved: float) -> NEPPolicy:
        """Return the same network for such questions."""
        if asks_moved == self._asks_moved:
            return self
        return NEPPolicy(self._module, self._builder, self._belief_filter, asks_moved)

    def reset(self, memory: MemoryBatch) -> None:
        """Forget earlier homes, ask for what features are computed from, take present weights."""
        self._is_current = False
        if self._builder.config.evidence:
            super().reset(memory)
        if self._belief_filter is not None:
            self._belief_filter.reset(memory)

    def observe(self, memory: MemoryBatch, change: Change) -> None:
        """Tell the filter about a look, and use it in the answers of this step."""
        if self._belief_filter is not None:
            self._belief_filter.observe(memory, change)
        super().observe(memory, change)

    @classmethod
    def load(cls, source: str | Path) -> NEPPolicy:
        """Load a trained network from any `source` that `load_trained` reads.

        Raises:
            ValueError: as `load_trained` does.
        """
        trained = load_trained(source)
        return cls(trained.module, trained.builder)

    def ask_anew(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        """Return logits of places and of elsewhere, (Q, F + 1); see `StepPolicy`."""
        places, elsewhere = self.score_places(memory, queries)
        return np.concatenate([places.max(axis=2), elsewhere[:, None]], axis=1)

    @torch.inference_mode()
    def score_places(self, memory: MemoryBatch, queries: Queries) -> tuple[np.ndarray, np.ndarray]:
        """Return logits of every place, (Q, F, relations), and of elsewhere, (Q,).

        -inf for what the network does not answer.
        """
        predictor = self._take_predictor()
        extras, question_extras = {}, {}
        if self._belief_filter is not None:
            extras["belief"] = self._belief_filter.compute_features(memory, queries)
        if self._builder.config.evidence:
            evidence = compute_features(memory, queries, self._asks_moved)
            extras["evidence"] = evidence.place
            question_extras["evidence"] = evidence.question
        alone = self._builder.reads_asked_alone
        snapshots = take_snapshots(
            memory, queries, None, extras, question_extras, asked_alone=alone
        )
        batch = self._builder.build(snapshots)
        places = (batch.query_snapshot, batch.query_furniture, batch.query_relation)
        first = next(predictor.parameters())
        answer = predictor.answer(batch.to(first.device, first.dtype))
        scores = np.full(queries.prior.shape, -np.inf)
        scores[tuple(place.numpy() for place in places)] = _round(answer.edges)
        elsewhere = np.full(len(queries.home), -np.inf)
        if answer.elsewhere is not None:
            elsewhere = _round(answer.elsewhere)
        return scores, elsewhere

    @torch.inference_mode()
    def _take_predictor(self) -> Any:
        """Return the network as it was at the last reset or first question.

        The copy is kept over resets, and takes the weights alone: a robot resets with every
        question that follows a look, and a copy of the whole network is half of its answer.
        """
        device = self._module.device
        if device.type == "mps":  # knows no float64
            device = torch.device("cpu")
        network = self._module.predictor
        if self._predictor is None or self._copied != (network, device):
            copy = deepcopy(network).requires_grad_(False).eval()
            self._predictor = copy.to(device, torch.float64)
            self._copied = network, device
        elif not self._is_current:
            for kept, present in (
                *zip(self._predictor.parameters(), network.parameters(), strict=True),
                *zip(self._predictor.buffers(), network.buffers(), strict=True),
            ):
                kept.copy_(present)
        self._is_current = True
        return self._predictor


def _round(logits: torch.Tensor) -> np.ndarray:
    rounded: np.ndarray = logits.double().cpu().numpy().round(DECIMALS)
    return rounded
