"""How well finders know what is out of the home: `python -m tools.bench elsewhere --help`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

from jsonargparse import Namespace

from nep.players.contestants import Checkpoint
from nep.robot.finder import ObjectFinder
from sgm.arrays.week import DAY_SECONDS
from sgm.finder.finder import Finder
from sgm.policies import Adaptive, Bayesian
from tools.bench.robot_life import LifeGame
from tools.bench.suite import Report, TableSuite
from tools.bench.table_options import Option, count, describe_made, list_table_options
from tools.elsewhere.homes import KINDS, RECORDED, STEP_SECONDS, list_recorded, list_simulated
from tools.elsewhere.questions import Answers, ask
from tools.elsewhere.summary import make_tables, summarise

_STEPS_PER_DAY = int(DAY_SECONDS / STEP_SECONDS)
_ASKED = ("days", "play_days", "looks", "questions")
_MINUS = "adaptive"  # who is compared with the others

_ABOUT = """\
`{command}`.
In each home a robot looked at {looks} random places a time step of half an hour, for {days} days.
Then it went on for {play_days} days. Asked for were all things that are out at some time of these
days, and as many other things. Each could be asked for at every fifth step once it had been seen;
{questions} such questions were drawn in each home. All were asked of the same memories.

Of the things that go out the tables have:

- how likely *elsewhere* was said to be while they were out, and while they were in;
- how often it was likelier than every place while they were out;
- the negative log likelihood (NLL) of whether they are elsewhere and of where they are, in nats;
- the calibration error of *elsewhere* (ten bins, over all homes).

*By chance*: that of answers whose probabilities are right, in as many questions, if these are
independent. *Of all things*: the calibration error where the others count as all things of the home
that stay in it. A finder that does not know what goes out is too low for these things, and right
over all. Of the others: *elsewhere* and the NLL of where they are.
All but the calibration errors are means over homes. Differences are paired over homes, with 95 %
intervals. The smallest true difference that would be found with 80 % power is *d*.

No constant of `sgm.evidence.elsewhere` was chosen in these homes."""


@dataclass(frozen=True)
class ElsewhereGame(LifeGame):
    """A home that things leave and come back to."""

    steps_per_day: int = _STEPS_PER_DAY

    scored_by: ClassVar[tuple[str, ...]] = (
        "tools.elsewhere.questions",
        "tools.elsewhere.summary",
    )

    def tell(self) -> dict[str, Any]:
        """Return title, unit, and kind of the home."""
        return {"title": self.home.name, "units": [self.home.unit], "kind": self.home.group}

    def play(self, players: Mapping[str, Callable[[], Finder]]) -> dict[str, dict[str, Any]]:
        """Let a robot live there, and ask finders."""
        life = self.live(self.asked["play_days"] * self.steps_per_day)
        questions = list(ask(life, self.asked["questions"]))
        return {
            name: summarise(Answers.gather(make(), questions)) for name, make in players.items()
        }


def list_players(checkpoints: Sequence[Checkpoint]) -> dict[str, Callable[[], Finder]]:
    """List what makes each finder."""
    players: dict[str, Callable[[], Finder]] = {
        "bayesian": lambda: Finder(Bayesian()),
        "adaptive": lambda: Finder(Adaptive()),
    }
    for point in checkpoints:
        players[point.name] = partial(ObjectFinder.load, point.path)
    return players


class Elsewhere(TableSuite[ElsewhereGame]):
    """Finders of things that leave the home and come back."""

    command = "tools.bench elsewhere"
    summary = (
        "Let a robot look around in homes that things leave and come back to, and ask finders for "
        "them."
    )

    options = (
        *list_table_options("elsewhere.md", ("any_home",)),
        Option("kinds", tuple(KINDS), f"of simulated homes: {', '.join(KINDS)}"),
        count("num_homes", 12, "of each kind"),
        Option("trace", (), "recorded homes, or folders of them, beside the simulated ones"),
        Option("outside", (), "furniture of recorded homes outside: what is there has left"),
        count("days", 7, "of looks without questions"),
        count("play_days", 7, "with questions, after these"),
        count("questions", 200, "at most, in each home"),
        count("looks", 2, "looks in each time step"),
        Option("seed", 0, "of the homes, looks and questions", low=0),
    )

    def list_games(self, options: Namespace, folder: Path) -> Mapping[str, ElsewhereGame]:
        """List the homes; copies of recorded ones lie in the folder."""
        homes = []
        for group in options.kinds:
            homes += list_simulated(group, options.num_homes, options.looks, options.seed)
        if options.trace:
            homes += list_recorded(
                options.trace, options.outside, options.looks, folder, options.seed
            )
        asked = {name: options[name] for name in _ASKED}
        return {home.name: ElsewhereGame(home, asked) for home in homes}

    def list_players(
        self, options: Namespace, game: ElsewhereGame, checkpoints: Sequence[Checkpoint]
    ) -> Mapping[str, Callable[[], Finder]]:
        """List rules and networks."""
        return list_players(checkpoints)

    def write(self, report: Report) -> list[str]:
        """Return what was done, and the tables of every kind of home."""
        options = report.options
        about = _ABOUT.format(
            command=report.command,
            looks=options.looks,
            days=options.days,
            play_days=options.play_days,
            questions=options.questions,
        )
        titles = {group: title for group, (title, _) in KINDS.items()}
        titles[RECORDED] = options.called[:1].lower() + options.called[1:]
        parts = ["# Things that leave and come back", about]
        kinds = {name: told["kind"] for name, told in report.about.items()}
        for group in dict.fromkeys(kinds.values()):
            scores = {name: report.scores[name] for name, other in kinds.items() if other == group}
            heading = f"## {titles[group][:1].upper()}{titles[group][1:]}"
            parts += [heading, make_tables(scores, _MINUS)]
        return [*parts, describe_made(report.cache, report.shown, report.networks)]


main = Elsewhere().main
