"""A folder of snapshots: collected, finished after an interruption, checked."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from tqdm import tqdm

from sgm.files import LOCK, lock_folder
from sgm.messages import shorten
from simulator.collect.settings import CollectConfig
from simulator.fan_out import check_workers, fan_out
from simulator.snapshots.shards import (
    MANIFEST,
    check_manifest,
    get_shard_name,
    load_manifest,
    load_shard,
    save_manifest,
)

_HOMES_PER_JOB = 100  # in lockstep, at most; also what a killed worker loses at most
_SNAPSHOTS_PER_JOB = 30_000  # at most, where homes have many steps: 0.8 GB until they are written
_MANIFEST_SHARE = 0.02  # the manifest is written when so many more homes are finished


def collect(
    config: CollectConfig,
    out: Path,
    workers: int = 1,
    progress: bool = True,
    backend: str = "processes",
) -> None:
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
    make_folder(out)
    if _is_complete(out, settings):  # others may read it at the same time
        return
    with lock_folder(out):
        _collect_missing(config, settings, out, workers, progress, backend)


def _collect_missing(
    config: CollectConfig,
    settings: dict[str, Any],
    out: Path,
    workers: int,
    progress: bool,
    backend: str,
) -> None:
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
            for _, done in fan_out(_collect_homes, jobs, workers, backend) if jobs else ():
                shards.update(done)
                if len(shards) >= num_listed * (1 + _MANIFEST_SHARE):
                    save_manifest(out, settings, dict(sorted(shards.items())))
                    num_listed = len(shards)
                bar.update(len(done) * config.steps)
        finally:
            if len(shards) > num_listed:
                save_manifest(out, settings, dict(sorted(shards.items())))


def _collect_homes(*arguments: Any) -> dict[str, str]:
    """Collect the homes of one job; what plays them is imported only where that is done."""
    from simulator.collect.homes import collect_homes

    return collect_homes(*arguments)


def make_folder(out: Path) -> None:
    """Make a folder for a collection; ValueError if it cannot be made."""
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
    for name, found, value in find_differences(manifest["settings"], wanted):
        raise ValueError(
            f"output folder must hold a collection of the same settings, got {name} = {found} "
            f"instead of {value} in {out}. Choose another folder or delete this one."
        )
    shards: dict[str, str] = manifest["shards"]
    finished = {name: checksum for name, checksum in shards.items() if (out / name).exists()}
    for name, checksum in finished.items():
        load_shard(out / name, checksum)
    return finished


def find_differences(found: Any, wanted: Any, name: str = "") -> Iterator[tuple[str, Any, Any]]:
    """Yield name, found and wanted value of each setting that differs, down to the innermost."""
    if isinstance(found, dict) and isinstance(wanted, dict):
        for key, value in wanted.items():
            yield from find_differences(found.get(key), value, f"{name}.{key}".lstrip("."))
    elif found != wanted:
        yield name, found, wanted
