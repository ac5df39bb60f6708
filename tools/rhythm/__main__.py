"""Fit what similar moments say beside the shipped network and `Adaptive`, in simulated homes.

Robots live in three kinds of homes (`LIVES`) and are asked. A quarter of the homes is kept apart to
measure. Answers of each home are kept in the folder, so that a stopped command goes on.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from sgm.files import write_whole
from sgm.policies.rhythm import TERMS
from simulator.command_line import make_parser, one_line_errors, parse
from simulator.process import run_main
from tools.rhythm.answers import LIVES, POLICIES, load_answers
from tools.rhythm.fit import Problem, Quality, fit_weights

_DECIMALS = 3  # of a weight


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line."""
    parser = make_parser("python -m tools.rhythm", __doc__)
    parser.add_argument("folder", type=Path, help="where the answers in each home are kept")
    parser.add_argument("--homes", type=int, default=28, help="number of homes of each kind")
    parser.add_argument("--out", type=Path, help="file of the weights; none to measure alone")
    with one_line_errors(status=2):
        options = parse(parser, arguments)
        if options.homes < 4:
            raise ValueError(f"homes must be at least 4, got {options.homes}. Take 28.")
        options.folder.mkdir(parents=True, exist_ok=True)
        weights = {}
        for policy in POLICIES:
            problems = {
                kind: [
                    Problem.of(load_answers(kind, number, options.folder), policy)
                    for number in range(options.homes)
                ]
                for kind in LIVES
            }
            learnt = [p for homes in problems.values() for n, p in enumerate(homes) if n % 4]
            found = fit_weights(Problem.join(learnt)).round(_DECIMALS)
            weights[policy] = dict(zip(TERMS, found.tolist(), strict=True))
            for kind, homes in problems.items():
                apart = Problem.join(homes[::4])
                for name, said in (("alone", apart.believed), ("with rhythm", apart.weigh(found))):
                    quality = Quality.of(apart, said)
                    print(
                        f"{kind}, {policy} {name}: {quality.right:.3f} right, "
                        f"{quality.nats:.3f} nats; of {apart.has_moved.sum()} that had moved "
                        f"{quality.right_moved:.3f} right, {quality.nats_moved:.3f} nats; "
                        f"{len(apart.answer)} questions"
                    )
        if options.out is not None:
            write_whole(options.out, _write(weights, options.homes))


def _write(weights: dict[str, dict[str, float]], num_homes: int) -> bytes:
    content = {"made_by": f"python -m tools.rhythm --homes {num_homes}", "weights": weights}
    return (json.dumps(content, indent=1) + "\n").encode()


if __name__ == "__main__":
    run_main(main)
