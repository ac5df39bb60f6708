"""The numbers of docs/robot.md hold."""

from pathlib import Path

from simulator.robot.search_plan import EXACT_PLACES

PAGE = (Path(__file__).resolve().parents[3] / "docs" / "robot.md").read_text(encoding="utf-8")


def test_numbers_of_the_page():
    assert EXACT_PLACES == 9
    assert PAGE.count("nine") == 2
