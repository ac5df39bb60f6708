"""Prints the first numbers of README and results/headlines.md: `python -m tools.headlines`."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from nep.games.score_cache import ScoreCache
from nep.report.results import ScoreSummary
from nep.report.statistics import LEVEL, compute_detectable, compute_error, correct_holm
from nep.report.tables import BOUNDED, TOP, Difference, correct_rows, join_table
from nep.reproduce.experiments import MODELS, SETTINGS, Setting
from nep.reproduce.paper_numbers import PAPER_TABLE_1
from nep.reproduce.paper_tables import (
    compute_table,
    find_known,
    list_claims,
    list_shown,
    load_table_1,
)
from sgm.files import read_json
from simulator.command_line import make_parser, one_line_errors, parse
from simulator.process import run_main
from tools.bench.columns import COLUMNS, COMPARED
from tools.bench.comparisons import compare_with_rules
from tools.kitchens.robot import compute_calibration_error

# Kinds of homes in README and results/headlines.md, of those of results/any_home.md.
_KINDS = {
    "paper-32": "the paper's homes",
    "routine": "people with routines",
    "mixed": "a mixture of homes",
    "household-hour-200": "five scripted households, 200 hours",
}
_FIRST_KINDS = ("routine", "household-hour-200")  # those that README begins with
# Of the questions of results/kitchens.md.
_POOLS = {
    "seen": "two real kitchens, what was seen",
    "in use": "two real kitchens, what has just been moved",
}
_COLUMNS = ("location ↑", "likelihood ↑", "find ↓")
_NETWORK = "any_home"
_WANTED = 0.01  # first guesses: what a reader would want told apart


def make_table_1(results: Mapping[Setting, Mapping[str, ScoreSummary]]) -> str:
    """Return Table 1, in brackets the paper's own numbers."""
    header = ["", "knows"]
    for title in _COLUMNS:
        header += [f"{title} {nodes}" if nodes == "on" else nodes for nodes in ("on", "off")]
    best = {
        setting: _find_best(setting, {t: s for t, s in scores.items() if not find_known(t)})
        for setting, scores in results.items()
    }
    rows = []
    for title, shown in list_shown(results[SETTINGS[0]]).items():
        cells = [shown, find_known(title)]
        for setting in SETTINGS:
            form = ".2f" if setting.task == "find_object" else ".3f"
            cell = _write(float(results[setting][title].home_values.mean()), form)
            cell = f"**{cell}**" if best[setting] == title else cell
            if title == TOP and setting.metric.name not in BOUNDED:
                cell = "no bound"
            if title in PAPER_TABLE_1[setting.name]:
                cell += f" ({_write(PAPER_TABLE_1[setting.name][title][0], form)})"
            cells.append(cell)
        rows.append(cells)
    return join_table(header, rows, num_text=2)


def say_power(results: Mapping[Setting, Mapping[str, ScoreSummary]]) -> str:
    """Say what Table 1 could have told apart."""
    scores = results[SETTINGS[0]]
    values = scores["NEP-HEAT"].home_values - scores["NEP-GCN"].home_values
    spread = compute_error(values)[0] * math.sqrt(len(values))
    needed = len(values)
    while compute_detectable(_spread_over(needed, spread)) > _WANTED:
        needed += 1
    return (
        f"With one training and {len(values)} homes, a true difference of "
        f"{_write(compute_detectable(values), '.3f')} first guesses between two networks would be "
        f"found with 80 % power. Finding {_write(_WANTED, '.2f')} takes {needed} homes. How much "
        "trainings differ comes on top."
    )


def say_order(claims: Mapping[str, Any]) -> str:
    """Say whether the networks differ, over all trainings, and without the prior."""
    found = []
    for by_network in claims["orders"].values():
        homes = {name: np.array([*by_seed.values()]) for name, by_seed in by_network.items()}
        found += [Difference.of(homes[b] - homes[a]) for a, b in combinations(homes, 2)]
    num_decided = sum(p < 1 - LEVEL for p in correct_holm([difference.p for difference in found]))
    changed = claims["switches"]["no prior"]
    without = Difference.of(np.array(changed["heat"]) - np.array(changed["mlp"]))
    low, high = (f"{_write(x, '.3f')}" for x in (without.low, without.high))
    least, most = (
        _write(pick(difference.detectable for difference in found), ".3f") for pick in (min, max)
    )
    return (
        "MLP, GCN and HEAT were trained three times each in four kinds of homes. After Holm's "
        f"correction {num_decided} of {len(found)} differences are decided. The largest is "
        f"{_write(max(abs(difference.mean) for difference in found), '.3f')}, and {least} to "
        f"{most} could have been found. Without the prior, HEAT is ahead of MLP by "
        f"{_write(without.mean, '.3f')} [{low}, {high}] in one training of each."
    )


