"""iGridson with a trained Node Edge Predictor: `python -m nep.igridson run --checkpoint CKPT`.

CKPT is a checkpoint, an exported folder, or "heat", which ships with the package.
The commands are those of `python -m simulator.igridson`, with one more policy, `nep`.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

import torch

from nep.players.own_encoders import import_encoders
from nep.players.policy import NEPPolicy
from simulator.igridson import command
from simulator.igridson.find_object import Searcher
from simulator.process import run_main

PROG = "python -m nep.igridson"


def main(args: Sequence[str] | None = None) -> int:
    """Load the checkpoint and hand on to iGridson's own command line."""
    parser = argparse.ArgumentParser(prog=PROG, add_help=False, allow_abbrev=False)
    parser.add_argument("--checkpoint")  # a name of one that ships with the package is no path
    parser.add_argument("--threads", type=int)
    parser.add_argument("--encoders", action="append", default=[])  # modules of one's own
    options, rest = parser.parse_known_args(args)
    if options.threads is not None:
        if options.threads < 1:
            print(
                f"error: threads must be at least 1, got {options.threads}. Raise it.",
                file=sys.stderr,
            )
            return 2
        torch.set_num_threads(options.threads)
    searchers: dict[str, Searcher] = {}
    if options.checkpoint is not None:
        try:
            import_encoders(options.encoders)
            policy = NEPPolicy.load(options.checkpoint)
        except (ValueError, OSError) as error:
            print(f"{PROG}: {error}", file=sys.stderr)
            return 2
        searchers["nep"] = Searcher(policy.play_in)
    return command.main(rest, searchers, f"{PROG} [--checkpoint CKPT] [--threads N]")


if __name__ == "__main__":
    run_main(main)
