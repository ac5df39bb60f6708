"""Who plays in an evaluation: policies by name, and checkpoints of networks."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from pathlib import Path

import numpy as np
import torch

from nep.players.checkpoints import checksum_trained, find_weights, load_config
from nep.players.policy import NEPPolicy
from nep.players.stored_network import import_encoders
from sgm.files import compute_checksum
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Change, Queries
from sgm.messages import shorten
from sgm.network.network import ONNX, has_onnx
from sgm.network.policy import NetworkPolicy
from sgm.network.shipped import CONFIG, PRETRAINED, find_trained, split_name
from sgm.policies.policy import Policy
from simulator.policies import POLICIES, check_policies, make_policy
from simulator.tasks.registry import TASKS, check_task
from simulator.world.homes import Homes

MakePolicy = Callable[[Homes], Policy]
Player = NEPPolicy | NetworkPolicy

_NETWORKS_KEPT = 32  # of a process; a megabyte each


@dataclass(frozen=True, slots=True)
class Checkpoint:
    """A trained network that takes part.

    Attributes:
        name: in tables and figures.
        path: the checkpoint, or the exported folder.
        task: the task that it plays, None for all.
        encoders: modules of encoders from outside the package, see `import_encoders`.
    """

    name: str
    path: Path
    task: str | None = None
    encoders: tuple[str, ...] = ()

    @classmethod
    def parse(cls, text: str, encoders: Sequence[str] = ()) -> Checkpoint:
        """Read `SOURCE`, `NAME=SOURCE` or `NAME@TASK=SOURCE`, where the source is a path or "heat".

        A path alone is named after its folder: `runs/heat/version_0/checkpoints/last.ckpt` is
        "heat/version_0"; an exported folder after itself.

        Raises:
            ValueError: if there is no such file, folder, shipped network or task, or the name is
                empty.
        """
        name, source = split_name(text)
        if name is None:
            path = find_trained(source)
            whole = path.absolute()
            run = whole.parent.parent if whole.parent.name == "checkpoints" else whole.parent
            name = whole.name if path.is_dir() else f"{run.parent.name}/{run.name}"
            return cls(name, path, None, tuple(encoders))
        name, separator, task = name.partition("@")
        if separator:
            check_task(task)
        if not name:
            raise ValueError(
                f"checkpoint must be NAME@TASK=SOURCE, got no name in {shorten(text)}. Name it."
            )
        found = find_trained(source)
        return cls(name, found, task if separator else None, tuple(encoders))

    def load(self) -> Player:
        """Load the network, once in a process as long as the file stays as it is.

        Raises:
            ValueError: if it is no fit for this version of the package.
        """
        import_encoders(self.encoders)
        names = (CONFIG, ONNX) if self.path.is_dir() else ()
        files = [self._find_file(), *(self.path / name for name in names)]
        states = [file.stat() for file in files if file.exists()]
        return _load(self.path, tuple((state.st_mtime_ns, state.st_size) for state in states))

    def compute_checksum(self) -> str:
        """Return the SHA-256 of its file, or of what an exported folder says but for its notes."""
        return checksum_trained(self.path)

    def describe(self) -> dict[str, str | None]:
        """Return name, task, path and SHA-256 (of an exported folder's weights), as JSON values."""
        shipped = self.path.parent == PRETRAINED
        return {
            "name": self.name,
            "task": self.task,
            "path": self.path.name if shipped else str(self.path),
            "sha256": compute_checksum(self._find_file()),
        }

    def _find_file(self) -> Path:
        """Return the checkpoint, or the weights of an exported folder."""
        if not self.path.is_dir():
            return self.path
        return find_weights(self.path, load_config(self.path))


def check_contestants(
    tasks: Sequence[str], policies: Sequence[str], checkpoints: Sequence[Checkpoint]
) -> None:
    """Check every name, and that every checkpoint can be loaded, before anything runs.

    Raises:
        ValueError: if a task or policy is unknown or named twice, two contestants of a task share
            a name, there are no players, or a checkpoint is no fit for this version of the package.
    """
    for task in tasks:
        check_task(task)
    check_policies(policies)
    for noun, names in (("tasks", tasks), ("policies", policies)):
        if len(set(names)) < len(names):
            raise ValueError(f"{noun} must differ, got {', '.join(names)}. Name each one once.")
    for task in {*TASKS, *tasks}:
        names = [point.name for point in checkpoints if point.task in (None, task)]
        for name in names:
            if name in POLICIES or names.count(name) > 1:
                raise ValueError(
                    "names of checkpoints must differ from each other and from the policies, got "
                    f"{shorten(name)} twice for {task}. Give NAME=SOURCE or NAME@TASK=SOURCE."
                )
    for task in tasks:
        if not policies and all(point.task not in (None, task) for point in checkpoints):
            raise ValueError(
                f"a policy must play {task}, got no policy and no checkpoint for it. Name some "
                "with --policies or --checkpoint."
            )
    for checkpoint in checkpoints:
        checkpoint.load()


def list_contestants(
    task: str,
    policies: Sequence[str],
    checkpoints: Sequence[Checkpoint],
    threads: int | None = None,
) -> dict[str, MakePolicy]:
    """Return what makes each player of a task, by name; networks come last.

    Networks for other tasks are left out. Wherever they play they set `threads`, unless it is None.
    """
    make = _make_policy_beside_networks if checkpoints else make_policy
    players: dict[str, MakePolicy] = {name: partial(make, name) for name in policies}
    for point in checkpoints:
        if point.task in (None, task):
            players[point.name] = partial(_play_network, point, threads)
    return players


def _make_policy_beside_networks(name: str, homes: Homes) -> Policy:
    # From this module, so that a worker imports torch with its first job. With a later one, joblib
    # would take the 300 MB for a leak, and replace the worker.
    return make_policy(name, homes)


def _play_network(point: Checkpoint, threads: int | None, homes: Homes) -> Policy:
    if threads is not None:
        torch.set_num_threads(threads)
    return point.load().play_in(homes)


def load_player(source: str | Path) -> Player:
    """Load a network to play with: by ONNX Runtime where it can be.

    Raises:
        ValueError: as `load_trained` does.
    """
    path = find_trained(source)
    if path.is_dir() and has_onnx(path):
        load_config(path)  # says what does not fit this package
        return NetworkPolicy.load(path)
    return NEPPolicy.load(path)


@lru_cache(maxsize=_NETWORKS_KEPT)
def _load(path: Path, version: tuple[tuple[int, int], ...]) -> Player:
    return load_player(path)


_HOME = "{home}"


class LeftOutPolicy(Policy):
    """Asks of every home the network that has not seen it."""

    score_kind = "logits"

    def __init__(self, networks: Sequence[Player], network_of_home: np.ndarray) -> None:
        """Keep the networks, and the number of that of each home, (H,)."""
        self._networks = networks
        self._network_of_home = network_of_home

    def reset(self, memory: MemoryBatch) -> None:
        """Forget earlier homes."""
        for network in self._networks:
            network.reset(memory)

    def scores(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        """Return logits, (Q, F), -inf where there is no query edge."""
        scores = np.full((len(queries.home), memory.num_furniture), -np.inf)
        asked = self._network_of_home[queries.home]
        for number, network in enumerate(self._networks):
            rows = np.flatnonzero(asked == number)
            if len(rows):
                scores[rows] = network.scores(memory, queries.take(rows))
        return scores

    def observe(self, memory: MemoryBatch, change: Change) -> None:
        """Take note of a look."""
        for network in self._networks:
            network.observe(memory, change)


@dataclass(frozen=True, slots=True)
class LeftOut:
    """Checkpoints that differ in the recorded home that they were not trained in.

    The source has "{home}" for the name of the home that each left out.
    """

    name: str
    source: str

    @classmethod
    def parse(cls, text: str) -> LeftOut:
        """Read `NAME=SOURCE`.

        Raises:
            ValueError: if there is no name, or no "{home}" in the source.
        """
        name, _, source = text.partition("=")
        if not name or _HOME not in source:
            raise ValueError(
                f"networks that leave a home out must be NAME=SOURCE with {_HOME} in SOURCE, got "
                f"{shorten(text)}. Write for example own=runs/without_{_HOME}/exported."
            )
        return cls(name, source)

    def find(self, home: str) -> Checkpoint:
        """Return the network that was trained without a home.

        Raises:
            ValueError: if there is none.
        """
        return Checkpoint.parse(f"{self.name}={self.source.replace(_HOME, home)}")

    def make(self, homes: Homes) -> LeftOutPolicy:
        """Make the player for recorded homes."""
        from simulator.trace.recorded_homes import RecordedHomes

        assert isinstance(homes, RecordedHomes), "only recorded homes have names"
        names = sorted(set(homes.names))
        networks = [self.find(name).load().play_in(homes) for name in names]
        return LeftOutPolicy(networks, np.array([names.index(name) for name in homes.names]))
