"""Collect snapshots: a policy plays a task in many homes, and every memory is kept on disk.

Run `python -m simulator.collect --help`.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any, Literal

import numpy as np
from tqdm import tqdm

from sgm.checks import check_at_least, check_at_most, check_choice, check_seed
from sgm.evidence.adaptive_filter import TASKS_ASK_MOVED
from sgm.evidence.columns import EVIDENCE_VERSION
from sgm.evidence.evidence_features import compute_features
from sgm.files import LOCK, lock_folder
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Change, Queries
from sgm.messages import shorten
from simulator.command_line import (
    add_home_arguments,
    add_worker_arguments,
    make_parser,
    one_line_errors,
    parse,
    pick,
)
from simulator.fan_out import check_workers, fan_out
from simulator.home_options import HomeOptions
from simulator.policies import check_policies, identify_policy, make_policy
from simulator.policies.filters import HomeFilter
from simulator.process import run_main
from simulator.snapshots.recorder import Recorder
from simulator.snapshots.shards import (
    MANIFEST,
    MAX_HOMES,
    check_manifest,
    get_shard_name,
    load_manifest,
    load_shard,
    save_manifest,
    save_shard,
)
from simulator.tasks.answer import Answer
from simulator.tasks.question_shares import QuestionShares
from simulator.tasks.registry import find_task
from simulator.world.source import HomeSource, SampledSource
from simulator.world.streams import SPLITS, Streams

# What a collection may keep beside the memory, by the name of its option.
EXTRAS = ("belief", "evidence", "relevance")
_HOMES_PER_JOB = 100  # in lockstep, at most; also what a killed worker loses at most
_SNAPSHOTS_PER_JOB = 30_000  # at most, where homes have many steps: 0.8 GB until they are written
_WRITERS = 8  # threads that wait for the disk while others write
_MANIFEST_SHARE = 0.02  # the manifest is written when so many more homes are finished


@dataclass(frozen=True, slots=True)
class CollectConfig:
    """What to collect.

    Attributes:
        homes: where homes come from.
        num_homes: how many, from number 0 on.
        steps: time steps per home, or searches of Find Object; where a source says for how long a
            home is lived in, so many of its steps are kept, or `HomeSource.kept_share` of them.
        policy: name of the collecting policy; "module:Class=FILE" for one that is loaded, such as
            a trained network ("nep.players.policy:NEPPolicy=FILE").
        task: name of the task it plays.
        asked: shares of the kinds of questions, of a task that takes them (`Task.shares`); None for
            those of the task.
        split: "train", "val" or "test": their homes never coincide.
        seed: experiment seed.
        belief: whether each snapshot keeps what `HomeFilter` believes about its query object.
        evidence: whether it keeps what the memory says about each place (`sgm.evidence`).
        relevance: whether each snapshot keeps the relevance of every place, if its task knows it.
    """

    homes: HomeSource = field(default_factory=SampledSource)
    num_homes: int = 100
    steps: int = 100
    policy: str = "bayesian"
    task: str = "predict_location"
    asked: QuestionShares | None = None
    split: str = "train"
    seed: int = 0
    belief: bool = False
    evidence: bool = False
    relevance: bool = False

    def __post_init__(self) -> None:
        """Raise ValueError if a count, a name or the seed is out of range."""
        check_at_least(1, num_homes=self.num_homes, steps=self.steps)
        check_at_most(MAX_HOMES, num_homes=self.num_homes)
        check_seed(self.seed)
        if self.asked is not None and find_task(self.task).shares is None:
            raise ValueError(
                f"asked must be left out for a task with questions of its own, got {self.task}. "
                "Leave it out, or take simulator.tasks.ask_anything:AskAnything."
            )
        find_task(self.task)
        check_choice("split", self.split, SPLITS)
        check_policies([self.policy])

    def check_homes(self) -> None:
        """Raise ValueError if there are fewer homes or steps, or the policy cannot play there."""
        self.homes.check_homes(range(self.num_homes))
        self.homes.check_steps(self.steps)
        check_policies([self.policy], self.homes)

    def describe(self) -> dict[str, Any]:
        """Return everything that the bytes of a collection depend on, as JSON values."""
        settings = {field.name: getattr(self, field.name) for field in fields(self)}
        shares = find_task(self.task).shares if self.asked is None else self.asked
        del settings["asked"]
        if shares is not None:
            settings["asked"] = asdict(shares)
        for extra in EXTRAS:
            if not settings[extra]:
                del settings[extra]  # collections without it are what they were before it existed
        if self.evidence:
            settings["evidence"] = EVIDENCE_VERSION
        checksum = identify_policy(self.policy)
        if checksum is not None:  # whatever the file is called
            settings["policy"] = f"{self.policy.partition('=')[0]}={checksum}"
        return {**settings, "homes": self.homes.describe(), "labels": list(self.homes.labels)}


def collect(
    config: CollectConfig, out: Path, workers: int = 1, progress: bool = True,
    backend: str = "processes",
) -> None:  # fmt: skip
    """Collect snapshots into a folder, or finish an interrupted collection there.

    The same config gives the same bytes, for any number of workers and however often the
    collection was interrupted.

    Args:
        config: what to collect.
        out: folder; made if needed.
        workers: processes that work in parallel.
        progress: whether to show a progress bar.
        backend: where they work, see `fan_out`; on a cluster, all its machines must see `out`.

    Raises:
        ValueError: if the folder holds a collection of other settings, or other files, or is in
            use while homes are missing, the backend is not there, or the policy cannot be loaded.
        OSError: if the disk is full; finished homes are kept.
    """
    check_workers(workers, backend)
    config.check_homes()
    settings = config.describe()
    _make_folder(out)
    if _is_complete(out, settings):  # others may read it at the same time
        return
    with lock_folder(out):
        _collect_missing(config, settings, out, workers, progress, backend)


def write_events(
    config: CollectConfig, out: Path, workers: int = 1, backend: str = "processes"
) -> None:
    """Collect events into a folder, all at once, unless they are there; extras must be off."""
    # Loaded when asked for: a training needs snapshots alone.
    from simulator.events.files import MANIFEST as EVENT_MANIFEST
    from simulator.events.files import load_events, read_manifest, save_events
    from simulator.events.recorder import collect_events

    settings = config.describe()
    for extra in EXTRAS:
        if extra in settings:
            raise ValueError(f"{extra} must be off for events, got {extra} on. Leave it out.")
    config.check_homes()
    _make_folder(out)
    if (out / EVENT_MANIFEST).exists():
        found = read_manifest(out)["settings"]
        for name, theirs, ours in _find_differences(found, json.loads(json.dumps(settings))):
            raise ValueError(
                f"output folder must hold events of the same settings, got {name} = "
                f"{shorten(theirs)} instead of {shorten(ours)} in {out}. Choose another folder."
            )
        load_events(out)
        return
    if any(out.iterdir()):
        raise ValueError(f"output folder must be empty, got files in {out}. Choose another one.")
    with tqdm(total=config.num_homes, desc=f"{config.split} events", unit="home") as bar:
        table = collect_events(
            config.homes, Streams(config.seed, config.split, range(config.num_homes)), config.steps,
            policy=config.policy, task=config.task, workers=workers, backend=backend,
            on_homes=bar.update,
        )  # fmt: skip
    names = save_events(table, out, settings)
    print(f"{out}: {', '.join(names)}; {len(table.events.home):,} events")


def _collect_missing(
    config: CollectConfig, settings: dict[str, Any], out: Path, workers: int, progress: bool,
    backend: str,
) -> None:  # fmt: skip
    shards = _open_folder(out, settings)  # checksums of the finished ones
    missing = [home for home in range(config.num_homes) if get_shard_name(home) not in shards]
    groups = config.homes.list_groups(missing)
    # The longest lives first, so that no worker is left alone with one.
    groups.sort(key=lambda group: group.play_steps or 0, reverse=True)
    size = min(-(-len(missing) // workers), _HOMES_PER_JOB, _SNAPSHOTS_PER_JOB // config.steps)
    size = max(size, 1)
    folder = out.absolute()  # processes that an earlier call has left may be in another folder
    jobs = [
        (config, group.homes[first : first + size], folder, group.play_steps)
        for group in groups
        for first in range(0, len(group.homes), size)
    ]
    num_listed = len(shards)
    with tqdm(
        total=config.num_homes * config.steps,
        initial=num_listed * config.steps,
        desc=f"collecting {config.split} snapshots",
        unit="step",
        disable=not progress or not jobs,
    ) as bar:
        try:
            for _, done in fan_out(collect_homes, jobs, workers, backend) if jobs else ():
                shards.update(done)
                if len(shards) >= num_listed * (1 + _MANIFEST_SHARE):
                    save_manifest(out, settings, dict(sorted(shards.items())))
                    num_listed = len(shards)
                bar.update(len(done) * config.steps)
        finally:
            if len(shards) > num_listed:
                save_manifest(out, settings, dict(sorted(shards.items())))


def collect_homes(
    config: CollectConfig, homes: Sequence[int], out: Path, play_steps: int | None = None
) -> dict[str, str]:
    """Collect some homes in lockstep; write their shards and return the checksum of each.

    The homes are lived in for `play_steps`, None for `config.steps`: so many of them, evenly
    spread, are kept, and more of long lives (`HomeSource.kept_share`).
    """
    play_steps = config.steps if play_steps is None else play_steps
    num_kept = max(config.steps, round(config.homes.kept_share * play_steps))
    num_kept = min(num_kept, play_steps)
    kept = set(np.linspace(0, play_steps - 1, num_kept).round().astype(int).tolist())
    step = 0
    state = config.homes.make(Streams(config.seed, config.split, homes))
    task_class = find_task(config.task)
    policy = make_policy(config.policy, state).for_questions(task_class.asks_moved)
    task = task_class(state, policy)
    if config.asked is not None:
        task.shares = config.asked
    recorder = Recorder(task.rollout.memory)
    if config.evidence:
        task.rollout.memory.count_history()
    # A collecting filter believes already; another policy is watched by one.
    belief_filter = policy if isinstance(policy, HomeFilter) else HomeFilter.make(state)
    watches = config.belief and belief_filter is not policy
    if watches:
        belief_filter.reset(task.rollout.memory)

    def record(answer: Answer) -> None:
        if step not in kept:
            return
        extras = {}
        if config.belief:
            memory = task.rollout.memory
            extras["belief"] = belief_filter.compute_features(memory, answer.queries)
        if config.relevance and answer.relevance is not None:
            extras["relevance"] = answer.relevance
        question_extras = {}
        if config.evidence:
            asks_moved = answer.asks_moved
            if asks_moved is None:
                asks_moved = np.full(len(answer.choice), task.asks_moved > 0)
            place, question = _compute_evidence(task.rollout.memory, answer.queries, asks_moved)
            extras["evidence"] = place.astype(np.float16)
            question_extras["evidence"] = question
            question_extras["asks_moved"] = asks_moved[:, None].astype(np.float32)
        recorder.add_snapshot(answer.queries, answer.answers, extras, question_extras)

    def record_change(change: Change) -> None:
        recorder.add_change(change)
        if watches:
            belief_filter.observe(task.rollout.memory, change)

    task.on_answer = record
    task.rollout.on_change = record_change
    for _ in task.run(play_steps):
        step += 1  # the answers of this one were recorded
    names = [get_shard_name(home) for home in homes]
    with ThreadPoolExecutor(_WRITERS) as pool:
        paths = [out / name for name in names]
        return dict(zip(names, pool.map(save_shard, paths, recorder.finish()), strict=True))


def _compute_evidence(
    memory: MemoryBatch, queries: Queries, asks_moved: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the features of places and of questions, (Q, F, D) and (Q, C), by kind of question."""
    parts = []
    for of_task in np.unique(asks_moved):
        rows = np.flatnonzero(asks_moved == of_task)
        found = compute_features(memory, queries.take(rows), TASKS_ASK_MOVED * of_task)
        parts.append((rows, found.place, found.question))
    rows, place, question = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
    order = np.argsort(rows)
    return place[order], question[order]


