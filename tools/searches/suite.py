"""How soon searches find things: `python -m tools.bench searches --help`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import cycle
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from jsonargparse import Namespace

from nep.games.score_cache import ScoreCache
from nep.players.contestants import Checkpoint
from nep.report.tables import Difference, format_difference, join_table
from nep.robot.finder import ObjectFinder
from sgm.belief import Detector
from sgm.finder.finder import Finder
from simulator.policies.registry import find_policy
from simulator.world.config import HomeConfig
from simulator.world.source import SampledSource
from tools.bench.home_games import list_lived_homes
from tools.bench.robot_life import LifeGame, LivedHome
from tools.bench.suite import Report, TableSuite
from tools.bench.table_options import Option, count, describe_made, list_table_options
from tools.searches.search_orders import COLUMNS, MOST_LOOKS, SEARCHERS, TOLD, WITHIN, search_all

RULES = ("bayesian", "adaptive")
_SIZES = (3, 6, 9)  # furniture nodes of each of four rooms, of one simulated home after the other
_ASKED = ("days", "looks", "searches", "miss_rate", "repeated_share")  # what a score depends on
_BOUND = 1.05  # of the looks of a greedy search
_EXPECTED = Detector(0.0).repeated_share  # by a finder without a detector of its own
_GROUPS = {
    "simulated": "Simulated homes, objects move at random",
    "people": "Simulated homes of people with routines",
    "recorded": "{called}, the household prior",
}
_ABOUT = """\
`{command}`.
In each home a robot looked at {looks} random places an hour for {days} days. Then it was asked
{searches} times, an hour apart, for something that was in the home. While it searched, the home
stood still, and each look missed the thing with {miss_rate:.0%}. Of these misses
{repeated_share:.0%} were repeated by every further look at the place, as of a hidden thing.
Each row asks one finder; all searches of a row meet the same misses.

- *greedy*: asks `finder.rank`, goes to the likeliest place, `note_absent`, and again.
- *greedy, told*: the same with a finder that is given the detector as it is,
  `Detector({miss_rate:g}, repeated_share={repeated_share:g})`. Its belief is right, and no other
  order has a better next look. The others expect that {expected:.0%} of the misses are repeated.
- *search*: `finder.search` with `give_up_at=1`, so that it ends as late as the others.
- *search, told*: the same with the detector as it is.
- *search, gives up*: `finder.search` as it is, with `give_up_at=0.9`.
- *everywhere first*: as *greedy*, and no place again before all others.

