"""What has to be trained and played for the tables of the paper, as far as it is not done yet."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from nep.config_files import CONFIG_FOLDER
from nep.games.play_all import load_played, play_all
from nep.games.score_cache import ScoreCache
from nep.players.contestants import Checkpoint, MakePolicy, list_contestants
from nep.report.results import ScoreSummary, list_versions, unpack_summary
from nep.reproduce.experiments import (
    ABLATION_SETTING,
    SETTINGS,
    Contestant,
    Model,
    Setting,
    enter,
    list_ablations,
    list_full_models,
)
from nep.reproduce.job_stages import Job
from nep.reproduce.paper_game import PaperGame
from nep.reproduce.paper_tables import Provenance
from nep.reproduce.training import Training, collect_data
from sgm.checks import check_at_least, check_seed
from sgm.files import compute_checksum
from sgm.messages import shorten
from simulator.policies import POLICIES

PAPER_TABLES = ("1", "2", "figure")
SCORES = "scores.json"  # in the folder of runs


@dataclass(frozen=True, slots=True)
class Plan:
    """What is trained, and then plays beside policies; all of it is kept in the folder `runs`.

    Attributes:
        tables: some of `PAPER_TABLES`.
        models: networks of Table 1 and the figure.
        homes, steps: test homes, and steps in each.
        seed: of the first training and of the test homes.
        fit_options: further options of every training.
        runs: folder of trainings and scores.
        data: folder of the collections.
        options: those of the command line that change what comes out, but for the table.
        encoders: modules of encoders from outside the package.
        source: name of where homes come from, see `simulator.home_options.SOURCES`.
        num_trainings: of every network, of seeds that follow each other; all play the same homes.
        settings: columns of Table 1.
        title: of its page.
    """

    tables: tuple[str, ...]
    models: tuple[Model, ...]
    num_homes: int
    steps: int
    seed: int
    fit_options: tuple[str, ...]
    runs: Path
    data: Path
    options: tuple[str, ...]
    encoders: tuple[str, ...] = ()
    source: str = "sampled"
    num_trainings: int = 1
    settings: tuple[Setting, ...] = SETTINGS
    title: str = "Table 1"

    def check(self) -> None:
        """Check what no parser has checked.

        Raises:
            ValueError: if a count or the seed is out of range, or a config is no file.
        """
        check_at_least(1, num_homes=self.num_homes, steps=self.steps, seeds=self.num_trainings)
        check_seed(self.seed)
        for config in (model.config for model in self.models if model.config):
            if not (CONFIG_FOLDER / config).is_file():
                raise ValueError(
                    f"config must be a file or a packaged config, got {shorten(config)}. Check the "
                    "path."
                )

    def describe(self, table: str) -> Provenance:
        """Return what to write under a table; folders and number of jobs change nothing in it."""
        options = ["--table", table, *self.options]
        played = map(self.make_game, self.list_settings() or SETTINGS)
        names = dict.fromkeys(name for game in played if (name := game.name_homes()))
        return Provenance(
            command=shlex.join(["python", "-m", "nep.reproduce", *options]),
            seed=self.seed,
            num_homes=self.num_homes,
            steps=self.steps,
            num_trainings=self.num_trainings,
            title=self.title,
            versions=list_versions(),
            test_sets=tuple(names),
            checkpoints=self.list_checkpoints(),
            configs={model.title: Path(model.file).name for model in self.models},
        )

    def list_checkpoints(self) -> dict[str, str]:
        """Return the SHA-256 of every network, by setting, title and seed of the training."""
        return {
            training.title: compute_checksum(training.checkpoint)
            for training in self.list_all_trainings()
            if training.checkpoint.is_file()
        }

    def list_settings(self) -> tuple[Setting, ...]:
        """Return the settings in which all models and policies play."""
        settings = self.settings if "1" in self.tables else ()
        if "figure" in self.tables and ABLATION_SETTING not in settings:
            settings += (ABLATION_SETTING,)
        return settings

    def list_networks(self) -> list[Contestant]:
        """Return every network that must be trained, setting by setting."""
        networks = [
            enter(model, setting) for setting in self.list_settings() for model in self.models
        ]
        if "2" in self.tables:
            networks += [network for network in list_full_models() if network not in networks]
            networks += list_ablations()
        return networks

    def list_trainings(self, network: Contestant) -> list[Training]:
        """Return the trainings of a network; those after the first are in folders of their own."""
        folders = {
            seed: self.runs if seed == self.seed else self.runs / f"seed_{seed}"
            for seed in range(self.seed, self.seed + self.num_trainings)
        }
        return [
            Training(network, seed, self.fit_options, runs, self.data, self.source)
            for seed, runs in folders.items()
        ]

    def make_game(self, setting: Setting) -> PaperGame:
        """Return what all play in a setting."""
        return PaperGame(setting, self.num_homes, self.steps, self.seed, self.source)

    def list_games(self) -> dict[str, PaperGame]:
        """Return what is played, by name."""
        settings = dict.fromkeys(
            [*self.list_settings(), *(network.setting for network in self.list_networks())]
        )
        return {game.name: game for game in map(self.make_game, settings)}

    def list_all_trainings(self) -> list[Training]:
        """Return the trainings of all networks."""
        return [
            training
            for network in self.list_networks()
            for training in self.list_trainings(network)
        ]

    def list_players(
        self, game: PaperGame, trained: Mapping[str, Training]
    ) -> dict[str, MakePolicy]:
        """Return what makes each policy and each network that was trained for a game, by name."""
        policies = tuple(POLICIES) if game.setting in self.list_settings() else ()
        networks = [
            Checkpoint(name, training.checkpoint, encoders=self.encoders)
            for name, training in trained.items()
            if training.contestant.setting == game.setting
        ]
        return list_contestants(game.setting.task, policies, networks)

    def load_scores(self, network: Contestant, cache: ScoreCache) -> ScoreSummary:
        """Return what the trainings of a network have scored; one alone as it is."""
        by_player = cache.scores[self.make_game(network.setting).name]
        trainings = self.list_trainings(network)
        scores = [unpack_summary(by_player[self.name_training(training)]) for training in trainings]
        return scores[0] if len(scores) == 1 else ScoreSummary.join(scores)

    def name_training(self, training: Training) -> str:
        """Return the name of a training among players: its folder."""
        return training.folder.relative_to(self.runs).as_posix()

    def list_trained(self) -> dict[str, Training]:
        """Return the trainings that are done, by name."""
        return {
            self.name_training(training): training
            for training in self.list_all_trainings()
            if training.is_done()
        }

    def compute_checksums(self) -> dict[str, str]:
        """Return the SHA-256 of the networks that are trained, by name."""
        return {
            name: compute_checksum(training.checkpoint)
            for name, training in self.list_trained().items()
        }

    def plan_stages(self) -> tuple[list[Job], list[Job]]:
        """List collections, then trainings, as far as they are not done yet."""
        missing = [training for training in self.list_all_trainings() if not training.is_done()]
        together: dict[Path, list[Training]] = {}
        for training in missing:
            together.setdefault(training.folder.parent, []).append(training)

        def make_job(
            verb: str, folder: Path, run: Callable[[], object], after: Sequence[str] = ()
        ) -> Job:
            key = folder.relative_to(self.runs).as_posix()
            log = self.runs / "logs" / f"{verb}-{key.replace('/', '-')}.log"
            return Job(f"{verb} {key}", run, log, tuple(after))

        collections = {
            folder: make_job("collect", folder, partial(collect_data, served))
            for folder, served in together.items()
        }
        trainings = [
            make_job(
                "train", training.folder, training.run, [collections[training.folder.parent].name]
            )
            for training in missing
        ]
        return list(collections.values()), trainings

    def play(self, workers: int = 1, backend: str = "processes") -> ScoreCache:
        """Let policies, and networks that are trained, play what they have not played yet."""
        trained = self.list_trained()
        return play_all(
            self.list_games(),
            lambda game: self.list_players(game, trained),
            self.runs / SCORES,
            self.compute_checksums(),
            workers,
            backend,
        )

    def load_cache(self) -> ScoreCache:
        """Return what has been played so far, by these networks."""
        return load_played(self.list_games(), self.runs / SCORES, self.compute_checksums())
