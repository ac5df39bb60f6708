"""Exports a trained network for use elsewhere: `python -m nep.export CKPT DIR`."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import torch
from jsonargparse import ArgumentParser, Namespace
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from nep.players.calibration_searches import Decisions, measure_calibration, play_searches
from nep.players.checkpoints import (
    CONFIG,
    WEIGHTS,
    TrainedModel,
    load_config,
    load_trained,
    save_exported,
)
from nep.players.policy import NEPPolicy
from nep.players.stored_network import import_encoders
from nep.report.model_card import REFERENCES, SCORED_TASKS, make_card
from nep.report.results import list_versions
from sgm.checks import check_at_least
from sgm.files import compute_checksum, write_whole
from sgm.messages import shorten
from sgm.network.network import ONNX, has_onnx
from sgm.network.shipped import find_trained
from simulator.command_line import (
    add_home_arguments,
    make_parser,
    normalise,
    one_line_errors,
    parse,
    pick,
)
from simulator.home_options import HomeOptions
from simulator.policies import find_policy, make_policy
from simulator.process import run_main
from simulator.tasks.evaluation import evaluate_policy
from simulator.world.source import HomeSource, SampledSource
from simulator.world.streams import Streams

CARD = "MODEL_CARD.md"

_SIZES = ("num_homes", "steps", "seed")
_TRAINING = {"snapshots", "num_homes", "steps", "task", "policy"}  # that notes have of it


@dataclass(frozen=True, slots=True)
class ExportConfig:
    """What an exported network is scored in.

    Attributes:
        homes: where homes come from. Of a limited number, all are test homes.
        num_homes: test homes that all scores come from; 0 for none. Shipped networks have 100.
        steps: time steps of the scores, and searches per home that its probabilities are held
            against; at most as many as homes were recorded for. Shipped networks have 100.
        seed: of the homes.
    """

    homes: HomeSource = field(default_factory=SampledSource)
    num_homes: int = 20
    steps: int = 50
    seed: int = 0

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            ValueError: if one is out of range.
        """
        check_at_least(0, num_homes=self.num_homes, seed=self.seed)
        check_at_least(1, steps=self.steps)

    @property
    def num_steps(self) -> int:
        """Steps that are played."""
        return min(self.steps, self.homes.num_steps or self.steps)

    @property
    def streams(self) -> Streams:
        """The streams of the test homes."""
        return Streams(self.seed, "test", range(self.homes.num_homes or self.num_homes))

    def count_steps(self) -> int:
        """Return how often `export_model` calls `on_step`."""
        num_games = len(SCORED_TASKS) * (len(REFERENCES) + 1)
        if not self.num_homes:
            return 0
        num_groups = len(self.homes.list_groups(self.streams.homes))
        return num_groups * (1 + num_games) * self.num_steps


def export_model(
    checkpoint: str | Path,
    folder: Path,
    config: ExportConfig,
    command: str,
    on_step: Callable[[str], None] = lambda text: None,
) -> None:
    """Write a network as safetensors and JSON, with a model card.

    Args:
        checkpoint: written by `python -m nep.fit`; or a network that is measured anew, one that
            ships or an exported folder.
        folder: made if needed.
        config: what it is scored in; with no homes, it is not, and the card says so.
        command: the command line that makes the folder again.
        on_step: called after each step with what is being done.

    Raises:
        ValueError: if the checkpoint is missing, damaged or no fit for this package, or reads a
            clock and is to be scored in homes without one.
        OSError: if the folder cannot be written.
    """
    source = find_trained(checkpoint)
    model = load_trained(source)
    if config.num_homes and model.builder.config.clock and not config.homes.has_clock:
        raise ValueError(
            "network must read no clock to be scored in homes without one, got features.clock in "
            f"{checkpoint}. Name recorded homes that have a start (--trace), or give --num_homes 0."
        )
    if source.is_dir():
        notes = _read_notes(source)
    else:
        training = model.training if _is_whole(model.training) else None
        notes = {"checkpoint_sha256": compute_checksum(source), "training": training}
    notes |= {
        "command": command,
        "versions": list_versions(),
        "num_parameters": sum(part.numel() for part in model.module.parameters()),
    }
    if config.num_homes:
        notes["measured"] = measure_model(model, config, on_step)
    save_exported(folder, model, notes)
    card = make_card(folder.resolve().name, load_config(folder))
    write_whole(folder / CARD, card.encode())


def _read_notes(folder: Path) -> dict[str, Any]:
    """Return what an exported folder says of its network, but for what was measured."""
    notes = load_config(folder).get("notes")
    training = notes.get("training", "") if isinstance(notes, dict) else ""
    if not isinstance(notes, dict) or not _is_whole(training) or "checkpoint_sha256" not in notes:
        raise ValueError(
            f"notes of {CONFIG} must have checkpoint_sha256 and training, got {shorten(notes)} in "
            f"{folder}. Export the checkpoint of the network instead."
        )
    return {name: value for name, value in notes.items() if name != "measured"}


def _is_whole(training: Any) -> bool:
    """Tell whether notes on a training have all that a card says of it, or there are none."""
    return training is None or (isinstance(training, dict) and training.keys() >= _TRAINING)


