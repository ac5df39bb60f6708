"""Measures how soon searches find things: `python -m nep.searches --out searches.md`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np
import torch
from jsonargparse import ArgumentParser, Namespace

from nep.kinds.command import add_table_options, describe_made, list_names, make_command
from nep.kinds.life import Life
from nep.kinds.played import Played, find_scores
from nep.kinds.searching import COLUMNS, MOST_LOOKS, SEARCHERS, WITHIN, search_all
from nep.own_home import Place, list_homes
from nep.players.contestants import Checkpoint
from nep.report.code_version import describe_code
from nep.report.tables import Difference, format_difference, join_table
from nep.robot.finder import ObjectFinder
from sgm.checks import check_at_least, check_at_most, check_shares
from sgm.files import write_whole
from sgm.finder.finder import Finder
from sgm.memory.clock import DAY_SECONDS, DEFAULT_STEP_SECONDS
from simulator.command_line import make_parser, one_line_errors, parse
from simulator.policies.registry import find_policy
from simulator.process import run_main
from simulator.world.config import HomeConfig
from simulator.world.source import SampledSource

RULES = ("bayesian", "adaptive")
_SIZES = (3, 6, 9)  # furniture nodes of each of four rooms, of one simulated home after the other
_MOST = 10_000  # homes, days, looks and searches
_ASKED = ("days", "looks", "searches", "miss_rate")  # what a score depends on
_STEPS_PER_DAY = int(DAY_SECONDS / DEFAULT_STEP_SECONDS)
_BOUND = 1.05  # of the looks of a greedy search
_GROUPS = {
    "simulated": "Simulated homes, objects move at random",
    "people": "Simulated homes of people with routines",
    "recorded": "{called}, the household prior",
}
_ABOUT = """\
`{command}`.
In each home a robot looked at {looks} random places an hour for {days} days. Then it was asked
{searches} times, an hour apart, for something that was in the home. While it searched, the home
stood still, and each look missed the thing with {miss_rate:.0%}, independently. Each row asks one
finder; all searches of a row meet the same misses.

- *greedy*: asks `finder.rank`, goes to the likeliest place, `note_absent`, and again.
- *search*: `finder.search` with `give_up_at=1`, so that it ends as late as the others.
- *search, gives up*: `finder.search` as it is, with `give_up_at=0.9`.
- *everywhere first*: as *greedy*, and no place again before all others.

