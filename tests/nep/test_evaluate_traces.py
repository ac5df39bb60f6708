"""Policies compared in recorded homes from the command line."""

import json
import shutil

import pytest

from nep.compare import compare
from nep.evaluate import main
from nep.report.results import Results
from sgm.prior.prior_graph import PriorGraph
from simulator.trace import record_homes, save_trace
from simulator.world.config import HomeConfig
from simulator.world.sampled_homes import SampledHomes
from simulator.world.streams import Streams

LAYOUT = """{"rooms": ["kitchen"], "furniture": [
 {"name": "table", "room": "kitchen"}, {"name": "bench", "room": "kitchen"}]}"""
EVENTS = ["time_s,object,furniture,relation"] + [
    f"{hour * 3600},robot {hour % 2},{('table', 'bench')[hour % 3 > 0]},onTop" for hour in range(7)
]


@pytest.fixture
def home(tmp_path):
    folder = tmp_path / "home"
    folder.mkdir()
    (folder / "layout.json").write_text(LAYOUT)
    (folder / "events.csv").write_text("\n".join(EVENTS))
    return folder


def load_results(folder):
    return json.loads((folder / "results.json").read_text())


def test_everybody_who_can_plays_in_recorded_homes(home, tmp_path, capsys):
    out = tmp_path / "out"
    main(["--trace", str(home), "--tasks", "find_object", "--out", str(out)])
    results = load_results(out)
    assert (results["config"]["num_homes"], results["config"]["steps"]) == (1, 6)
    assert results["config"]["homes"]["step_seconds"] == [3600]
    for task in results["tasks"].values():
        assert "oracle" in task["policies"]
        assert "ceiling" not in task["policies"]  # nobody knows the true dynamics
    assert "Find Object, 1 recorded home x 6 steps" in capsys.readouterr().out


@pytest.mark.slow
def test_a_replay_ends_with_the_scores_of_the_simulated_homes(tmp_path):
    homes = SampledHomes(PriorGraph.default(), HomeConfig(), Streams(3, "test", range(2)))
    for trace in record_homes(homes, 5):
        save_trace(trace, tmp_path / "traces" / trace.name)
    shared = ["--policies", "bayesian", "ceiling", "--tasks", "predict_location", "--seed", "3"]
    main([*shared, "--trace", str(tmp_path / "traces"), "--out", str(tmp_path / "a")])
    main([*shared, "--num_homes", "2", "--steps", "5", "--out", str(tmp_path / "b")])
    main(
        [
            *shared,
            "--trace",
            str(tmp_path / "traces"),
            "--out",
            str(tmp_path / "c"),
            "--workers",
            "2",
        ]
    )
    assert load_results(tmp_path / "c")["tasks"] == load_results(tmp_path / "a")["tasks"]
    replayed, played = load_results(tmp_path / "a"), load_results(tmp_path / "b")
    for of_policy in replayed["tasks"]["predict_location"]["policies"].values():
        assert len(set(of_policy.pop("units"))) == 2  # simulated homes are numbered, not named
    assert replayed["tasks"] == played["tasks"]
    assert played["config"]["homes"]["source"] == "sampled"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--policies", "ceiling"], "is unknown of the homes, got ceiling, which reads"),
        (["--steps", "7"], "at most the 6 steps of 3600 s"),
        (["--homes", "mixed"], "homes must be left out with trace, got both"),
        (["--num_homes", "2"], "home must be one of the 1 that were recorded, got 1"),
        (["--step-seconds", "-1"], "step must be a number of seconds > 0, got -1.0"),
    ],
)
def test_bad_arguments(home, tmp_path, capsys, arguments, message):
    with pytest.raises(SystemExit):
        main(["--trace", str(home), *arguments, "--out", str(tmp_path / "out")])
    assert message in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_replays_of_a_recording_are_one_unit_in_results(home, tmp_path):
    main(
        [
            "--trace",
            str(home),
            "--replays",
            "3",
            "--steps",
            "3",
            "--out",
            str(tmp_path / "out"),
            "--tasks",
            "predict_location",
            "--policies",
            "random",
        ]
    )
    played = Results.load(tmp_path / "out" / "results.json").tasks["predict_location"]["random"]
    assert len(played.values) % 3 == 0
    assert len(set(played.units)) == len(played.values) // 3
    assert [played.units[0]] * 3 == list(played.units[:3])


def test_a_copy_is_the_same_household_and_a_name_says_nothing(home, tmp_path, capsys):
    """Two runs in one recording under two names are paired; two copies are one unit."""
    other = shutil.copytree(home, tmp_path / "other")
    shared = ["--tasks", "predict_location", "--policies", "random", "bayesian", "--steps", "3"]
    for folders in ([home], [other], [home, other]):
        main(
            [
                *shared,
                "--trace",
                *map(str, folders),
                "--out",
                str(tmp_path / f"{len(folders)}{folders[0].name}"),
            ]
        )
    first, second, both = (
        Results.load(tmp_path / name / "results.json") for name in ("1home", "1other", "2home")
    )
    assert "minus" not in compare(first, second)
    assert len(set(both.tasks["predict_location"]["random"].units)) == 1
    assert "2 plays of 1 recorded home x 3 steps" in " ".join(capsys.readouterr().out.split())


def test_fewer_homes_than_were_recorded(home, tmp_path, capsys):
    other = shutil.copytree(home, tmp_path / "other")
    options = ["--tasks", "predict_location", "--policies", "random", "--num_homes", "1"]
    main(["--trace", str(home), str(other), *options, "--out", str(tmp_path / "out")])
    assert load_results(tmp_path / "out")["config"]["num_homes"] == 1
    assert "1 recorded home x 6 steps" in " ".join(capsys.readouterr().out.split())


def test_days_that_were_recorded_in_part_are_named(home, tmp_path, capsys):
    layout = json.loads((home / "layout.json").read_text())
    layout |= {"start": "2026-03-09T18:00", "end_s": 36 * 3600}  # six hours, a day, six hours
    (home / "layout.json").write_text(json.dumps(layout))
    options = ["--by_day", "true", "--tasks", "predict_location", "--policies", "random"]
    main(["--trace", str(home), *options, "--out", str(tmp_path / "out")])
    told = " ".join(capsys.readouterr().out.split())
    assert "Left out: home 2026-03-09: only 25% of the day was recorded" in told
    assert "Left out: home 2026-03-11" in told
    assert "Left out: home 2026-03-10" not in told
