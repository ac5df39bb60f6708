"""The command line of iGridson: play and video."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sgm.checks import check_seed
from sgm.prior.prior_graph import PRIOR_HELP, load_prior
from simulator.command_line import choose, make_parser, parse, pick
from simulator.igridson.find_object import POLICY_HELP, RunConfig, Searcher, find_searcher
from simulator.igridson.navigation import LOOK_COST
from simulator.process import run_main

if TYPE_CHECKING:
    from jsonargparse import ArgumentParser, Namespace


def main(
    args: Sequence[str] | None = None,
    prog: str = "python -m simulator.igridson",
    more: type[Any] | None = None,
) -> int:
    """Run the command line.

    Args:
        args: arguments; those of the process if None.
        prog: the command, for the help.
        more: dataclass of further options, each described in its docstring; its `make_searchers`
            returns the policies that they add, by name, such as a trained network.

    Returns:
        The exit status: 0, or 2 if an argument is wrong.
    """
    commands = {name: partial(run, prog, more) for name, run in COMMANDS.items()}
    return choose(prog, commands, args, status=2)


def _make_parser(prog: str, more: type[Any] | None, description: str) -> ArgumentParser:
    parser = make_parser(prog, description)
    if more is not None:
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


def _find_searcher(options: Namespace, more: type[Any] | None) -> Searcher | None:
    """Return the policy that options name, those of further options included."""
    check_seed(options.seed)
    searchers = {} if more is None else more(**pick(options, more)).make_searchers()
    if options.policy is None:
        return None
    return find_searcher(options.policy, searchers, options.look_cost)


def _play(prog: str, more: type[Any] | None, arguments: Sequence[str]) -> int:
    """Search with the keyboard."""
    from simulator.igridson.agent import HELP, play
    from simulator.igridson.env import IGridsonEnv

    parser = _make_parser(f"{prog} play", more, "Search with the keyboard.")
    parser.add_argument(
        "--policy",
        type=str | None,
        help=f"show what it believes from what you have seen: {POLICY_HELP}",
    )
    parser.add_argument("--show_all", type=bool, default=False, help="show where all objects are")
    options = parse(parser, arguments)
    searcher = _find_searcher(options, more)
    env = IGridsonEnv(
        options.layout, load_prior(options.prior), shows_all=options.show_all, render_mode="human"
    )
    print(HELP)
    play(env, options.seed, searcher)
    env.close()
    return 0


def _film(prog: str, more: type[Any] | None, arguments: Sequence[str]) -> int:
    """Film searches."""
    from PIL import Image

    from simulator.igridson.env import IGridsonEnv
    from simulator.igridson.video import check_format, film_searches, save_video

    parser = _make_parser(f"{prog} video", more, "Film searches.")
    parser.add_argument("--policy", type=str, default="prior_filter", help=POLICY_HELP)
    parser.add_argument("--out", type=Path, required=True, help="file ending in .gif or .mp4")
    parser.add_argument("--still", type=Path | None, help="PNG file for the last picture")
    parser.add_argument("--searches", type=int, default=2, help="searches that are filmed")
    parser.add_argument("--warm_up", type=int, default=50, help="searches before them")
    parser.add_argument("--tile", type=int, default=40, help="pixels per cell")
    options = parse(parser, arguments)
    check_format(options.out)
    searcher = _find_searcher(options, more)
    assert searcher is not None
    env = IGridsonEnv(
        options.layout, load_prior(options.prior), tile_size=options.tile, render_mode="rgb_array"
    )
    frames = film_searches(env, searcher, options.seed, options.searches, options.warm_up)
    save_video(frames, options.out)
    if options.still is not None:
        Image.fromarray(frames[-1]).save(options.still)
    return 0


# The commands by name.
COMMANDS = {"play": _play, "video": _film}


if __name__ == "__main__":
    run_main(main)