Cells: share found within {within} looks / share found / mean looks, found or not, with {most} looks
at most. *Looks*: those of *search* by those of *greedy*; {bound:.0%} at most is the aim.
Differences are *search* minus *greedy*, over homes, with 95 % intervals; less looks are better."""


def list_groups(
    num_homes: int, folders: Sequence[str], rules: HomeConfig, seed: int
) -> dict[str, list[Place]]:
    """List the homes by group.

    Args:
        num_homes: simulated homes of each group, and plays of each recorded home.
        folders: traces, or folders of traces; none to leave out recorded homes.
        rules: of looking.
        seed: of the homes.
    """
    simulated = [
        Place(
            f"{size * len(rules.rooms)} places-{number}",
            SampledSource(None, replace(rules, furniture_per_room=size)), number, seed,
            f"simulated-{number}",
        )
        for number, size in zip(range(num_homes), cycle(_SIZES), strict=False)
    ]  # fmt: skip
    groups = {"simulated": simulated, "people": list_homes(_SIZES, num_homes, (), rules, seed)}
    if folders:
        groups["recorded"] = list_homes(_SIZES, 1, folders, rules, seed)
    return groups


def list_finders(checkpoints: Sequence[Checkpoint]) -> dict[str, Callable[[], Finder]]:
    """List what makes each finder, by name."""
    finders: dict[str, Callable[[], Finder]] = {
        name: lambda rule=name: Finder(find_policy(rule)())  # type: ignore[misc]
        for name in RULES
    }
    return finders | {one.name: partial(ObjectFinder.load, one.path) for one in checkpoints}


def make_tables(played: Played, groups: Mapping[str, Sequence[str]], called: str) -> str:
    """Return one Markdown table a group.

    Args:
        played: scores of the homes, by finder and searcher.
        groups: names of the homes.
        called: what recorded homes are.
    """
    parts = []
    for group, names in groups.items():
        units = [unit for name in names for unit in played.about[name]["units"]]
        rows = []
        for finder in _list_finders(played.scores[names[0]]):
            own = {
                who: np.array([
                    [played.scores[name][f"{finder}: {who}"][column] for column in COLUMNS]
                    for name in names
                ])
                for who in SEARCHERS
            }  # fmt: skip
            means = {who: values.mean(axis=0) for who, values in own.items()}
            cells = ["{:.3f} / {:.3f} / {:.2f}".format(*mean) for mean in means.values()]
            looks = COLUMNS.index("looks")
            share = means["search"][looks] / means["greedy"][looks]
            delta = (own["search"] - own["greedy"]).T  # (3, H)
            differences = [
                format_difference(Difference.of(delta[COLUMNS.index(name)], units), form)
                for name, form in (("within", ".3f"), ("looks", ".2f"))
            ]
            rows.append([finder, *cells, f"{share:.3f}", *differences])
        header = ["finder", *SEARCHERS, "looks", f"within {WITHIN} [95 %]", "looks [95 %]"]
        title = f"## {_GROUPS[group].format(called=called)} ({len(set(units))})"
        parts.append(f"{title}\n\n{join_table(header, rows).strip()}")
    return "\n\n".join(parts)


def _list_finders(scores: Mapping[str, Any]) -> list[str]:
    return list(dict.fromkeys(player.rpartition(": ")[0] for player in scores))


def _make_parser() -> ArgumentParser:
    parser = make_parser(
        "python -m nep.searches",
        "Let a robot look around in homes for some days, then search for things by several orders "
        "of looks, and count the looks. Run again to resume: what has been played is in the JSON "
        "file beside the table.",
    )
    add_table_options(parser, "searches.md", ("any_home",))
    parser.add_argument(
        "--trace", type=tuple[str, ...], default=(), help="recorded homes, or folders of them"
    )
    parser.add_argument("--num_homes", type=int, default=6, help="simulated homes of each group")
    parser.add_argument("--days", type=int, default=7, help="of looks before the searches")
    parser.add_argument("--looks", type=int, default=2, help="looks in each time step, an hour")
    parser.add_argument("--searches", type=int, default=100, help="in each home, one an hour")
    parser.add_argument(
        "--miss_rate", type=float, default=0.25, help="probability that a look misses the thing"
    )
    parser.add_argument("--seed", type=int, default=0, help="of the homes")
    return parser


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line."""
    parser = _make_parser()
    torch.set_num_threads(1)
    with one_line_errors(status=2):
        options = parse(parser, arguments)
        counts = {name: options[name] for name in ("num_homes", "days", "searches")}
        check_at_least(1, **counts)
        check_at_least(0, seed=options.seed, looks=options.looks)
        check_at_most(_MOST, **counts, looks=options.looks)
        check_shares(miss_rate=options.miss_rate)
        path = find_scores(options.out)
        networks = list_names(options.checkpoint)
        if options.play:
            played = _play_all(options, path)
        else:
            players = [f"{name}: {who}" for name in networks for who in SEARCHERS]
            played = Played.load_all(path, None, players)
        groups: dict[str, list[str]] = {}
        for name, row in played.about.items():
            groups.setdefault(row["group"], []).append(name)
        about = _ABOUT.format(
            command=make_command(parser, options, networks), looks=options.looks,
            days=options.days, searches=options.searches, miss_rate=options.miss_rate,
            within=WITHIN, most=MOST_LOOKS, bound=_BOUND,
        )  # fmt: skip
        tables = make_tables(played, groups, options.called)
        parts = ["# Searches", about, tables, describe_made(played, list(played.about), networks)]
        write_whole(options.out, ("\n\n".join(part.strip() for part in parts) + "\n").encode())
        print(options.out)


def _play_all(options: Namespace, path: Path) -> Played:
    """Let every finder search in every home where it has not yet."""
    checkpoints = [Checkpoint.parse(text) for text in options.checkpoint]
    rules = HomeConfig(looks="random", looks_per_step=options.looks)
    groups = list_groups(options.num_homes, options.trace, rules, options.seed)
    asked = {name: options[name] for name in _ASKED}
    places = {f"{group}: {one.name}": (group, one) for group, own in groups.items() for one in own}
    played = Played.load(
        path,
        {name: {**one.describe(), **asked} for name, (_, one) in places.items()},
        {point.name: point.compute_checksum() for point in checkpoints},
    )
    for name, (group, place) in places.items():
        played.about[name] = {"title": name, "units": [place.unit], "group": group}
        _play(place, played.scores[name], options, checkpoints)
        played.made[name] = describe_code()
        played.save()
        print(name, flush=True)
    return played


def _play(
    place: Place,
    scores: dict[str, Any],
    options: Namespace,
    checkpoints: Sequence[Checkpoint],
) -> None:
    """Let all finders search in one home."""
    finders = list_finders(checkpoints)
    players = {f"{name}: {who}" for name in finders for who in SEARCHERS}
    if players <= scores.keys():
        return
    life = Life.record(
        place.source, options.days * _STEPS_PER_DAY, options.searches, home=place.home,
        seed=place.seed,
    )  # fmt: skip
    questions = list(life.ask(1, asks_moved=0.0))
    for name, make in finders.items():
        finder = make()
        for who, searcher in SEARCHERS.items():
            if f"{name}: {who}" not in scores:
                scores[f"{name}: {who}"] = search_all(
                    finder, searcher, questions, options.miss_rate, place.seed
                )


if __name__ == "__main__":
    run_main(main)