def _make_folder(out: Path) -> None:
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ValueError(
            f"output folder must be one that can be made, got {shorten(error.strerror)} for {out}. "
            "Choose another folder."
        ) from error


def _is_complete(out: Path, settings: dict[str, Any]) -> bool:
    """Tell whether a folder has every home; nothing is written, and no lock is needed."""
    if not (out / MANIFEST).exists():
        return False
    manifest, num_homes = load_manifest(out), settings["num_homes"]
    check_manifest(manifest, out)
    if len(manifest["shards"]) < num_homes:  # looking at shards takes longer, and is for the lock
        return False
    return len(_check_finished(manifest, out, settings)) == num_homes


def _open_folder(out: Path, settings: dict[str, Any]) -> dict[str, str]:
    """Prepare a locked folder; return the checksums of the shards that its manifest lists."""
    if not (out / MANIFEST).exists():
        strangers = sorted(
            path.name
            for path in out.iterdir()
            if not path.name.endswith(".part") and path.name != LOCK
        )
        if strangers:
            raise ValueError(
                f"output folder must be empty or hold a collection, got {shorten(strangers[0])} in "
                f"{out}. Choose another folder."
            )
        save_manifest(out, settings, {})
    manifest = load_manifest(out)
    check_manifest(manifest, out)
    finished = _check_finished(manifest, out, settings)
    for partial in out.glob("*.part"):
        partial.unlink()
    return finished


