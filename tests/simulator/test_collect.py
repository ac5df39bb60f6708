import json
import os
import resource
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest

from sgm.files import lock_folder
from simulator.collect import folder as collect_module
from simulator.collect.__main__ import main
from simulator.collect.folder import collect
from simulator.collect.settings import CollectConfig
from simulator.snapshots.shards import get_shard_name, load_manifest, load_shard
from simulator.world.config import HomeConfig
from simulator.world.mixture.source import Mixture, MixtureSource
from simulator.world.source import SampledSource

ROOT = Path(__file__).resolve().parents[2]
SMALL = CollectConfig(num_homes=5, steps=4, seed=3)


def read_all(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


def start(out: Path, *arguments: str, homes_per_job: int = 20, **options) -> subprocess.Popen:
    """Run the command line in a process of its own."""
    code = (
        "import sys, simulator.collect.__main__ as c, simulator.collect.folder as f; "
        f"f._HOMES_PER_JOB = {homes_per_job}; c.main(sys.argv[1:])"
    )
    return subprocess.Popen(
        [sys.executable, "-c", code, "--out", str(out), *arguments],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        **options,
    )


@pytest.fixture(scope="module")
def reference(tmp_path_factory) -> dict[str, bytes]:
    """What `SMALL` gives, collected in one go by one process."""
    out = tmp_path_factory.mktemp("reference") / "data"
    collect(SMALL, out, progress=False)
    return read_all(out)


def test_one_shard_per_home_and_a_manifest_that_vouches_for_them(reference):
    manifest = json.loads(reference["manifest.json"])
    assert len(reference) == 6
    assert list(manifest["shards"]) == [f"home_{home:06d}.safetensors" for home in range(5)]
    settings = manifest["settings"]
    assert (settings["num_homes"], settings["steps"], settings["seed"]) == (5, 4, 3)
    assert (settings["policy"], settings["split"]) == ("bayesian", "train")
    assert settings["homes"]["home"]["detection_error"] == 0.25
    assert settings["labels"][:2] == ["house", "floor"]
    assert len({reference[name] for name in manifest["shards"]}) == 5


@pytest.mark.slow
def test_two_workers_give_the_same_bytes(reference, tmp_path, monkeypatch):
    monkeypatch.setattr(collect_module, "_HOMES_PER_JOB", 2)
    collect(SMALL, tmp_path / "data", workers=2, progress=False)
    assert read_all(tmp_path / "data") == reference


@pytest.mark.slow
def test_workers_follow_into_another_folder(tmp_path, monkeypatch):
    """The processes of an earlier call are still in its folder."""
    monkeypatch.setattr(collect_module, "_HOMES_PER_JOB", 1)
    for name in ("first", "second"):
        (tmp_path / name).mkdir()
        monkeypatch.chdir(tmp_path / name)
        collect(replace(SMALL, num_homes=2), Path("data"), workers=2, progress=False)
    first, second = (read_all(tmp_path / name / "data") for name in ("first", "second"))
    assert len(first) == 3
    assert first == second


@pytest.mark.slow
def test_killed_and_started_again_gives_the_same_bytes(tmp_path):
    """SIGKILL in the middle of a collection, once some shards are there."""
    arguments = ["--num_homes", "12", "--steps", "30", "--workers", "1", "--seed", "1"]
    out = tmp_path / "killed"
    process = start(out, *arguments, homes_per_job=1)
    deadline = time.monotonic() + 600
    while len(list(out.glob("*.safetensors"))) < 2 and time.monotonic() < deadline:
        time.sleep(0.005)
    process.send_signal(signal.SIGKILL)
    process.communicate()
    assert process.returncode == -signal.SIGKILL
    finished = {path: path.stat().st_mtime_ns for path in out.glob("*.safetensors")}
    vouched = load_manifest(out)["shards"]
    assert 2 <= len(finished) < 12
    (out / "home_000011.safetensors.123.part").write_bytes(b"half")  # of an earlier process
    main(["--out", str(out), *arguments])
    for path, stamp in finished.items():
        if path.name in vouched:
            assert path.stat().st_mtime_ns == stamp, "a finished house was collected again"
    main(["--out", str(tmp_path / "whole"), *arguments])
    assert read_all(out) == read_all(tmp_path / "whole")


def test_a_finished_collection_is_left_as_it_is(tmp_path, reference):
    collect(SMALL, tmp_path / "data", progress=False)
    stamps = {path: path.stat().st_mtime_ns for path in (tmp_path / "data").iterdir()}
    collect(SMALL, tmp_path / "data", progress=False)
    assert {path: path.stat().st_mtime_ns for path in stamps} == stamps


def test_a_deleted_shard_is_collected_again(tmp_path, reference):
    collect(SMALL, tmp_path / "data", progress=False)
    (tmp_path / "data" / "home_000002.safetensors").unlink()
    collect(SMALL, tmp_path / "data", progress=False)
    assert read_all(tmp_path / "data") == reference


@pytest.mark.parametrize(
    "damage", [lambda content: content[:-9], lambda content: content[:-1] + b"?"]
)
def test_a_truncated_or_altered_shard_is_named_and_kept(tmp_path, reference, damage):
    folder = tmp_path / "data"
    folder.mkdir()
    for name, content in reference.items():
        (folder / name).write_bytes(content)
    bad = folder / "home_000003.safetensors"
    bad.write_bytes(damage(reference[bad.name]))
    before = read_all(folder)
    with pytest.raises(ValueError, match=rf"got .* for {bad}\. .*delete it and collect again"):
        collect(SMALL, folder, progress=False)
    assert read_all(folder) == before


@pytest.mark.parametrize(
    ("other", "named"),
    [
        (CollectConfig(num_homes=6, steps=4, seed=3), "num_homes = 5 instead of 6"),
        (CollectConfig(num_homes=5, steps=4, seed=4), "seed = 3 instead of 4"),
        (CollectConfig(num_homes=5, steps=4, seed=3, policy="random"), "policy = bayesian"),
        (CollectConfig(num_homes=5, steps=4, seed=3, split="val"), "split = train instead of val"),
        (
            CollectConfig(
                num_homes=5,
                steps=4,
                seed=3,
                homes=SampledSource(home=HomeConfig(dynamic_nodes=False)),
            ),
            "homes.home.dynamic_nodes = True instead of False",
        ),
    ],
)
def test_a_folder_of_other_settings_is_refused_and_kept(tmp_path, reference, other, named):
    for name, content in reference.items():
        (tmp_path / name).write_bytes(content)
    message = rf"same settings, got {named}.* in {tmp_path}\. Choose another folder or delete"
    with pytest.raises(ValueError, match=message):
        collect(other, tmp_path, progress=False)
    assert read_all(tmp_path) == reference


def test_another_prior_is_another_setting(tmp_path, tiny_prior):
    prior = tmp_path / "tiny.json"
    tiny_prior.save(prior)
    home = HomeConfig(rooms=("kitchen", "bedroom"))
    collect(
        CollectConfig(num_homes=1, steps=2, homes=SampledSource(home=home)),
        tmp_path / "data",
        progress=False,
    )
    other = CollectConfig(num_homes=1, steps=2, homes=SampledSource(tiny_prior, home))
    with pytest.raises(ValueError, match=r"got homes.prior = \w{64} instead of \w{64} in"):
        collect(other, tmp_path / "data", progress=False)
    collect(other, tmp_path / "tiny", progress=False)
    assert load_manifest(tmp_path / "tiny")["settings"]["homes"]["prior"] == tiny_prior.checksum


def test_a_folder_of_other_files_is_refused_and_kept(tmp_path):
    (tmp_path / "thesis.txt").write_text("years of work")
    with pytest.raises(ValueError, match=r"must be empty or hold a collection, got 'thesis\.txt'"):
        collect(SMALL, tmp_path, progress=False)
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.txt"]


def fail(tmp_path, capsys, *arguments: str) -> str:
    """Run the command line, which must fail without a traceback; return its message."""
    out = tmp_path / "out"
    with pytest.raises(SystemExit) as stop:
        main(["--out", str(out), "--steps", "2", "--workers", "1", *arguments])
    assert isinstance(stop.value.code, str)  # printed to stderr; the exit status is 1
    assert capsys.readouterr().out == ""
    assert not list(tmp_path.glob("out/*.safetensors"))
    return stop.value.code


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--num_homes", "0"], "error: num_homes must be at least 1, got 0. Raise it."),
        (["--steps", "-3"], "error: steps must be at least 1, got -3. Raise it."),
        (["--workers", "0"], "error: workers must be at least 1, got 0. Raise it."),
        (["--seed", "-1"], "error: seed must be non-negative, got -1. Choose 0 or more."),
        (["--policy", "clever"], "got 'clever'. Choose one of these, or"),
        (["--task", "dance"], "relative_likelihood, find_object, got 'dance'. Choose one"),
        (["--split", "all"], "error: split must be one of train, val, test, got 'all'. Choose"),
        (["--home.rooms", "kitchen", "garage"], "got none for 'garage' in the prior"),
        (["--prior", "no/such/file.json"], "'No such file or directory' for no/such/file.json."),
    ],
)
def test_bad_arguments_are_answered_with_a_remedy(tmp_path, capsys, arguments, message):
    found = fail(tmp_path, capsys, *arguments)
    assert message in found
    assert found.endswith(".")


