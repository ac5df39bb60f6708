"""What the looks of a home gain there: networks as they are, adapted, and fine-tuned."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping, Sequence
from contextlib import redirect_stdout
from dataclasses import dataclass
from functools import partial
from io import StringIO
from itertools import islice, product
from pathlib import Path
from typing import ClassVar

import numpy as np
from jsonargparse import Namespace

from nep import export, fit
from nep.bench.columns import COLUMNS, COMPARED, find_best_rule, format_mean
from nep.bench.home_games import list_lived_homes
from nep.bench.robot_life import LifeGame, measure
from nep.bench.runner import Report, TableSuite
from nep.bench.table_options import MOST, Option, count, describe_made, list_table_options
from nep.players.contestants import Checkpoint
from nep.report.statistics import FEWEST_RESAMPLED, LEVEL, correct_holm
from nep.report.tables import Difference, format_difference, format_number, join_table
from nep.robot.finder import ObjectFinder
from sgm.evidence.adaptive_filter import TASKS_ASK_MOVED
from sgm.finder.finder import Finder
from sgm.memory.clock import DEFAULT_STEP_SECONDS
from simulator.policies.registry import find_policy
from simulator.trace.__main__ import main as trace
from simulator.world.config import HomeConfig

# Rules that read nothing but the memory, as a robot's finder asks them.
RULES = ("last_seen", "last_seen_prior", "frequentist", "myopic", "bayesian", "adaptive")
ADAPTED, TUNED = "adapted", "fine-tuned"

_LOG = "looks.jsonl"
_ASKED = ("days", "play_days", "looks", "questions", "asks_moved")  # what a score depends on

_ABOUT = """\
`{command}`.
In each of {num_homes} {kind} a robot looked at {looks} random places a time step. A step takes
{step_seconds:g} s, and the robot looked for {days} days. Then it went on looking for {play_days}
days. Before the looks of each step {questions} things were asked for, {asked}.
Networks were asked as they were{learnt}. So were the rules that read nothing but a memory, all of
the same memory.
NLL and looks: less is better. Looks are counted in the order of the answer, with a detector that
misses nothing.

Differences are paired over the {num_units} {unit}, with 95 % intervals{how}. The smallest true
difference that would be found with 80 % power is *d*. Bold: p of the paired t test, corrected by
Holm's method for all {num_compared} distinct differences, is below .05."""
_ABOUT_MOVED = (
    "share of the questions that are about what has just moved, as in the tasks; 0 for those of "
    "people, who ask for anything"
)
_RECORDED = "plays of {called}, with the household prior,"
_T_INTERVAL = " (t, as there are fewer than ten)"
_LEARNT = {
    ADAPTED: ", `adapted` to the log of the first days (`finder.adapt`)",
    TUNED: ", `fine-tuned` on it ([Learn a home](../docs/robot/learn.md#your-own-home))",
}


@dataclass(frozen=True)
class OwnHomeGame(LifeGame):
    """A home in which finders may learn from the first days, and are asked in those after."""

    scored_by: ClassVar[tuple[str, ...]] = ("nep.bench.robot_life", "simulator.tasks.metrics")

    def play(self, players: Mapping[str, Callable[[Path], Finder]]) -> dict[str, dict[str, float]]:
        """Let a robot live there, and players answer."""
        asked = self.asked
        life = self.live(asked["play_days"] * self.steps_per_day)
        questions = list(life.ask(asked["questions"], asked["asks_moved"]))
        scores = {}
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            life.write_log(folder / _LOG)
            for who, make in players.items():
                with redirect_stdout(StringIO()):  # what training prints
                    finder = make(folder)
                scores[who] = measure(finder, questions)
        return scores


