"""The test homes of a setting, in which policies and networks play its task."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, ClassVar

from nep.games.game import Game
from nep.players.contestants import MakePolicy
from nep.report.results import ScoreSummary, pack_summary
from nep.reproduce.experiments import Setting
from sgm.prior.prior_graph import PriorGraph
from simulator.home_options import import_source
from simulator.tasks.evaluation import evaluate_policy
from simulator.test_sets.test_sets import name_test_set
from simulator.world.config import HomeConfig
from simulator.world.homes import Homes
from simulator.world.source import HomeSource
from simulator.world.streams import Streams


@dataclass(frozen=True)
class PaperGame(Game):
    """A setting and its test homes.

    Attributes:
        setting: what is played.
        num_homes, steps, seed: of the test homes.
        source: name of where homes come from, see `simulator.home_options.SOURCES`.
    """

    setting: Setting
    num_homes: int
    steps: int
    seed: int
    source: str = "sampled"

    scored_by: ClassVar[tuple[str, ...]] = (
        "simulator.tasks.evaluation",
        "simulator.tasks.metrics",
        "simulator.tasks.scores",
    )

    @property
    def name(self) -> str:
        """Name among kept scores; other homes or steps give another one."""
        where = "" if self.source == "sampled" else f" of {self.source}"
        size = f"{self.num_homes} homes x {self.steps} steps, seed {self.seed}"
        return f"{self.setting.name}{where}, {size}"

    @property
    def streams(self) -> Streams:
        """Random numbers of the test homes."""
        return Streams(self.seed, "test", range(self.num_homes))

    def describe(self) -> dict[str, Any]:
        """Return everything that the scores depend on, as JSON values."""
        about = asdict(self)
        return {**about.pop("setting"), **about, "prior": PriorGraph.default().checksum}

    def tell(self) -> dict[str, Any]:
        """Return title and units."""
        return {
            "title": self.setting.title,
            "units": [f"home {n}" for n in range(self.num_homes)],
        }

    def play(self, players: Mapping[str, MakePolicy]) -> dict[str, Any]:
        """Let players play; return summaries by player (`pack_summary`)."""
        source, task = self.make_source(), self.setting.task
        return {
            name: pack_summary(
                ScoreSummary.of(evaluate_policy(make, source, self.streams, self.steps, task=task))
            )
            for name, make in players.items()
        }

    def make_source(self) -> HomeSource:
        """Return where the homes come from."""
        rules = HomeConfig(dynamic_nodes=self.setting.dynamic_nodes)
        return import_source(self.source)(PriorGraph.default(), rules)

    def name_homes(self) -> str | None:
        """Return the name of the test homes, None if they have none (`simulator.test_sets`)."""
        return name_test_set(self.make_source(), self.streams, self.steps)

    def make_homes(self) -> Homes:
        """Return the homes at t = 0, all in one group."""
        return self.make_source().make(self.streams)