def test_a_malformed_prior_is_answered_with_its_row(tmp_path, capsys, tiny_prior):
    prior = tmp_path / "prior.json"
    data = tiny_prior.to_dict()
    data["placements"][4]["prob"] = -1
    prior.write_text(json.dumps(data))
    found = fail(tmp_path, capsys, "--prior", str(prior))
    assert "placements[4].prob" in found
    assert "got -1" in found
    prior.write_text('{"version": 1,\n "rooms": [}')
    found = fail(tmp_path, capsys, "--prior", str(prior))
    assert f"in {prior}, line 2" in found


def test_an_output_folder_that_is_a_file_is_answered(tmp_path, capsys):
    (tmp_path / "out").write_text("not a folder")
    found = fail(tmp_path, capsys)
    assert "output folder must be one that can be made" in found
    assert found.endswith("Choose another folder.")
    assert (tmp_path / "out").read_text() == "not a folder"


def test_an_unknown_option_ends_with_status_2(tmp_path, capsys):
    with pytest.raises(SystemExit) as stop:
        main(["--out", str(tmp_path / "out"), "--house", "3", "--speed", "9"])
    assert stop.value.code == 2
    assert "--speed" in capsys.readouterr().err


@pytest.mark.slow
def test_a_full_disk_is_answered_and_finished_homes_are_kept(tmp_path):
    """The operating system refuses files above 20 KB, as a full disk refuses any."""
    arguments = ["--num_homes", "3", "--steps", "30", "--workers", "1"]
    limit = 20_000
    full = start(
        tmp_path / "data",
        *arguments,
        homes_per_job=1,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)),
    )
    _, errors = full.communicate(timeout=600)
    assert full.returncode == 1
    assert "Traceback" not in errors
    last = errors.strip().splitlines()[-1]
    assert "disk must take" in last
    assert "home_000000.safetensors. Free some space" in last
    assert last.endswith("finished files are kept.")
    assert [path.name for path in (tmp_path / "data").iterdir()] == ["manifest.json"]
    main(["--out", str(tmp_path / "data"), *arguments])
    main(["--out", str(tmp_path / "whole"), *arguments])
    assert read_all(tmp_path / "data") == read_all(tmp_path / "whole")


