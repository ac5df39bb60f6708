"""iGridson with a trained Node Edge Predictor: `python -m nep.igridson play --checkpoint CKPT`.

CKPT is a checkpoint, an exported folder, or "heat", which ships with the package. The commands
are those of `python -m simulator.igridson`, with one more policy, `nep`.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass

import torch

from nep.players.contestants import load_player
from nep.players.stored_network import import_encoders
from sgm.checks import check_at_least
from simulator.igridson import __main__ as command
from simulator.igridson.find_object import Searcher
from simulator.process import run_main


@dataclass(frozen=True, slots=True)
class NetworkOptions:
    """A network that plays as the policy `nep`.

    Attributes:
        checkpoint: the network: a checkpoint, an exported folder or one that ships.
        threads: CPU threads; all cores if left out.
        encoders: modules of your own with its encoder.
    """

    checkpoint: str | None = None
    threads: int | None = None
    encoders: tuple[str, ...] = ()

    def make_searchers(self) -> dict[str, Searcher]:
        """Load the network, if there is one.

        Raises:
            ValueError: if it cannot be read, or there is no thread.
        """
        check_at_least(1, threads=self.threads)
        if self.threads is not None:
            torch.set_num_threads(self.threads)
        if self.checkpoint is None:
            return {}
        import_encoders(self.encoders)
        return {"nep": Searcher(load_player(self.checkpoint).play_in)}


def main(args: Sequence[str] | None = None) -> int:
    """Run the command line; options may stand before the command, too."""
    args = sys.argv[1:] if args is None else args
    position = next((place for place, arg in enumerate(args) if arg in command.COMMANDS), 0)
    args = [*args[position : position + 1], *args[:position], *args[position + 1 :]]
    return command.main(args, "python -m nep.igridson", NetworkOptions)


if __name__ == "__main__":
    run_main(main)
