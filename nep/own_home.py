"""Measures what the looks of a home are worth there: `python -m nep.own_home --out own_home.md`."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping, Sequence
from contextlib import redirect_stdout
from dataclasses import dataclass, replace
from functools import partial
from io import StringIO
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np
import torch
from jsonargparse import ArgumentParser, Namespace

from nep import export, fit
from nep.kinds.command import add_table_options, describe_made, list_names, make_command
from nep.kinds.life import COLUMNS, Life, measure
from nep.kinds.played import Played, find_scores
from nep.players.contestants import Checkpoint
from nep.report.code_version import describe_code
from nep.report.statistics import FEWEST_RESAMPLED, LEVEL, correct_holm
from nep.report.tables import Difference, format_difference, format_number, join_table
from nep.robot.finder import ObjectFinder
from sgm.checks import check_at_least, check_at_most, check_shares
from sgm.evidence.adaptive_filter import TASKS_ASK_MOVED
from sgm.files import write_whole
from sgm.finder import object_finder
from sgm.finder.finder import Finder
from sgm.memory.clock import DAY_SECONDS, DEFAULT_STEP_SECONDS
from sgm.messages import shorten
from sgm.prior.prior_graph import PriorGraph
from simulator.command_line import make_parser, one_line_errors, parse
from simulator.policies.registry import find_policy
from simulator.process import run_main
from simulator.trace.__main__ import main as trace
from simulator.trace.source import RecordedSource
from simulator.trace.trace import find_traces
from simulator.world.config import HomeConfig
from simulator.world.routine.dynamics import RoutineDynamics
from simulator.world.source import HomeSource, SampledSource

# Rules that read nothing but the memory, as a robot's finder asks them.
RULES = ("last_seen", "last_seen_prior", "frequentist", "myopic", "bayesian", "adaptive")
ADAPTED, TUNED = "adapted", "fine-tuned"

_LOG = "looks.jsonl"
_MOST = 10_000  # of homes, days, and looks or questions in a time step
_ASKED = ("days", "play_days", "looks", "questions", "asks_moved")  # what a score depends on
_STEPS_PER_DAY = int(DAY_SECONDS / DEFAULT_STEP_SECONDS)
_FORMATS = {"accuracy": ".3f", "nll": ".2f", "looks": ".2f"}
_TITLES = {"accuracy": "first guess", "nll": "NLL", "looks": "looks until found"}

_ABOUT = """\
`{command}`.
In each of {num_homes} {kind} a robot looked at {looks} random places a time step for
{days} days, in steps of {step_seconds:g} s. Then it went on looking for {play_days} days, and
before the looks of each step {questions} things were asked for, {asked}: of the
networks as they were{learnt}, and of the rules that read nothing but a memory. All were
asked of the same memory.
NLL and looks: less is better; looks are counted in the order of the answer, with a detector that
misses nothing.

