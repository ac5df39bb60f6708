"""docs/box_world.md: its commands take its options."""

import re
from pathlib import Path

import pytest

from simulator.box_world.__main__ import main

PAGE = (Path(__file__).parents[3] / "docs" / "box_world.md").read_text("utf-8")


def test_the_commands_have_the_options_of_the_page(capsys):
    named = set(re.findall(r"--(\w+)`|`--(\w+)", PAGE))
    options = {name for pair in named for name in pair if name} - {"home", "dynamics"}
    assert len(options) > 7
    with pytest.raises(SystemExit):
        main(["play", "--help"])
    printed = capsys.readouterr().out
    assert {name for name in options if f"--{name}" not in printed} == set()