def tune(source: str, log: Path, folder: Path) -> Path:
    """Fine-tune a network on a log, as docs/robot/learn.md says, and return the exported folder."""
    parts = {name: str(folder / "home" / name) for name in ("train", "val", "test")}
    trace(["from-log", str(log), "--out", str(folder / "home")])
    fit.main(
        [
            f"--from={source}", "--config=own_home.yaml", f"--log={log}",
            f"--data.trace=[{parts['train']}]", f"--data.val_trace=[{parts['val']}]",
            f"--data.data_dir={folder / 'data'}",
            f"--trainer.logger.init_args.save_dir={folder / 'runs'}", "--threads=1",
            "--trainer.enable_progress_bar=false", "--trainer.enable_model_summary=false",
        ]
    )  # fmt: skip
    best = folder / "runs" / "own_home" / "version_0" / "checkpoints" / "best.ckpt"
    export.main(
        [
            str(best), str(folder / "exported"), "--trace", parts["val"], parts["test"],
            "--replays=20", "--threads=1",
        ]
    )  # fmt: skip
    return folder / "exported"


def list_players(
    checkpoints: Sequence[Checkpoint], learns: Sequence[str], asks_moved: float
) -> dict[str, Callable[[Path], Finder]]:
    """List what makes each finder of a home, from a folder with the log of its looks."""

    def follow(rule: str, folder: Path) -> Finder:
        return Finder(find_policy(rule)(), asks_moved=asks_moved)

    def load(point: Checkpoint, how: str, folder: Path) -> Finder:
        source, own = point.path, folder / point.name
        if how == TUNED:
            own.mkdir()
            source = tune(str(source), folder / _LOG, own)
        finder = ObjectFinder.load(source, asks_moved=asks_moved)
        if how == ADAPTED:
            finder.adapt(folder / _LOG)
        return finder

    players: dict[str, Callable[[Path], Finder]] = {name: partial(follow, name) for name in RULES}
    for point, how in product(checkpoints, ("", ADAPTED, TUNED)):
        if how in ("", *learns):
            players[f"{point.name} {how}".rstrip()] = partial(load, point, how)
    return players


def make_tables(
    scores: Mapping[str, Mapping[str, Mapping[str, float]]],
    networks: Sequence[str],
    units: Sequence[str] | None = None,
) -> tuple[str, int]:
    """Return two Markdown tables, and how many distinct differences there are.

    The first has the means over homes, the second differences home by home.

    `units` says what each home is a play of, None if all differ.
    """
    players = list(next(iter(scores.values())))
    titles = [COLUMNS[name].title for name in COMPARED]
    values = {
        who: {name: np.array([own[who][name] for own in scores.values()]) for name in COMPARED}
        for who in players
    }
    rows = [
        [who, *(format_mean(name, values[who][name]) for name in COMPARED)]
        for who in sorted(players, key=lambda who: float(values[who]["accuracy"].mean()))
    ]
    means = join_table(["who", *titles], rows)
    pairs: list[tuple[str, str | None]] = []  # who, and minus whom: None for the best rule
    for network in networks:
        learnt = [f"{network} {how}" for how in (ADAPTED, TUNED) if f"{network} {how}" in players]
        pairs += [(who, network) for who in learnt]
        pairs += [(who, None) for who in (network, *learnt)]
    found, tests = [], {}
    for (who, other), name in product(pairs, COMPARED):
        than = other or find_best_rule(values, COLUMNS[name], RULES)
        delta = values[who][name] - values[than][name]
        difference, key = Difference.of(delta, units), (name, delta.tobytes())
        found.append((difference, key, "" if other else than))
        # A player that is another one in all but its name is tested once, and not against itself.
        if delta.any():
            tests[key] = difference.p
    corrected = dict(zip(tests, correct_holm([*tests.values()]), strict=True))
    cells = (
        _format_compared(difference, corrected.get(key, float("nan")), key[0], rule)
        for difference, key, rule in found
    )
    rows = [[who, other or "the best rule", *islice(cells, len(COMPARED))] for who, other in pairs]
    header = ["who", "minus", *(f"{title} [95 %]" for title in titles)]
    return f"{means}\n{join_table(header, rows, num_text=2)}", len(tests)