Differences are paired over the {num_units} {unit}, with 95 % intervals{how}; d is the smallest true
difference that would be found with 80 % power. Bold: p of the paired t test, corrected by Holm's
method for all {num_compared} distinct differences, is below .05."""
_RECORDED = "plays of {called}, with the household prior,"
_T_INTERVAL = " (t, as there are fewer than ten)"
_LEARNT = {
    ADAPTED: ", `adapted` to the log of the first days (`finder.adapt`)",
    TUNED: ", `fine-tuned` on it ([docs/robot.md](../docs/robot.md#your-own-home))",
}

Scores = dict[str, dict[str, dict[str, float]]]  # by home, player and column


@dataclass(frozen=True, slots=True)
class Place:
    """One home of the table.

    Attributes:
        name: in the file of scores.
        source: of the home.
        home: its number there.
        seed: of everything random.
        unit: what it is a play of; all plays of a recording count as one.
    """

    name: str
    source: HomeSource
    home: int
    seed: int
    unit: str

    def describe(self) -> dict[str, Any]:
        """Return what the home is, as JSON values."""
        return {"source": self.source.describe(), "home": self.home, "seed": self.seed}


def list_homes(
    sizes: Sequence[int], num_homes: int, folders: Sequence[str], rules: HomeConfig, seed: int
) -> list[Place]:
    """List the homes: people with routines, or recordings.

    Args:
        sizes: furniture nodes of each room, of one simulated home after the other, in turn.
        num_homes: simulated homes, or plays of each recording.
        folders: traces, or folders of traces, where a robot's memory goes by the household prior,
            as it does unless it is told otherwise; none for simulated homes.
        rules: of looking.
        seed: of the first play, or of all simulated homes.
    """
    if folders:
        prior = PriorGraph.household()
        return [
            Place(
                f"{path.name}-{own}", RecordedSource(prior, rules, [str(path)]), 0, own, path.name
            )
            for path in find_traces(folders)
            for own in range(seed, seed + num_homes)
        ]
    places = []
    for number in range(num_homes):
        size = sizes[number % len(sizes)]
        own = replace(
            rules, furniture_per_room=size, objects_per_furniture=3, dynamics=RoutineDynamics()
        )
        name = f"{size * len(rules.rooms)} places-{number}"
        places.append(Place(name, SampledSource(None, own), number, seed, name))
    return places


def tune(source: str, log: Path, folder: Path) -> Path:
    """Fine-tune a network on a log, as docs/robot.md says, and return the exported folder."""
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
    """List what makes each finder of a home, from a folder with the log of its looks.

    Args:
        checkpoints: networks.
        learns: how the networks learn from the log, of `ADAPTED` and `TUNED`.
        asks_moved: share of the questions that are about what has just moved.
    """

    def load(source: Path, folder: Path) -> object_finder.ObjectFinder:
        return ObjectFinder.load(source, asks_moved=asks_moved)

    def adapt(source: Path, folder: Path) -> Finder:
        finder = load(source, folder)
        finder.adapt(folder / _LOG)
        return finder

    def tune_in(name: str, source: Path, folder: Path) -> Finder:
        own = folder / name
        own.mkdir()
        return load(tune(str(source), folder / _LOG, own), own)

    def follow(rule: str, folder: Path) -> Finder:
        return Finder(find_policy(rule)(), asks_moved=asks_moved)

    players: dict[str, Callable[[Path], Finder]] = {name: partial(follow, name) for name in RULES}
    for point in checkpoints:
        players[point.name] = partial(load, point.path)
        if ADAPTED in learns:
            players[f"{point.name} {ADAPTED}"] = partial(adapt, point.path)
        if TUNED in learns:
            players[f"{point.name} {TUNED}"] = partial(tune_in, point.name, point.path)
    return players


@dataclass(frozen=True, slots=True)
class Compared:
    """Two players in the same homes, by one column.

    Attributes:
        who, other: names; `other` is a rule where the best one is meant.
        is_rule: whether it is.
        difference: of `who` minus `other`.
    """

    who: str
    other: str
    is_rule: bool
    difference: Difference


def make_tables(
    scores: Scores, networks: Sequence[str], units: Sequence[str] | None = None
) -> tuple[str, int]:
    """Return two Markdown tables, and how many distinct differences there are.

    The first has the means over homes, the second differences home by home.

    Args:
        scores: of all homes; the same players in each.
        networks: names of the networks, as they were.
        units: what each home is a play of; None if all differ.
    """
    players = list(next(iter(scores.values())))
    values = {
        who: {name: np.array([own[who][name] for own in scores.values()]) for name in COLUMNS}
        for who in players
    }
    rows = [
        [who, *(format(values[who][name].mean(), _FORMATS[name]) for name in COLUMNS)]
        for who in sorted(players, key=lambda who: float(values[who]["accuracy"].mean()))
    ]
    means = join_table(["who", *_TITLES.values()], rows)
    pairs = []
    for network in networks:
        learnt = [f"{network} {how}" for how in (ADAPTED, TUNED) if f"{network} {how}" in players]
        pairs += [(who, network) for who in learnt]
        pairs += [(who, "") for who in (network, *learnt)]
    found = []
    tests: dict[tuple[str, bytes], float] = {}  # a player that is another one in all but its name
    keys = []
    for who, other in pairs:
        for name in COLUMNS:
            than = other or _find_best_rule(values, name)
            delta = values[who][name] - values[than][name]
            found.append(Compared(who, than, not other, Difference.of(delta, units)))
            keys.append((name, delta.tobytes()))
            if delta.any():
                tests[keys[-1]] = found[-1].difference.p
    by_test = dict(zip(tests, correct_holm([*tests.values()]), strict=True))
    corrected = [by_test.get(key, float("nan")) for key in keys]
    cells = [
        _format_compared(one, p, _FORMATS[name])
        for one, p, name in zip(found, corrected, cycle(COLUMNS))
    ]
    rows = [
        [who, other or "the best rule", *cells[number : number + len(COLUMNS)]]
        for number, (who, other) in zip(range(0, len(cells), len(COLUMNS)), pairs, strict=True)
    ]
    header = ["who", "minus", *(f"{title} [95 %]" for title in _TITLES.values())]
    return f"{means}\n{join_table(header, rows, num_text=2)}", len(tests)


def _format_compared(one: Compared, p: float, form: str) -> str:
    mark = "**" if p < 1 - LEVEL else ""
    text = f"{mark}{format_difference(one.difference, form)}{mark}"
    text += f", d {format_number(one.difference.detectable, form)}"
    return f"{text} {one.other}" if one.is_rule else text


def _find_best_rule(values: Mapping[str, Mapping[str, np.ndarray]], column: str) -> str:
    sign = 1 if column == "accuracy" else -1
    return max(RULES, key=lambda who: sign * float(values[who][column].mean()))


def _make_parser() -> ArgumentParser:
    parser = make_parser(
        "python -m nep.own_home",
        "Let a robot look around in homes for some days; adapt and fine-tune networks on the log "
        "of its looks, and ask them, as they were and as they are, in the days after. Run again to "
        "resume: what has been played is in the JSON file beside the table.",
    )
    add_table_options(parser, "own_home.md", ("heat", "any_home"))
    parser.add_argument(
        "--learn",
        type=tuple[str, ...],
        default=(ADAPTED, TUNED),
        help=f"what is done with the log: {ADAPTED}, {TUNED} or both",
    )
    parser.add_argument(
        "--trace",
        type=tuple[str, ...],
        default=(),
        help="recorded homes, or folders of them; homes with people are simulated if left out",
    )
    parser.add_argument(
        "--num_homes", type=int, default=6, help="simulated homes, or plays of each recorded one"
    )
    parser.add_argument(
        "--sizes",
        type=tuple[int, ...],
        default=(3, 6, 9),
        help="furniture nodes of each of four rooms, of one simulated home after the other",
    )
    parser.add_argument("--days", type=int, default=7, help="of looks to learn from")
    parser.add_argument("--play_days", type=int, default=7, help="with questions, after these")
    parser.add_argument("--looks", type=int, default=2, help="looks in each time step, an hour")
    parser.add_argument("--questions", type=int, default=4, help="questions in each time step")
    parser.add_argument(
        "--asks_moved",
        type=float,
        default=TASKS_ASK_MOVED,
        help="share of the questions that are about what has just moved, as in the tasks; 0 for "
        "those of people, who ask for anything",
    )
    parser.add_argument("--seed", type=int, default=0, help="of the homes")
    return parser


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line."""
    parser = _make_parser()
    torch.set_num_threads(1)
    with one_line_errors(status=2):
        options = parse(parser, arguments)
        check_at_least(
            1, num_homes=options.num_homes, days=options.days, play_days=options.play_days,
            questions=options.questions, sizes=min(options.sizes, default=0),
        )  # fmt: skip
        check_at_least(0, seed=options.seed, looks=options.looks)
        check_at_most(
            _MOST, num_homes=options.num_homes, days=options.days, play_days=options.play_days,
            questions=options.questions, looks=options.looks, sizes=max(options.sizes),
        )  # fmt: skip
        for how in options.learn:
            if how not in (ADAPTED, TUNED):
                raise ValueError(
                    f"learn must be {ADAPTED}, {TUNED} or both, got {shorten(how)}. "
                    "Choose among these."
                )
        check_shares(asks_moved=options.asks_moved)
        path = find_scores(options.out)
        if options.play:
            played, shown = _play_all(options, path)
        else:
            played = Played.load_all(path, None, list_names(options.checkpoint))
            shown = list(played.about)
        _write(parser, options, played, shown)


