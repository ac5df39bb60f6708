"""Options of all commands: spellings, names, homes and policies of one's own."""

import subprocess
import sys
from pathlib import Path

import pytest

from simulator.collect import __main__ as collect_module
from simulator.command_line import (
    add_home_arguments,
    add_worker_arguments,
    choose,
    make_parser,
    normalise,
    one_line_errors,
    parse,
    pick,
)
from simulator.home_options import HomeOptions
from simulator.snapshots.shards import load_manifest
from simulator.world.config import HomeConfig
from simulator.world.sensing import MissesPerType

ROOT = Path(__file__).parents[2]


def make(prefix=""):
    parser = make_parser("command", "A command.")
    add_home_arguments(parser)
    add_worker_arguments(parser, workers=1)
    parser.add_argument("--policies", type=tuple[str, ...], default=("all",))
    return parser


@pytest.mark.parametrize(
    ("typed", "read"),
    [
        (["--step-seconds", "60"], ["--step_seconds=60"]),
        (["--by-day"], ["--by_day=true"]),
        (["--by_day", "--workers", "2"], ["--by_day=true", "--workers=2"]),
        (["--by_day", "false"], ["--by_day=false"]),
        (["--home.no-dynamic-nodes"], ["--home.dynamic_nodes=false"]),
        (["--trace", "a", "b c"], ['--trace=["a", "b c"]']),
        (["--trace=[a, b]"], ["--trace=[a, b]"]),
        (["--trace=[a]b"], ['--trace=["[a]b"]']),  # a name, not a list
        (["--policies", "x", "--policies", "y:Z"], ['--policies=["x", "y:Z"]']),
        (["--home.rooms", "kitchen"], ['--home.rooms=["kitchen"]']),
        (
            ["--home.dynamics", "paper"],
            ["--home.dynamics=simulator.world.paper_dynamics.PaperDynamics"],
        ),
        (["--homes", "recorded"], ["--homes=simulator.trace.source.RecordedSource"]),
        (
            ["--home.dynamics", "PaperDynamics"],
            ["--home.dynamics=PaperDynamics"],
        ),  # a class's own name
        (["--homes", "own.Homes", "--homes.size", "3"], ["--homes=own.Homes", "--homes.size", "3"]),
        (["--out", "-1", "file"], ["--out", "-1", "file"]),
    ],
)
def test_options_are_read_as_they_are_typed(typed, read):
    assert normalise(make(), typed) == read


def test_every_rule_of_a_home_is_an_option():
    options = parse(
        make(),
        (
            "--home.furniture_per_room 6 --home.detection_error=0.1 --home.rooms kitchen "
            "--home.sensing misses_per_type --home.sensing.rates.mug 0.5"
        ).split(),
    )
    source = HomeOptions(**pick(options, HomeOptions)).make()
    assert source.home == HomeConfig(
        rooms=("kitchen",),
        furniture_per_room=6,
        detection_error=0.1,
        sensing=MissesPerType(rates={"mug": 0.5}),
    )
    assert source.describe()["home"]["sensing"]["name"] == "misses_per_type"


@pytest.mark.parametrize(
    ("typed", "status", "message"),
    [
        (["--home.move_share", "7"], 1, "move_share must lie in [0, 1], got 7.0."),
        (["--workers", "many"], 2, "Parser key \"workers\": Expected a <class 'int'>."),
        (["--bogus", "1"], 2, "unrecognized arguments: --bogus"),
        (
            ["--homes", "nowhere"],
            1,
            "--homes must be one of sampled, recorded, paper, mixed, lived_in, or",
        ),
        (["--home.dynamics=abstrct"], 1, "import path of a class, got 'abstrct'. Choose one."),
        (["--homes", "nowhere.Homes"], 2, "No module named 'nowhere'"),
    ],
)
def test_bad_options_are_one_line(typed, status, message, capsys):
    with pytest.raises(SystemExit) as stop, one_line_errors():
        parse(make(), typed)
    line = capsys.readouterr().err if status == 2 else str(stop.value.code)
    assert (stop.value.code == 2) is (status == 2)
    assert line.startswith("error: ")
    assert message in line
    assert "\n" not in line.strip()


def test_a_command_is_chosen_by_its_name(capsys):
    def play(arguments):
        """Play a game."""
        if arguments:
            raise ValueError("chess is not known")
        return 0

    assert choose("prog", {"play": play}, ["play"]) == 0
    assert choose("prog", {"play": play}, ["--help"]) == 0
    assert "play        Play a game." in capsys.readouterr().out
    assert choose("prog", {"play": play}, ["play", "chess"]) == 1
    assert choose("prog", {"play": play}, ["sing"]) == 2
    assert "command must be one of play, got 'sing'" in capsys.readouterr().err


OWN = '''
from dataclasses import replace

from simulator import Policy, SampledHomes, SampledSource


class Mixed(SampledSource):
    """Homes of one, two and four rooms in turn."""

    def __init__(self, prior, home, most: int = 4):
        super().__init__(prior, home)
        self.most = most

    def make(self, streams):
        rooms = [min(2 ** (home % 3), self.most) for home in streams.homes]
        rules = [replace(self.home, rooms=self.home.rooms[:count]) for count in rooms]
        return SampledHomes(self.prior, rules, streams)

    def describe(self):
        return {**super().describe(), "source": "mixed", "most": self.most}


class First(Policy):
    """Always says the first furniture node."""

    def scores(self, memory, queries):
        scores = memory.is_furniture[queries.home].astype(float)
        scores[:, 0] = 2.0
        return scores
'''


@pytest.fixture
def own(tmp_path, monkeypatch):
    (tmp_path / "own_homes.py").write_text(OWN)
    monkeypatch.syspath_prepend(tmp_path)
    yield tmp_path
    sys.modules.pop("own_homes", None)


def test_homes_and_a_policy_of_ones_own(own):
    out = own / "data"
    collect_module.main(
        [
            "--homes",
            "own_homes.Mixed",
            "--homes.most",
            "2",
            "--policy",
            "own_homes:First",
            "--num_homes",
            "3",
            "--steps",
            "4",
            "--workers",
            "1",
            "--out",
            str(out),
        ]
    )
    settings = load_manifest(out)["settings"]
    assert settings["homes"]["source"] == "mixed"
    assert settings["homes"]["most"] == 2
    assert settings["policy"] == "own_homes:First"


def test_importing_the_simulator_loads_no_parser():
    code = "import sys, simulator; print('jsonargparse' in sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "False"
