"""Trainings, and the games that their networks play: what the paper's tables and claims share."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path

from nep.bench.paper.paper_game import PaperGame
from nep.bench.paper.stages import Job
from nep.bench.paper.training import Training, collect_data
from nep.bench.runner import load_played, play_all
from nep.bench.score_cache import ScoreCache
from nep.players.contestants import MakePolicy
from sgm.files import compute_checksum

SCORES = "scores.json"  # in the folder of runs


class TrainedPlan(ABC):
    """What is trained, and then plays beside policies; all of it is kept in the folder `runs`."""

    __slots__ = ()
    runs: Path

    @abstractmethod
    def list_all_trainings(self) -> list[Training]:
        """Return the trainings, the most important ones first."""

    @abstractmethod
    def list_games(self) -> dict[str, PaperGame]:
        """Return what is played, by name."""

    @abstractmethod
    def list_players(
        self, game: PaperGame, trained: Mapping[str, Training]
    ) -> dict[str, MakePolicy]:
        """Return what makes each policy, and each network that was trained, of a game by name."""

    def name_training(self, training: Training) -> str:
        """Return the name of a training among players: its folder."""
        return training.folder.relative_to(self.runs).as_posix()

    def list_trained(self) -> dict[str, Training]:
        """Return the trainings that are done, by name."""
        return {self.name_training(row): row for row in self.list_all_trainings() if row.is_done()}

    def compute_checksums(self) -> dict[str, str]:
        """Return the SHA-256 of the networks that are trained, by name."""
        return {name: compute_checksum(own.checkpoint) for name, own in self.list_trained().items()}

    def plan_stages(self) -> tuple[list[Job], list[Job]]:
        """List collections, then trainings, as far as they are not done yet."""
        missing = [training for training in self.list_all_trainings() if not training.is_done()]
        together: dict[Path, list[Training]] = {}
        for training in missing:
            together.setdefault(training.folder.parent, []).append(training)

        def make_job(
            what: str, folder: Path, run: Callable[[], object], after: Sequence[str] = ()
        ) -> Job:
            key = folder.relative_to(self.runs).as_posix()
            log = self.runs / "logs" / f"{what}-{key.replace('/', '-')}.log"
            return Job(f"{what} {key}", run, log, tuple(after))

        collections = {
            folder: make_job("collect", folder, partial(collect_data, own))
            for folder, own in together.items()
        }
        trainings = [
            make_job("train", row.folder, row.run, [collections[row.folder.parent].name])
            for row in missing
        ]
        return list(collections.values()), trainings

    def play(self, workers: int = 1, backend: str = "processes") -> ScoreCache:
        """Let policies, and networks that are trained, play what they have not played yet."""
        trained = self.list_trained()
        return play_all(
            self.list_games(), lambda game: self.list_players(game, trained), self.runs / SCORES,
            self.compute_checksums(), workers, backend,
        )  # fmt: skip

    def load_cache(self) -> ScoreCache:
        """Return what has been played so far, by these networks."""
        return load_played(self.list_games(), self.runs / SCORES, self.compute_checksums())
