"""The benchmark of recorded homes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from jsonargparse import Namespace

from nep.players.contestants import Checkpoint, LeftOut, MakePolicy
from nep.report.figures import draw_by_hour, make_png
from sgm.files import write_whole
from sgm.messages import shorten
from sgm.prior.prior_graph import PriorGraph, load_prior
from simulator.trace.source import check_step_seconds
from simulator.trace.trace import find_traces
from tools.bench.columns import make_accuracy_table, make_table
from tools.bench.comparisons import compare_priors, make_comparison, make_overview
from tools.bench.home_games import choose_games, list_benchmark
from tools.bench.suite import Report, TableSuite
from tools.bench.table_options import Option, describe_made, list_table_options
from tools.bench.task_game import TaskGame

_ABOUT = """\
`{command}`. {replays} replays of each of {num_homes} homes ({others} in long lives), with other
looks and questions. All of it is from these homes. Nothing was trained or chosen in this command.
A home is one unit of all statistics, however often it is played. A prior "counted in the
other homes" leaves out the home that is played. Where the policy says where the robot looks, one
that guesses badly also sees less; on patrol all read the same memory. *Right if away*: among
questions about things that are not where this agent saw them last. *Right if out of place*: among
those about things that are not where they have been most of the time so far. These are the same
questions for all. NLL, calibration error and looks: less is better. `oracle` knows how often each
thing is put at each place, the future included.
[Recorded homes](../docs/traces.md#the-benchmark-of-recorded-homes) says more."""
_ABOUT_SOURCE = (
    "NAME=SOURCE of networks that were each trained without one home, {home} in SOURCE: every home "
    "is played by that which has not seen it"
)
_ABOUT_PRIOR = (
    "NAME=FILE of further priors, each with kinds of its own: of word vectors, or filled in by a "
    "language model (docs/priors.md)"
)
_ABOUT_LEFT_OUT = " {names}: networks that were each trained in the other homes."


class Recorded(TableSuite[TaskGame]):
    """Episodes from an empty memory and long lives, with every prior."""

    command = "tools.bench recorded"
    summary = (
        "Play all policies and some networks in recorded homes: episodes from an empty memory and "
        "long lives, looking where the policy says and on patrol, with both priors that ship and "
        "one counted in the other homes."
    )

    shows_all = True
    needs_networks = False
    options = (
        Option("trace", (), "two or more recorded homes, or folders of them"),
        *list_table_options("recorded_homes.md", ("heat",)),
        Option("left_out", (), _ABOUT_SOURCE),
        Option("also_prior", (), _ABOUT_PRIOR),
        Option("kinds", None, "names of kinds; all if left out", type=tuple[str, ...] | None),
        Option("steps", 200, "of an episode", low=1),
        Option("step_seconds", 3600.0, "length of a step"),
        Option("replays", 4, "of each home in episodes, half as many in lives", low=1),
    )

    def check(self, options: Namespace) -> None:
        """Check the length of a step."""
        check_step_seconds(options.step_seconds)

    def list_games(self, options: Namespace, folder: Path) -> Mapping[str, TaskGame]:
        """List episodes and lives, with every prior."""
        games = list_benchmark(
            options.trace,
            options.steps,
            options.step_seconds,
            options.replays,
            _load_priors(options.also_prior),
        )
        return choose_games(games, options.kinds)

    def list_players(
        self, options: Namespace, game: TaskGame, checkpoints: Sequence[Checkpoint]
    ) -> Mapping[str, MakePolicy]:
        """List policies and networks, and those that were trained in the other homes."""
        left_out = [LeftOut.parse(text) for text in options.left_out]
        return {
            **game.list_players(checkpoints),
            **{player.name: player.make for player in left_out},
        }

    def checksum_more(self, options: Namespace) -> Mapping[str, str]:
        """Return the checksums of networks that were trained in the other homes."""
        checksums = {}
        for several in map(LeftOut.parse, options.left_out):
            found = [several.find(folder.name) for folder in find_traces(options.trace)]
            for point in found:
                point.load()  # what is missing is missed now
            checksums[several.name] = " ".join(point.compute_checksum() for point in found)
        return checksums

    def write(self, report: Report) -> list[str]:
        """Return first guesses, the overview, hours of the day, and a table of each game."""
        options, scores, networks = report.options, report.scores, report.networks
        titles = {name: about["title"] for name, about in report.about.items()}
        left_out = [text.partition("=")[0] for text in options.left_out]
        about = _ABOUT.format(
            command=report.command,
            replays=options.replays,
            others=max(options.replays // 2, 1),
            num_homes=len(set(next(iter(report.cache.about.values()))["units"])),
        )
        if left_out:
            about += _ABOUT_LEFT_OUT.format(names=", ".join(f"`{name}`" for name in left_out))
        parts = [f"# {options.called}", about]
        parts.append(f"## First guesses right\n\n{make_accuracy_table(scores)}")
        told = {name: scores[name] for name in titles if networks[0] in scores[name]}
        if told:
            compared = make_overview({name: report.about[name] for name in told}, told, networks[0])
            parts.append(f"## `{networks[0]}` beside the best rule\n\n{compared}")
        further = [text.partition("=")[0] for text in options.also_prior]
        if paired := compare_priors(report.about, scores, further, ("priors", *networks[:1])):
            parts.append(f"## Priors beside each other\n\n{make_comparison(paired)}")
        hours = {
            titles[name]: {who: score["by_hour"] for who, score in players.items()}
            for name, players in scores.items()
            if all("by_hour" in score for score in players.values())
        }
        if hours:
            picture = options.out.with_name(f"{options.out.stem}_by_hour.png")
            write_whole(picture, make_png(draw_by_hour(hours)))
            parts.append(f"## By the hour\n\n![Wrong guesses by the hour of day]({picture.name})")
        parts += [
            f"## {titles[name]}\n\n{make_table(game_scores)}"
            for name, game_scores in scores.items()
        ]
        return [*parts, describe_made(report.cache, report.shown, [*networks, *left_out])]


def _load_priors(texts: Sequence[str]) -> dict[str, PriorGraph]:
    """Load further priors, NAME=FILE each."""
    priors = {}
    for text in texts:
        name, _, source = text.partition("=")
        if not name.isidentifier() or not source:
            raise ValueError(
                f"also_prior must be NAME=FILE, got {shorten(text)}. Name it in letters, digits "
                "and underscores."
            )
        priors[name] = load_prior(source)
    return priors


main = Recorded().main
