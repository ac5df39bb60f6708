"""Command lines: record, check, collect from traces; bad input is one line and status 1."""

import json

import numpy as np
import pytest

from simulator.collect import __main__ as collect
from simulator.snapshots.shards import load_manifest, load_shard
from simulator.trace import load_trace
from simulator.trace.__main__ import main


def test_record_and_check(tmp_path, capsys):
    out = tmp_path / "traces"
    arguments = ["record", "--num_homes", "2", "--steps", "3", "--seed", "5", "--out", str(out)]
    assert main([*arguments, "--home.no-dynamic-nodes", "--step-seconds", "60"]) == 0
    trace = load_trace(out / "home_000001")
    assert trace.truth.step_seconds == 60
    assert not trace.truth.config.dynamic_nodes
    assert trace.end_s == 180
    assert main(["check", str(out)]) == 0
    text = capsys.readouterr().out
    assert "home_000000: 4 rooms, 32 furniture nodes, 192 objects" in text
    assert "2 homes of at least 3 steps\n" in text
    assert main([*arguments]) == 1
    assert "error: folder must not hold another trace" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["record", "--steps", "0", "--out", "x"], "steps must be at least 1, got 0"),
        (["record", "--num_homes", "0", "--out", "x"], "homes must be one or more"),
        (["record", "--step-seconds", "-1", "--out", "x"], "step must be a number of seconds"),
        (["record", "--step-seconds", "1e308", "--out", "x"], "seconds <= 1e+09, got 1e+308"),
        (
            ["record", "--prior", "none.json", "--out", "x"],
            "prior must be default or household, or a file",
        ),
        (["check", "nowhere"], "trace must be a folder with layout.json"),
        (["import", "procthor", "none.json"], "Give --out or --memory"),
        (["import", "procthor", "none.json", "--out", "x"], "house must be a file that exists"),
    ],
)
def test_bad_arguments_are_one_line(arguments, message, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(arguments) == 1
    error = capsys.readouterr().err
    assert error.startswith("error: ")
    assert message in error
    assert error.count("\n") == 1


def test_collecting_from_a_trace(write_home, tmp_path):
    home, out = write_home(), tmp_path / "out"
    arguments = ["--trace", str(home), "--step-seconds", "1800", "--workers", "1", "--belief"]
    collect.main([*arguments, "--out", str(out)])
    manifest = load_manifest(out)
    assert manifest["settings"]["num_homes"] == 1
    assert manifest["settings"]["steps"] == 12
    assert manifest["settings"]["homes"]["checksums"] == [load_trace(home).checksum]
    assert str(tmp_path) not in json.dumps(manifest)
    shard = load_shard(out / "home_000000.safetensors")
    assert shard["snapshot_furniture_answers"].shape == (12, 3)
    assert shard["snapshot_furniture_answers"].any(axis=1).all()
    assert shard["snapshot_furniture_extra_belief"].shape[:2] == (12, 3)
    labels = manifest["settings"]["labels"]
    assert [labels[i] for i in shard["furniture_label"]] == ["table", "shelf", "shelf"]
    collect.main([*arguments, "--out", str(out)])  # finished: the same again
    with pytest.raises(SystemExit, match="must hold a collection of the same settings"):
        collect.main([*arguments, "--steps", "3", "--out", str(out)])


def test_collecting_a_simulated_home_again(tmp_path):
    """Snapshots of a replay hold what those of the simulated home hold."""
    traces, out = tmp_path / "traces", tmp_path / "out"
    main(["record", "--num_homes", "2", "--steps", "4", "--split", "train", "--out", str(traces)])
    collect.main(["--trace", str(traces), "--workers", "1", "--out", str(out / "a")])
    collect.main(["--num_homes", "2", "--steps", "4", "--workers", "1", "--out", str(out / "b")])
    for name in ("home_000000.safetensors", "home_000001.safetensors"):
        replayed, played = load_shard(out / "a" / name), load_shard(out / "b" / name)
        assert replayed.keys() == played.keys()
        for key in (
            "snapshot_furniture_answers",
            "snapshot_furniture_prior",
            "furniture_version_num_observed",
        ):
            np.testing.assert_array_equal(replayed[key], played[key])
        for key in ("object_version_num_observed", "edge_version_num_true"):  # numbered otherwise
            np.testing.assert_array_equal(np.sort(replayed[key]), np.sort(played[key]))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--by-day"], "step_seconds, by_day and replays must come with trace"),
        (["--trace", "{home}", "--policy", "ceiling"], "is unknown of the homes, got ceiling"),
        (["--trace", "{home}", "--steps", "7"], "at most the 6 steps of 3600 s"),
        (["--trace", "{home}", "--step-seconds", "0"], "step must be a number of seconds > 0"),
        (["--trace", "{home}", "--by-day"], "must cover a day from midnight to midnight"),
        (
            ["--trace", "{home}", "--num_homes", "2"],
            "must be one of the 1 that were recorded, got 1",
        ),
        (["--trace", "nowhere"], "trace must be a folder with layout.json"),
    ],
)
def test_what_cannot_be_collected_makes_no_folder(write_home, tmp_path, arguments, message):
    home = write_home()
    arguments = [text.format(home=home) for text in arguments]
    with pytest.raises(SystemExit, match=message):
        collect.main([*arguments, "--workers", "1", "--out", str(tmp_path / "out")])
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("form", ["csv", "xml"])
def test_a_format_that_is_none_is_told_all_that_there_are(form, capsys):
    from simulator.trace.__main__ import main

    assert main(["import", form, "seen.csv"]) == 2
    said = " ".join(capsys.readouterr().err.split())
    for known in ("procthor", "bag", "hd_epic", "homer"):
        assert known in said
    assert f"got '{form}'" in said
    assert "a folder with layout.json and events.csv is a trace" in said
