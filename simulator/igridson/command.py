"""The command line of iGridson: play, run, video."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from tqdm import tqdm

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
from simulator.priors.prior_graph import PriorGraph

TRAVEL = "+travel"  # ending of a policy's name that makes the search travel-aware

_BELIEVERS = ("bayesian", "prior_filter", "ceiling")  # whose scores are near probabilities


def main(
    args: Sequence[str] | None = None,
    searchers: Mapping[str, Searcher] | None = None,
    prog: str = "python -m simulator.igridson",
) -> int:
    """Run the command line.

    Args:
        args: arguments; those of the process if None.
        searchers: further policies by name, such as a trained network.
        prog: the command, for the help.

    Returns:
        The exit status: 0, or 2 if an argument is wrong.
    """
    known = {name: Searcher(policy.make) for name, policy in POLICIES.items()} | dict(
        searchers or {}
    )
    options = _make_parser(prog, known).parse_args(args)
    try:
        options.execute(options, known)
    except (ValueError, OSError) as error:
        print(f"{prog}: {error}", file=sys.stderr)
        return 2
    return 0


def find_searcher(name: str, known: Mapping[str, Searcher], look_cost: float) -> Searcher:
    """Return the searcher of a policy's name, travel-aware if it ends in `+travel`.

    Raises:
        ValueError: if there is no such policy.
    """
    plain = name.removesuffix(TRAVEL)
    if plain not in known:
        raise ValueError(
            f"policy must be one of {', '.join(known)}, got {name!r}. Choose one of these, with "
            f"'{TRAVEL}' at its end for a travel-aware search; a trained network is played by "
            "`python -m nep.igridson`."
        )
    return replace(known[plain], is_travel_aware=name != plain, look_cost=look_cost)


def _make_parser(prog: str, known: Mapping[str, Searcher]) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog=prog, description=__doc__)
    commands = parser.add_subparsers(required=True, metavar="play | run | video")
    names = f"one of {', '.join(known)}; with '{TRAVEL}' at its end, walking distances count"

    play = commands.add_parser("play", help="search with the keyboard")
    play.add_argument("--policy", help=f"show what it believes from what you have seen: {names}")
    play.add_argument("--show-all", action="store_true", help="show where all objects are")
    play.set_defaults(execute=_play)

    run = commands.add_parser("run", help="thousands of searches, as a table")
    defaults = RunConfig()
    run.add_argument(
        "--policy", nargs="+", metavar="NAME", default=_list_default(known),
        help=f"default: all, and travel-aware those whose scores are near probabilities; {names}",
    )  # fmt: skip
    run.add_argument("--runs", type=int, default=defaults.runs)
    run.add_argument("--queries-per-home", type=int, default=defaults.queries_per_home)
    run.add_argument("--attempts", type=int, default=defaults.attempts)
    run.add_argument("--out", type=Path, help="JSON file for the results")
    run.add_argument("--quiet", action="store_true", help="no progress bars")
    run.set_defaults(execute=_run)

    video = commands.add_parser("video", help="film a search")
    video.add_argument("--policy", default="prior_filter", help=names)
    video.add_argument("--out", type=Path, required=True, help="file ending in .gif or .mp4")
    video.add_argument("--still", type=Path, help="PNG file for the last picture")
    video.add_argument("--searches", type=int, default=2, help="searches that are filmed")
    video.add_argument("--warm-up", type=int, default=50, help="searches before them")
    video.add_argument("--tile", type=int, default=40, help="pixels per cell")
    video.set_defaults(execute=_film)

    for command in (play, run, video):
        command.add_argument("--seed", type=int, default=defaults.seed)
        command.add_argument("--layout", type=Path, help="layout file; the shipped home if absent")
        command.add_argument("--prior", type=Path, help="prior file; the shipped one if absent")
        command.add_argument(
            "--look-cost", type=float, default=LOOK_COST,
            help="price of a look in steps, for travel-aware searches",
        )  # fmt: skip
    return parser


def _list_default(known: Mapping[str, Searcher]) -> list[str]:
    """List all policies, and the travel-aware form of those whose scores are probabilities."""
    suited = [name for name in known if name in _BELIEVERS or name not in POLICIES]
    return [*known, *(name + TRAVEL for name in suited)]


def _load_prior(options: argparse.Namespace) -> PriorGraph:
    return PriorGraph.default() if options.prior is None else PriorGraph.load(options.prior)


def _play(options: argparse.Namespace, known: Mapping[str, Searcher]) -> None:
    from simulator.igridson.env import IGridsonEnv
    from simulator.igridson.play import HELP, play

    searcher = None
    if options.policy is not None:
        searcher = find_searcher(options.policy, known, options.look_cost)
    env = IGridsonEnv(
        options.layout, _load_prior(options), shows_all=options.show_all, render_mode="human"
    )
    print(HELP)
    play(env, options.seed, searcher)
    env.close()


def _run(options: argparse.Namespace, known: Mapping[str, Searcher]) -> None:
    config = RunConfig(options.runs, options.queries_per_home, options.attempts, options.seed)
    prior, layout = _load_prior(options), load_layout(options.layout)
    check_attempts(config, layout)
    searchers = {name: find_searcher(name, known, options.look_cost) for name in options.policy}
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


def _film(options: argparse.Namespace, known: Mapping[str, Searcher]) -> None:
    from PIL import Image

    from simulator.igridson.env import IGridsonEnv
    from simulator.igridson.video import check_format, film_searches, save_video

    check_format(options.out)
    searcher = find_searcher(options.policy, known, options.look_cost)
    env = IGridsonEnv(
        options.layout, _load_prior(options), tile_size=options.tile, render_mode="rgb_array"
    )
    frames = film_searches(env, searcher, options.seed, options.searches, options.warm_up)
    save_video(frames, options.out)
    if options.still is not None:
        Image.fromarray(frames[-1]).save(options.still)
