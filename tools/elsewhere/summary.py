"""What finders said of things that go out, summed up by home, and the tables of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy import stats

from tools.elsewhere.questions import Answers  # isort: skip (first, as in the stored checksum)
from nep.report.statistics import FEWEST_RESAMPLED
from nep.report.tables import Difference, format_difference, format_number, join_table

NUM_BINS = 10  # of probabilities, all as wide
# Columns of the tables: title, and how they are written.
_COLUMNS = {
    "said_out": ("said while out", ".2f"),
    "said_in": ("said while in", ".3f"),
    "first_out": ("on top while out", ".2f"),
    "elsewhere_nll": ("NLL of elsewhere", ".3f"),
    "nll": ("NLL of where", ".3f"),
    "others_said": ("others: said", ".3f"),
    "others_nll": ("others: NLL of where", ".3f"),
}
_COMPARED = ("elsewhere_nll", "nll", "others_nll")

Summary = Mapping[str, Any]


def summarise(answers: Answers) -> dict[str, Any]:
    """Sum up what was said in one home; nan where there was nothing of a kind."""
    goes_out, is_out = answers.goes_out, answers.is_out & answers.goes_out
    is_in, num_own = goes_out & ~is_out, int(goes_out.sum())
    return {
        "num_questions": num_own,
        "num_out": int(is_out.sum()),
        "said_out": _average(answers.said[is_out]),
        "said_in": _average(answers.said[is_in]),
        "first_out": _average(answers.is_first[is_out]),
        "elsewhere_nll": _average(answers.elsewhere_nll[goes_out]),
        "nll": _average(answers.nll[goes_out]),
        "others_said": _average(answers.said[~goes_out]),
        "others_nll": _average(answers.nll[~goes_out]),
        "bins": _sum_bins(answers.said[goes_out], is_out[goes_out], np.ones(num_own)),
        "all_bins": _sum_bins(answers.said, answers.is_out, answers.weight),
    }


def _sum_bins(said: np.ndarray, is_out: np.ndarray, weight: np.ndarray) -> list[list[float]]:
    """Return the weight, what was said and what was out of each bin, (3, NUM_BINS)."""
    bins = np.minimum((said * NUM_BINS).astype(int), NUM_BINS - 1)
    sums = [
        np.bincount(bins, weight * values, minlength=NUM_BINS)
        for values in (np.ones(len(said)), said, is_out.astype(float))
    ]
    found: list[list[float]] = np.stack(sums).round(6).tolist()
    return found


def compute_calibration_error(bins: Sequence[Any]) -> float:
    """Return by how much what was said differs from how often it was so, nan of nothing.

    The expected calibration error: the absolute differences of the bins, weighed by the questions
    in each.

    Args:
        bins: of homes, (H, 3, NUM_BINS): questions, sum of what was said, how many were out.
    """
    number, said, out = np.asarray(bins, dtype=float).sum(axis=0)
    return float(np.abs(said - out).sum() / number.sum()) if number.any() else float("nan")


def compute_chance_error(bins: Sequence[Any]) -> float:
    """Return the calibration error to be expected if what was said is right, nan of nothing.

    It is above zero, since the number of things that are out is one of chance in each bin: a mean
    absolute deviation of the binomial distribution with n questions of probability p,
    2 (m + 1) (1 - p) P(m + 1) with m the whole part of n p. Questions about one thing hang
    together, so that it is a lower bound.

    Args:
        bins: as in `compute_calibration_error`.

    Source: De Moivre 1730 (the deviation).
    """
    number, said, _ = np.asarray(bins, dtype=float).sum(axis=0)
    p = np.divide(said, number, out=np.zeros_like(said), where=number > 0).clip(0, 1)
    above = np.floor(said) + 1
    deviation = 2 * above * (1 - p) * stats.binom.pmf(above, number, p)
    return float(deviation.sum() / number.sum()) if number.any() else float("nan")


def make_tables(scores: Mapping[str, Mapping[str, Summary]], minus: str) -> str:
    """Return two Markdown tables of the homes of a kind.

    The first has the means over homes, the second differences from one player.

    Args:
        scores: by home and player; the same players in each.
        minus: the player that all others are compared with.
    """
    players = list(next(iter(scores.values())))
    num_questions = sum(summaries[players[0]]["num_questions"] for summaries in scores.values())
    num_out = sum(summaries[players[0]]["num_out"] for summaries in scores.values())
    rows = []
    for who in players:
        values = {name: _gather(scores, who, name) for name in _COLUMNS}
        bins = [summaries[who]["bins"] for summaries in scores.values()]
        all_bins = [summaries[who]["all_bins"] for summaries in scores.values()]
        errors = [
            compute_calibration_error(bins),
            compute_chance_error(bins),
            compute_calibration_error(all_bins),
        ]
        cells = [format_number(_average(values[name]), _COLUMNS[name][1]) for name in _COLUMNS]
        errors_told = [format_number(error, ".3f") for error in errors]
        rows.append([who, *cells[:5], *errors_told, *cells[5:]])
    titles = [title for title, _ in _COLUMNS.values()]
    header = ["who", *titles[:5], "calibration error", "by chance", "of all things", *titles[5:]]
    compared = []
    for who in players:
        if who != minus:
            cells = []
            for name in _COMPARED:
                change = _gather(scores, who, name) - _gather(scores, minus, name)
                cells.append(_format(change[~np.isnan(change)]))
            compared.append([who, minus, *cells])
    how = "bootstrap" if len(scores) >= FEWEST_RESAMPLED else "t intervals"
    about = (
        f"{len(scores)} homes ({how}), {num_questions} questions about things that go out; at "
        f"{num_out} of them ({num_out / max(num_questions, 1):.0%}) the thing was out."
    )
    names = [f"{_COLUMNS[name][0]} [95 %]" for name in _COMPARED]
    return "\n\n".join(
        [
            about,
            join_table(header, rows).strip(),
            join_table(["who", "minus", *names], compared, num_text=2).strip(),
        ]
    )


def _format(change: np.ndarray) -> str:
    """Return a difference with its interval and what could have been detected."""
    if not len(change):
        return "n/a"
    difference = Difference.of(change)
    text = format_difference(difference, ".3f")
    return f"{text}, d {format_number(difference.detectable, '.3f')}"


def _gather(scores: Mapping[str, Mapping[str, Summary]], who: str, name: str) -> np.ndarray:
    return np.array([summaries[who][name] for summaries in scores.values()], dtype=float)


def _average(values: np.ndarray) -> float:
    """Return the mean of what is known, nan of nothing."""
    known = values[~np.isnan(values.astype(float))]
    return float(known.mean()) if len(known) else float("nan")
