"""Where to look for something, asked of a memory and a trained network."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from datamodules.features import require_clock
from nep.players.calibration import Calibration
from nep.players.checkpoints import TrainedModel, load_trained
from nep.players.policy import NEPPolicy
from nep.players.searches import find_absent
from nep.robot.evidence import gather_evidence
from nep.robot.place import Place, Ranking
from nep.robot.search_plan import Distance, SearchPlan, plan_search
from simulator.memory.scene_graph_memory import SceneGraphMemory
from simulator.memory.sighting import RELATIONS


class ObjectFinder:
    """Answers where an object is, from a `SceneGraphMemory` alone, on one CPU thread in 3 ms.

    Any words will do: labels of rooms, furniture and objects that no training home had are known by
    their text vectors. An object that the prior does not know may be at all furniture.

    Example:
        >>> finder = ObjectFinder.load("heat")
        >>> for place in finder.rank(memory, "large red mug", k=5):
        ...     print(place.name, place.probability, place.why)

    Attributes:
        calibration: what turns logits into probabilities. A checkpoint that was never calibrated
            has the softmax of its logits, and never says "elsewhere".
    """

    def __init__(self, model: TrainedModel, elsewhere_share: float | None = None) -> None:
        """Ask a trained network; `load` reads one from disk.

        Args:
            model: the network.
            elsewhere_share: as in `load`.

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
        self._policy = NEPPolicy(model.module.eval(), model.builder)
        calibration = model.calibration or Calibration()
        if elsewhere_share is not None:
            calibration = calibration.with_share(elsewhere_share)
        self.calibration = calibration

    @classmethod
    def load(
        cls, source: str | Path = "heat", elsewhere_share: float | None = None
    ) -> ObjectFinder:
        """Load a trained network; nothing in the files is executed.

        Args:
            source: "heat", which ships with the package; a folder of `python -m nep.export`; or a
                checkpoint of `python -m nep.fit`.
            elsewhere_share: how often what is asked for is at no known place, above 0 and below 1;
                None for the share that the network was calibrated with, 0.1.

        Raises:
            ValueError: if there is no such file, it is damaged, or it was made for another feature
                schema or other text vectors than those installed.
        """
        return cls(load_trained(source), elsewhere_share)

    def rank(self, memory: SceneGraphMemory, description: str, k: int | None = None) -> Ranking:
        """Rank the places where an object may be.

        Asking is a query to the memory: a look in the same time step at one of these places that
        does not show the object is remembered, and lowers the place from then on.

        Args:
            memory: what was seen so far; it needs furniture.
            description: what to look for, such as "large red mug", seen before or not.
            k: most places to return; None for all.

        Raises:
            ValueError: if the description is no name (`read_words`), there is no furniture yet,
                `k` is below 1, or the network reads a clock and the memory has none.
        """
        if k is not None and k < 1:
            raise ValueError(f"k must be at least 1, got {k}. Leave it out for all places.")
        if self._builder.config.clock:
            require_clock(memory.batch.clock)
        query = memory.query(description)
        scores = self._policy.score_places(memory.batch, query)  # (1, F, 2)
        probability = self.calibration.compute_probabilities(
            scores.max(axis=2), find_absent(memory.batch, query)
        )[0]  # (F + 1,)
        order = np.argsort(-probability[:-1], kind="stable")
        chosen = order[np.isfinite(scores[0, order]).any(axis=1)][:k]
        cosines = self._builder.compute_cosines(memory.batch.labels)
        ids = memory.furniture_ids
        sightings = memory.places_of(description)
        return Ranking(
            description=description,
            places=tuple(
                Place(
                    furniture=ids[place],
                    name=memory.describe(ids[place]),
                    relation=RELATIONS[scores[0, place].argmax()],
                    probability=float(probability[place]),
                    evidence=evidence,
                )
                for place, evidence in zip(
                    chosen,
                    gather_evidence(memory, sightings, query, cosines, chosen),
                    strict=True,
                )
            ),
            elsewhere=float(probability[-1]),
            last_seen=next(iter(sightings), None),
        )

    def search_plan(
        self,
        memory: SceneGraphMemory,
        description: str,
        start: Any = None,
        distance: Distance | None = None,
        look_cost: float = 1.0,
        k: int | None = None,
    ) -> SearchPlan:
        """Plan in which order to look, so that the expected cost until it is found is small.

        The plan takes it that a look finds what is there, and keeps today's probabilities: after a
        look in vain, `memory.observe` it and plan again.

        Args:
            memory: what was seen so far.
            description: what to look for.
            start: where the search starts, as `distance` understands it.
            distance: cost of the way, `distance(start, furniture)` and
                `distance(furniture, furniture)` with furniture ids, in any unit; None if only looks
                cost.
            look_cost: of one look, in the unit of the distances.
            k: most places to plan over, the likeliest ones; None for all.

        Raises:
            ValueError: as in `rank`; or if a cost is negative or not finite, or a start is given
                without distances.
        """
        places = self.rank(memory, description, k).places
        return plan_search(description, places, start, distance, look_cost)
