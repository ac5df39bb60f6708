"""Temporal graph networks beside rules: `python -m nep.bench temporal --help`."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, fields, replace
from pathlib import Path
from typing import Any

import torch
from jsonargparse import ArgumentParser, Namespace

from nep.bench.paper.work import work_in
from nep.bench.runner import Suite
from nep.bench.table_options import Option, make_command
from nep.players.contestants import Checkpoint, list_contestants
from nep.report.results import describe_code
from sgm.files import VERSION, write_whole
from simulator.command_line import one_line_errors, pick
from simulator.policies import find_policy
from simulator.policies.registry import EVENT_RULES
from tools.temporal.plan import (
    HOUSEHOLDS,
    TINY,
    TRAINED_ELSEWHERE,
    Entry,
    Sizes,
    Workshop,
    list_kinds,
    read_unit,
)
from tools.temporal.registry import NETWORKS
from tools.temporal.report import (
    MEMORY,
    NEGATIVES,
    SCORES,
    SIGHTINGS,
    make_report,
    read_scores,
)

TABLE = "temporal.md"
RULES = (
    "random",
    "priors",
    "bayesian",
    "last_seen_prior",
    "persistence",
    "adaptive",
    *EVENT_RULES,
    "ceiling",
)
_INFORMATION = ("sightings", "negatives")
_UNTOLD = ("runs", "threads", "note", "table_only")  # options on which no score depends
_KINDS = ("paper_on", "paper_off", "routine", "mixed")


def make_content(
    workshop: Workshop,
    entries: Sequence[Entry],
    seeds: int,
    references: Sequence[str],
    checkpoints: Sequence[str],
    command: str,
    note: str | None = None,
) -> dict[str, Any]:
    """Return what has been played so far, as JSON values; rows without a training are left out.

    Further trainings than those that were asked for are in it, too.
    """
    missing, kinds = [], {}
    made: dict[str, None] = {}  # code that played, each once
    for game, homes in workshop.kinds.items():
        rows: list[dict[str, Any]] = []
        for name in (*references, *checkpoints):
            found = read_unit(workshop.runs / game / "references" / f"{name}.json")
            if found is not None:
                reads = MEMORY if name in checkpoints else "rule"
                checksum = found["about"]["checksum"]
                rows.append(
                    {
                        "name": name,
                        "reads": reads,
                        "plays": [found["done"]],
                        "checkpoints": [] if checksum is None else [checksum],
                    }
                )
                made[found["made"]] = None
        for entry in entries:
            if TRAINED_ELSEWHERE.get(game, game) != entry.game:
                continue
            own_entry = replace(entry, game=game)
            plays, seconds, checksums = [], [], []
            more = sum(1 for _ in (workshop.runs / own_entry.key).glob("played_*.json"))
            for seed in range(max(seeds, more)):  # a command for some may have trained more
                played = read_unit(workshop.runs / own_entry.key / f"played_{seed}.json")
                trained = read_unit(workshop.runs / entry.key / f"seed_{seed}.json")
                if played is None or trained is None:
                    missing += [f"{own_entry.key} seed {seed}"] * (seed < seeds)
                    continue
                plays.append(played["done"])
                seconds.append(trained["done"]["seconds"])
                checksums.append(trained["done"]["checkpoint"])
                made[played["made"]] = None
            if plays:
                rows.append(
                    {
                        "name": NETWORKS[entry.network].name,
                        "reads": SIGHTINGS if entry.sightings_alone else NEGATIVES,
                        "plays": plays,
                        "num_trainings": len(plays),
                        "seconds": sum(seconds) / len(seconds),
                        "checkpoints": checksums,
                    }
                )
        units = homes.list_units() if homes.is_recorded else None
        kinds[game] = {"title": homes.title, "units": units, "rows": rows}
    return {
        "version": VERSION,
        "command": command,
        "made": f"played with {'; '.join(made) or describe_code()}",
        "sizes": asdict(workshop.sizes),
        "note": note,
        "missing": missing,
        "kinds": kinds,
    }


def write_table(content: dict[str, Any], out: Path) -> None:
    """Write the scores and the table, each whole or not."""
    out.mkdir(parents=True, exist_ok=True)
    write_whole(out / SCORES, (json.dumps(content) + "\n").encode())
    write_whole(out / TABLE, make_report(content).encode())


OPTIONS = (
    Option("out", Path("results"), "folder for the table", type=Path),
    Option("runs", Path("runs/temporal"), "folder for networks and scores", type=Path),
    Option("kinds", _KINDS, f"some of {', '.join(_KINDS)}", known=_KINDS),
    Option("recorded", (), "recorded homes (docs/traces.md), which networks of mixed play, too"),
    Option("networks", tuple(NETWORKS), f"some of {', '.join(NETWORKS)}", known=NETWORKS),
    Option(
        "information",
        _INFORMATION,
        "sightings: events of things that were seen alone; negatives: of negative looks, too",
        known=_INFORMATION,
    ),
    Option("seeds", 3, "trainings of each network", low=1),
    Option(
        "checkpoint",
        (),
        "[NAME=]SOURCE: graph memories beside them, as in nep.evaluate: any_home, heat, files",
    ),
    Option(
        "note",
        None,
        "a remark for the page, such as what the graph memories were trained on",
        type=str | None,
    ),
    Option("table_only", False, "write the table of what is complete"),
    Option(
        "stored", None, "temporal.json: write the table again from its scores", type=Path | None
    ),
    Option("threads", 1, "CPU threads", low=1),
    Option("tiny", False, "everything as small as can be, to try the command"),
    *(
        Option(
            field.name,
            None,
            f"{field.default} if left out",
            int(field.name != "trials"),
            type=int | None,
        )
        for field in fields(Sizes)
    ),
)


class Temporal(Suite):
    """Networks that are tuned, trained and play, beside rules and graph memories."""

    command = "nep.bench temporal"
    summary = (
        "Tune, train and play temporal graph networks beside rules, and write temporal.md, which "
        "has what is complete at any time."
    )
    options = OPTIONS
    workers = None

    def check(self, options: Namespace) -> None:
        """Check that recorded homes come with the networks that play them."""
        if options.recorded and "mixed" not in options.kinds:
            raise ValueError(
                "recorded homes must come with the kind mixed, whose networks play them, got "
                f"{', '.join(options.kinds)}. Add it to --kinds."
            )

    def run(self, options: Namespace, parser: ArgumentParser) -> None:
        """Tune, train and play what has not been, and write."""
        if options.stored is not None:
            options.out.mkdir(parents=True, exist_ok=True)
            write_whole(options.out / TABLE, make_report(read_scores(options.stored)).encode())
            return
        sizes = read_sizes(options)
        torch.set_num_threads(options.threads)
        every = list_kinds(sizes, options.recorded)
        kinds = {name: every[name] for name in options.kinds}
        if options.recorded:
            kinds[HOUSEHOLDS] = every[HOUSEHOLDS]
        sources = {name: game.sources[0] for name, game in kinds.items() if name != HOUSEHOLDS}
        checkpoints = [Checkpoint.parse(text) for text in options.checkpoint]
        names = [point.name for point in checkpoints]
        told = Namespace(
            {name: value for name, value in vars(options).items() if name not in _UNTOLD}
        )
        command = make_command(parser, told, names)
        options.runs.mkdir(parents=True, exist_ok=True)
        entries = [
            Entry(game, network, information == "sightings")
            for network in options.networks
            for information in options.information
            for game in sources
        ]

        def write(text: str = "") -> None:
            if text:
                print(text, flush=True)
            write_table(
                make_content(workshop, entries, options.seeds, RULES, names, command, options.note),
                options.out,
            )

        workshop = Workshop(options.runs, sizes, kinds, sources, write)
        if options.table_only:
            write()
            return
        with work_in(options.runs), one_line_errors():
            for game, homes in kinds.items():
                players = [
                    name
                    for name in RULES
                    if all(find_policy(name).needs <= source.knows for source in homes.sources)
                ]
                sums = {point.name: point.compute_checksum() for point in checkpoints}
                made = list_contestants("predict_location", players, checkpoints)
                for name, make in made.items():
                    workshop.play_reference(game, name, make, sums.get(name))
            for seed in range(options.seeds):  # every network once before any is trained again
                for entry in entries:
                    workshop.play(entry, seed)
            write()
        print(f"wrote {options.out / TABLE}")


def read_sizes(options: Namespace) -> Sizes:
    """Return how much is trained and played."""
    given = {name: value for name, value in pick(options, Sizes).items() if value is not None}
    return replace(TINY if options.tiny else Sizes(), **given)


main = Temporal().main
