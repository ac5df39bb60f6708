"""Tries what the authors' released code does otherwise: `python -m tools.released_code`.

In that code NEP-HEAT is ahead of NEP-MLP, in this package both are level. Each switch makes one
thing as it is there, trains both networks and plays the same test homes. What has been trained and
played is kept, and a study goes on where it stopped. The page holds what has been played so far.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jsonargparse.typing import NonNegativeInt

from nep.bench.paper.experiments import Contestant, Setting
from nep.bench.paper.paper_game import PaperGame
from nep.bench.paper.training import Training
from nep.players.policy import NEPPolicy
from nep.report.results import ScoreSummary
from nep.report.tables import Difference, compute_difference, format_difference, join_table
from sgm.files import read_json, write_whole
from sgm.messages import shorten
from simulator.command_line import make_parser, one_line_errors, parse, pick
from simulator.process import run_main
from tools.claims.released_code import RELEASED
from tools.released_code.switches import SWITCHES

TITLES = {"mlp": "NEP-MLP", "heat": "NEP-HEAT"}
PAGE = "released_code"  # and the file of scores beside it
FEW_STEPS = 10  # at either end of an episode


@dataclass(frozen=True, slots=True)
class Study:
    """Where the study is, and how large.

    Attributes:
        runs: folder of trainings.
        data: folder of the collections.
        out: folder of the page.
        num_homes, steps: test homes, and steps in each.
        options: further options of every training.
    """

    runs: Path = Path("runs/released_code")
    data: Path = Path("data")
    out: Path = Path("results")
    num_homes: int = 100
    steps: int = 100
    options: tuple[str, ...] = ()

    @property
    def scores(self) -> Path:
        """File of scores, by run."""
        return self.out / f"{PAGE}.json"


@dataclass(frozen=True, slots=True)
class Run:
    """One training, and its play.

    Attributes:
        nodes: "on" where objects come and go, else "off".
        switch: in `SWITCHES`.
        network: in `TITLES`.
        seed: of weights, shuffling and training homes.
    """

    nodes: str
    switch: str
    network: str
    seed: int

    @property
    def key(self) -> str:
        """Name among the scores."""
        return f"{self.nodes}/{self.switch}/{self.network}/{self.seed}"


def list_runs(nodes: Sequence[str], switches: Sequence[str], seeds: Sequence[int]) -> Iterator[Run]:
    """List the runs, both networks of a switch after each other."""
    for seed in seeds:
        for switch in switches:
            for where in nodes:
                for network in SWITCHES[switch].networks:
                    yield Run(where, switch, network, seed)


def play(study: Study, run: Run) -> HomeScores:
    """Train, unless that is done, and play; return the scores of each test home."""
    switch, setting = SWITCHES[run.switch], Setting("predict_location", run.nodes == "on")
    files = (f"{run.network}.yaml",)
    training = Training(
        Contestant(setting, f"{run.switch}-{run.network}", TITLES[run.network], files),
        run.seed,
        (*switch.options, *study.options),
        study.runs / f"seed_{run.seed}",
        study.data,
        switch.source,
    )
    game = PaperGame(setting, study.num_homes, study.steps, 0, switch.source)
    with switch.change():
        if not training.is_done():
            training.run()
        player = NEPPolicy.load(training.checkpoint)
        played = game.play({run.network: player.play_in})[run.network]
    return summarise(np.array(played["values"]))


# Mean score of each test home over "all" steps, the "first" and the "last" few.
HomeScores = Mapping[str, Sequence[float]]
Scores = Mapping[str, HomeScores]  # by key of a run


def summarise(values: np.ndarray) -> HomeScores:
    """Return what is kept of the scores of homes and steps, (H, T)."""
    parts = {"all": values, "first": values[:, :FEW_STEPS], "last": values[:, -FEW_STEPS:]}
    return {name: part.mean(axis=1).round(4).tolist() for name, part in parts.items()}


def make_page(study: Study, scores: Scores) -> str:
    """Write HEAT minus MLP under each switch, as far as it has been played."""
    cells, differences = [], {}
    for nodes in ("off", "on"):
        for name, switch in SWITCHES.items():
            mlp = _load(scores, nodes, name if "mlp" in switch.networks else "as_it_is", "mlp")
            heat = _load(scores, nodes, name, "heat")
            if both := sorted(mlp.keys() & heat.keys()):
                first, second = (
                    ScoreSummary.join([found[seed] for seed in both]) for found in (heat, mlp)
                )
                means = [f"{found.home_values.mean():.3f}" for found in (second, first)]
                difference = differences[nodes, name] = compute_difference(first, second)
                shown = format_difference(difference, ".3f")
                cells.append([nodes, switch.title, str(len(both)), *means, shown])
    header = ["objects come and go", "as in the released code", "trainings", *TITLES.values()]
    text = [
        "# What the released code does otherwise\n",
        "In the authors' released code NEP-HEAT is ahead of NEP-MLP; here both are level "
        "([claims](claims.md#the-authors-code-beside-ours)). Each row makes one thing as it is "
        "there, the last one all of them, in homes of its sizes (24 places). Predict Object "
        f"Location, share of right first guesses in {study.num_homes} test homes x {study.steps} "
        "steps; 95 % intervals over homes, and over trainings where there are several.\n",
        join_table([*header, "HEAT minus MLP [95 %]"], cells, 2),
        conclude({name: found for (nodes, name), found in differences.items() if nodes == "off"}),
        "A switch of HEAT alone stands beside MLP as it is. Trainings with objects that come and "
        "go were made before the encoders ran on DGL, which changed no output.\n",
        "## First steps against last\n",
        f"The same networks as they are: the first {FEW_STEPS} steps in a home, the last "
        f"{FEW_STEPS}, and the gain, paired over homes.\n",
        join_table(_ADAPTATION, _list_gains(scores), 2),
        "Made by `python -m tools.released_code`.\n",
    ]
    return "\n".join(text)


def conclude(differences: Mapping[str, Difference]) -> str:
    """Say whether a switch brings the order about where objects stay, and which were not played.

    Args:
        differences: HEAT minus MLP by switch, in homes where objects stay.
    """
    played = {name: found for name, found in differences.items() if name != "as_it_is"}
    theirs, sentences = RELEASED["off"], []
    if played:
        reaching = [SWITCHES[name].title for name, found in played.items() if found.high >= theirs]
        verdict = (
            f"{'; '.join(reaching)}: up to there"
            if reaching
            else ("none of these brings the order about. Why theirs is another is not known")
        )
        sentences = [
            f"Where objects stay, HEAT minus MLP is {theirs:+.3f} in the released code. Of "
            f"{len(played)} switches the highest interval ends at "
            f"{max(found.high for found in played.values()):+.3f}: {verdict}."
        ]
    left = [switch.title for name, switch in SWITCHES.items() if name not in differences]
    if left:
        sentences.append(f"Not played there, one at a time: {'; '.join(left)}.")
    return " ".join(sentences) + "\n"


_ADAPTATION = ("objects come and go", "network", "trainings", "first", "last", "gain [95 %]")


def _list_gains(scores: Scores) -> list[list[str]]:
    """Return the cells of what networks gain over an episode."""
    cells = []
    for nodes in ("off", "on"):
        for network, title in TITLES.items():
            first, last = (
                _load(scores, nodes, "as_it_is", network, part) for part in ("first", "last")
            )
            if first:
                before, after = (ScoreSummary.join([*found.values()]) for found in (first, last))
                means = [f"{found.home_values.mean():.3f}" for found in (before, after)]
                gain = format_difference(compute_difference(after, before), ".3f")
                cells.append([nodes, title, str(len(first)), *means, gain])
    return cells


def _load(
    scores: Scores, nodes: str, switch: str, network: str, part: str = "all"
) -> dict[int, ScoreSummary]:
    """Return what one network scored in each home, by seed."""
    found = {}
    for key, by_part in scores.items():
        *where, seed = key.split("/")
        if where == [nodes, switch, network]:
            found[int(seed)] = ScoreSummary(np.array(by_part[part])[:, None], {})
    return found


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line: train, play, and write the page after each run."""
    parser = make_parser("python -m tools.released_code", __doc__)
    parser.add_class_arguments(Study)
    parser.add_argument("--switches", type=list[str], default=list(SWITCHES))
    parser.add_argument("--nodes", type=list[bool], default=[False, True])  # off, on in YAML
    parser.add_argument("--seeds", type=list[NonNegativeInt], default=[0])
    with one_line_errors(status=2):
        options = parse(parser, arguments)
        study = Study(**pick(options, Study))
        for name in options.switches:
            if name not in SWITCHES:
                raise ValueError(
                    f"switch must be one of {', '.join(SWITCHES)}, got {shorten(name)}. Choose "
                    "among these."
                )
    with one_line_errors():
        scores = read_json(study.scores) if study.scores.is_file() else {}
        nodes = ["on" if come_and_go else "off" for come_and_go in options.nodes]
        for run in list_runs(nodes, options.switches, options.seeds):
            if run.key not in scores:
                scores[run.key] = play(study, run)
                study.out.mkdir(parents=True, exist_ok=True)
                write_whole(study.scores, (json.dumps(scores, indent=0) + "\n").encode())
                print(f"{run.key}: {np.mean(scores[run.key]['all']):.3f}", flush=True)
        write_whole(study.out / f"{PAGE}.md", make_page(study, scores).encode())


if __name__ == "__main__":
    run_main(main)