def say_trainings(setting: Setting, scores: Mapping[str, ScoreSummary]) -> str:
    """Say how networks of several trainings compare in many homes."""
    claims = correct_rows(list_claims(setting, compute_table(setting, scores), scores))
    titles = [model.title for model in MODELS if model.title in scores]
    between = [claim for claim in claims if claim.better in titles and claim.worse in titles]
    decided = [claim for claim in between if claim.verdict != "undecided"]
    num_homes = len(scores[titles[0]].home_values)
    num_trainings = len(scores[titles[0]].by_training)
    means = {
        title: _write(float(summary.home_values.mean()), ".3f") for title, summary in scores.items()
    }
    least, most = (
        _write(pick(claim.difference.detectable for claim in between), ".3f") for pick in (min, max)
    )
    parts = [
        f"Location once more with {num_trainings} trainings of each network in {num_homes} homes: "
        + ", ".join(f"{title} {means[title]}" for title in titles)
        + f"; `adaptive` has {means['adaptive']}.",
        f"Of {len(between)} differences between these networks {len(decided)} "
        f"{'is' if len(decided) == 1 else 'are'} decided after Holm's correction, and {least} to "
        f"{most} could have been found.",
    ]
    for claim in decided:
        pair = (
            (claim.better, claim.worse) if claim.verdict == "holds" else (claim.worse, claim.better)
        )
        ends = sorted(abs(x) for x in (claim.difference.low, claim.difference.high))
        mean, low, high = (_write(x, ".3f") for x in (abs(claim.difference.mean), *ends))
        parts.append(f"{pair[0]} is ahead of {pair[1]} by {mean} [{low}, {high}].")
    return " ".join(parts)


def make_kinds(played: ScoreCache, kitchens: ScoreCache) -> str:
    """Return the table of a network in homes of several kinds, beside the best rule of each."""
    compared = compare_with_rules(played.about, played.scores, _NETWORK)
    rules = {(comparison.game, comparison.column.name): comparison for comparison in compared}
    rows = []
    for game, title in _KINDS.items():
        pairs = [
            (comparison.network_mean, comparison.rule_mean)
            for comparison in (rules[game, column] for column in COMPARED)
        ]
        rows.append([title, *_write_pairs(pairs)])
    for pool, title in _POOLS.items():
        rows.append([title, *_write_pairs(_compare_in_kitchens(kitchens, pool))])
    return join_table(["homes", f"`{_NETWORK}`", "best rule"], rows)


def make_first_rows(played: ScoreCache, kitchens: ScoreCache) -> str:
    """Return four rows for who wants to find things: how often the first place is right."""
    compared = compare_with_rules(played.about, played.scores, _NETWORK)
    rules = {(comparison.game, comparison.column.name): comparison for comparison in compared}
    rows = []
    for game in _FIRST_KINDS:
        pairs = [rules[game, column] for column in (COMPARED[0], COMPARED[-1])]
        guess, looks = ((pair.network_mean, pair.rule_mean) for pair in pairs)
        rows.append([_KINDS[game], *(f"{x:.0%}" for x in guess), *(f"{x:.1f}" for x in looks)])
    for pool, title in _POOLS.items():
        guess = _compare_in_kitchens(kitchens, pool)[0]
        rows.append([title, *(f"{x:.0%}" for x in guess), "", ""])
    header = ["homes", "first place right", "best rule's", "looks until found", "best rule's"]
    return join_table(header, rows)


def say_trust(played: ScoreCache, kitchens: ScoreCache) -> str:
    """Say in one sentence how far the network's probabilities can be believed."""
    most, seen, moved, marked = (f"{error:.0%}" for error in _list_errors(played, kitchens))
    return (
        f"Its probabilities are off by {most} at most on average in simulated homes and by {seen} "
        f"in the kitchens, but by {moved} for what was moved minutes ago: look before you tell. "
        f"Asked with `in_use=True`, they are off by {marked} there."
    )


def _list_errors(played: ScoreCache, kitchens: ScoreCache) -> list[float]:
    """Return the calibration error in simulated homes, the largest, and of each pool.

    The last is that of what has just been moved, asked for as a thing in use.
    """
    errors = [max(players[_NETWORK]["calibration_error"][0] for players in played.scores.values())]
    for pool in (*_POOLS, "marked"):
        errors.append(compute_calibration_error(_sum_kitchens(kitchens, pool)[_NETWORK]["bins"]))
    return errors


