"""Scores on disk: one file per setting and contestant, played once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from nep.bench.paper.experiments import Setting
from nep.bench.stored_play import StoredPlay
from nep.players.contestants import Checkpoint
from nep.report.results import ScoreSummary, pack_summary, unpack_summary
from sgm.files import compute_checksum
from sgm.prior.prior_graph import PriorGraph
from simulator.home_options import import_source
from simulator.policies import Policy, make_policy
from simulator.tasks.evaluation import evaluate_policy
from simulator.tasks.metrics import METRICS
from simulator.test_sets.test_sets import name_test_set
from simulator.world.config import HomeConfig
from simulator.world.homes import Homes
from simulator.world.source import HomeSource
from simulator.world.streams import Streams


@dataclass(frozen=True)
class Evaluation(StoredPlay):
    """A contestant that plays a setting on test homes, and the file that keeps how it did.

    Attributes:
        setting: what is played.
        contestant: name of a policy, or of the network of `checkpoint`.
        checkpoint: the network; None for a policy.
        homes, steps, seed: of the test homes.
        path: the file.
        encoders: modules of encoders from outside the package.
        source: name of where homes come from, see `simulator.home_options.SOURCES`.
        cross_room_moves: whether a move may lead to another room.
    """

    setting: Setting
    contestant: str
    checkpoint: Path | None
    num_homes: int
    steps: int
    seed: int
    path: Path
    encoders: tuple[str, ...] = ()
    source: str = "sampled"
    cross_room_moves: bool = False

    scored_by: ClassVar[Sequence[str]] = (
        "simulator.tasks.evaluation", "simulator.tasks.metrics", "simulator.tasks.scores",
    )  # fmt: skip

    def describe(self) -> dict[str, Any]:
        """Return everything that the scores depend on, as JSON values."""
        return {
            "metrics": [*METRICS],
            "task": self.setting.task,
            "dynamic_nodes": self.setting.dynamic_nodes,
            "source": self.source,
            "contestant": self.contestant,
            "checkpoint": compute_checksum(self.checkpoint) if self.checkpoint else None,
            "prior": PriorGraph.default().checksum,
            "num_homes": self.num_homes,
            "steps": self.steps,
            "seed": self.seed,
            "split": "test",
            **({"cross_room_moves": True} if self.cross_room_moves else {}),
        }

    def play(self) -> dict[str, Any]:
        """Play, and return the summary as JSON values."""
        streams = Streams(self.seed, "test", range(self.num_homes))
        task = self.setting.task
        scores = evaluate_policy(
            self.make_player, self.make_source(), streams, self.steps, task=task
        )
        return pack_summary(ScoreSummary.of(scores))

    def make_source(self) -> HomeSource:
        """Return where the homes come from."""
        rules = HomeConfig(
            dynamic_nodes=self.setting.dynamic_nodes, cross_room_moves=self.cross_room_moves
        )
        return import_source(self.source)(PriorGraph.default(), rules)

    def name_homes(self) -> str | None:
        """Return the name of the test homes, None if they have none (`simulator.test_sets`)."""
        streams = Streams(self.seed, "test", range(self.num_homes))
        return name_test_set(self.make_source(), streams, self.steps)

    def make_homes(self) -> Homes:
        """Return the homes at t = 0, all in one group."""
        return self.make_source().make(Streams(self.seed, "test", range(self.num_homes)))

    def make_player(self, homes: Homes) -> Policy:
        """Return the contestant for homes."""
        if self.checkpoint is None:
            return make_policy(self.contestant, homes)
        network = Checkpoint(self.contestant, self.checkpoint, encoders=self.encoders)
        return network.load().play_in(homes)

    def load(self) -> ScoreSummary:
        """Read the scores of a finished evaluation."""
        return unpack_summary(self.read())
