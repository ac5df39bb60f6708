"""Where to look for something, asked of a memory and a trained network."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from datamodules.features import require_clock
from nep.players.calibration import Calibration
from nep.players.checkpoints import TrainedModel, load_trained
from nep.players.policy import NEPPolicy
from simulator.memory.asking import Asked
from simulator.memory.names import Similarity
from simulator.robot.belief import Detector
from simulator.robot.finder import DEFAULT_SHARE, Finder


class ObjectFinder(Finder):
    """Answers where an object is, from a `SceneGraphMemory` alone, on one CPU thread.

    A `Finder` whose policy is a trained network. Any words will do: labels of rooms, furniture and
    objects that no training home had are known by their text vectors.

    Example:
        >>> finder = ObjectFinder.load("heat")
        >>> for place in finder.rank(memory, "large red mug", k=5):
        ...     print(place.name, place.probability, place.why)

    Attributes:
        calibration: what turns logits into probabilities before the looks of a time step. A
            checkpoint that was never calibrated has the softmax of its logits.
    """

    def __init__(
        self,
        model: TrainedModel,
        elsewhere_share: float | None = None,
        detector: Detector | None = None,
    ) -> None:
        """Ask a trained network; `load` reads one from disk.

        Args:
            model: the network.
            elsewhere_share: as in `load`.
            detector: as in `load`.

        Raises:
            ValueError: if the network reads the belief of a filter, which knows the rules of
                simulated homes, or the share is out of range.
        """
        if model.builder.config.belief:
            raise ValueError(
                "network must read the memory alone, got one with features.belief: that filter "
                "knows the rules of simulated homes. Train without, or take the shipped 'heat'."
            )
        self._builder = model.builder
        self._network = NEPPolicy(model.module.eval(), model.builder)
        self.calibration = model.calibration or Calibration()
        if elsewhere_share is None:
            elsewhere_share = self.calibration.elsewhere_share or DEFAULT_SHARE
        super().__init__(self._network, detector, elsewhere_share)
        self.calibration = self.calibration.with_share(elsewhere_share)

    @classmethod
    def load(
        cls,
        source: str | Path = "heat",
        elsewhere_share: float | None = None,
        detector: Detector | None = None,
    ) -> ObjectFinder:
        """Load a trained network; nothing in the files is executed.

        Args:
            source: "heat", which ships with the package; a folder of `python -m nep.export`; or a
                checkpoint of `python -m nep.fit`.
            elsewhere_share: how often what is asked for is at no known place, above 0 and below 1;
                None for the share that the network was calibrated with, 0.1.
            detector: how often a look misses what is there, and how fast things leave; None for
                those of the paper's homes.

        Raises:
            ValueError: if there is no such file, it is damaged, or it was made for another feature
                schema or other text vectors than those installed.
        """
        return cls(load_trained(source), elsewhere_share, detector)

    def _judge(self, asked: Asked) -> tuple[np.ndarray, np.ndarray]:
        if self._builder.config.clock:
            require_clock(asked.batch.clock)
        scores = self._network.score_places(asked.batch, asked.queries).max(axis=2)  # (K, F)
        probability = self.calibration.compute_probabilities(scores)
        return probability[:, :-1], probability[:, -1]

    def _get_similarity(self) -> Similarity:
        def compare(label: str, others: Sequence[str]) -> Sequence[float]:
            with self._lock:
                return self._builder.compare_labels(label, others).tolist()

        return compare

    def _get_cosines(self, asked: Asked) -> np.ndarray:
        with self._lock:
            return self._builder.compute_cosines(asked.batch.labels)
