"""Tables of results, by hand."""

import csv
import io
from dataclasses import replace

import numpy as np
import pytest

from nep.report.results import ScoreSummary
from nep.report.tables import (
    compute_rows,
    format_table,
    make_csv,
    make_markdown,
    make_rich_table,
    tell_few_homes,
)
from simulator.tasks.metrics import METRICS, Metric
from simulator.tasks.registry import TASKS
from simulator.tasks.scores import TaskScores


def make_scores(values) -> ScoreSummary:
    """Scores of two homes; half of the answers right, at confidence 0.75."""
    right = np.array([[True, False], [True, False]])
    share = np.full((2, 2), 0.75)
    return ScoreSummary.of(
        TaskScores(
            np.array(values, dtype=float),
            right,
            ~right,
            right,
            share,
            share,
            2 - right,
            right,
            share,
        )
    )


@pytest.fixture
def looks():
    """Find Object: fewer is better. Means over homes: 4, 3.5, 3 and 2."""
    return {
        "bayesian": make_scores([[3, 5], [4, 4]]),  # homes 4 and 4
        "NEP": make_scores([[2, 2], [5, 5]]),  # homes 2 and 5
        "last_seen_prior": make_scores([[3, 3], [3, 3]]),
        "ceiling": make_scores([[1, 1], [3, 3]]),
    }


def test_rows_by_hand(looks):
    rows = compute_rows(TASKS["find_object"], looks)
    assert [row.policy for row in rows] == ["bayesian", "NEP", "last_seen_prior", "ceiling"]
    nep = rows[1]
    assert (nep.mean, nep.std) == (3.5, 1.5)
    # Home by home against bayesian: -2 and +1, s = 2.1213, error 1.5; t of one degree is 12.7062.
    delta = nep.differences["bayesian"]
    assert (delta.mean, delta.low, delta.high) == pytest.approx((-0.5, -19.559, 18.559), abs=1e-3)
    # (12.7062 + 1.3764) x 1.5
    assert delta.detectable == pytest.approx(21.124, abs=1e-3)
    assert nep.differences["last_seen_prior"].mean == 0.5
    # From 4 (bayesian) to 2 (ceiling): 3.5 is a quarter of the way.
    assert [row.gap_closed for row in rows] == [0, 0.25, 0.5, 1]
    assert nep.metrics == pytest.approx(
        {
            "accuracy": 0.5,
            "away_accuracy": 1,  # what was away was right
            "out_of_place_accuracy": 1,
            "calibration_error": 0.25,  # confidence 0.75, accuracy 0.5
            "nll": -np.log(0.75),
            "candidate_recall": 0.5,
        }
    )
    assert rows[0].differences["bayesian"] is None  # nobody is compared with himself


def test_higher_scores_come_last_where_they_are_better(looks):
    rows = compute_rows(TASKS["predict_location"], looks)
    assert [row.policy for row in rows] == ["ceiling", "last_seen_prior", "NEP", "bayesian"]


def test_without_the_policies_to_compare_with_there_are_no_such_columns(looks):
    rows = compute_rows(TASKS["find_object"], {"NEP": looks["NEP"]})
    header, cells = format_table(TASKS["find_object"], rows)
    assert header == [
        "policy",
        "looks",
        "std",
        "answers right",
        "right if away",
        "right if out of place",
        "ECE",
        "NLL",
        "recall",
    ]
    assert cells == [["NEP", "3.50", "1.50", "0.500", "1.000", "1.000", "0.250", "0.29", "0.500"]]
    assert rows[0].gap_closed is None


def test_markdown_and_csv_say_the_same(looks):
    rows = compute_rows(TASKS["find_object"], looks)
    three = [replace(row, num_homes=3) for row in rows]
    markdown = make_markdown(TASKS["find_object"], three, "Find Object")
    assert markdown.startswith("## Find Object\n\n| policy | looks | std | minus bayesian [95 %] |")
    assert "| NEP | 3.50 | 1.50 | -0.50 [-19.56, +18.56] |" in markdown
    assert "Would be found with 80 % power, if true: minus bayesian 0.00 to 21.12, " in markdown
    assert "too few" not in markdown
    assert "| 25% |" in markdown
    read = list(csv.DictReader(io.StringIO(make_csv({"find_object": rows}))))
    assert [line["policy"] for line in read] == [row.policy for row in rows]
    assert float(read[1]["minus_bayesian_low"]) == pytest.approx(-19.559, abs=1e-3)
    assert float(read[1]["gap_closed"]) == 0.25
    assert read[0]["minus_bayesian"] == ""


def test_two_homes_are_said_to_be_too_few_for_intervals(looks):
    rows = compute_rows(TASKS["find_object"], looks)
    markdown = make_markdown(TASKS["find_object"], rows, "Find Object")
    assert "| policy | looks | std | minus bayesian | minus last_seen_prior |" in markdown
    assert "| NEP | 3.50 | 1.50 | -0.50 | +0.50 |" in markdown
    assert markdown.endswith("\n2 homes are too few for intervals. Play in 3 or more.\n")
    table = make_rich_table(TASKS["find_object"], rows, "Find Object")
    assert table.caption == "2 homes are too few for intervals. Play in 3 or more."


def test_replays_of_one_recording_are_one_home(looks):
    played = {name: replace(summary, units=("ann", "ann")) for name, summary in looks.items()}
    rows = compute_rows(TASKS["find_object"], played)
    assert tell_few_homes(rows).startswith("One home is too few for spread and intervals")


def test_one_entry_makes_a_column_everywhere(monkeypatch):
    """Hits@2 of ranks 1, 2, 1, 2: all of them."""
    hits = Metric("hits_at_2", "hits@2", ".1%", True, lambda scores: (scores.rank <= 2).mean())
    monkeypatch.setitem(METRICS, "hits_at_2", hits)
    rows = compute_rows(TASKS["find_object"], {"NEP": make_scores([[2, 2], [5, 5]])})
    header, cells = format_table(TASKS["find_object"], rows)
    assert (header[-1], cells[0][-1]) == ("hits@2", "100.0%")
    assert make_csv({"find_object": rows}).splitlines()[0].endswith(",candidate_recall,hits_at_2")


def test_a_single_home_has_neither_interval_nor_spread():
    """Nobody knows how far another home would be from it."""
    one_home = [
        TaskScores(
            np.array([[looks]]),
            *(np.array([[value]]) for value in (True, True, False)),
            np.array([[0.75]]),
            np.array([[0.75]]),
            np.array([[1]]),
            np.array([[False]]),
            np.array([[-1]]),
        )
        for looks in (4.0, 3.0)
    ]
    scores = dict(zip(("bayesian", "NEP"), map(ScoreSummary.of, one_home), strict=True))
    rows = compute_rows(TASKS["find_object"], scores)
    header, cells = format_table(TASKS["find_object"], rows)
    of_nep = dict(zip(header, cells[1], strict=True))
    assert of_nep["looks"] == "3.00"
    assert "std" not in of_nep
    assert of_nep["minus bayesian"] == "-1.00"
    told = make_markdown(TASKS["find_object"], rows, "Find Object")
    assert told.endswith("\nOne home is too few for spread and intervals. Play in 3 or more.\n")
    assert of_nep["right if away"] == "n/a"  # it was not away

    (row,) = [row for row in csv.DictReader(io.StringIO(make_csv({"find_object": rows})))][1:]
    assert (row["minus_bayesian"], row["minus_bayesian_low"], row["std"]) == ("-1.0", "", "")