Cells: share found within {within} looks / share found / mean looks, found or not, with {most} looks
at most. *Looks by*: those of *search* by those of *greedy*, and both told; {bound:.0%} at most is
the aim.
Differences are *search* minus *greedy*, over homes, with 95 % intervals; less looks are better."""


@dataclass(frozen=True)
class SearchGame(LifeGame):
    """A home in which things are searched for, by finder and order of looks."""

    scored_by: ClassVar[tuple[str, ...]] = (
        "tools.bench.robot_life",
        "tools.searches.search_orders",
    )

    def play(
        self, players: Mapping[str, tuple[Callable[[], Finder], str]]
    ) -> dict[str, dict[str, float]]:
        """Search with what makes a finder, and the name of an order of looks."""
        questions = list(self.live(self.asked["searches"]).ask(1, asks_moved=0.0))
        miss_rate, repeated_share = self.asked["miss_rate"], self.asked["repeated_share"]
        finders = {(make, who in TOLD): make() for make, who in players.values()}
        for (_, is_told), finder in finders.items():
            if is_told:
                finder.detector = Detector(miss_rate, repeated_share=repeated_share)
        return {
            name: search_all(
                finders[make, who in TOLD],
                SEARCHERS[who],
                questions,
                miss_rate,
                repeated_share,
                self.home.seed,
            )
            for name, (make, who) in players.items()
        }


def list_groups(
    num_homes: int, folders: Sequence[str], rules: HomeConfig, seed: int
) -> dict[str, list[LivedHome]]:
    """List the homes by group.

    Args:
        num_homes: simulated homes of each group, and plays of each recorded home.
        folders: traces, or folders of traces; none to leave out recorded homes.
        rules: of looking.
        seed: of the homes.
    """
    simulated = [
        LivedHome(
            f"{size * len(rules.rooms)} places-{number}",
            SampledSource(None, replace(rules, furniture_per_room=size)),
            number,
            seed,
            f"simulated-{number}",
        )
        for number, size in zip(range(num_homes), cycle(_SIZES), strict=False)
    ]
    people = list_lived_homes(_SIZES, num_homes, (), rules, seed)
    groups = {"simulated": simulated, "people": people}
    if folders:
        groups["recorded"] = list_lived_homes(_SIZES, 1, folders, rules, seed)
    return groups


def list_finders(checkpoints: Sequence[Checkpoint]) -> dict[str, Callable[[], Finder]]:
    """List what makes each finder, by name."""
    finders: dict[str, Callable[[], Finder]] = {
        name: lambda rule=name: Finder(find_policy(rule)())  # type: ignore[misc]
        for name in RULES
    }
    return finders | {
        checkpoint.name: partial(ObjectFinder.load, checkpoint.path) for checkpoint in checkpoints
    }


def make_tables(played: ScoreCache, groups: Mapping[str, Sequence[str]], called: str) -> str:
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
            by_searcher = {
                who: np.array(
                    [
                        [played.scores[name][f"{finder}: {who}"][column] for column in COLUMNS]
                        for name in names
                    ]
                )
                for who in SEARCHERS
            }
            means = {who: values.mean(axis=0) for who, values in by_searcher.items()}
            cells = ["{:.3f} / {:.3f} / {:.2f}".format(*mean) for mean in means.values()]
            looks = COLUMNS.index("looks")
            pairs = (("search", "greedy"), TOLD[::-1])
            shares = [means[who][looks] / means[greedy][looks] for who, greedy in pairs]
            delta = (by_searcher["search"] - by_searcher["greedy"]).T  # (3, H)
            differences = [
                format_difference(Difference.of(delta[COLUMNS.index(name)], units), form)
                for name, form in (("within", ".3f"), ("looks", ".2f"))
            ]
            greedy_cells = [f"{share:.3f}" for share in shares]
            rows.append([finder, *cells, *greedy_cells, *differences])
        greedy_titles = ["looks by greedy", "looks by greedy, both told"]
        header = ["finder", *SEARCHERS, *greedy_titles, f"within {WITHIN} [95 %]", "looks [95 %]"]
        title = f"## {_GROUPS[group].format(called=called)} ({len(set(units))})"
        parts.append(f"{title}\n\n{join_table(header, rows).strip()}")
    return "\n\n".join(parts)


def _list_finders(scores: Mapping[str, Any]) -> list[str]:
    return list(dict.fromkeys(player.rpartition(": ")[0] for player in scores))


class Searches(TableSuite[SearchGame]):
    """Orders of looks, each with the belief of several finders."""

    command = "tools.bench searches"
    summary = (
        "Let a robot look around in homes for some days, then search for things by several orders "
        "of looks, and count the looks."
    )

    shows_all = True
    options = (
        *list_table_options("searches.md", ("any_home",)),
        Option("trace", (), "recorded homes, or folders of them"),
        count("num_homes", 6, "simulated homes of each group"),
        count("days", 7, "of looks before the searches"),
        count("looks", 2, "looks in each time step, an hour", low=0),
        count("searches", 100, "in each home, one an hour"),
        Option("miss_rate", 0.25, "probability that a look misses the thing", 0, 1),
        Option("repeated_share", _EXPECTED, "of these, that every look repeats", 0, 1),
        Option("seed", 0, "of the homes", low=0),
    )

    def list_games(self, options: Namespace, folder: Path) -> Mapping[str, SearchGame]:
        """List the homes of every group."""
        rules = HomeConfig(looks="random", looks_per_step=options.looks)
        groups = list_groups(options.num_homes, options.trace, rules, options.seed)
        asked = {name: options[name] for name in _ASKED}
        homes = [
            replace(home, name=f"{group}: {home.name}", group=group)
            for group, members in groups.items()
            for home in members
        ]
        return {home.name: SearchGame(home, asked) for home in homes}

    def list_players(
        self, options: Namespace, game: SearchGame, checkpoints: Sequence[Checkpoint]
    ) -> Mapping[str, Any]:
        """List finders, each with every order of looks."""
        return {
            f"{name}: {who}": (make, who)
            for name, make in list_finders(checkpoints).items()
            for who in SEARCHERS
        }

    def list_needed(self, options: Namespace, networks: Sequence[str]) -> Sequence[str]:
        """Name every network with every order of looks."""
        return [f"{name}: {who}" for name in networks for who in SEARCHERS]

    def write(self, report: Report) -> list[str]:
        """Return what was done, and a table a group."""
        options = report.options
        groups: dict[str, list[str]] = {}
        for name, told in report.about.items():
            groups.setdefault(told["group"], []).append(name)
        about = _ABOUT.format(
            command=report.command,
            looks=options.looks,
            days=options.days,
            searches=options.searches,
            miss_rate=options.miss_rate,
            repeated_share=options.repeated_share,
            expected=_EXPECTED,
            within=WITHIN,
            most=MOST_LOOKS,
            bound=_BOUND,
        )
        tables = make_tables(report.cache, groups, options.called)
        made = describe_made(report.cache, report.shown, report.networks)
        return ["# Searches", about, tables, made]


main = Searches().main
