"""Let robots patrol simulated homes for a week, and ask what they know then of all things.

Scores of each home are kept in the JSON beside the table, so that a stopped command goes on.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from nep.report.statistics import FEWEST_RESAMPLED
from nep.report.tables import Difference, format_difference, join_table
from sgm.checks import check_at_least
from sgm.files import write_whole
from sgm.finder.object_finder import ObjectFinder
from sgm.network.policy import NetworkPolicy
from sgm.network.shipped import find_trained
from simulator.command_line import make_parser, one_line_errors, parse
from simulator.process import run_main
from tools.patrols.lives import ASKED, ROUND, STEPS_PER_DAY, PatrolledHome, make_patrols

COMPARED = "next_looks"  # with every other patrol
_DIGITS = 4
_NETWORK = "any_home"
_ABOUT = """\
# Where to look on a patrol

`{command}`.
In each simulated home a robot made a round of {looks} looks every {hours} hours, day and night, for
{days} days. Its patrol says where. Between the rounds it looked at random, as if on an errand. On
the day after it went on, and was asked {asked} times where each thing of the home is,
seen before or not. Each patrol had the same homes, the same errands, and a detector that misses the
same things at one place and time. All were asked with the network that ships.

- `next_looks`: where a look tells most of where things are (`sgm.finder.patrol`).
- `round_robin`: all places in turn.
- `longest_not_seen`: the place whose last look is the longest ago, errands included.
- `random`: a place at random.

Scores are means over homes. *nats* is the negative log likelihood of where things are, *right* the
share of first answers that were right. Nothing of `next_looks` was chosen in these homes.
Differences are paired over homes, with 95 % intervals ({how})."""

_Scores = Mapping[str, Mapping[str, Sequence[float]]]


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line."""
    parser = make_parser("python -m tools.patrols", __doc__)
    parser.add_argument("--out", type=Path, default=Path("patrols.md"), help="the table")
    parser.add_argument("--homes", type=int, default=24, help="number of homes")
    parser.add_argument("--days", type=int, default=7, help="of patrols before any question")
    parser.add_argument("--looks", type=int, default=4, help="of a round")
    parser.add_argument("--seed", type=int, default=2, help="of homes and looks")
    with one_line_errors(status=2):
        options = parse(parser, arguments)
        check_at_least(1, homes=options.homes, days=options.days, looks=options.looks)
        check_at_least(0, seed=options.seed)
        rules = {name: options[name] for name in ("days", "looks", "seed")}
        scores = _play(options.out.with_suffix(".json"), options.homes, rules)
        changed = {
            name: options[name]
            for name in ("homes", *rules)
            if options[name] != parser.get_default(name)
        }
        said = [f"--{name} {value}" for name, value in changed.items()]
        command = " ".join(["python -m tools.patrols", *said])
        checksum = NetworkPolicy.identify(find_trained(_NETWORK))
        write_whole(options.out, make_table(scores, command, rules, checksum).encode())
        print(options.out)


def _play(path: Path, num_homes: int, rules: Mapping[str, int]) -> _Scores:
    """Play the homes that are not in a file yet, and return the scores of all by home."""
    kept = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    scores = kept["homes"] if kept.get("rules") == rules else {}
    finder = ObjectFinder.load(_NETWORK)
    for number in range(num_homes):
        if str(number) not in scores:
            home = PatrolledHome.make(rules["seed"], number, rules["days"])
            scores[str(number)] = {
                name: [round(score, _DIGITS) for score in home.patrol(look, rules["looks"], finder)]
                for name, look in make_patrols(finder, number).items()
            }
            content = json.dumps({"rules": rules, "homes": scores}, indent=1)
            write_whole(path, f"{content}\n".encode())
    return {str(number): scores[str(number)] for number in range(num_homes)}


def make_table(scores: _Scores, command: str, rules: Mapping[str, int], checksum: str) -> str:
    """Write the page of scores: by home and patrol, nats and share of right answers."""
    patrols = list(next(iter(scores.values())))
    table = {name: np.array([home[name] for home in scores.values()]) for name in patrols}
    rows = []
    for name, values in table.items():
        compared = ["", ""]
        if name != COMPARED:
            change = table[COMPARED] - values
            compared = [
                format_difference(Difference.of(change[:, column]), ".3f") for column in (0, 1)
            ]
        means = [f"{mean:.3f}" for mean in values.mean(axis=0)]
        rows.append([name, *means, *compared])
    header = ["patrol", "nats", "right", f"{COMPARED} minus it: nats [95 %]", "right [95 %]"]
    about = _ABOUT.format(
        command=command,
        hours=24 * ROUND // STEPS_PER_DAY,
        asked=STEPS_PER_DAY // ASKED,
        how="bootstrap" if len(scores) >= FEWEST_RESAMPLED else "t intervals",
        days=rules["days"],
        looks=rules["looks"],
    )
    made = f"Network `{_NETWORK}`: SHA-256 `{checksum}`."
    return f"{about}\n\n{len(scores)} homes.\n\n{join_table(header, rows)}\n{made}\n"


if __name__ == "__main__":
    run_main(main)
