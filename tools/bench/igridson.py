"""Searches in the home on a grid, beside the paper's Table 3."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, ClassVar

from jsonargparse import Namespace

from nep.games.game import Game
from nep.players.contestants import Checkpoint, list_contestants
from nep.report.tables import join_table
from sgm.files import compute_checksum
from sgm.network.shipped import split_name
from sgm.prior.prior_graph import PRIOR_HELP, load_prior
from simulator.command_line import pick
from simulator.igridson.find_object import (
    POLICY_HELP,
    TRAVEL,
    RunConfig,
    Searcher,
    check_attempts,
    find_searcher,
    list_searchers,
    run_searches,
)
from simulator.igridson.layout_file import DEFAULT_LAYOUT, load_layout
from simulator.igridson.navigation import LOOK_COST
from simulator.policies import POLICIES
from tools.bench.suite import Report, TableSuite
from tools.bench.table_options import Option, describe_made, list_names, list_table_options

# Table 3: success rate, number of actions and path length, each with its standard deviation.
PAPER: Mapping[str, tuple[float, tuple[float, float], tuple[float, float]]] = {
    "random": (0.57, (9.36, 4.09), (141.74, 63.86)),
    "myopic": (0.57, (9.31, 4.14), (140.92, 64.40)),
    "bayesian": (0.84, (5.06, 4.50), (70.90, 63.06)),
    "nep": (1.00, (1.56, 0.86), (30.05, 24.67)),
}
_NETWORK = "nep"  # what a network is called that is given no name
_PROBABLE = ("bayesian", "prior_filter", "ceiling")  # policies whose scores are near probabilities
_HEADER = (
    "policy",
    "success",
    "actions",
    "path length",
    "paper: success",
    "actions",
    "path length",
)
_ABOUT = """\
`{command}`.
Mean ± standard deviation over searches; the JSON file beside this page has standard errors over
homes. Every policy gets the same homes and the same queries.
[A home on a grid](../docs/igridson.md) has the rules. *Paper*: its Table 3."""


@dataclass(frozen=True)
class GridGame(Game):
    """Searches in homes on a grid.

    Attributes:
        config: how many.
        look_cost: price of a look in steps, for travel-aware searches.
        layout: file of the grid; None for the one that ships.
        prior: what homes look like, see `load_prior`.
    """

    config: RunConfig
    look_cost: float
    layout: Path | None
    prior: str | None

    scored_by: ClassVar[tuple[str, ...]] = ("simulator.igridson.find_object",)

    def describe(self) -> dict[str, Any]:
        """Return everything that scores depend on but the player."""
        return {
            **asdict(self.config),
            "look_cost": self.look_cost,
            "layout": compute_checksum(self.layout or DEFAULT_LAYOUT),
            "prior": load_prior(self.prior).checksum,
        }

    def tell(self) -> dict[str, Any]:
        """Return title and units."""
        config = self.config
        title = (
            f"At most {config.attempts} looks: {config.runs:,} searches, {config.num_homes} unseen "
            f"homes x {config.queries_per_home} queries"
        )
        return {"title": title, "units": [f"home {number}" for number in range(config.num_homes)]}

    def play(self, players: Mapping[str, Searcher]) -> dict[str, Any]:
        """Let players search; return `Runs.summarise` by player."""
        prior, layout = load_prior(self.prior), load_layout(self.layout)
        return {
            name: run_searches(searcher, prior, layout, self.config).summarise()
            for name, searcher in players.items()
        }


def make_grid_table(scores: Mapping[str, Mapping[str, float]]) -> str:
    """Return a Markdown table of summaries by player, ours beside the paper's."""
    rows = []
    for name, summary in scores.items():
        cells = [name, f"{summary['success_rate']:.3f}"]
        cells += [
            f"{summary[column]:.{digits}f} ± {summary[f'{column}_std']:.{digits}f}"
            for column, digits in (("num_actions", 2), ("path_length", 1))
        ]
        if name in PAPER:
            success, actions, path = PAPER[name]
            cells += [f"{success:.2f}", "{:.2f} ± {:.2f}".format(*actions)]
            cells.append("{:.1f} ± {:.1f}".format(*path))
        rows.append([*cells, *[""] * (len(_HEADER) - len(cells))])
    return join_table(_HEADER, rows)


class GridSearches(TableSuite[GridGame]):
    """Policies and networks that search on the grid, some with walking distances."""

    command = "tools.bench igridson"
    summary = "Search thousands of times in the home on a grid, and write a table."

    shows_all = True
    needs_networks = False
    options = (
        *(option for option in list_table_options("igridson.md", ()) if option.name != "called"),
        Option("encoders", (), "modules of your own with encoders of networks"),
        Option(
            "policy",
            None,
            "all, and travel-aware those whose scores are near probabilities, if "
            f"left out; {POLICY_HELP}",
            type=tuple[str, ...] | None,
        ),
        Option("runs", RunConfig().runs, "searches in all"),
        Option("queries_per_home", RunConfig().queries_per_home, "searches in each home"),
        Option("attempts", RunConfig().attempts, "looks that a search may take"),
        Option("seed", RunConfig().seed, "of the homes"),
        Option("look_cost", LOOK_COST, "price of a look in steps, for travel-aware searches"),
        Option("layout", None, "layout file; the home that ships if left out", type=Path | None),
        Option("prior", None, PRIOR_HELP, type=str | None),
    )

    def check(self, options: Namespace) -> None:
        """Check counts and names; a network without a name is called `nep`."""
        config = RunConfig(**pick(options, RunConfig))
        check_attempts(config, load_layout(options.layout))
        options.checkpoint = tuple(
            text if split_name(text)[0] else f"{_NETWORK}={text}" for text in options.checkpoint
        )
        known = list_searchers()
        known |= dict.fromkeys(list_names(options.checkpoint), known["random"])  # for their names
        for name in options.policy or ():
            find_searcher(name, known, options.look_cost)

    def list_games(self, options: Namespace, folder: Path) -> Mapping[str, GridGame]:
        """List the one that is played now."""
        config = RunConfig(**pick(options, RunConfig))
        game = GridGame(config, options.look_cost, options.layout, options.prior)
        return {f"{config.runs} searches, {config.attempts} attempts": game}

    def list_players(
        self, options: Namespace, game: GridGame, checkpoints: Sequence[Checkpoint]
    ) -> Mapping[str, Searcher]:
        """List policies and networks, each plain or travel-aware."""
        points = [
            Checkpoint(checkpoint.name, checkpoint.path, None, options.encoders)
            for checkpoint in checkpoints
        ]
        for point in points:
            point.load()  # says what is wrong before anything is played
        made = list_contestants("find_object", tuple(POLICIES), points)
        known = {name: Searcher(make) for name, make in made.items()}
        names = options.policy
        if names is None:
            suited = [name for name in known if name in _PROBABLE or name not in POLICIES]
            names = [*known, *(name + TRAVEL for name in suited)]
        return {name: find_searcher(name, known, options.look_cost) for name in names}

    def write(self, report: Report) -> list[str]:
        """Return what was done, and a table for each number of looks."""
        parts = ["# Find Object in iGridson", _ABOUT.format(command=report.command)]
        for name, scores in report.scores.items():
            table = make_grid_table(scores)
            print(table)
            parts.append(f"## {report.about[name]['title']}\n\n{table}")
        return [*parts, describe_made(report.cache, report.shown, report.networks)]


main = GridSearches().main
