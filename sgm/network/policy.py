"""A trained network as one more policy, without torch."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from sgm.arrays.grouped import mark_rows
from sgm.belief import Belief, compute_miss
from sgm.evidence.adaptive_filter import TASKS_ASK_MOVED
from sgm.evidence.elsewhere import compute_elsewhere
from sgm.evidence.evidence_features import compute_features
from sgm.evidence.question import choose_edges
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Change, Queries
from sgm.network.network import Network
from sgm.policies.policy import Policy, weigh_looks_since
from sgm.policies.rhythm import load_weights, weigh_rhythm
from sgm.prior.place_prior import PlacePrior

# Of a logit: sums in another order differ nine orders of magnitude below, so that an answer does
# not depend on who shares the batch.
DECIMALS = 6

# Share of the misses that another look of a step repeats in the searches of tasks.
_REPEATED_SHARE = 0.2


class StepPolicy(Policy):
    """A network that is asked once in a time step for each thing.

    The answers of a step stay, but for what looks have shown since (`StepAnswers`).
    """

    score_kind = "logits"
    _answers: StepAnswers | None = None

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
            return self.ask_anew(memory, queries)[:, :-1]
        return self._answers.answer(queries, partial(self.ask_anew, memory))[:, :-1]

    def believe(self, memory: MemoryBatch, queries: Queries) -> Belief:
        """Return its logits of the places and of elsewhere, (Q, F + 1).

        Of a network that answers places alone, elsewhere is that of the rules; so are the looks of
        earlier steps, unless it `counts_looks`.
        """
        logits = self.ask_anew(memory, queries)
        if np.isfinite(logits[:, -1]).all():
            return Belief(logits)
        places = np.where(memory.mark_places(queries), logits[:, :-1], -np.inf)
        if not self.counts_looks:
            places = places + np.log(weigh_looks_since(memory, queries))
        return Belief.of_logits(places, compute_elsewhere(memory, queries))

    @abstractmethod
    def ask_anew(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        """Return logits of places and of elsewhere, whatever it said before in this step.

        (Q, F + 1), -inf where there is no place, and for elsewhere if it does not say.
        """


class NetworkPolicy(StepPolicy):
    """Asks a network about all queries of all homes at once, each place one row of an array.

    A home's scores do not depend on the homes beside it, nor on threads, to the last bit. ONNX
    Runtime computes every row in the same order in any batch. Sums over places are sums
    of whole numbers, and what the last sums round differently is rounded away.
    """

    answers_apart = True
    counts_looks = True
    reads_clock = False
    text_pipeline = None

    def __init__(
        self, network: Network, asks_moved: float = TASKS_ASK_MOVED, *, uses_rhythm: bool = True
    ) -> None:
        """Ask a network, which reads evidence alone; `load` reads one from disk.

        Args:
            network: the network.
            asks_moved: share of the questions that are about what has just moved.
            uses_rhythm: whether similar moments are weighed beside it (`sgm.policies.rhythm`),
                where no question is about what has just moved.
        """
        self.network = network
        self._asks_moved = asks_moved
        self._uses_rhythm = uses_rhythm

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
        return NetworkPolicy(self.network, self._asks_moved, uses_rhythm=self._uses_rhythm)

    def for_questions(self, asks_moved: float) -> NetworkPolicy:
        """Return the same network for such questions."""
        if asks_moved == self._asks_moved:
            return self
        return NetworkPolicy(self.network, asks_moved, uses_rhythm=self._uses_rhythm)

    def believe(self, memory: MemoryBatch, queries: Queries) -> Belief:
        """Return where the objects may be, (Q, F + 1): by the network, and the home's rhythm."""
        belief = super().believe(memory, queries)
        if not self._uses_rhythm or self._asks_moved:
            return belief
        return weigh_rhythm(memory, queries, belief, load_weights("network"))

    def ask_anew(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        """Return logits of places and of elsewhere, (Q, F + 1)."""
        evidence = compute_features(memory, queries, self._asks_moved)
        # Prior weight of each place, and relation in which it was seen there the most often.
        edge, is_place = choose_edges(evidence.asked), evidence.asked.is_place
        logits = self.network.compute_logits(evidence.place, evidence.question, edge, is_place)
        logits = logits.round(DECIMALS)
        logits[:, :-1][~is_place] = -np.inf
        return logits


class StepAnswers:
    """The answers of one time step, which negative looks change by Bayes' rule.

    Nothing moves within a step. So a look at a place that does not show a thing says of this step
    that it is not there, or was missed, and nothing else: the odds of the place are multiplied by
    the share of things that such a look misses (`sgm.belief.compute_miss`), those of all others
    stay. What was seen is no longer known here.

    Answers are of one memory, and hold for as long as every look at it is noted (`note_look`).
    """

    def __init__(self, memory: MemoryBatch) -> None:
        """Start without answers; the looks at the memory, which counts `history`, are noted."""
        self.memory = memory
        self._clear()

    def _clear(self) -> None:
        self._state = self._read_state()
        self._objects = np.zeros(0, dtype=np.int64)  # that were asked for, (n,)
        self._looked = np.zeros((self.memory.num_homes, self.memory.num_furniture))
        self._logits = np.zeros((0, self.memory.num_furniture + 1))  # (n, F + 1)

    def _read_state(self) -> tuple[int, int, int, PlacePrior]:
        """Return what differs after a step, a look, or a change of the furniture."""
        memory = self.memory
        num_looks = int(memory.furniture["num_observed"].sum())
        return memory.time, num_looks, memory.edges.num_rows, memory.place_prior

    def answer(self, queries: Queries, ask: Callable[[Queries], np.ndarray]) -> np.ndarray:
        """Return logits, (Q, F + 1), of what is known, and of what `ask` says of the others."""
        if self._state != self._read_state():
            self._clear()
        answer_of = np.full(self.memory.objects.num_rows, -1)
        answer_of[self._objects] = np.arange(len(self._objects))
        new = np.flatnonzero(answer_of[queries.object] < 0)
        if len(new):
            objects, first = np.unique(queries.object[new], return_index=True)  # each once
            answer_of[objects] = np.arange(len(objects)) + len(self._objects)
            self._objects = np.append(self._objects, objects)
            self._logits = np.concatenate([self._logits, ask(queries.take(new[first]))])
        return self._logits[answer_of[queries.object]]

    def note_look(self, change: Change) -> None:
        """Use a look that the memory has just folded in."""
        memory = self.memory
        if self._state[0] != memory.time:
            self._clear()
            return
        seen = memory.edges["object"][change.edges[change.is_seen]]
        is_kept = ~mark_rows(seen, memory.objects.num_rows)[self._objects]
        self._objects, self._logits = self._objects[is_kept], self._logits[is_kept]
        place, missed = np.full(memory.num_homes, -1), np.ones(memory.num_homes)
        place[change.home] = change.furniture
        before = self._looked[change.home, change.furniture]
        miss_rate = memory.history.compute_miss_rate()[change.home]
        repeated = _REPEATED_SHARE
        missed[change.home] = compute_miss(before + change.coverage, miss_rate, repeated)
        missed[change.home] /= compute_miss(before, miss_rate, repeated)
        self._looked[change.home, change.furniture] += change.coverage
        home = memory.objects["home"][self._objects]
        rows = np.flatnonzero(place[home] >= 0)
        self._logits[rows, place[home[rows]]] += np.log(missed[home[rows]])
        self._state = self._read_state()
