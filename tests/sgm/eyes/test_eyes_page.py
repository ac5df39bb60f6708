"""docs/eyes.md: its example runs on rendered frames, and it names every setting and count."""

import inspect
import re
from dataclasses import fields
from pathlib import Path

from sgm.eyes import Box, Detection, Gate, LookBuilder, LookRules, Pose

PAGE = (Path(__file__).resolve().parents[3] / "docs" / "eyes.md").read_text(encoding="utf-8")


def test_the_example_opens_the_cabinet(capsys):
    (block,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    assert len(block.splitlines()) <= 75
    names: dict = {}
    exec(compile(block, "docs/eyes.md", "exec"), names)  # our own text
    said = capsys.readouterr().out.strip()
    assert said == "open the cabinet left of the sink in kitchen"
    assert block.rstrip().endswith(f"# {said}")
    memory = names["memory"]
    assert memory.last_seen("pasta").is_there
    assert memory.last_seen("pasta").steps_ago == 1
    assert memory.last_seen("pasta").times_looked == 1  # the shut cabinet is no look into it


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
