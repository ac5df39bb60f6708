"""The command line of iGridson: play, run, video."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from tqdm import tqdm

from sgm.checks import check_seed
from sgm.messages import shorten
from sgm.prior.prior_graph import PRIOR_HELP, load_prior
from simulator.command_line import choose, make_parser, parse, pick
from simulator.igridson.find_object import (
    RunConfig,
    Runs,
    Searcher,
    check_attempts,
    run_searches,
)
from simulator.igridson.layout_file import load_layout
from simulator.igridson.report import format_table, save_results
from simulator.igridson.travel import LOOK_COST
from simulator.policies import POLICIES

if TYPE_CHECKING:
    from jsonargparse import ArgumentParser, Namespace

TRAVEL = "+travel"  # ending of a policy's name that makes the search travel-aware

_BELIEVERS = ("bayesian", "prior_filter", "ceiling")  # whose scores are near probabilities
_POLICY_HELP = f"one of {', '.join(POLICIES)}; with '{TRAVEL}' at its end, walking distances count"


class MoreOptions(Protocol):
    """A dataclass of further options that adds policies, such as a trained network."""

    def make_searchers(self) -> Mapping[str, Searcher]:
        """Return policies by name."""


@dataclass(frozen=True, slots=True)
class NoOptions:
    """No further options."""

    def make_searchers(self) -> Mapping[str, Searcher]:
        """Return no policy."""
        return {}


def main(
    args: Sequence[str] | None = None,
    prog: str = "python -m simulator.igridson",
    more: type[MoreOptions] = NoOptions,
) -> int:
    """Run the command line.

    Args:
        args: arguments; those of the process if None.
        prog: the command, for the help.
        more: dataclass of further options, each described in its docstring.

    Returns:
        The exit status: 0, or 2 if an argument is wrong.
    """
    commands = {name: partial(run, prog, more) for name, run in COMMANDS.items()}
    return choose(prog, commands, args, status=2)


def find_searcher(name: str, known: Mapping[str, Searcher], look_cost: float) -> Searcher:
    """Return the searcher of a policy's name, travel-aware if it ends in `+travel`.

    Raises:
        ValueError: if there is no such policy.
    """
    plain = name.removesuffix(TRAVEL)
    if plain not in known:
        raise ValueError(
            f"policy must be one of {', '.join(known)}, got {shorten(name)}. Choose one of these, "
            f"with '{TRAVEL}' at its end for a travel-aware search; a trained network is played by "
            "`python -m nep.igridson --checkpoint CKPT`."
        )
    return replace(known[plain], is_travel_aware=name != plain, look_cost=look_cost)


def _make_parser(prog: str, more: type[MoreOptions], description: str) -> ArgumentParser:
    parser = make_parser(prog, description)
    parser.add_class_arguments(more)
    parser.add_argument("--seed", type=int, default=RunConfig().seed)
    parser.add_argument(
        "--layout", type=Path | None, help="layout file; the shipped home if absent"
    )
    parser.add_argument("--prior", type=str | None, help=PRIOR_HELP)
    parser.add_argument(
        "--look_cost",
        type=float,
        default=LOOK_COST,
        help="price of a look in steps, for travel-aware searches",
    )
    return parser


def _find_searchers(options: Namespace, more: type[MoreOptions]) -> dict[str, Searcher]:
    """Return all policies by name, those of further options last."""
    known = {name: Searcher(policy.make) for name, policy in POLICIES.items()}
    return known | dict(more(**pick(options, more)).make_searchers())


def _list_default(known: Mapping[str, Searcher]) -> list[str]:
    """List all policies, and the travel-aware form of those whose scores are probabilities."""
    suited = [name for name in known if name in _BELIEVERS or name not in POLICIES]
    return [*known, *(name + TRAVEL for name in suited)]


def _play(prog: str, more: type[MoreOptions], arguments: Sequence[str]) -> int:
    """Search with the keyboard."""
    from simulator.igridson.env import IGridsonEnv
    from simulator.igridson.play import HELP, play

    parser = _make_parser(f"{prog} play", more, "Search with the keyboard.")
    parser.add_argument(
        "--policy",
        type=str | None,
        help=f"show what it believes from what you have seen: {_POLICY_HELP}",
    )
    parser.add_argument("--show_all", type=bool, default=False, help="show where all objects are")
    options = parse(parser, arguments)
    check_seed(options.seed)
    known = _find_searchers(options, more)
    searcher = None
    if options.policy is not None:
        searcher = find_searcher(options.policy, known, options.look_cost)
    env = IGridsonEnv(
        options.layout, load_prior(options.prior), shows_all=options.show_all, render_mode="human"
    )
    print(HELP)
    play(env, options.seed, searcher)
    env.close()
    return 0


def _run(prog: str, more: type[MoreOptions], arguments: Sequence[str]) -> int:
    """Search thousands of times, for a table."""
    parser = _make_parser(f"{prog} run", more, "Search thousands of times, for a table.")
    parser.add_argument(
        "--policy",
        type=tuple[str, ...] | None,
        help="default: all, and travel-aware those whose scores are near probabilities; "
        + _POLICY_HELP,
    )
    parser.add_class_arguments(RunConfig, skip={"seed"})
    parser.add_argument("--out", type=Path | None, help="JSON file for the results")
    parser.add_argument("--quiet", type=bool, default=False, help="no progress bars")
    options = parse(parser, arguments)
    config = RunConfig(**pick(options, RunConfig))
    known = _find_searchers(options, more)
    prior, layout = load_prior(options.prior), load_layout(options.layout)
    check_attempts(config, layout)
    names = _list_default(known) if options.policy is None else options.policy
    searchers = {name: find_searcher(name, known, options.look_cost) for name in names}
    results: dict[str, Runs] = {}
    seconds: dict[str, float] = {}
    for name, searcher in searchers.items():
        start = time.perf_counter()
        with tqdm(total=config.runs, desc=name, unit="run", disable=options.quiet) as bar:
            results[name] = run_searches(searcher, prior, layout, config, bar.update)
        seconds[name] = round(time.perf_counter() - start, 2)
    print(
        f"Find Object in iGridson: {config.runs} runs, {config.num_homes} homes x "
        f"{config.queries_per_home} queries, {config.attempts} attempts\n"
    )
    print(format_table(results))
    if options.out is not None:
        settings = {
            "look_cost": options.look_cost,
            "layout": str(options.layout or "shipped"),
            "prior": prior.checksum,
            "seconds": seconds,
        }
        save_results(options.out, results, config, settings)
    return 0


def _film(prog: str, more: type[MoreOptions], arguments: Sequence[str]) -> int:
    """Film searches."""
    from PIL import Image

    from simulator.igridson.env import IGridsonEnv
    from simulator.igridson.video import check_format, film_searches, save_video

    parser = _make_parser(f"{prog} video", more, "Film searches.")
    parser.add_argument("--policy", type=str, default="prior_filter", help=_POLICY_HELP)
    parser.add_argument("--out", type=Path, required=True, help="file ending in .gif or .mp4")
    parser.add_argument("--still", type=Path | None, help="PNG file for the last picture")
    parser.add_argument("--searches", type=int, default=2, help="searches that are filmed")
    parser.add_argument("--warm_up", type=int, default=50, help="searches before them")
    parser.add_argument("--tile", type=int, default=40, help="pixels per cell")
    options = parse(parser, arguments)
    check_format(options.out)
    check_seed(options.seed)
    known = _find_searchers(options, more)
    searcher = find_searcher(options.policy, known, options.look_cost)
    env = IGridsonEnv(
        options.layout, load_prior(options.prior), tile_size=options.tile, render_mode="rgb_array"
    )
    frames = film_searches(env, searcher, options.seed, options.searches, options.warm_up)
    save_video(frames, options.out)
    if options.still is not None:
        Image.fromarray(frames[-1]).save(options.still)
    return 0


# The commands by name.
COMMANDS = {"play": _play, "run": _run, "video": _film}
