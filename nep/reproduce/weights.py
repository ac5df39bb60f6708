"""The networks of the paper's tables as folders of weights, with a list by which they are checked.

A folder of weights has one exported folder for each network, and `weights.json`: what each is
called in the tables, and the checksums of its checkpoint and of its weights.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from nep.export import ExportConfig, export_model
from nep.players.checkpoints import CONFIG, find_weights, load_config, load_exported
from nep.report.results import list_versions
from nep.reproduce.plan import Plan
from sgm.files import compute_checksum, read_json, write_whole
from sgm.messages import shorten

LIST = "weights.json"
_FIELDS = ("setting", "title", "seed", "checkpoint_sha256", "weights_sha256")


def export_weights(plan: Plan, folder: Path) -> list[str]:
    """Export every network of a plan that was trained; the same networks give the same weights.

    A network lies in `SETTING/NAME`, of further trainings in `seed_N/SETTING/NAME`. Their names in
    the list are returned.

    Raises:
        OSError: if a file cannot be written.
    """
    listed = {}
    for training in plan.list_all_trainings():
        name, network = plan.name_training(training), training.contestant
        exported = folder / name
        command = f"python -m nep.reproduce --weights {folder.name}"
        export_model(training.checkpoint, exported, ExportConfig(num_homes=0), command)
        listed[name] = {
            "setting": network.setting.name,
            "title": network.title,
            "seed": training.seed,
            **_read_checksums(exported),
        }
    content = {"command": plan.describe("all").command, "versions": list_versions()}
    text = json.dumps({**content, "networks": listed}, indent=1) + "\n"
    write_whole(folder / LIST, text.encode())
    return list(listed)


def check_weights(folder: Path, checkpoints: Mapping[str, str] | None = None) -> list[str]:
    """Check a folder of weights by the names in its list.

    Args:
        folder: that `export_weights` wrote.
        checkpoints: SHA-256 of the checkpoints of a table, by setting, title and seed as in
            `Provenance.checkpoints`; every network must be one of them. None to leave that out.

    Returns:
        A line for each network, in the order of the list.

    Raises:
        ValueError: if the list is missing or damaged, a network is missing or is another one than
            the list says, or none of the table.
    """
    lines = []
    for name, entry in _read_list(folder).items():
        exported = folder / name
        load_exported(exported)  # whole, and fit for this package
        for key, checksum in _read_checksums(exported).items():
            if checksum != entry[key]:
                raise ValueError(
                    f"{key} of {name} must be {entry[key]}, as {LIST} says, got "
                    f"{shorten(checksum)} in {exported}. Export again with --weights."
                )
        title = f"{entry['setting']}, {entry['title']}, seed {entry['seed']}"
        if checkpoints is not None and checkpoints.get(title) != entry["checkpoint_sha256"]:
            raise ValueError(
                f"checkpoint of {name} must be that of the table, {checkpoints.get(title)}, got "
                f"{entry['checkpoint_sha256']} in {folder / LIST}. Take the weights of its run."
            )
        lines.append(f"{name}: {entry['title']}, weights {entry['weights_sha256'][:12]}, as listed")
    return lines


def _read_checksums(folder: Path) -> dict[str, Any]:
    """Return the checksums of the checkpoint that was exported to a folder, and of its weights."""
    config = load_config(folder)
    return {
        "checkpoint_sha256": config["notes"].get("checkpoint_sha256"),
        "weights_sha256": compute_checksum(find_weights(folder, config)),
    }


def _read_list(folder: Path) -> dict[str, dict[str, Any]]:
    """Read the list of a folder of weights."""
    path = folder / LIST
    try:
        networks: dict[str, dict[str, Any]] = read_json(path)["networks"]
        for name, entry in networks.items():
            inside = (folder / name).resolve().is_relative_to(folder.resolve())
            if not inside or not (folder / name / CONFIG).is_file():
                raise ValueError(f"{shorten(name)}, which is no folder of a network")
            for field in _FIELDS:
                entry[field]
    except (OSError, ValueError, LookupError, TypeError, AttributeError) as error:
        raise ValueError(
            f"{LIST} must list the networks of its folder, got {type(error).__name__}: "
            f"{shorten(str(error))} in {folder}. Write it with `python -m nep.reproduce --weights`."
        ) from error
    return networks
