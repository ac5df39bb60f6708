import pytest

from sgm import SceneGraphMemory
from sgm.memory.memory_event import read_events
from simulator.box_world.__main__ import main

SMALL = (
    "--home.furniture_per_room 2 --home.objects_per_furniture 2 --home.dynamics paper --quiet"
).split()


@pytest.mark.slow
def test_play_prints_finds_and_saves_the_memory(tmp_path, capsys):
    arguments = ["play", "--steps", "2", "--save", str(tmp_path / "week"), "--ask", "mug", *SMALL]
    assert main(arguments) == 0
    printed = capsys.readouterr().out
    assert "4 rooms, 8 pieces of furniture, 16 things, 2 steps" in printed
    robots = [line.split()[0] for line in printed.splitlines()[1:5]]
    assert robots == ["robot", "eyes", "all", "perfect"]
    memory = SceneGraphMemory.load(tmp_path / "week" / "home.sgm")
    assert memory.time == 2
    assert memory.num_furniture == 8
    assert len(memory.descriptions) > 3
    looks = [line for line in read_events(tmp_path / "week" / "home.sgm") if line.kind == "look"]
    assert len(looks) >= 4
    assert main(arguments) == 1
    assert "save must be a folder without a memory" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["play", "--steps", "0"], "steps must be at least 1, got 0"),
        (["play", "--position_sd", "-1"], "position_sd must be at least 0, got -1"),
        (["play", "--seed", "-1"], "seed must be"),
    ],
)
def test_bad_input_is_one_line(arguments, message, capsys):
    assert main([*arguments, *SMALL]) == 1
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1


def test_help_names_the_command(capsys):
    assert main(["--help"]) == 0
    assert "play" in capsys.readouterr().out
