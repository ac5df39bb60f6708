"""What is tuned, trained and played for the table of temporal networks, one resumable unit each."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import torch

from nep.bench.task_game import TaskGame
from nep.report.results import describe_code
from sgm.files import compute_checksum, read_json, write_whole
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Change, Queries
from sgm.policies.policy import Policy
from simulator.tasks.evaluation import evaluate_policy
from simulator.tasks.metrics import METRICS, STEP_METRICS, Metric
from simulator.trace.source import RecordedSource
from simulator.world.homes import Homes
from simulator.world.source import HomeSource, SampledSource
from simulator.world.streams import Streams
from tools.home_games import list_simulated
from tools.temporal.episodes import EventEpisode, record_episodes
from tools.temporal.policy import EventPolicy
from tools.temporal.registry import TrainedNetwork, make_network
from tools.temporal.training import train_network, tune, validate

HOUSEHOLDS = "households"
TRAINED_ELSEWHERE = {HOUSEHOLDS: "mixed"}  # homes that nothing is trained in, and where instead
_METRICS = {
    "first_guess": METRICS["accuracy"],
    "mrr": Metric("mrr", "MRR", ".3f", True, lambda scores: (1 / scores.rank).mean()),
    "nll": METRICS["nll"],
}
# Columns of every home, and how tables write them.
COLUMNS = {**_METRICS, "looks": STEP_METRICS["looks"]}


@dataclass(frozen=True, slots=True)
class Sizes:
    """How much is trained and played.

    Attributes:
        train_homes, val_homes: homes whose recorded episodes are learnt from and tuned on.
        train_steps: time steps of each.
        batch_homes: homes that a step of the optimiser learns from, at most.
        epochs: of a training.
        trials: settings that are tried for each network; 0 for those of its constructor.
        trial_epochs: of a trial; pruned ones have fewer.
        num_homes, steps, searches: test homes, time steps of Predict Object Location, and searches
            of Find Object.
    """

    train_homes: int = 100
    val_homes: int = 20
    train_steps: int = 100
    batch_homes: int = 16
    epochs: int = 8
    trials: int = 8
    trial_epochs: int = 3
    num_homes: int = 200
    steps: int = 100
    searches: int = 20


TINY = Sizes(3, 2, 4, 2, 1, 2, 1, 2, 3, 2)


@dataclass(frozen=True, slots=True)
class Entry:
    """A network of `NETWORKS` in one kind of homes, with one kind of information.

    With `sightings_alone` it is not told that things were not seen.
    """

    game: str
    network: str
    sightings_alone: bool

    @property
    def key(self) -> str:
        """Folder within the runs."""
        return f"{self.game}/{self.network}-{'sightings' if self.sightings_alone else 'negatives'}"


@dataclass
class Workshop:
    """Does one unit of work at a time; what is finished stays, and is not done again.

    Attributes:
        sources: what is trained in, by name of the kind.
        on_unit: called with what has been done.
    """

    runs: Path
    sizes: Sizes
    kinds: Mapping[str, TaskGame]
    sources: Mapping[str, HomeSource]
    on_unit: Callable[[str], None] = print
    _episodes: dict[tuple[str, str], list[EventEpisode]] = field(default_factory=dict)

    def tune(self, entry: Entry) -> dict[str, Any]:
        """Return the settings of a network, chosen in the validation homes."""
        sizes = self.sizes
        about = {
            **self._describe_training(entry),
            "trials": sizes.trials,
            "trial_epochs": sizes.trial_epochs,
        }

        def work() -> dict[str, Any]:
            train, val = self._record(entry.game, "train"), self._record(entry.game, "val")
            return tune(
                entry.network, entry.sightings_alone, train, val, sizes.trials, sizes.trial_epochs
            )

        path = self.runs / entry.key / "tuned.json"
        found = keep_unit(path, about, work, partial(self.on_unit, f"tuned {entry.key}"))
        return dict(found["settings"])

    def train(self, entry: Entry, seed: int) -> Path:
        """Train a network with its tuned settings; return its file."""
        settings = self.tune(entry)
        folder = self.runs / entry.key
        path = folder / f"seed_{seed}.pt"
        about = {
            **self._describe_training(entry),
            "epochs": self.sizes.epochs,
            "settings": settings,
            "seed": seed,
        }

        def work() -> dict[str, Any]:
            train, val = self._record(entry.game, "train"), self._record(entry.game, "val")
            network_settings = dict(settings)
            rate = network_settings.pop("learning_rate")
            torch.manual_seed(seed)
            network = make_network(entry.network, network_settings)
            began = time.process_time()
            train_network(
                network,
                train,
                sightings_alone=entry.sightings_alone,
                epochs=self.sizes.epochs,
                learning_rate=rate,
            )
            seconds = time.process_time() - began
            trained = TrainedNetwork(entry.network, network, entry.sightings_alone, about)
            trained.save(path)
            found = validate(network, val, entry.sightings_alone)
            return {
                "seconds": seconds,
                "checkpoint": compute_checksum(path),
                "num_parameters": sum(part.numel() for part in network.parameters()),
                "validation": asdict(found),
            }

        on_done = partial(self.on_unit, f"trained {entry.key} {seed}")
        done = keep_unit(folder / f"seed_{seed}.json", about, work, on_done)
        if not path.is_file() or compute_checksum(path) != done["checkpoint"]:
            (folder / f"seed_{seed}.json").unlink()
            return self.train(entry, seed)
        return path

    def play(self, entry: Entry, seed: int) -> None:
        """Let a trained network play the test homes of its kind, and of those without training."""
        path = self.train(entry, seed)
        about = {"checkpoint": compute_checksum(path)}
        for game in self.kinds:
            if TRAINED_ELSEWHERE.get(game, game) == entry.game:
                name = replace(entry, game=game).key
                file = self.runs / name / f"played_{seed}.json"
                make = EventPolicy.load(str(path)).play_in
                self._play(game, make, file, about, f"played {name} {seed}")

    def play_reference(
        self, game: str, name: str, make: Callable[[Homes], Policy], checksum: str | None = None
    ) -> None:
        """Let a policy or a network of another sort play the test homes of a kind."""
        path = self.runs / game / "references" / f"{name}.json"
        about = {"player": name, "checksum": checksum}
        self._play(game, make, path, about, f"played {game}/{name}")

    def _play(
        self,
        game: str,
        make: Callable[[Homes], Policy],
        path: Path,
        about: Mapping[str, Any],
        title: str,
    ) -> None:
        homes = self.kinds[game]
        about = {**about, "homes": homes.describe()}
        keep_unit(path, about, partial(play_kind, homes, make), partial(self.on_unit, title))

    def _describe_training(self, entry: Entry) -> dict[str, Any]:
        sizes = self.sizes
        return {
            "homes": self.sources[entry.game].describe(),
            "network": entry.network,
            "sightings_alone": entry.sightings_alone,
            "numbers": [sizes.train_homes, sizes.val_homes, sizes.train_steps, sizes.batch_homes],
        }

    def _record(self, game: str, split: str) -> list[EventEpisode]:
        """Return recorded episodes; the policy `bayesian` looks, as for `nep.fit`."""
        if (game, split) not in self._episodes:
            count = self.sizes.train_homes if split == "train" else self.sizes.val_homes
            self._episodes[game, split] = record_episodes(
                self.sources[game],
                Streams(0, split, range(count)),
                self.sizes.train_steps,
                most_homes=self.sizes.batch_homes,
            )
        return self._episodes[game, split]


def play_kind(game: TaskGame, make: Callable[[Homes], Policy]) -> dict[str, Any]:
    """Let a player answer and search in all homes of a kind.

    Returns:
        `COLUMNS`, a number per home each, and `milliseconds`, processor time of a decision of the
        player and of what it does with a look, homes in lockstep.
    """
    clocks: list[_Timed] = []

    def make_timed(homes: Homes) -> Policy:
        clocks.append(_Timed(make(homes)))
        return clocks[-1]

    # Code that is compiled at its first call is no cost of a decision.
    evaluate_policy(make, game.sources[0], Streams(0, "val", range(1)), 1)
    located, searched = [], []
    for source in game.sources:
        streams = Streams(0, "test", range(source.num_homes or game.num_homes))
        steps = min(game.num_steps, source.num_steps or game.num_steps)
        located.append(evaluate_policy(make_timed, source, streams, steps))
        count = min(game.num_searches, source.num_steps or game.num_searches)
        searched.append(evaluate_policy(make, source, streams, count, task="find_object"))
    seconds = sum(clock.seconds for clock in clocks)
    return {
        **{
            name: np.concatenate([metric.by_home(score) for score in located]).tolist()
            for name, metric in _METRICS.items()
        },
        "looks": np.concatenate([score.home_values for score in searched]).tolist(),
        "milliseconds": 1000 * seconds / max(sum(clock.num_answers for clock in clocks), 1),
    }


class _Timed(Policy):
    """A policy whose processor time is counted."""

    def __init__(self, policy: Policy) -> None:
        self._policy = policy
        self.score_kind = policy.score_kind  # type: ignore[misc]
        self.seconds, self.num_answers = 0.0, 0

    def reset(self, memory: MemoryBatch) -> None:
        self._policy.reset(memory)

    def observe(self, memory: MemoryBatch, change: Change) -> None:
        began = time.process_time()
        self._policy.observe(memory, change)
        self.seconds += time.process_time() - began

    def scores(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        began = time.process_time()
        found = self._policy.scores(memory, queries)
        self.seconds += time.process_time() - began
        self.num_answers += len(found)
        return found


def list_kinds(sizes: Sizes, recorded: Sequence[str] = ()) -> dict[str, TaskGame]:
    """Return the kinds of homes by name: simulated ones, and recorded households if any."""
    simulated = list_simulated(sizes.num_homes, sizes.steps, sizes.searches)
    on = replace(simulated["paper-32"], title="The paper's homes, objects come and go")
    off_source = SampledSource(home=replace(SampledSource().home, dynamic_nodes=False))
    kinds = {
        "paper_on": on,
        "paper_off": replace(on, title="The paper's homes, objects stay", sources=(off_source,)),
        "routine": simulated["routine"],
        "mixed": simulated["mixed"],
    }
    if recorded:
        source = RecordedSource(SampledSource().prior, SampledSource().home, tuple(recorded))
        kinds[HOUSEHOLDS] = TaskGame(
            "Scripted households (HOMER), networks trained in the mixture",
            (source,),
            source.num_homes,
            sizes.steps,
            sizes.searches,
        )
    return kinds


def keep_unit(
    path: Path,
    about: Mapping[str, Any],
    work: Callable[[], Any],
    on_done: Callable[[], object] = lambda: None,
) -> Any:
    """Return what a file keeps of a unit of work, or do it and keep it.

    What came of it, and `about`, everything that it depends on, are JSON values.
    """
    found = read_unit(path, about)
    if found is not None:
        return found["done"]
    content = {"about": about, "made": describe_code(), "done": work()}
    path.parent.mkdir(parents=True, exist_ok=True)
    text = json.dumps(content)
    write_whole(path, f"{text}\n".encode())
    on_done()
    return json.loads(text)["done"]


def read_unit(path: Path, about: Mapping[str, Any] | None = None) -> dict[str, Any] | None:
    """Return what a unit has kept; None if it is not there, or of something else than `about`."""
    try:
        found = read_json(path, allow_nan=True)
    except (OSError, ValueError):
        return None
    if not isinstance(found, dict) or not {"about", "made", "done"} <= found.keys():
        return None
    is_same = about is None or found["about"] == json.loads(json.dumps(about))
    return found if is_same else None
