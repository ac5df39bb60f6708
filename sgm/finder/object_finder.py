"""Where to look for something, asked of a memory and a trained network."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import islice, takewhile
from pathlib import Path
from typing import Any

import numpy as np

from sgm.belief import Belief, Detector
from sgm.finder.adaptation import Adaptation, AskedAgain, Questions, fit_adaptation
from sgm.finder.finder import Finder
from sgm.memory.asking import Asked
from sgm.memory.look_log import LogLine, read_log
from sgm.memory.look_weights import SURE
from sgm.memory.replay import replay
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.names.name_matching import Similarity
from sgm.names.words import read_words
from sgm.network.network import Network, has_onnx
from sgm.network.policy import NetworkPolicy
from sgm.network.shipped import find_trained
from sgm.policies.adaptive import Adaptive
from sgm.text import load_text

# The latest ones, to adapt to. With half of them more fits were kept, and later answers were worse.
_MOST_QUESTIONS = 2000


class ObjectFinder(Finder):
    """Answers where an object is, from a `SceneGraphMemory` alone, on one CPU thread.

    A `Finder` whose policy is a trained network. Any words will do: labels of rooms, furniture and
    objects that no training home had are known by their text vectors. Networks that read evidence
    alone, such as "any_home", are run by ONNX Runtime; `nep.ObjectFinder` runs others with torch.

    Example:
        >>> finder = ObjectFinder.load()
        >>> for place in finder.rank(memory, "large red mug", k=5):
        ...     print(place.name, place.probability, place.why)

    Attributes:
        adaptation: to the home that it was adapted to; none at first.
    """

    def __init__(
        self,
        model: Any,
        detector: Detector | None = None,
        asks_moved: float = 0.0,
    ) -> None:
        """Ask a trained network; `load` reads one from disk.

        Args:
            model: the network: a `Network`, or in `nep` one that torch runs.
            detector: as in `load`.
            asks_moved: as in `Finder`.

        Raises:
            ValueError: if the network reads the belief of a filter, which knows the rules of
                simulated homes, or the share is out of range.
        """
        policy = self._make_policy(model, asks_moved)
        self._network = policy
        self._text = load_text(policy.text_pipeline)
        self._cosines: tuple[tuple[str, ...], np.ndarray] = ((), np.zeros((0, 0)))
        self.adaptation = Adaptation()
        super().__init__(policy, detector, asks_moved)
        self._asks_moved = asks_moved

    @classmethod
    def load(
        cls,
        source: str | Path = "any_home",
        detector: Detector | None = None,
        asks_moved: float = 0.0,
    ) -> ObjectFinder:
        """Load a trained network; nothing in the files is executed.

        Args:
            source: "any_home" or "heat", which ship with the package; a folder of
                `python -m nep.export`; or a checkpoint of `python -m nep.fit`.
            detector: how often a look misses what is there; None for that of the paper's homes.
            asks_moved: as in `Finder`; networks without evidence, such as "heat", answer as if it
                were 0.5.

        Raises:
            FileNotFoundError: if there is no such file; it is a `ValueError`, too.
            ValueError: if the file is damaged, or it was made for another feature
                schema or other text vectors than those installed; or if it needs torch, and that
                is not installed.
        """
        return cls(cls._read(find_trained(source)), detector, asks_moved)

    @classmethod
    def _read(cls, path: Path) -> Any:
        """Read a network; `ValueError` if it cannot be read, or not be run here."""
        if not (path.is_dir() and has_onnx(path)):
            raise ValueError(
                "network must read evidence alone to be run without torch, got one without "
                f"network.onnx in {path}. Take 'any_home', or install scene-graph-memory and ask "
                "nep.ObjectFinder."
            )
        return Network.load(path)

    def _make_policy(self, model: Any, asks_moved: float) -> Any:
        """Return the policy that asks a network, and says whose text vectors that reads.

        `NetworkPolicy`, or one of its kind: with `text_pipeline` and `ask_anew`.
        """
        return NetworkPolicy(model, asks_moved)

    def adapt(self, log: str | Path) -> Adaptation:
        """Learn the home that a robot has looked around in, in seconds.

        The looks are made again in a new memory; whatever one of them showed is asked for just
        before it, as if it were unknown. The adaptation is kept where it makes looks likelier that
        it was not fitted to, and left out where it does not; it is returned in both cases.

        Args:
            log: of a `SceneGraphMemory(log="looks.jsonl")` of this home.

        Returns:
            The adaptation, whose `save` keeps it beside the memory; `finder.adaptation =
            Adaptation.load(path)` takes it up again.

        Raises:
            ValueError: if the file is no log, or shows too little.
        """
        self.adaptation = fit_adaptation(self.ask_again(log))
        return self.adaptation

    def ask_again(self, log: str | Path) -> Questions:
        """Make the looks of a log again, and ask for what each of them showed just before it.

        Args:
            log: as in `adapt`.

        Returns:
            What the network says, without its adaptation; the latest `_MOST_QUESTIONS`.

        Raises:
            ValueError: if the file is no log.
        """
        return Questions.join(list(self._ask_again(log)), self._asks_moved)

    def _ask_again(self, log: str | Path) -> Iterator[AskedAgain]:
        lines = read_log(log)
        sure = _list_sure(lines)
        # The line from which on the looks show that many things, or fewer.
        num_after = np.cumsum([len(names) for names in sure[::-1]])[::-1]
        is_late = num_after <= _MOST_QUESTIONS
        begin = int(is_late.argmax()) if is_late.any() else len(sure)
        asked_in: dict[str, AskedAgain] = {}  # answers before the looks of this time step
        for number, (memory, line, furniture) in enumerate(replay(lines)):
            if line.kind != "look":
                asked_in = {}
                continue
            if number < begin:
                continue
            names = sure[number]
            if any(name not in asked_in for name in names):
                # All looks of a time step are asked about at once, since none of them counts yet.
                # Things that are asked for together move each other's logits by some hundredths.
                later = islice(zip(lines, sure, strict=True), number, None)
                looks = takewhile(lambda own: own[0].kind == "look", later)
                new = dict.fromkeys(name for _, shown in looks for name in shown)
                asked_in = self._answer(memory, list(new), furniture)
            here = line.values["furniture"]
            for name in names:
                places = memory.places_of(name)
                was_here = any(
                    place.furniture == furniture[here] and place.is_there for place in places
                )
                yield replace(
                    asked_in[name], furniture=here, has_moved=bool(places) and not was_here
                )

    def _answer(
        self, memory: SceneGraphMemory, names: list[str], furniture: Mapping[int, int]
    ) -> dict[str, AskedAgain]:
        """Ask for things, and return logits and beliefs of each by ids of the log.

        Args:
            memory: before the looks of a time step, or between them, which is the same.
            names: of the things.
            furniture: ids in the memory by those in the log.
        """
        asked = memory.ask(names)
        self._tell_miss_rate(asked)
        with self._lock:
            scores, belief = self._score(asked)
        number_of = {own: number for number, own in furniture.items()}
        numbers = [number_of[own] for own in asked.furniture_ids]
        first = asked.question
        rows = zip(names, scores[first].tolist(), belief[first].tolist(), strict=True)
        return {
            name: AskedAgain(dict(zip(numbers, zip(*row, strict=True), strict=True)), -1, False)
            for name, *row in rows
        }

    def _score(self, asked: Asked) -> tuple[np.ndarray, np.ndarray]:
        """Return logits, and what the adaptive filter believes, (K, F) both."""
        belief = Adaptive().for_questions(self._asks_moved).follow(asked.batch, asked.queries)
        return self._network.ask_anew(asked.batch, asked.queries), belief[:, :-1]

    def _believe(self, asked: Asked) -> Belief:
        belief = super()._believe(asked)
        if not self.adaptation.is_used:
            return belief
        scores = self.adaptation.change(*self._score(asked), asked.furniture_ids)
        return Belief.of_logits(scores, belief.elsewhere)

    def _list_settings(self) -> tuple[object, ...]:
        return (*super()._list_settings(), self.adaptation)

    def _get_similarity(self) -> Similarity:
        def compare(label: str, others: Sequence[str]) -> Sequence[float]:
            with self._lock:
                return self._text.cosines([label, *others])[0, 1:].tolist()

        return compare

    def _get_cosines(self, asked: Asked) -> np.ndarray:
        labels = tuple(asked.batch.labels)
        with self._lock:
            if labels != self._cosines[0]:  # a memory in use learns new labels now and then
                self._cosines = labels, self._text.cosines(labels)
            return self._cosines[1]


def _list_sure(lines: Sequence[LogLine]) -> list[list[str]]:
    """Return the words, or ids, of what each look showed for sure; nothing of other lines."""
    sure: list[list[str]] = []
    calibration = None
    for line in lines:
        if line.kind == "start":
            calibration = line.values["memory"].score_calibration
        names = (
            about[1] if about and about[1] else read_words("description", name)
            for name, _, score, *about in (line.values["seen"] if line.kind == "look" else ())
            if (score if calibration is None else calibration(score)) >= SURE
        )
        sure.append(list(dict.fromkeys(names)))
    return sure
