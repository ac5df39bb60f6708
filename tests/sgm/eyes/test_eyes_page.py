"""docs/eyes.md: its example is short, and it names every setting and count."""

import inspect
import re
from dataclasses import fields
from pathlib import Path

from sgm.eyes import Box, Detection, Gate, LookBuilder, LookRules, Pose

PAGE = (Path(__file__).resolve().parents[3] / "docs" / "eyes.md").read_text(encoding="utf-8")


def test_the_example_is_short():
    block, *_ = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    assert len(block.splitlines()) <= 75


def test_the_page_names_what_there_is():
    for field in (*fields(Detection)[:4], *fields(Box)):
        assert f"`{field.name}`" in PAGE, field.name
    for name in list(inspect.signature(LookBuilder.frame).parameters)[1:]:
        assert f"| `{name}` |" in PAGE, name
    assert LookRules().num_points == 1000
    assert "1000 points" in PAGE
    rules = {field.name for field in fields(LookRules)}
    assert {"margin", "most_blind", "pause", "longest", "least_coverage"} <= rules
    for name in ("margin", "most_blind", "pause", "longest", "least_coverage", "on_look"):
        assert f"`{name}" in PAGE, name
    folder = Path(inspect.getfile(LookBuilder)).parent
    code = "".join(file.read_text("utf-8") for file in folder.glob("*.py"))
    reasons = re.findall(r'return "([a-z ]+)"', code) + re.findall(
        r'_counts?(?:\[|\()"([a-z ]+)"', code
    )
    reasons += re.findall(r'else "(frame came twice)"', code)
    for reason in {*reasons} - {"frames", "detections", "looks"}:
        assert f'"{reason}"' in PAGE, reason
    assert Gate().farthest > Gate().nearest
    assert Pose.look_at((0, 0, 1), (1, 0, 1)).position_sd == 0