def _check_finished(
    manifest: dict[str, Any], out: Path, settings: dict[str, Any]
) -> dict[str, str]:
    """Check settings and finished shards; return the checksum of each."""
    wanted = {name: value for name, value in settings.items() if name != "labels"}
    for name, found, value in _find_differences(manifest["settings"], wanted):
        raise ValueError(
            f"output folder must hold a collection of the same settings, got {name} = {found} "
            f"instead of {value} in {out}. Choose another folder or delete this one."
        )
    shards: dict[str, str] = manifest["shards"]
    finished = {name: checksum for name, checksum in shards.items() if (out / name).exists()}
    for name, checksum in finished.items():
        load_shard(out / name, checksum)
    return finished


def _find_differences(found: Any, wanted: Any, name: str = "") -> Iterator[tuple[str, Any, Any]]:
    """Yield name, found and wanted value of each setting that differs, down to the innermost."""
    if isinstance(found, dict) and isinstance(wanted, dict):
        for key, value in wanted.items():
            yield from _find_differences(found.get(key), value, f"{name}.{key}".lstrip("."))
    elif found != wanted:
        yield name, found, wanted


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line."""
    parser = make_parser(
        "python -m simulator.collect",
        "Collect scene graph memories into a folder; run again to resume.",
    )
    parser.add_argument("--out", type=Path, required=True, help="folder for shards and manifest")
    parser.add_argument(
        "--num_homes", type=int | None, help="number of homes; 100, or all that there are"
    )
    parser.add_argument("--steps", type=int | None, help="time steps; 100, or all that there are")
    parser.add_argument(
        "--format",
        type=Literal["snapshots", "events"],
        default="snapshots",
        help="snapshots: the memory at every question, for nep.fit; events: what looks have shown, "
        "as CSV, and Parquet if pyarrow is installed (docs/events.md)",
    )
    parser.add_class_arguments(CollectConfig, skip={"homes", "num_homes", "steps"})
    add_home_arguments(parser)
    add_worker_arguments(parser, os.cpu_count() or 1)
    with one_line_errors():
        options = parse(parser, arguments)
        homes = HomeOptions(**pick(options, HomeOptions)).make()
        print(*homes.left_out, sep="\n", end="\n" if homes.left_out else "")
        sizes = {
            "num_homes": homes.num_homes or 100 if options.num_homes is None else options.num_homes,
            "steps": homes.num_steps or 100 if options.steps is None else options.steps,
        }
        config = CollectConfig(**pick(options, CollectConfig) | {"homes": homes} | sizes)
        if options.format == "events":
            write_events(config, options.out, options.workers, options.backend)
        else:
            collect(config, options.out, workers=options.workers, backend=options.backend)


if __name__ == "__main__":
    run_main(main)