def _compare_in_kitchens(kitchens: ScoreCache, pool: str) -> list[tuple[float, float]]:
    """Return first guesses and NLL over all questions: of the network, and of the best rule."""
    sums = _sum_kitchens(kitchens, pool)
    pairs = []
    for name, pick in (("first", max), ("nll", min)):
        means = {who: total[name] / total["number"] for who, total in sums.items()}
        pairs.append((means.pop(_NETWORK), pick(means.values())))
    return pairs


def _sum_kitchens(kitchens: ScoreCache, pool: str) -> dict[str, dict[str, Any]]:
    """Return the sums of every finder over the kitchens that a robot was put in."""
    games = [name for name, told in kitchens.about.items() if told.get("asks") == "robot"]
    sums: dict[str, dict[str, Any]] = {}
    for who in kitchens.scores[games[0]]:
        parts = [kitchens.scores[name][who][pool] for name in games]
        sums[who] = {
            name: np.sum([each[name] for each in parts], axis=0)
            for name in ("number", "first", "nll", "bins")
        }
    return sums


def _write_pairs(pairs: Sequence[tuple[float, float]]) -> list[str]:
    """Return the cells of a network and of a rule, from what each has of every column."""
    forms = [COLUMNS[column].format for column in COMPARED]
    both = zip(*pairs, strict=True)
    return [" / ".join(map(_write, values, forms[: len(values)])) for values in both]


def say_decided(played: ScoreCache, kitchens: ScoreCache) -> str:
    """Say in how many comparisons the network is ahead, and how far its confidence holds."""
    rows = compare_with_rules(played.about, played.scores, _NETWORK)
    counted = [comparison for comparison in rows if comparison.same_as is None]
    decided = [comparison for comparison in counted if comparison.corrected < 1 - LEVEL]
    ahead = sum(comparison.is_ahead for comparison in decided)
    errors = _list_errors(played, kitchens)
    most, seen, moved, marked = (_write(error, ".2f") for error in errors)
    return (
        f"In {len(counted)} comparisons with the best rule in {len(played.about)} kinds of homes, "
        f"the network is ahead in {ahead} and a rule in {len(decided) - ahead}, after Holm's "
        f"correction. Its calibration error is at most {most} in these kinds. In the "
        f"kitchens it is {seen} for what was seen, {moved} for what has just been moved, and "
        f"{marked} if that is asked for with `in_use=True`."
    )


def list_headlines(folder: Path) -> list[str]:
    """Return every paragraph and table of the README that results stand in.

    Args:
        folder: of the stored results.

    Raises:
        ValueError: if a file is missing or damaged.
    """
    table_1, _ = load_table_1(folder / "table_1.json")
    (again,) = load_table_1(folder / "location_200.json")[0].items()
    played = ScoreCache.load_all(folder / "any_home.json", None, [_NETWORK])
    kitchens = ScoreCache.load_all(folder / "kitchens.json", None, [_NETWORK])
    claims = read_json(folder / "claims.json")
    parts: list[Callable[[], str]] = [
        lambda: make_table_1(table_1),
        lambda: say_power(table_1),
        lambda: say_order(claims),
        lambda: say_trainings(*again),
        lambda: make_kinds(played, kitchens),
        lambda: say_decided(played, kitchens),
        lambda: make_first_rows(played, kitchens),
        lambda: say_trust(played, kitchens),
    ]
    return [make().strip() for make in parts]


def _find_best(setting: Setting, scores: Mapping[str, ScoreSummary]) -> str:
    sign = 1 if setting.metric.is_higher_better else -1
    return max(scores, key=lambda title: sign * float(scores[title].home_values.mean()))


def _spread_over(num_homes: int, spread: float) -> np.ndarray:
    """Return values of `num_homes` homes with this standard deviation."""
    values = np.arange(num_homes, dtype=float)
    return values / values.std(ddof=1) * spread


def _write(value: float, form: str) -> str:
    """Write a number without the zero before its point."""
    return format(value, form).replace("0.", ".", 1) if abs(value) < 1 else format(value, form)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line."""
    parser = make_parser(
        "python -m tools.headlines", "Print the first numbers of README, from the stored results."
    )
    parser.add_argument("--results", type=Path, default=Path("results"), help="folder of results")
    with one_line_errors(status=2):
        options = parse(parser, arguments)
        print("\n\n".join(list_headlines(options.results)))


if __name__ == "__main__":
    run_main(main)