def _format_compared(difference: Difference, p: float, name: str, rule: str) -> str:
    mark, form = "**" if p < 1 - LEVEL else "", COLUMNS[name].format
    text = f"{mark}{format_difference(difference, form)}{mark}"
    return f"{text}, d {format_number(difference.detectable, form)} {rule}".rstrip()


class OwnHome(TableSuite[OwnHomeGame]):
    """Networks as they were, adapted and fine-tuned, and rules, in the days after a first week."""

    command = "nep.own_home"
    summary = (
        "Let a robot look around in homes for some days; adapt and fine-tune networks on the log "
        "of its looks, and ask them, as they were and as they are, in the days after."
    )

    options = (
        *list_table_options("own_home.md", ("heat", "any_home")),
        Option(
            "learn",
            (ADAPTED, TUNED),
            f"what is done with the log: {ADAPTED}, {TUNED} or both",
            known=(ADAPTED, TUNED),
        ),
        Option("trace", (), "recorded homes, or folders of them; people are simulated if left out"),
        count("num_homes", 6, "simulated homes, or plays of each recorded one"),
        Option("sizes", (3, 6, 9), "furniture of each of four rooms, home after home", 1, MOST),
        count("days", 7, "of looks to learn from"),
        count("play_days", 7, "with questions, after these"),
        count("looks", 2, "looks in each time step, an hour", low=0),
        count("questions", 4, "questions in each time step"),
        Option("asks_moved", TASKS_ASK_MOVED, _ABOUT_MOVED, 0, 1),
        Option("seed", 0, "of the homes", low=0),
    )

    def list_games(self, options: Namespace, folder: Path) -> Mapping[str, OwnHomeGame]:
        """List the homes."""
        rules = HomeConfig(looks="random", looks_per_step=options.looks)
        homes = list_lived_homes(
            options.sizes, options.num_homes, options.trace, rules, options.seed
        )
        asked = {name: options[name] for name in _ASKED}
        return {home.name: OwnHomeGame(home, asked) for home in homes}

    def list_players(
        self, options: Namespace, game: OwnHomeGame, checkpoints: Sequence[Checkpoint]
    ) -> Mapping[str, Callable[[Path], Finder]]:
        """List rules and networks, and the networks as they have learnt."""
        return list_players(checkpoints, options.learn, options.asks_moved)

    def write(self, report: Report) -> list[str]:
        """Return what was done, means, and differences home by home."""
        options = report.options
        units = [unit for own in report.about.values() for unit in own["units"]]
        tables, num_compared = make_tables(report.scores, report.networks, units)
        num_units = len(set(units))
        called = options.called[:1].lower() + options.called[1:]  # within a sentence
        about = _ABOUT.format(
            command=report.command, num_homes=len(report.shown),
            kind=_RECORDED.format(called=called) if options.trace
            else "homes of people with routines",
            looks=options.looks, days=options.days, play_days=options.play_days,
            questions=options.questions, step_seconds=DEFAULT_STEP_SECONDS,
            asked=_describe_questions(options.asks_moved),
            learnt="".join(_LEARNT[how] for how in options.learn),
            num_units=num_units, unit="households" if options.trace else "homes",
            how=_T_INTERVAL if num_units < FEWEST_RESAMPLED else "", num_compared=num_compared,
        )  # fmt: skip
        made = describe_made(report.cache, report.shown, report.networks)
        return ["# One's own home", about, tables, made]


def _describe_questions(asks_moved: float) -> str:
    """Say what was asked for."""
    if asks_moved == 0:
        return "whether they had just moved or not"
    share = "half" if asks_moved == 0.5 else f"{asks_moved:.0%}"
    return f"{share} of them such as had just moved"


main = OwnHome().main