def test_a_snapshot_takes_less_than_20_kilobytes(tmp_path):
    collect(CollectConfig(num_homes=1, steps=100), tmp_path, progress=False)
    size = os.path.getsize(tmp_path / "home_000000.safetensors")
    assert size / 100 < 20_000


@pytest.mark.slow
def test_the_module_runs_as_documented(tmp_path):
    command = (
        "--num_homes 1 --steps 2 --policy bayesian --task predict_location --workers 1 "
        "--home.no-dynamic-nodes"
    ).split()
    done = subprocess.run(
        [sys.executable, "-m", "simulator.collect", "--out", str(tmp_path / "data"), *command],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "collecting train snapshots" in done.stderr
    assert not load_manifest(tmp_path / "data")["settings"]["homes"]["home"]["dynamic_nodes"]


def test_more_homes_than_there_are_names_for_are_refused():
    with pytest.raises(ValueError, match=r"num_homes must be at most 1000000, got 10{20}\. Lower"):
        CollectConfig(num_homes=10**20)
    with pytest.raises(ValueError, match=r"num_homes must be .*, got a number of about 400 digits"):
        CollectConfig(num_homes=10**400)


def test_a_folder_in_use_is_refused_and_left_alone(tmp_path):
    config = CollectConfig(num_homes=2, steps=2)
    out = tmp_path / "data"
    collect(config, out, progress=False)
    (out / "home_000001.safetensors").rename(out / "home_000001.safetensors.77.part")
    with lock_folder(out):
        with pytest.raises(
            ValueError, match=r"one command at a time, got another .* at work in .*"
        ):
            collect(config, out, progress=False)
        assert (out / "home_000001.safetensors.77.part").exists()
    collect(config, out, progress=False)
    assert sorted(path.name for path in out.iterdir()) == [
        "home_000000.safetensors",
        "home_000001.safetensors",
        "manifest.json",
    ]


def test_a_complete_collection_may_be_read_by_several_at_once(tmp_path):
    config = CollectConfig(num_homes=2, steps=2)
    collect(config, tmp_path, progress=False)
    before = {path.name: path.stat().st_mtime_ns for path in tmp_path.iterdir()}
    with lock_folder(tmp_path):
        collect(config, tmp_path, progress=False)
        assert (tmp_path / ".lock").exists()
    assert {path.name: path.stat().st_mtime_ns for path in tmp_path.iterdir()} == before
    shard = tmp_path / "home_000001.safetensors"
    shard.write_bytes(shard.read_bytes()[:-1])  # it is checked all the same
    with lock_folder(tmp_path), pytest.raises(ValueError, match=r"home_000001\.safetensors"):
        collect(config, tmp_path, progress=False)


def test_a_lock_that_a_killed_process_left_locks_nobody_out(tmp_path):
    (tmp_path / ".lock").touch()
    collect(CollectConfig(num_homes=1, steps=2), tmp_path, progress=False)
    assert not (tmp_path / ".lock").exists()


class LongLives(MixtureSource):
    """Homes of which a tenth of the questions is kept, where that is more than was asked for."""

    kept_share = 0.1

    def __init__(self, prior=None, home=None):
        super().__init__(prior, home, Mixture(max_places=6, max_objects=8, lives=(10, 60)))


def test_more_is_kept_of_a_long_life(tmp_path):
    collect(CollectConfig(homes=LongLives(), num_homes=8, steps=3), tmp_path, progress=False)
    groups = LongLives().list_groups(range(8))
    lives = {home: group.play_steps for group in groups for home in group.homes}
    kept = {
        home: len(load_shard(tmp_path / get_shard_name(home))["snapshot_time"]) for home in lives
    }
    assert kept == {home: 6 if steps == 60 else 3 for home, steps in lives.items()}
    assert set(lives.values()) == {10, 60}


def test_the_homes_that_are_lived_in_longest_come_first(monkeypatch, tmp_path):
    lives = []

    def fan_out(run, jobs, *_):
        lives.extend(play_steps for *_, play_steps in jobs)
        return ()

    monkeypatch.setattr(collect_module, "fan_out", fan_out)
    mixture = Mixture(lives=(5, 50, 500))
    config = CollectConfig(homes=MixtureSource(mixture=mixture), num_homes=40, steps=5)
    collect(config, tmp_path / "mixed", workers=2, progress=False)
    assert set(lives) == {5, 50, 500}
    assert lives == sorted(lives, reverse=True)
