"""A trained network as one more policy, without torch."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from sgm.belief.corrections import CORRECTIONS
from sgm.evidence.adaptive_filter import TASKS_ASK_MOVED
from sgm.evidence.evidence_features import compute_features
from sgm.evidence.object_counts import choose_edges
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Change, Queries
from sgm.network.network import Network
from sgm.network.sharing import mix_answers
from sgm.network.step_answers import StepAnswers
from sgm.policies.policy import Policy


class NetworkPolicy(Policy):
    """Asks a network about all queries of all homes at once, each place one row of an array.

    A home's scores do not depend on the homes beside it, nor on threads, to the last bit. ONNX
    Runtime computes every row in the same order in any batch. Sums over places are sums
    of whole numbers, and what the last sums round differently is rounded away.

    The answers of a time step stay, but for what looks have shown since (`StepAnswers`).
    """

    score_kind = "logits"
    answers_apart = True
    reads_clock = False
    text_pipeline = None

    def __init__(self, network: Network, asks_moved: float = TASKS_ASK_MOVED) -> None:
        """Ask a network, which reads evidence alone; `load` reads one from disk.

        `asks_moved` is the share of the questions that are about what has just moved.
        """
        self.network = network
        self._asks_moved = asks_moved
        self._answers: StepAnswers | None = None

    @classmethod
    def load(cls, source: str | Path) -> NetworkPolicy:
        """Load an exported folder; see `Network.load`.

        Raises:
            ValueError: as `Network.load` does.
        """
        return cls(Network.load(Path(source)))

    @classmethod
    def identify(cls, source: str | Path) -> str:
        """Return the checksum of what `load` reads.

        Raises:
            ValueError: as `load` does.
        """
        return Network.load(Path(source)).checksum

    def play_in(self, homes: Any) -> NetworkPolicy:
        """Return the same network for some homes."""
        return NetworkPolicy(self.network, self._asks_moved)

    def for_questions(self, asks_moved: float) -> NetworkPolicy:
        """Return the same network for such questions."""
        if asks_moved == self._asks_moved:
            return self
        return NetworkPolicy(self.network, asks_moved)

    def reset(self, memory: MemoryBatch) -> None:
        """Forget earlier homes, and ask for what features are computed from."""
        memory.count_history()
        self._answers = StepAnswers(memory)

    def observe(self, memory: MemoryBatch, change: Change) -> None:
        """Use a look in the answers of this step."""
        if self._answers is not None and memory is self._answers.memory:
            self._answers.note_look(change)

    def scores(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        """Return logits, (Q, F), -inf where there is no place."""
        if self._answers is None or memory is not self._answers.memory:
            return self.ask_anew(memory, queries)
        return self._answers.answer(queries, partial(self.ask_anew, memory))

    def ask_anew(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        """Return what it says whatever it said before in this step, (Q, F)."""
        learns = self.network.learns_asked
        asked = self._asks_moved if learns else TASKS_ASK_MOVED
        evidence = compute_features(memory, queries, asked)
        is_place = evidence.asked.is_place
        logits = self.network.compute_logits(
            evidence.place, evidence.question, _gather_edges(memory, queries), is_place
        )
        scores = np.where(is_place, logits.round(CORRECTIONS.decimals), -np.inf)
        corrected = TASKS_ASK_MOVED if learns else self._asks_moved
        mixed = mix_answers(scores[..., None], evidence, self.network.prior_share, corrected)
        return mixed[..., 0]


def _gather_edges(memory: MemoryBatch, queries: Queries) -> np.ndarray:
    """Return prior weight and relation, 0 "in", 1 "onTop", of each place, float32 (Q, F, 2).

    The relation in which the object was seen there the most often; else the likelier one.
    """
    edges = memory.edges
    return choose_edges(
        queries.object.astype(np.int64), len(memory.objects), queries.prior, edges["object"],
        edges["furniture"], edges["relation"], edges["num_true"], edges["prior"],
    )  # fmt: skip