def _play_all(options: Namespace, path: Path) -> tuple[Played, list[str]]:
    """Let everybody play what has not been played yet, and name the homes."""
    checkpoints = [Checkpoint.parse(text) for text in options.checkpoint]
    rules = HomeConfig(looks="random", looks_per_step=options.looks)
    places = list_homes(options.sizes, options.num_homes, options.trace, rules, options.seed)
    players = list_players(checkpoints, options.learn, options.asks_moved)
    asked = {name: options[name] for name in _ASKED}
    played = Played.load(
        path,
        {place.name: {**place.describe(), **asked} for place in places},
        {point.name: point.compute_checksum() for point in checkpoints},
    )
    scores: Scores = played.scores
    for place in places:
        played.about[place.name] = {"title": place.name, "units": [place.unit]}
        own = scores[place.name]
        missing = {who: make for who, make in players.items() if who not in own}
        if missing:
            own |= _play(place, missing, options)
            played.made[place.name] = describe_code()
            played.save()
        print(f"{place.name}: {', '.join(own)}", flush=True)
    played.save()
    return played, [place.name for place in places]


def _write(
    parser: ArgumentParser, options: Namespace, played: Played, shown: Sequence[str]
) -> None:
    """Write the table of some homes."""
    networks = list_names(options.checkpoint)
    units = [unit for name in shown for unit in played.about[name]["units"]]
    tables, num_compared = make_tables(
        {name: played.scores[name] for name in shown}, networks, units
    )
    num_units = len(set(units))
    called = options.called[:1].lower() + options.called[1:]  # within a sentence
    about = _ABOUT.format(
        command=make_command(parser, options, networks), num_homes=len(shown),
        kind=_RECORDED.format(called=called) if options.trace
        else "homes of people with routines",
        looks=options.looks, days=options.days, play_days=options.play_days,
        questions=options.questions, step_seconds=DEFAULT_STEP_SECONDS,
        asked=_describe_questions(options.asks_moved),
        learnt="".join(_LEARNT[how] for how in options.learn),
        num_units=num_units, unit="households" if options.trace else "homes",
        how=_T_INTERVAL if num_units < FEWEST_RESAMPLED else "", num_compared=num_compared,
    )  # fmt: skip
    parts = ["# One's own home", about, tables, describe_made(played, shown, networks)]
    write_whole(options.out, ("\n\n".join(part.strip() for part in parts) + "\n").encode())
    print(options.out)


def _describe_questions(asks_moved: float) -> str:
    """Say what was asked for."""
    if asks_moved == 0:
        return "whether they had just moved or not"
    share = "half" if asks_moved == 0.5 else f"{asks_moved:.0%}"
    return f"{share} of them such as had just moved"


def _play(
    place: Place, players: Mapping[str, Callable[[Path], Finder]], options: Namespace
) -> dict[str, dict[str, float]]:
    """Let a robot live in one home, and players answer there."""
    life = Life.record(
        place.source, options.days * _STEPS_PER_DAY, options.play_days * _STEPS_PER_DAY,
        home=place.home, seed=place.seed,
    )  # fmt: skip
    questions = list(life.ask(options.questions, options.asks_moved))
    scores = {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        life.write_log(folder / _LOG)
        for who, make in players.items():
            with redirect_stdout(StringIO()):  # what training prints
                finder = make(folder)
            scores[who] = measure(finder, questions)
    return scores


if __name__ == "__main__":
    run_main(main)