def measure_model(
    model: TrainedModel, config: ExportConfig, on_step: Callable[[str], None]
) -> dict[str, Any]:
    """Score a network in test homes.

    Args:
        model: the network.
        config: which homes.
        on_step: called after each step with what is being done.

    Returns:
        What was measured as JSON values: the sizes, and the scores of it and of the references in
        two tasks. "before" and "after": how far its probabilities can be believed when it is asked
        again after every look, and when looks are folded in by Bayes' rule.
    """
    player, streams = NEPPolicy(model.module.eval(), model.builder), config.streams

    def score(task: str, name: str) -> dict[str, float]:
        make = player.play_in if name == "network" else partial(make_policy, name)
        scores = evaluate_policy(
            make,
            config.homes,
            streams,
            config.num_steps,
            lambda: on_step(f"{name} in test homes"),
            task,
        ).home_values
        return {"mean": float(scores.mean()), "std": float(scores.std())}

    able = [name for name in REFERENCES if find_policy(name).needs <= config.homes.knows]
    on_search = partial(on_step, "searching in test homes")
    groups = config.homes.list_groups(streams.homes)
    decisions = _join(
        [
            play_searches(homes, player.play_in(homes), config.num_steps, on_search=on_search)
            for homes in (config.homes.make(streams.select(group.homes)) for group in groups)
        ]
    )
    return {
        "homes": len(streams.homes),
        "source": config.homes.describe(),
        "steps": config.num_steps,
        "seed": config.seed,
        "num_decisions": len(decisions.scores),
        "before": measure_calibration(decisions, asks_again=True),
        "after": measure_calibration(decisions),
        "scores": {
            task: {name: score(task, name) for name in (*able, "network")} for task in SCORED_TASKS
        },
    }


def _join(parts: Sequence[Decisions]) -> Decisions:
    """Put searches of groups of homes together; places that a home has not are no candidates."""
    joined = {"num_looks": np.concatenate([part.num_looks for part in parts])}
    sizes = [part.scores.shape[1] for part in parts]
    fill = {"scores": -np.inf, "asked_again": -np.inf, "is_absent": False, "answers": False}
    for name, value in fill.items():
        wide = [  # after the last place, which in answers "nowhere" follows
            np.insert(getattr(part, name), [size] * (max(sizes) - size), value, axis=1)
            for part, size in zip(parts, sizes, strict=True)
        ]
        joined[name] = np.concatenate(wide)
    return Decisions(**joined)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line."""
    parser = make_parser(
        "python -m nep.export",
        f"Write a trained network as {WEIGHTS} and {CONFIG}, without pickle, with a "
        f"{CARD}; and as {ONNX}, if it reads evidence alone. "
        "`ObjectFinder.load(DIR)` reads it.",
    )
    parser.add_argument(
        "checkpoint",
        metavar="CKPT",
        type=str,
        help="written by nep.fit; or a network to measure anew: one that ships, "
        "or an exported folder",
    )
    parser.add_argument("folder", metavar="DIR", type=Path, help="made if needed")
    parser.add_class_arguments(ExportConfig, skip={"homes"})
    add_home_arguments(parser)
    parser.add_argument(
        "--encoders", type=tuple[str, ...], default=(), help="modules of your own with encoders"
    )
    parser.add_argument("--threads", type=int | None, help="CPU threads; all cores if left out")
    console = Console()
    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
    )
    arguments = sys.argv[1:] if arguments is None else list(arguments)
    with one_line_errors(status=2):
        options = parse(parser, arguments)
        if options.threads is not None:
            check_at_least(1, threads=options.threads)
            torch.set_num_threads(options.threads)
        import_encoders(options.encoders)
        homes = HomeOptions(**pick(options, HomeOptions)).make()
        config = ExportConfig(**pick(options, ExportConfig) | {"homes": homes})
        print(
            f"Scores in {len(config.streams.homes)} homes, {config.num_steps} steps each. "
            "--num_homes 0 leaves it out; --num_homes 100 --steps 100, as shipped networks have, "
            "takes minutes."
            if config.num_homes
            else "Nothing is scored (--num_homes 0)."
        )
        with Progress(*columns, console=console, transient=True) as progress:
            bar = progress.add_task("loading", total=config.count_steps())
            export_model(
                options.checkpoint,
                options.folder,
                config,
                _write_command(parser, options, arguments),
                lambda text: progress.update(bar, advance=1, description=text),
            )
    names = [CONFIG, WEIGHTS, *([ONNX] if has_onnx(options.folder) else []), CARD]
    print(f"{options.folder}: {', '.join(names)}")


def _write_command(parser: ArgumentParser, options: Namespace, arguments: Sequence[str]) -> str:
    """Return the command line, with the names alone of files outside the working folder."""
    paths = [
        path.name if path.is_absolute() else str(path)
        for path in (Path(options.checkpoint), options.folder)
    ]
    sizes = [f"--{name}={options[name]}" for name in _SIZES]
    others = [
        word
        for word in normalise(parser, arguments)
        if word.startswith("--") and word[2:].partition("=")[0] not in (*_SIZES, "threads")
    ]
    return shlex.join(["python", "-m", "nep.export", *paths, *sizes, *others])


if __name__ == "__main__":
    run_main(main)
