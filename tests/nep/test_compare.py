"""`python -m nep.compare`: paired differences by hand, and runs that cannot be compared."""

import re
from dataclasses import replace

import numpy as np
import pytest

from nep.compare import compare, main
from nep.evaluate import main as evaluate
from nep.report.results import Results, ScoreSummary

CONFIG = {"num_homes": 2, "seed": 0, "policies": ["a"]}


def make_results(config, units=None, **policies) -> Results:
    """Homes that take these numbers of looks."""
    summaries = {
        name: ScoreSummary(np.array(homes, dtype=float)[:, None], {}, units=units)
        for name, homes in policies.items()
    }
    return Results("command", config, {}, {"find_object": summaries})


def test_differences_by_hand():
    first = make_results(CONFIG, a=(4, 6), b=(3, 5))
    second = make_results(CONFIG | {"policies": ["a", "c"]}, a=(4, 4), c=(2, 5))
    lines = compare(first, second).splitlines()
    assert lines[0] == "## Find Object, 2 homes x 1 steps, less is better"
    # With itself: 0 and -2. The best of the first run is b, with fewer looks: c has -1 and 0.
    # Errors 1 and .5, t of one degree 12.706; detectable is 14.083 of them.
    assert lines[4] == "| a | a | 4.00 | 5.00 | -1.00 [-13.71, +11.71] | 14.08 |"
    assert lines[5] == "| c | b | 3.50 | 4.00 | -0.50 [-6.85, +5.85] | 7.04 |"


def test_what_is_new_is_compared_with_no_oracle():
    """An oracle reads the true home: to be behind it says nothing of a policy."""
    first = make_results(CONFIG, oracle=(1, 1), ceiling=(1, 2), a=(4, 6))
    second = make_results(CONFIG | {"policies": ["c"]}, c=(2, 5))
    assert compare(first, second).splitlines()[4].startswith("| c | a | 3.50 | 5.00 |")
    alone = make_results(CONFIG, oracle=(1, 1))
    assert compare(alone, second).splitlines()[4].startswith("| c | oracle | 3.50 | 1.00 |")


def test_replays_of_a_recording_are_one_unit():
    # Replays of home a differ by -1 and -3, of b by -2 and -4: means -2 and -3, error .5.
    units = ("a", "a", "b", "b")
    config = {"num_homes": 4}
    first = make_results(config, units, a=(5, 5, 5, 5))
    second = make_results(config, units, a=(4, 2, 3, 1))
    assert "-2.50 [-8.85, +3.85] | 7.04 |" in compare(first, second)
    other = make_results(config, ("a", "b", "b", "b"), a=(4, 2, 3, 1))
    with pytest.raises(ValueError, match=r"play in the same homes to be paired"):
        compare(first, other)


def test_other_homes_and_other_tasks_are_refused():
    first = make_results(CONFIG, a=(4, 6))
    with pytest.raises(ValueError, match=r"same homes and rules, got seed 0 and 1\. Evaluate with"):
        compare(first, make_results(CONFIG | {"seed": 1}, a=(4, 4)))
    with pytest.raises(ValueError, match=r"got home None and 3\."):
        compare(first, make_results(CONFIG | {"home": 3}, a=(4, 4)))
    other = replace(first, config=CONFIG | {"first_home": "a1"}, versions={"numpy": "3.0"})
    with pytest.raises(
        ValueError,
        match=r"first_home None and 'a1'. All settings are equal.* and versions.* numpy None",
    ):
        compare(first, other)
    other = replace(first, tasks={"predict_location": first.tasks["find_object"]})
    with pytest.raises(ValueError, match=r"share a task, got find_object and predict_location"):
        compare(first, other)
    for other in (make_results(CONFIG, a=(4, 6, 7)), make_results(CONFIG)):  # edited
        with pytest.raises(ValueError, match=r"must have played find_object in as many homes"):
            compare(first, other)


def test_the_setting_that_differs_is_named_before_checksums():
    home = {"looks": "policy", "dynamics": {"name": "paper", "move_share": 0.05}}
    config = CONFIG | {"homes": {"home": home, "prior": 64 * "a"}, "first_home": 64 * "1"}
    first = make_results(config, a=(4, 6))
    other = home | {"dynamics": {"name": "paper", "move_share": 0.2}}
    homes = config["homes"] | {"home": other}
    with pytest.raises(
        ValueError, match=r"got homes\.home\.dynamics\.move_share 0\.05 and 0\.2\. Evaluate with"
    ):
        compare(first, make_results(config | {"homes": homes, "first_home": 64 * "2"}, a=(4, 6)))
    homes = config["homes"] | {"prior": 64 * "b"}
    with pytest.raises(
        ValueError, match=r"homes\.prior aaaaaaaa\.\.\. \(a checksum\) and bbbbbbbb"
    ):
        compare(first, make_results(config | {"homes": homes}, a=(4, 6)))


@pytest.mark.slow
def test_two_runs_of_the_command_line(tmp_path, capsys):
    small = ["--num_homes", "2", "--steps", "4", "--tasks", "find_object"]
    paths = []
    for who in ("bayesian", "ceiling"):
        evaluate(["--out", str(tmp_path / who), *small, "--policies", "random", who])
        paths.append(str(tmp_path / who / "results.json"))
    capsys.readouterr()
    main(paths)
    out = capsys.readouterr().out
    assert re.search(
        r"\| random \| random \| [\d.]+ \| [\d.]+ \| \+0\.00 \[\+0\.00, \+0\.00\]", out
    )
    assert re.search(r"\| ceiling \| (bayesian|random) \|", out)
    with pytest.raises(SystemExit):
        main([paths[0], str(tmp_path / "no.json")])
    assert "results must be a file that can be read as JSON" in capsys.readouterr().err
