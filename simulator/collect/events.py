"""Events collected into a folder."""

from __future__ import annotations

import json
from pathlib import Path

from tqdm import tqdm

from sgm.messages import shorten
from simulator.collect.folder import find_differences, make_folder
from simulator.collect.settings import EXTRAS, CollectConfig
from simulator.events.files import MANIFEST, load_events, read_manifest, save_events
from simulator.events.recorder import collect_events
from simulator.world.streams import Streams


def write_events(
    config: CollectConfig, out: Path, workers: int = 1, backend: str = "processes"
) -> None:
    """Collect events into a folder, all at once, unless they are there; extras must be off."""
    settings = config.describe()
    for extra in EXTRAS:
        if extra in settings:
            raise ValueError(f"{extra} must be off for events, got {extra} on. Leave it out.")
    config.check_homes()
    make_folder(out)
    if (out / MANIFEST).exists():
        found = read_manifest(out)["settings"]
        for name, theirs, ours in find_differences(found, json.loads(json.dumps(settings))):
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
            config.homes,
            Streams(config.seed, config.split, range(config.num_homes)),
            config.steps,
            policy=config.policy,
            task=config.task,
            workers=workers,
            backend=backend,
            on_homes=bar.update,
        )
    names = save_events(table, out, settings)
    print(f"{out}: {', '.join(names)}; {len(table.events.home):,} events")
